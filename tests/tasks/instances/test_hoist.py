"""Tanks as CSV, their hoist's empty moves beside them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.tasks.cell_file import CellFile
from lab.tasks.instances import InstanceRequest

TANKS = "tank,soak_min,soak_max,move_from_previous\n1,150,200,31\n2,90,,22\nunload,,,30\n"
ROWS = "1,load,11 1,1,0 1,2,2 2,load,14 2,1,2 2,2,0 unload,load,19 unload,1,3 unload,2,4"
EMPTY = "\n".join(["after_move_into,to_remove_from,time", *ROWS.split()])


@pytest.fixture
def empty(tmp_path: Path) -> InstanceRequest:
    path = tmp_path / "empty.csv"
    path.write_text(EMPTY)
    return InstanceRequest(path)


def test_a_line_of_tanks(read: Callable[..., CellFile], empty: InstanceRequest) -> None:
    cell = read(TANKS, "tanks.csv", empty).cell()
    tanks = cell.stations[1:3]
    assert [(tank.capacity, tank.processing_s, tank.at_most_s) for tank in tanks] == [(1, 150.0, 50.0), (1, 90.0, None)]
    load, one, two, unload = range(4)
    assert [cell.loaded_s[load, one], cell.loaded_s[one, two], cell.loaded_s[two, unload]] == [31.0, 22.0, 30.0]
    assert [cell.empty_s[one, load], cell.empty_s[unload, load], cell.empty_s[unload, two]] == [11.0, 19.0, 4.0]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("200", "100", "line 2: wanted a most time of at least 150, not '100'"),
        (
            "unload,,,30\n",
            "",
            "line 3: wanted a last row 'unload', with the move out of the last tank: the file ends before it",
        ),
        (",22", ",", "line 3: wanted the move to '2', a number from 0 to 1e+06, not ''"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    refused: Callable[..., str], empty: InstanceRequest, old: str, new: str, expected: str
) -> None:
    assert refused(TANKS.replace(old, new), "tanks.csv", empty) == f"tanks.csv: {expected}"


def test_what_stands_beside_it(refused: Callable[..., str], empty: InstanceRequest) -> None:
    assert refused(TANKS, "tanks.csv").endswith("give --layout FILE")
    assert "hoists share a track" in refused(TANKS, "tanks.csv", InstanceRequest(empty.layout, robots=2))
    assert refused(EMPTY, "empty.csv").startswith("empty.csv: line 1: wanted jobs or tanks: these are travel times")


def test_a_long_name_makes_no_long_line(refused: Callable[..., str], empty: InstanceRequest) -> None:
    assert len(refused(TANKS.replace("2,90,,22", f"{'x' * 5000},,,22"), "tanks.csv", empty)) < 400
