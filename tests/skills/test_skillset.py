"""A task's skills: exactly those that its route needs, and the cell that their measured durations make."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.production.durations import Durations, cell_of
from lab.skills import SKILLS, Insert, Place, Transfer
from lab.skills.skillset import Carried, SkillSet, products, stations, ways_of
from lab.skills.surveys import INSERT
from lab.tasks.task import Task
from lab.tasks.task_fields import Stage
from lab.tasks.task_file import load


@pytest.fixture(scope="module")
def task() -> Task:
    return load("toast")


def durations(skillset: SkillSet) -> Durations:
    """Empty moves take 2, 3, ... s, loaded ones 20, 21, ... s, butter 30 s."""
    empty = {pair: 2.0 + n for n, pair in enumerate(skillset.moves.empty)}
    loaded = {pair: 20.0 + n for n, pair in enumerate(skillset.moves.loaded)}
    return Durations(empty, loaded, {"butter_applier": 30.0}, 99.0)


def test_the_crew_for_one_toast_is_what_its_way_needs(task: Task) -> None:
    direct = task.model_copy(update={"route": tuple(Stage(station=s.station) for s in task.route)})
    assert set(SkillSet.of(direct, 1).skills) == {
        "transfer toaster_buffer to plate",
        "grasp at plate",
        "transfer plate to insert with slice",
        "insert at toaster",
        "grasp at toaster",
        "transfer toaster to butter_applier with slice",
        "place at butter_applier",
        "butter at butter_applier",
        "grasp at butter_applier",
        "transfer butter_applier to finished_plate with slice",
        "place at finished_plate",
        "grasp at finished_plate",  # to take up again what was set down badly
    }


@pytest.mark.parametrize("toasts", [1, 2, 50])
def test_every_needed_move_has_its_skills(task: Task, toasts: int) -> None:
    skillset = SkillSet.of(task, toasts)
    assert {skill.subtask for skill in skillset.skills.values()} == set(SKILLS)
    for origin, target in skillset.moves.loaded:
        grasp, transfer, arrive = skillset.legs[origin, target]
        assert grasp.name == f"grasp at {origin}"
        assert isinstance(transfer, Transfer)
        assert transfer.loaded
        if target == "toaster":
            assert (transfer.target, type(arrive)) == (INSERT_START, Insert)
        else:
            assert (transfer.target, type(arrive)) == (target, Place)
        assert arrive.name.endswith(f" at {target}")
    for origin, target in skillset.moves.empty:
        assert [skill.name for skill in skillset.travels[origin, target]] == [f"transfer {origin} to {target}"]
    assert skillset.policies == {}


def test_more_toasts_need_more_empty_ways_but_no_other_skills(task: Task) -> None:
    one, two, many = (set(SkillSet.of(task, toasts).skills) for toasts in (1, 2, 30))
    assert one < two == many
    assert all(name.startswith("transfer ") and "slice" not in name for name in two - one)


def test_only_the_toaster_is_reached_through_the_camera(task: Task) -> None:
    assert [s.name for s in task.stations if is_toaster(s)] == ["toaster"]


def test_the_sequencer_is_told_what_the_task_says(task: Task) -> None:
    told = {s.name: s for s in stations(task, {"butter_applier": 42.0})}
    assert [(s.name, s.kind, s.capacity) for s in told.values()] == [
        (s.name, s.kind, s.capacity) for s in task.stations
    ]
    assert told["toaster"].processing_s == 60.0
    assert told["butter_applier"].processing_s == 42.0
    assert told["plate"].processing_s == 0.0
    assert [(s.station, s.buffer) for s in route(task)] == [(s.station, s.buffer) for s in task.route]


def test_the_cell_holds_the_measured_times_and_nothing_else(task: Task) -> None:
    skillset = SkillSet.of(task, 2)
    measured = durations(skillset)
    cell = cell_of(task, measured, 2)
    assert cell.order == ("toast", "toast")
    assert cell.robot_start == task.robot.start
    for table, times in ((cell.empty_s, measured.empty_s), (cell.loaded_s, measured.loaded_s)):
        found = {
            (cell.names[i], cell.names[j]): float(table[i, j]) for i, j in np.argwhere(np.isfinite(table)) if i != j
        }
        assert found == dict(times)


def test_a_move_that_was_not_measured_is_missed(task: Task) -> None:
    skillset = SkillSet.of(task, 2)
    measured = durations(skillset)
    less = Durations(measured.empty_s, {}, measured.process_s)
    with pytest.raises(BadInput, match="loaded_s 'plate' -> 'toaster' is missing"):
        cell_of(task, less, 2)


def test_an_unknown_sub_task_is_refused(task: Task) -> None:
    typo = task.model_copy(update={"subtasks": {"insrt": task.subtask("insert")}})
    with pytest.raises(BadInput, match=r"unknown sub-task 'insrt' .task 'toast': subtasks.: did you mean 'insert'"):
        SkillSet.of(typo, 1)


def test_a_machine_whose_process_nobody_can_do_is_refused(task: Task) -> None:
    jam = tuple(s.model_copy(update={"process": "jam"}) if s.process else s for s in task.stations)
    with pytest.raises(
        BadInput, match=r"unknown process 'jam' .task 'toast': station 'butter_applier'.: known: butter"
    ):
        SkillSet.of(task.model_copy(update={"stations": jam}), 1)


def test_what_skills_make_keeps_its_names(task: Task) -> None:
    first, *rest = task.obstacles
    patch = task.model_copy(update={"obstacles": (first.model_copy(update={"name": "butter 1 00"}), *rest)})
    with pytest.raises(BadInput, match="task 'toast': 'butter 1 00' is the name of what a skill makes"):
        SkillSet.of(patch, 1)
    made = {body.name: name for name, kind in SKILLS.items() for number in (1, 2) for body in kind.on_slice(number)}
    assert len(made) == 18
    assert all(body.startswith(f"{name} ") for body, name in made.items())
