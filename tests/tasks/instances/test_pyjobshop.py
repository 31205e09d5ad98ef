"""PyJobShop's JSON: what is written reads as the same cell; what the lab has no equal of is refused."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.tasks.cell_file import CellFile
from lab.tasks.instances import pyjobshop
from lab.tasks.task_file import load_cell

SHOP = "3 2\n0 3 1 2\n1 4 0 1\n0 5\n"


def document() -> dict[str, Any]:
    """Two tasks of one job, the second on either of two machines."""
    return {
        "jobs": [{"tasks": [0, 1], "release_date": 2}],
        "resources": [{"type": "machine"}, {"type": "machine"}, {"type": "machine"}],
        "tasks": [{"job": 0}, {"job": 0}],
        "modes": [
            {"task": 0, "resources": [0], "duration": 3, "demands": [0]},
            {"task": 1, "resources": [1], "duration": 4, "demands": [0]},
            {"task": 1, "resources": [2], "duration": 5, "demands": [0]},
        ],
        "constraints": {"end_before_start": [{"task1": 0, "task2": 1, "delay": 0}]},
    }


def test_what_is_written_reads_as_the_same_cell(read: Callable[..., CellFile]) -> None:
    file = read(SHOP, "shop.jsp")
    cell, again = file.cell(), read(pyjobshop.write(file), "shop.json").cell()
    assert (again.stations, again.products, again.order) == (cell.stations, cell.products, cell.order)
    assert np.array_equal(again.loaded_s, cell.loaded_s, equal_nan=True)


def test_setups_and_release_times_are_kept(read: Callable[..., CellFile]) -> None:
    raw = document()
    raw["jobs"] = [{"tasks": [0], "release_date": 2}, {"tasks": [1]}]
    raw["modes"] = [{"task": n, "resources": [0], "duration": 3, "demands": [0]} for n in (0, 1)]
    raw["constraints"] = {"setup_times": [{"machine": 0, "task1": 0, "task2": 1, "duration": 7}]}
    file = read(json.dumps(raw), "shop.json")
    assert file.cell().setups[1] == {("job1", "job2"): 7.0}
    assert file.release_s == (2.0, 0.0)
    again = read(pyjobshop.write(file), "again.json")
    assert again.model_copy(update={"name": file.name}) == file


def test_a_task_that_two_machines_can_do_has_an_alternative(read: Callable[..., CellFile]) -> None:
    (route,) = read(json.dumps(document()), "shop.json").cell().products[0].routes
    assert [(way.station, way.processing_s) for way in route[2].ways] == [("M2", 4.0), ("M3", 5.0)]


@pytest.mark.parametrize(
    ("way", "value", "expected"),
    [
        (("jobs", 0, "deadline"), 9, "no deadline, which the lab's cells do not have, as 'jobs.0.deadline', not '9'"),
        (("modes", 0, "duration"), -1, "a whole number from 0 to 1000000 as 'modes.0.duration', not '-1'"),
        (("modes", 0, "task"), 9, "a whole number from 0 to 1 as 'modes.0.task', not '9'"),
        (("constraints",), {}, "tasks one after the other (end_before_start): 0 and 1 have no order as 'jobs.0'"),
        (("constraints", "no_overlap"), [1], "no constraints but end_before_start and setup_times"),
        (("jobs",), 3, "a list of up to 200 as 'jobs', not '3'"),
        (("modes",), [], "a mode of this task: there is none as 'tasks.0'"),
        (("objective",), {"weight_makespan": 1, "weight_total_tardiness": 2}, "the makespan alone, so 0"),
    ],
)
def test_what_has_no_equal_is_refused_with_its_line(
    refused: Callable[..., str], way: tuple[str | int, ...], value: object, expected: str
) -> None:
    raw: Any = document()
    at = raw
    for key in way[:-1]:
        at = at[key]
    at[way[-1]] = value
    said = refused(json.dumps(raw, indent=1), "shop.json")
    assert said.startswith("shop.json: line ")
    assert f"wanted {expected}" in said


def test_text_that_is_no_json_is_refused_with_its_line(refused: Callable[..., str]) -> None:
    assert refused('{"jobs": [\n}', "shop.json").startswith("shop.json: line 2: wanted JSON: ")


def test_a_cell_with_a_robot_is_not_written() -> None:
    with pytest.raises(BadInput, match="it has 1 robots: only cells without a robot"):
        pyjobshop.write(load_cell("toast-case-1"))
