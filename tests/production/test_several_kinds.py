"""Parts of several kinds, on pallets and with services: the cell that their times make, and a run in physics."""

from pathlib import Path
from typing import NamedTuple

import pytest

from lab.production.composer import carry_out
from lab.production.durations import Durations, cell_of, measure
from lab.production.outcome import Outcome
from lab.sequencing.cell.schedule import Move
from lab.sequencing.methods.exact import optimum
from lab.sim.frames import Recording
from lab.skills.prepared_scene import Prepared, prepare
from lab.skills.skillset import CarriedPath, SkillSet
from lab.tasks.task_file import load
from lab.teaching.events import Event, MoveMade
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox

# ---- the cell of measured times -----------------------------------------------------------------------------------


def test_kinds_that_share_a_way_share_its_mean_time() -> None:
    """A slice takes 4 s from the toaster to the tray, a cup would take 6 s: 5 s; all else takes 3 s."""
    task = load("breakfast")
    order = task.ordered(None, "slice=1,cup=1")
    skills = SkillSet.of(task, order)
    loaded = dict.fromkeys(skills.legs, 3.0)
    assert CarriedPath("toaster", "tray", "slice") in loaded
    loaded |= {CarriedPath("toaster", "tray", "slice"): 4.0, CarriedPath("toaster", "tray", "cup"): 6.0}
    cell = cell_of(task, Durations(dict.fromkeys(skills.travels, 1.0), loaded, {}), order)
    ways = {(a, b): float(cell.loaded_s[cell.index(a), cell.index(b)]) for a, b, _ in loaded}
    assert ways.pop(("toaster", "tray")) == 5.0
    assert set(ways.values()) == {3.0}
    assert [cell.part_name(number) for number in (1, 2)] == ["slice 1", "cup 2"]


def test_a_service_takes_its_measured_time() -> None:
    task = load("fms-arm")
    order = task.ordered(None, "sign=1")
    skills = SkillSet.of(task, order)
    moves = dict.fromkeys(skills.travels, 1.0), dict.fromkeys(skills.legs, 2.0)
    plain, served = (
        optimum(cell_of(task, Durations(*moves, {}, {("sign", "mill"): seconds}), order)).bound_s
        for seconds in (0.0, 30.0)
    )
    assert served == pytest.approx(plain + 30.0)


# ---- in physics ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def prepared(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    """One sign in the cell with pallets, milled in 2 s and vacuumed in one; its skills learned from the expert."""
    folder = tmp_path_factory.mktemp("fms")
    text = (root / "tasks" / "fms-arm.toml").read_text(encoding="utf-8")
    for long, short in (("processing_s = 600", "processing_s = 2"), ("dwell_s = 28.0", "dwell_s = 0.1")):
        assert long in text
        text = text.replace(long, short)
    (folder / "brisk.toml").write_text(text, encoding="utf-8")
    task = load(str(folder / "brisk.toml"))
    prepared = prepare(task, task.ordered(None, "sign=1"), 0)
    teacher = Teacher(Toolbox(folder / "toolbox"))
    for name, problem in prepared.problems.items():
        settings = task.subtask(problem.subtask)
        lesson = LessonPlan(problem, settings.learner, settings.gate, task.name)
        prepared.skillset.policies[name] = teacher.find_or_teach(lesson, KnownPolicies.of([])).policy
    return prepared


class Done(NamedTuple):
    """A run, with what it was planned by, and its moves."""

    durations: Durations
    outcome: Outcome
    recording: Recording
    moves: list[Move]


@pytest.fixture(scope="module")
def run(prepared: Prepared) -> Done:
    """The sign brought from the first station to the last, as predicted by its durations."""
    durations, moves = measure(prepared), list[Move]()

    def hear(event: Event) -> None:
        if isinstance(event, MoveMade):
            assert event.part == "sign 1"
            moves.append(event.move)

    cell = cell_of(prepared.task, durations, prepared.order)
    outcome, recording = carry_out(prepared, cell, optimum(cell).sequence, tell=hear)
    return Done(durations, outcome, recording, moves)


@pytest.mark.slow
def test_a_part_and_its_pallet_are_carried_in_their_order(run: Done) -> None:
    _, outcome, recording, moves = run
    assert (outcome.failure, outcome.retries) == (None, ())
    assert (outcome.delivered, outcome.dropped) == ((1,), ())
    assert [(move.origin, move.target, move.carries) for move in moves] == [
        ("incoming", "mill-in", "part"),
        ("mill-in", "mill", "part"),
        ("mill-in", "mill-out", "pallet"),
        ("mill", "mill-out", "part"),
        ("mill-out", "outgoing", "part"),
    ]
    last = recording.frames[-1].poses
    assert last["sign 1"][:2] == pytest.approx(last["sign 1's pallet"][:2], abs=0.01)
    assert last["sign 1"][2] > last["sign 1's pallet"][2]
    assert "done sign 1 at mill" in {
        name for frame in recording.frames for name in frame.visible if frame.visible[name]
    }


def test_the_robot_vacuums_before_it_takes_the_part_out(run: Done) -> None:
    durations, moves = run.durations, run.moves
    assert durations.service_s.keys() == {("sign", "mill")}
    served = {move.target: move.service_s for move in moves if move.service_s > 0}
    assert served == {"mill-out": pytest.approx(durations.service_s["sign", "mill"], rel=0.05)}
    kinds = {way.kind for way in durations.loaded_s}
    assert kinds == {"sign", "pallet", "sign on pallet"}
