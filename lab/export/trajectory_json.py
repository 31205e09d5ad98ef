"""A run's timed points as a JSON document, written and read."""

import json
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from lab.errors import BadInput
from lab.export.program import Options, Program
from lab.export.timed import Point, TimedPoints, timed
from lab.sim.arms.arm import Arm
from lab.tasks.record import Record

Tool = tuple[float, float, float, float]


class PointFields(Record):
    """One point; see `Point`."""

    t_s: float
    joints_rad: tuple[float, ...]
    tool_m_rad: Tool
    gripper_closed: bool
    waits_for: str | None
    job: Annotated[int, Field(ge=1)]


class TrajectoryDocument(Record):
    """The document; joints are interpolated linearly between points. base_up_m: height of the arm's foot above z = 0 [m]."""

    format: Literal["lab trajectory"] = "lab trajectory"
    version: Literal[1] = 1
    task: str
    arm: str
    base_up_m: float
    joints: tuple[str, ...]
    points: tuple[PointFields, ...]


def write(program: Program, options: Options) -> dict[str, str]:
    """The text of the only file, `trajectory.json`, by its name."""
    arm = program.arm
    return {"trajectory.json": text_of(timed(program), program.carried.task, arm.name, arm.base_up_m)}


def text_of(trajectory: TimedPoints, task: str, arm: str, base_up_m: float) -> str:
    """The document's text, one point per line."""
    head = {"format": "lab trajectory", "version": 1, "task": task, "arm": arm, "base_up_m": base_up_m}
    lines = ",\n".join(json.dumps(_fields(point), allow_nan=False) for point in trajectory.points)
    opened = json.dumps(head | {"joints": list(trajectory.joints)}, allow_nan=False)[:-1]
    return f'{opened}, "points": [\n{lines}\n]}}\n'


def _fields(point: Point) -> dict[str, object]:
    return {
        "t_s": point.t_s,
        "joints_rad": list(point.joints),
        "tool_m_rad": list(point.tool),
        "gripper_closed": point.closed,
        "waits_for": point.waits_for or None,
        "job": point.job,
    }


def read(files: Mapping[str, str], arm: Arm) -> TimedPoints:
    """The points of the only file, for this arm. BadInput names the field that is wrong."""
    if len(files) != 1:
        raise BadInput(f"wanted one document, found {', '.join(files) or 'none'}")
    ((name, text),) = files.items()
    return read_document(text, arm.joints, name)


def read_document(text: str, joints: tuple[str, ...], where: str) -> TimedPoints:
    """The points of a document with these joints; `where`: its file."""
    try:
        document = TrajectoryDocument.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(f"{where}: {'.'.join(map(str, first['loc'])) or 'the document'}: {first['msg']}") from None
    if document.joints != joints:
        raise BadInput(f"{where}: joints {', '.join(document.joints)}; wanted {', '.join(joints)}")
    before = 0.0
    for number, point in enumerate(document.points):
        if len(point.joints_rad) != len(joints):
            raise BadInput(
                f"{where}: points.{number}.joints_rad: {len(point.joints_rad)} numbers, wanted {len(joints)}"
            )
        if point.t_s < before:
            raise BadInput(f"{where}: points.{number}.t_s = {point.t_s} lies before {before}, of the point above")
        before = point.t_s
    return TimedPoints(joints, tuple(_point(fields) for fields in document.points))


def _point(fields: PointFields) -> Point:
    waits_for = fields.waits_for or ""
    return Point(fields.t_s, fields.joints_rad, fields.tool_m_rad, fields.gripper_closed, waits_for, fields.job)
