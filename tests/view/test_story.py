"""What a replay tells beside the picture."""

import json

import pytest

from lab.errors import BadInput
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.view.scene_data import MARKS, Mark, Story

CARRY = Activity("robot", "carry", 1, "plate", "toaster", 1.00049, 4.0)
TOASTS = Activity("toaster", "process", 1, "toaster", "toaster", 4.0, 64.0)
SLICE = Activity("slice 1", "process", 1, "toaster", "toaster", 4.0, 64.0)
MEASURED = Schedule((CARRY,), (TOASTS,), (SLICE,), 64.0, (1,))


def test_a_story_has_the_rows_of_robot_and_machines_and_all_else_in_the_order_of_time() -> None:
    late, early = Mark(9.0, "stop", "emergency stop"), Mark(2.0, "fault", "slice 1 was moved")
    story = Story(MEASURED, None, ((5.0, "waits"), (1.0, "carries")), (late, early), (8.0, 1.0))
    said = json.loads(json.dumps(story.to_json()))
    assert [row["resource"] for row in said["measured"]] == ["robot", "toaster"]
    assert said["measured"][0]["start_s"] == 1.0
    assert (said["planned"], said["begins_s"]) == ([], [1.0, 8.0])
    assert said["captions"] == [[1.0, "carries"], [5.0, "waits"]]
    assert [mark["kind"] for mark in said["marks"]] == ["fault", "stop"]


def test_a_bar_is_called_as_its_part_and_has_its_colour_where_the_part_is_worked_on_or_carried() -> None:
    waits = Activity("robot", "wait", 1, "plate", "plate", 0.0, 1.0)
    schedule = Schedule((waits, CARRY), (TOASTS,), (), 64.0, (1,))
    rows = Story(schedule, looks={1: ("slice 1", "#E69F00")}).to_json()["measured"]
    assert [row["name"] for row in rows] == ["slice 1"] * 3
    assert [row.get("color") for row in rows] == [None, "#E69F00", "#E69F00"]
    assert "name" not in Story(schedule).to_json()["measured"][0]


def test_a_mark_is_of_a_known_kind() -> None:
    with pytest.raises(BadInput, match=r"'fualt'.*did you mean 'fault'"):
        Mark(1.0, "fualt", "")  # type: ignore[arg-type]
    assert [Mark(0.0, kind, "").kind for kind in MARKS] == [*MARKS]
