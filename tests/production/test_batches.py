"""A machine with batches in physics: it begins once for all parts in it, and a job tells it so once."""

from pathlib import Path

import pytest

from lab.export.commands import Reset, Start, jobs_of
from lab.production.composer import Conditions, carry_out
from lab.production.durations import cell_of, measure
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import follow, simulate
from lab.skills.new_cell import new_cell
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.fault_fields import FaultFields
from lab.tasks.new_task import Changes, new_task
from lab.tasks.task_file import load
from lab.teaching.events import Event, MachineBegan
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox


@pytest.fixture(scope="module")
def oven_of_two(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    """Three boxes, and an oven of 60 s for two; its skills are learned from the expert."""
    folder: Path = tmp_path_factory.mktemp("batches")
    new = new_task(
        "ovens", "up6", ["box:0.05x0.03x0.04:3"], ["oven:60"], False, Changes(capacities=["oven=2"], batches=["oven"])
    )
    (folder / "ovens.toml").write_text(new_cell(new, folder / "ovens.toml")[0], encoding="utf-8")
    task = load(str(folder / "ovens.toml"))
    assert task.station("oven").batch
    found = prepare(task, ("box",) * 3, 0)
    teacher = Teacher(Toolbox(folder / "toolbox"))
    for name, problem in found.problems.items():
        settings = task.subtask(problem.subtask)
        lesson = LessonPlan(problem, settings.learner, settings.gate, task.name)
        found.skillset.policies[name] = teacher.find_or_teach(lesson, KnownPolicies.of([])).policy
    return found


def test_a_batch_begins_when_its_last_part_has_come(oven_of_two: Prepared) -> None:
    cell, events = cell_of(oven_of_two.task, measure(oven_of_two), oven_of_two.order), list[Event]()
    predicted_s = simulate(cell, (1, 2, 1, 2, 3, 3)).makespan_s
    assert predicted_s == pytest.approx(optimum(cell).cost)
    outcome, _ = carry_out(oven_of_two, cell, (1, 2, 1, 2, 3, 3), tell=events.append)
    assert (outcome.failure, outcome.delivered) == (None, (1, 2, 3))
    assert outcome.schedule.makespan_s == pytest.approx(predicted_s, rel=0.03)
    began = [(one.part, one.at_s) for one in events if isinstance(one, MachineBegan)]
    assert [part for part, _ in began] == ["box 1", "box 2", "box 3"]
    assert began[0][1] == began[1][1] < began[2][1]
    rows = [(one.start_s, one.end_s) for one in outcome.schedule.machines if one.kind == "process"]
    assert rows[0] == rows[1]
    assert rows[0][1] - rows[0][0] == pytest.approx(60.0, abs=0.01)
    assert outcome.program is not None
    told = [[type(one) for one in job.commands if isinstance(one, Start | Reset)] for job in jobs_of(outcome.program)]
    assert told == [[], [Start], [], [Reset], [Start], [Reset]]


def test_parts_one_by_one_are_batches_of_one(oven_of_two: Prepared) -> None:
    cell = cell_of(oven_of_two.task, measure(oven_of_two), oven_of_two.order)
    outcome, _ = carry_out(oven_of_two, cell, (1, 1, 2, 3, 3, 2))
    assert (outcome.failure, outcome.delivered) == (None, (1, 2, 3))
    rows = {one.part: one.start_s for one in outcome.schedule.machines if one.kind == "process"}
    assert rows[1] < rows[2] == rows[3]


def test_what_is_moved_out_of_a_batch_just_before_its_end_is_put_back(oven_of_two: Prepared) -> None:
    """The batch ends 60 s after box 2 has come; once it counted as done, and only the audit found that it was not."""
    cell = cell_of(oven_of_two.task, measure(oven_of_two), oven_of_two.order)
    done_s = follow(cell, (1, 2)).moves[1].drop_s + 60.0
    moved = {"what": "part moved", "part": "box 1", "at_s": done_s - 1.3, "when": "in machine", "by_m": [0.0, 0.25]}
    conditions = Conditions(faults=(FaultFields.model_validate(moved),))
    outcome, _ = carry_out(oven_of_two, cell, (1, 2, 1, 2, 3, 3), conditions)
    assert [one.undone for one in outcome.happened] == [True]
    assert (outcome.failure, outcome.delivered) == (None, (1, 2, 3))
    assert outcome.audit is not None
    assert outcome.audit.findings == ()
