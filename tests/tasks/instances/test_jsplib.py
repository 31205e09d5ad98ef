"""JSPLIB's text: two jobs on two machines, read to be redone by hand."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.sequencing import find_sequence
from lab.sequencing.cell.stations import UNLIMITED
from lab.sequencing.search import Search
from lab.tasks.cell_file import CellFile
from lab.tasks.instances import InstanceRequest

TWO = "# two jobs\n2 2\n0 3  1 2\n1 4  0 1\n"


def test_without_a_layout_the_jobs_go_on_by_themselves(read: Callable[..., CellFile]) -> None:
    cell = read(TWO, "two.txt").cell()
    assert cell.robots == ()
    assert cell.order == ("job1", "job2")
    assert [(one.name, one.capacity, one.servers) for one in cell.stations[1:]] == [
        ("M1", UNLIMITED, 1),
        ("M2", UNLIMITED, 1),
    ]
    assert [(stage.station, stage.processing_s) for stage in cell.products[1].routes[0]] == [
        ("in", None),
        ("M2", 4.0),
        ("M1", 1.0),
    ]
    # M1 3 then M2 2, but M2 is taken 0 to 4: 4 + 2 = 6; the other one ends at 5.
    assert find_sequence(cell, "cp-sat", Search(1), 0).cost == 6.0


def test_with_a_layout_vehicles_carry_them(read: Callable[..., CellFile], layout: Path) -> None:
    cell = read(TWO, "two.txt", InstanceRequest(layout)).cell()
    assert [robot.start for robot in cell.robots] == ["LU"]
    assert cell.loaded_s[cell.index("M1"), cell.index("LU")] == 12.0
    assert cell.loaded_s[cell.index("LU"), cell.index("M1")] == 6.0
    several = read(TWO, "two.txt", InstanceRequest(layout, robots=3)).cell()
    assert [robot.name for robot in several.robots] == ["robot 1", "robot 2", "robot 3"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "2 2\n0 3 1 2\n1 4 2 1\n",
            "line 3: wanted the machine of operation 2 of job 2, a whole number from 0 to 1, not '2'",
        ),
        ("2 2\n0 3 1 2\n1 4 0\n", "line 3: wanted a machine and a time for each operation of job 2, up to 99 pairs"),
        (
            "2 2\n0 3 1 x\n1 4 0 1\n",
            "line 2: wanted the time of operation 2 of job 1, a number from 0 to 1e+06, not 'x'",
        ),
        ("3 2\n0 3 1 2\n1 4 0 1\n", "line 3: wanted 3 rows, one for each job, not '2 rows'"),
        ("999999 2\n0 3 1 2\n", "line 1: wanted how many jobs, a whole number from 1 to 200, not '999999'"),
        ("2 9999999999999\n0 3 1 2\n", "line 1: wanted how many machines, a whole number from 1 to 98"),
        ("2 2\n0 3 1 -2\n1 4 0 1\n", "line 2: wanted the time of operation 2 of job 1"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(refused: Callable[..., str], text: str, expected: str) -> None:
    assert refused(text, "two.jsp").startswith(f"two.jsp: {expected}")


def test_robots_need_travel_times(refused: Callable[..., str]) -> None:
    assert refused(TWO, "two.jsp", InstanceRequest(robots=2)).endswith("it has no travel times: give --layout FILE")
