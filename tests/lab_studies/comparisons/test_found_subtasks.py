"""Found sub-tasks: the floors and their doors by hand, a session of every kind, and the rows."""

import numpy as np
import pytest

from lab.learning.bottlenecks import METHODS
from lab.studies.findings import those
from lab_studies.comparisons import found_subtasks
from lab_studies.comparisons.advice_bench.layouts import DOOR_KEY_ROWS, At, minigrid_moves, numbered
from lab_studies.comparisons.found_subtasks import (
    FLAT,
    HOWS,
    Setting,
    compass_floor,
    costs_of,
    drawn_rows,
    in_short,
    key_floor,
    looking_rows,
    looks_of,
    rows_of,
    shortest,
    tasks_of,
)

TWO_ROOMS = ("...#...", ".......", "...#...")


@pytest.fixture
def two_rooms(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(found_subtasks, "FLOORS", {"two rooms": lambda: compass_floor(TWO_ROOMS)})
    found_subtasks.floor_of.cache_clear()
    return "two rooms"


def test_the_door_of_two_rooms_is_known_by_hand() -> None:
    floor = compass_floor(TWO_ROOMS)
    assert (floor.mdp.n_states, floor.doors) == (19, ((9,),))  # six cells above, three to its left in its row


def test_a_key_a_door_and_its_cell_are_doors() -> None:
    floor = key_floor(DOOR_KEY_ROWS)
    start, actions, leads = minigrid_moves([row.replace("G", ".") for row in DOOR_KEY_ROWS])
    states: list[At] = list(numbered(start, len(actions), leads)[0])
    taken, opened, inside = ([states[n] for n in door] for door in floor.doors)
    assert {(at.row, at.column, at.facing) for at in taken} == {
        (1, 0, 1),
        (2, 1, 2),
        (3, 0, 3),
    }  # beside the key at (2, 0)
    assert {(at.row, at.column, at.facing) for at in opened} == {(2, 1, 0)}
    assert {(at.row, at.column) for at in inside} == {(2, 2)}


def test_drawn_rooms_are_rectangles_with_doors() -> None:
    rows = drawn_rows(1)
    assert len({len(row) for row in rows}) == 1
    assert len(compass_floor(rows).doors) == 5
    assert rows == drawn_rows(1)


def test_tasks_are_drawn_far_apart() -> None:
    floor = compass_floor(TWO_ROOMS)
    tasks = tasks_of(floor, np.random.default_rng(0), 20)
    assert all(shortest(floor, task) >= found_subtasks.FAR_APART for task in tasks)
    assert tasks == tasks_of(floor, np.random.default_rng(0), 20)


def test_a_session_of_every_kind_solves_its_tasks(two_rooms: str) -> None:
    costs = {Setting(two_rooms, how): costs_of(Setting(two_rooms, how), sessions=2, seed=0) for how in HOWS}
    assert all(cost.solved == found_subtasks.TASKS for of in costs.values() for cost in of)
    assert costs == {setting: costs_of(setting, sessions=2, seed=0) for setting in costs}
    rows = [row for setting in costs for row in rows_of(setting, costs)]
    assert not those(rows, how=FLAT, measure="moves_times_flat")
    assert set(in_short(rows)) == set(HOWS)


def test_what_is_found_after_so_many_moves(two_rooms: str) -> None:
    looks = [looks_of(two_rooms, seed) for seed in (0, 1)]
    rows = looking_rows(two_rooms, looks)
    last = those(rows, after_moves=found_subtasks.LOOKS[-1])
    assert [row["value"] for row in those(last, measure="doors_percent")] == [100.0] * len(METHODS)
    assert [row["value"] for row in those(last, measure="false")] == [0.0] * len(METHODS)
