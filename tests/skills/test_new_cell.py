"""A new task's cell: laid out around any arm, gripped, and every sub-task of it has a way."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.skills.new_cell import new_cell
from lab.skills.prepared_scene import check_task
from lab.tasks.new_task import new_task


def test_what_is_written_is_sound(tmp_path: Path) -> None:
    path = tmp_path / "t.toml"
    text, task = new_cell(
        new_task("t", "up6", ("box:0.04x0.02x0.06:2", "cup=cylinder:0.03x0.08:1"), ("oven:60",), True), path
    )
    assert not path.exists()
    path.write_text(text)
    assert check_task(str(path), None, 1) == ([], [])
    assert [station.name for station in task.stations] == ["input", "oven_buffer", "oven", "output"]
    assert task.robot.opening_m is None  # the gripper's 0.044 m are no more than is needed


def test_parts_may_be_brought_from_one_place_to_another_only(tmp_path: Path) -> None:
    _, task = new_cell(new_task("t", "up6", ("cylinder:0.03x0.1:2",), (), False), tmp_path / "t.toml")
    assert [station.name for station in task.stations] == ["input", "output"]


@pytest.mark.slow
def test_parts_that_the_fingers_open_wide_for_have_more_room(tmp_path: Path) -> None:
    _, task = new_cell(new_task("t", "panda", ("cup=cylinder:0.06x0.08:3",), (), False), tmp_path / "t.toml")
    assert task.robot.opening_m == 0.076  # of the panda's 0.08 m
    parts = ("box:0.06x0.02x0.1:2", "pin=cylinder:0.03x0.1:2")
    _, task = new_cell(new_task("t", "xarm6", parts, (), False), tmp_path / "t.toml")
    assert task.robot.opening_m == 0.046
    assert task.station("input").spots is not None  # the rows of a station are too close


@pytest.mark.parametrize(
    ("part", "machines", "line"),
    [
        ("box:0.06x0.05x0.1:1", 1, "part 'box' cannot be gripped: .*the gripper takes up to 0\\.036 m"),
        ("cylinder:0.05x0.1:1", 1, "part 'cylinder' cannot be gripped: .*the gripper takes up to 0\\.036 m"),
        (
            "box:0.5x0.03x0.1:50",
            1,
            "3 stations for 50 parts do not fit around the arm 'up6', which reaches 0.36 to ",
        ),
        ("box:0.1x0.03x0.1:9", 20, "22 stations for 9 parts do not fit around the arm 'up6'"),
    ],
)
def test_what_has_no_room_or_no_grip(tmp_path: Path, part: str, machines: int, line: str) -> None:
    new = new_task("t", "up6", (part,), [f"m{number}:1" for number in range(machines)], False)
    with pytest.raises(BadInput, match=line):
        new_cell(new, tmp_path / "t.toml")


def test_parts_that_are_higher_than_the_arm_reaches(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"0\.93 m above the table are out of the reach of the arm 'xarm6'"):
        new_cell(new_task("t", "xarm6", ("box:0.03x0.03x0.4:1",), (), False), tmp_path / "t.toml")
