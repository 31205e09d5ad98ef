"""Parts on parts in physics: a lid is put on its box, and layers are taken off from the top; measured as predicted."""

from pathlib import Path

import pytest

from lab.production.composer import carry_out
from lab.production.durations import cell_of, measure
from lab.production.outcome import Outcome
from lab.sequencing.methods.exact import optimum
from lab.sim.frames import Recording
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.task_file import load
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher
from lab.toolbox.index import KnownPolicies
from lab.toolbox.registry import Toolbox


def prepared(folder: Path, text: str, order: tuple[str, ...]) -> Prepared:
    """A cell whose skills are learned from the expert."""
    (folder / "stacks.toml").write_text(text, encoding="utf-8")
    task = load(str(folder / "stacks.toml"))
    found = prepare(task, order, 0)
    teacher = Teacher(Toolbox(folder / "toolbox"))
    for name, problem in found.problems.items():
        settings = task.subtask(problem.subtask)
        lesson = LessonPlan(problem, settings.learner, settings.gate, task.name)
        found.skillset.policies[name] = teacher.find_or_teach(lesson, KnownPolicies.of([])).policy
    return found


def carried(cell: Prepared) -> tuple[Outcome, Recording]:
    """The best order, carried out; what was measured is at most 3 % off what was predicted."""
    problem = cell_of(cell.task, measure(cell), cell.order)
    best = optimum(problem)
    outcome, recording = carry_out(cell, problem, best.sequence)
    assert outcome.schedule.makespan_s == pytest.approx(best.cost, rel=0.03)
    return outcome, recording


def test_a_lid_is_put_on_its_box(root: Path, tmp_path: Path) -> None:
    text = (root / "tasks" / "kit.toml").read_text(encoding="utf-8")
    outcome, recording = carried(prepared(tmp_path, text, ("lid", "box")))
    assert (outcome.failure, outcome.delivered) == (None, (1, 2))
    last = recording.frames[-1].poses
    assert last["lid 1"][:2] == pytest.approx(last["box 2"][:2], abs=0.01)
    assert last["lid 1"][2] == pytest.approx(last["box 2"][2] + 0.025 + 0.01, abs=0.003)  # half a box and half a lid


@pytest.mark.slow
def test_a_layer_is_taken_off_before_the_one_below(root: Path, tmp_path: Path) -> None:
    text = (root / "tasks" / "palletise.toml").read_text(encoding="utf-8")
    for old, new in (
        ('["conveyor", "labeller", "pallet"]', '["pallet", "labeller", "conveyor"]'),
        ("area = [0.006, 0.004, 0.05]", "area = [0.002, 0.002, 0.02]"),
    ):
        assert old in text
        text = text.replace(old, new)
    outcome, recording = carried(prepared(tmp_path, text, ("box",) * 6))
    assert (outcome.failure, len(outcome.delivered)) == (None, 6)
    first = dict[str, float]()  # when each box was lifted off the height at which it stood
    begun = recording.frames[0].poses
    for frame in recording.frames:
        for name, pose in frame.poses.items():
            if name.startswith("box ") and abs(pose[2] - begun[name][2]) > 0.01:
                first.setdefault(name, frame.time_s)
    assert max(first["box 5"], first["box 6"]) < min(first[f"box {n}"] for n in (1, 2, 3, 4))
