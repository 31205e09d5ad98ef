"""Waits on purpose in physics: the robot rests before it picks and while it holds, by what machines have really done."""

from dataclasses import replace
from pathlib import Path

import pytest

from lab.export.commands import Pause, jobs_of
from lab.production.composer import carry_out
from lab.production.durations import cell_of, measure
from lab.production.order import moves_from
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import simulate, waits_in
from lab.sequencing.simulate.run import Run
from lab.skills.new_cell import new_cell
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.new_task import new_task
from lab.tasks.task_file import load
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox

IN_TURN = (1, 1, 2, 1, 2, 2)


@pytest.fixture(scope="module")
def slow_dryer(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    """Two boxes, a washer of 10 s in which they may stay for 12 s more, and a dryer of 50 s."""
    folder: Path = tmp_path_factory.mktemp("waits")
    new = new_task("dry", "up6", ["box:0.05x0.03x0.04:2"], ["wash:10", "dry:50"], False)
    path = folder / "dry.toml"
    path.write_text(
        new_cell(new, path)[0].replace("processing_s = 10.0\n", "processing_s = 10.0\nat_most_s = 12.0\n"), "utf-8"
    )
    found = prepare(load(str(path)), ("box",) * 2, 0)
    teacher = Teacher(Toolbox(folder / "toolbox"))
    for name, problem in found.problems.items():
        settings = found.task.subtask(problem.subtask)
        lesson = LessonPlan(problem, settings.learner, settings.gate, found.task.name)
        found.skillset.policies[name] = teacher.find_or_teach(lesson, KnownPolicies.of([])).policy
    return found


@pytest.fixture(scope="module")
def cell(slow_dryer: Prepared) -> Cell:
    return cell_of(slow_dryer.task, measure(slow_dryer), slow_dryer.order)


def test_the_plan_waits_where_that_is_better(cell: Cell) -> None:
    assert optimum(cell).cost < simulate(cell, (1, 1, 1, 2, 2, 2)).makespan_s - 15.0
    assert waits_in(Run(cell), optimum(cell).sequence)


def test_a_run_waits_before_it_picks(slow_dryer: Prepared, cell: Cell) -> None:
    """Audited: box 2 leaves the washer in time, when the dryer is free; a controller is told the wait as a timer."""
    outcome, _ = carry_out(slow_dryer, cell, IN_TURN)
    assert (outcome.failure, outcome.delivered) == (None, (1, 2))
    planned = moves_from(Run(cell), IN_TURN, "order")
    measured = [activity for activity in outcome.schedule.robot if activity.kind == "wait" and activity.part == 2]
    assert measured[0].origin == "input"
    assert measured[0].end_s - measured[0].start_s == pytest.approx(planned[2].pick_s - planned[2].reach_s, abs=2.0)
    assert outcome.schedule.makespan_s == pytest.approx(planned[-1].drop_s, rel=0.03)
    assert outcome.program is not None
    longest = [
        max((c.seconds for c in job.commands if isinstance(c, Pause)), default=0.0) for job in jobs_of(outcome.program)
    ]
    assert longest[2] == pytest.approx(measured[0].end_s - measured[0].start_s, abs=0.1)
    assert max(longest[:2] + longest[3:]) < 5.0


def test_a_run_waits_by_what_machines_have_really_done(slow_dryer: Prepared, cell: Cell) -> None:
    """All ways are believed to take 5 % less: box 1 comes late to the dryer, and so box 2 to the washer; none is spoilt."""
    brisk = replace(cell, empty_s=0.95 * cell.empty_s, loaded_s=0.95 * cell.loaded_s)
    outcome, _ = carry_out(slow_dryer, brisk, IN_TURN)
    assert (outcome.failure, outcome.delivered) == (None, (1, 2))
