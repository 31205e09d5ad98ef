"""A run's timed points as a CSV table, written and read."""

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from math import isfinite

from lab.errors import BadInput
from lab.export.program import Options, Program
from lab.export.timed import DIGITS, Point, TimedPoints, timed
from lab.sim.arms.arm import Arm

_TOOL = ("x_m", "y_m", "z_m", "yaw_rad")
_LAST = ("gripper_closed", "waits_for", "job")


def write(program: Program, options: Options) -> dict[str, str]:
    """The text of the only file, `trajectory.csv`, by its name."""
    return {"trajectory.csv": text_of(timed(program))}


def text_of(trajectory: TimedPoints) -> str:
    """The table's text: time, a column for each joint [rad], the tool's pose, gripper, machine waited for, and job."""
    text = StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(_header(trajectory.joints))
    for point in trajectory.points:
        numbers = [f"{number:.{DIGITS}f}" for number in (point.t_s, *point.joints, *point.tool)]
        rows.writerow([*numbers, int(point.closed), point.waits_for, point.job])
    return text.getvalue()


def _header(joints: Sequence[str]) -> list[str]:
    return ["t_s", *joints, *_TOOL, *_LAST]


def read(files: Mapping[str, str], arm: Arm) -> TimedPoints:
    """The points of the only file, for this arm. BadInput names the line that is wrong."""
    if len(files) != 1:
        raise BadInput(f"wanted one table, found {', '.join(files) or 'none'}")
    ((name, text),) = files.items()
    return read_table(text, arm.joints, name)


def read_table(text: str, joints: Sequence[str], where: str) -> TimedPoints:
    """The points of a table with these joints; `where`: its file."""
    rows = csv.reader(StringIO(text), strict=True)
    points: list[Point] = []
    try:
        wanted, header = _header(joints), next(rows, [])
        if header != wanted:
            raise BadInput(f"{where}, line 1: the columns are {', '.join(header)}; wanted {', '.join(wanted)}")
        for row in rows:
            place = f"{where}, line {rows.line_num}"
            point = _point(row, len(joints), place)
            if points and point.t_s < points[-1].t_s:
                raise BadInput(f"{place}: t_s = {point.t_s} lies before {points[-1].t_s}, of the row above")
            points.append(point)
    except csv.Error as error:
        raise BadInput(f"{where}, line {rows.line_num}: {error}") from None
    return TimedPoints(tuple(joints), tuple(points))


def _point(row: Sequence[str], axes: int, where: str) -> Point:
    if len(row) != axes + 8:
        raise BadInput(f"{where}: {len(row)} columns, wanted {axes + 8}")
    numbers = [_number(text, where) for text in row[: axes + 5]]
    closed, waits_for, job = row[axes + 5 :]
    if closed not in ("0", "1"):
        raise BadInput(f"{where}: gripper_closed = '{closed}', wanted 0 or 1")
    if not (job.isascii() and job.isdigit() and len(job) < 7):
        raise BadInput(f"{where}: job = '{job}', wanted a whole number")
    x, y, z, yaw = numbers[axes + 1 :]
    return Point(numbers[0], tuple(numbers[1 : axes + 1]), (x, y, z, yaw), closed == "1", waits_for, int(job))


def _number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise BadInput(f"{where}: '{text}' is no number")
    return number
