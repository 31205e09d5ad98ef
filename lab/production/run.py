"""The main job: find or learn the skills, measure their durations, sequence, carry out in physics."""

import time
from dataclasses import replace
from pathlib import Path

from lab.errors import LabError
from lab.production.composer import carry_out
from lab.production.durations import RECORDS, Durations, cell_of, durations_key, kept_durations, measure
from lab.production.recorder import Viewer, show_scene
from lab.production.report import Report, Taught, write_files
from lab.sequencing import find_sequence
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import Reference
from lab.skills.prepared_scene import Prepared
from lab.skills.trial import trial_of
from lab.tasks.sequencing import search_for
from lab.teaching.events import MoveTimed, PhaseBegan, RecordSkipped, ScenePrepared, SequenceFound, SkillReady
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.teacher import Teacher


def teach_all(prepared: Prepared, teacher: Teacher) -> Taught:
    """Find or learn every skill, then find or measure the durations of every move."""
    task, skillset = prepared.task, prepared.skillset
    teacher = replace(teacher, trial=trial_of(prepared))
    known, damaged = teacher.toolbox.index()
    for what in damaged:
        teacher.tell(RecordSkipped(what))
    teacher.tell(ScenePrepared(prepared))
    teacher.tell(PhaseBegan("learn", len(prepared.problems)))
    lessons, first = {}, dict[str, str]()  # by signature, the skill that it was first found or learned for
    for name, problem in prepared.problems.items():
        settings = task.subtask(problem.subtask)
        lesson = teacher.find_or_teach(LessonPlan(problem, settings.learner, settings.gate, task.name), known)
        same = first.setdefault(f"{problem.subtask} {problem.mdp.signature}", name)
        if same != name and lesson.source == "reused":  # it would have been learned only once
            lesson = replace(lesson, reason=f"it is the same problem as '{same}'", saved=(0, 0))
        known[problem.subtask, lesson.policy.signature] = lesson.policy
        skillset.policies[name] = lesson.policy
        lessons[name] = lesson
        teacher.tell(SkillReady(name, lesson))
    durations, key = _durations(prepared, teacher)
    return Taught(lessons, durations, cell_of(task, durations, prepared.order), key)


def _durations(prepared: Prepared, teacher: Teacher) -> tuple[Durations, str]:
    """The durations measured earlier for exactly these policies in exactly this scene, or measured now and kept; their key.

    The key is "" where they cannot be kept.
    """
    skillset, key, kept = prepared.skillset, "", None
    try:
        key = durations_key(prepared.task, prepared.layout, skillset, skillset.policies)
        kept = kept_durations(teacher.toolbox, key, skillset)
    except LabError as error:  # then they are measured: nothing is lost but time
        teacher.tell(RecordSkipped(f"durations measured earlier: {error}"))
    if kept is not None:
        return kept, key
    works = sum(bool(skills) for skills in (*skillset.processes.values(), *skillset.services.values()))
    teacher.tell(PhaseBegan("measure", len(skillset.legs) + len(skillset.travels) + works))
    durations = measure(prepared, lambda name, seconds: teacher.tell(MoveTimed(name, seconds)))
    if key:
        teacher.toolbox.save_record(RECORDS, key, durations.to_json())
    return durations, key


def run(
    prepared: Prepared, teacher: Teacher, out: Path, *, override: float = 1.0, viewer: Viewer | None = None
) -> Report:
    """The whole job on a prepared task; pictures, replay and JSON files go to `out` (see `lab.files.check_out`).

    override: the arm's share of its speed (see `carry_out`). How long moves took is kept, and the next run plans with it.
    """
    began = time.perf_counter() - prepared.wall_s
    if viewer is not None:
        show_scene(prepared.task, prepared.order, prepared.layout, viewer)
    taught = teach_all(prepared, teacher)
    teacher.tell(PhaseBegan("sequence", 1))
    settings = prepared.task.sequencing
    found = find_sequence(taught.cell, settings.method, search_for(settings), prepared.seed)
    proven = optimum(taught.cell)
    teacher.tell(SequenceFound(found, Reference(proven.bound_s, proven.proven, "A*")))
    teacher.tell(PhaseBegan("carry out", len(found.sequence)))
    outcome, recording = carry_out(
        prepared, taught.cell, found.sequence, override=override, viewer=viewer, tell=teacher.tell
    )
    report = Report(prepared, taught, found, proven, outcome, recording, began)
    teacher.tell(PhaseBegan("draw", 1))
    write_files(report, out)
    remember(report, teacher)
    return report


def remember(report: Report, teacher: Teacher) -> None:
    """Keeps how long moves took, and in each skill's log that it was used; what cannot be kept is told: the run counts."""
    taught, outcome, prepared = report.taught, report.outcome, report.prepared
    used = {"task": prepared.task.name, "seed": prepared.seed}
    used["delivered"] = f"{len(outcome.delivered)} of {len(prepared.order)}"
    try:
        if taught.durations_key:
            teacher.toolbox.save_record(RECORDS, taught.durations_key, taught.durations.after(outcome.timed).to_json())
        for name in sorted({lesson.policy.name for lesson in taught.lessons.values()}):
            teacher.toolbox.note(name, "used", **used)
    except LabError as error:
        teacher.tell(RecordSkipped(f"what this run measured: {error}"))
