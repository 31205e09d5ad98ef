"""Points in time as a document: what it holds, and what is said of a field that is wrong."""

import json
import re
from typing import Any

import pytest

from lab.errors import BadInput
from lab.export import trajectory_json
from lab.export.program import Options, Program
from lab.export.timed import Point, TimedPoints
from lab.export.trajectory_json import read_document, text_of

JOINTS = ("turn", "lift")
POINTS = (
    Point(0.0, (0.5, -0.25), (0.4, 0.1, 0.3, 0.0), False, "", 1),
    Point(1.5, (0.75, -0.25), (0.4, 0.2, 0.3, 0.1), True, "oven", 2),
)


def test_a_document_by_hand() -> None:
    document = json.loads(text_of(TimedPoints(JOINTS, POINTS), "toast", "up6", 0.25))
    assert {name: document[name] for name in ("task", "arm", "base_up_m", "joints")} == {
        "task": "toast",
        "arm": "up6",
        "base_up_m": 0.25,
        "joints": ["turn", "lift"],
    }
    assert document["points"][1] == {
        "t_s": 1.5,
        "joints_rad": [0.75, -0.25],
        "tool_m_rad": [0.4, 0.2, 0.3, 0.1],
        "gripper_closed": True,
        "waits_for": "oven",
        "job": 2,
    }


def test_the_points_of_a_run_say_when_the_gripper_closes_and_what_is_waited_for(up6: Program) -> None:
    ((_, text),) = trajectory_json.write(up6, Options()).items()
    points = json.loads(text)["points"]
    closed = [point["gripper_closed"] for point in points]
    first, last = closed.index(True), len(closed) - 1 - closed[::-1].index(True)
    assert all(closed[first : last + 1])
    assert points[first]["tool_m_rad"] == pytest.approx([0.5, 0.1, 0.15, 0.0], abs=1e-3)
    assert points[last]["tool_m_rad"][:3] == pytest.approx([0.6, -0.1, 0.3], abs=1e-3)
    assert [point["waits_for"] for point in points if point["waits_for"]] == ["toaster"]
    assert {point["job"] for point in points} == {1, 2}


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"format": "a list"}, "t.json: format: Input should be 'lab trajectory'"),
    ({"joints": ["turn"]}, "t.json: joints turn; wanted turn, lift"),
    ({"more": 1}, "t.json: more: Extra inputs are not permitted"),
    ({"points": [{"t_s": 1.0}]}, "t.json: points.0.joints_rad: Field required"),
]


@pytest.mark.parametrize(("change", "said"), WRONG)
def test_a_wrong_field_is_named(change: dict[str, Any], said: str) -> None:
    document = json.loads(text_of(TimedPoints(JOINTS, POINTS), "toast", "up6", 0.0)) | change
    with pytest.raises(BadInput, match=re.escape(said)):
        read_document(json.dumps(document), JOINTS, "t.json")


def test_points_must_fit_their_joints_and_go_on_in_time() -> None:
    lame = TimedPoints(JOINTS, (POINTS[0], Point(1.0, (0.1,), POINTS[0].tool, False, "", 1)))
    for points, said in (
        (lame, "t.json: points.1.joints_rad: 1 numbers, wanted 2"),
        (TimedPoints(JOINTS, POINTS[::-1]), "t.json: points.1.t_s = 0.0 lies before 1.5, of the point above"),
    ):
        with pytest.raises(BadInput, match=re.escape(said)):
            read_document(text_of(points, "toast", "up6", 0.0), JOINTS, "t.json")


def test_what_is_no_json_is_said_so() -> None:
    with pytest.raises(BadInput, match=r"t\.json: the document: Invalid JSON"):
        read_document("t_s, turn", JOINTS, "t.json")
