"""The main job: find or learn the skills, measure their durations, sequence, carry out in physics."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from lab.errors import BadInput, LabError
from lab.production.composer import carry_out
from lab.production.conditions import Conditions
from lab.production.durations import RECORDS, Durations, cell_of, durations_key, kept_durations, measure
from lab.production.faults.draw import draw
from lab.production.floor import Floor
from lab.production.order import OrderAdvice, ordered
from lab.production.recorder import show_scene
from lab.production.relearning import Relearner
from lab.production.report import Report, begin_pictures, write_files
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import DurationsKept, RunEnded, RunJournal
from lab.production.taught import Taught, skill_row
from lab.sequencing.simulate.follow import simulate
from lab.sim.frames import Recording
from lab.skills.prepared_scene import Prepared
from lab.skills.trial import trial_of
from lab.teaching.events import MoveTimed, PhaseBegan, PlanMade, RecordSkipped, ScenePrepared, SkillReady
from lab.teaching.lesson_plan import Lesson, LessonPlan
from lab.teaching.teacher import Teacher
from lab.workers import Task, Workers

Described = tuple[Recording, Task[dict[str, Any]]]  # a recording, and the scene that it shows


def teach_all(
    prepared: Prepared,
    teacher: Teacher,
    journal: RunJournal | None = None,
    advice: RunAdvice | None = None,
    workers: Workers | None = None,
) -> Taught:
    """Find or learn every skill, then find or measure the durations of every move; what the journal holds is taken from it.

    advice: of a run that is gone on with, what was said in the lessons that are over counts in its receipts. workers: who
    shares in the timing; None: nobody.
    """
    task, skillset, journal = prepared.task, prepared.skillset, journal or RunJournal()
    teacher = replace(teacher, trial=trial_of(prepared))
    known, damaged = teacher.toolbox.index()
    known = journal.known_at_first(known)
    for what in damaged:
        teacher.tell(RecordSkipped(what))
    teacher.tell(ScenePrepared(prepared))
    teacher.tell(PhaseBegan("learn", len(prepared.problems)))
    lessons, rows, first = (
        dict[str, Lesson](),
        dict[str, dict[str, Any]](),
        dict[str, str](),
    )  # by signature, the skill that it was first found or learned for
    for name, problem in prepared.problems.items():
        kept, same = journal.skill(name), first.setdefault(f"{problem.subtask} {problem.mdp.signature}", name)
        settings = task.subtask(problem.subtask)
        plan = LessonPlan(problem, settings.learner, settings.gate, task.name)
        if kept is not None:
            if advice is not None and kept.row["source"] != "reused":
                try:
                    advice.again(plan)
                except BadInput as error:  # the policy is there: only what it was worth is not known
                    teacher.tell(RecordSkipped(f"what was said about '{name}': {error}"))
            lesson, row = Lesson(kept.policy, "reused", reason="it was there before this run was stopped"), kept.row
        else:
            lesson = teacher.find_or_teach(plan, known)
            if same != name and lesson.source == "reused":  # it would have been learned only once
                lesson = replace(lesson, reason=f"it is the same problem as '{same}'", saved=(0, 0))
            row = skill_row(name, lesson)
            journal.keep_skill(row, lesson.policy)
        known[problem.subtask, lesson.policy.signature] = lesson.policy
        skillset.policies[name] = lesson.policy
        lessons[name], rows[name] = lesson, row
        teacher.tell(SkillReady(name, lesson))
    durations, key = _durations(prepared, teacher, journal, workers)
    return Taught(lessons, rows, durations, cell_of(task, durations, prepared.order), key)


def _durations(
    prepared: Prepared, teacher: Teacher, journal: RunJournal, workers: Workers | None
) -> tuple[Durations, str]:
    """The durations measured earlier for exactly these policies in exactly this scene, or measured now and kept; their key.

    The key is "" where they cannot be kept.
    """
    skillset, key, kept = prepared.skillset, "", None
    try:
        key = durations_key(prepared.task, prepared.layout, skillset, skillset.policies, prepared.order)
        record = journal.durations()
        if record is not None:
            return replace(Durations.from_json(record.times, skillset), sim_s=record.sim_s), key
        kept = kept_durations(teacher.toolbox, key, skillset)
    except LabError as error:  # then they are measured: nothing is lost but time
        teacher.tell(RecordSkipped(f"durations measured earlier: {error}"))
    if kept is None:
        works = sum(bool(skills) for skills in (*skillset.processes.values(), *skillset.services.values()))
        teacher.tell(PhaseBegan("measure", len(skillset.legs) + len(skillset.travels) + works))
        kept = measure(prepared, lambda name, seconds: teacher.tell(MoveTimed(name, seconds)), workers)
        if key:
            try:
                teacher.toolbox.save_record(RECORDS, key, kept.to_json())
            except LabError as error:  # they are measured again: nothing is lost but time
                teacher.tell(RecordSkipped(f"the durations: {error}"))
    journal.write(DurationsKept(kept.to_json(), kept.sim_s))
    return kept, key


def run(
    prepared: Prepared,
    teacher: Teacher,
    out: Path,
    conditions: Conditions | None = None,
    workers: Workers | None = None,
) -> Report:
    """The whole job on a prepared task; pictures, replay and JSON files go to `out` (see `lab.files.check_out`).

    How long moves took is kept, and the next run plans with it. Ctrl-C while it is carried out ends it with what came of it
    until then; the journal goes on from there. workers: who shares in timing and drawing, None: this process alone.
    """
    conditions, workers = conditions or Conditions(), workers or Workers()
    began = time.perf_counter() - prepared.wall_s
    if conditions.viewer is not None:
        show_scene(prepared.task, prepared.order, prepared.layout, conditions.viewer)
    taught = teach_all(prepared, teacher, conditions.journal, conditions.advice, workers)
    drawn = begin_pictures(prepared, taught, workers)
    teacher.tell(PhaseBegan("sequence", 1))
    advice, people = conditions.advice, teacher.advising.people
    whose = OrderAdvice() if advice is None else advice.order(people, taught.durations.to_json())
    order = ordered(taught.cell, prepared.task.sequencing, whose, prepared.seed, teacher.tell)
    planned = simulate(taught.cell, order.found.sequence)
    gap, proven = order.proven.gap(planned.makespan_s), order.proven.proven
    teacher.tell(PhaseBegan("carry out", len(order.found.sequence)))
    teacher.tell(PlanMade(planned, len(order.found.sequence), gap, proven, 0.0, method=order.used))
    faults = prepared.task.faults
    if conditions.fault_seed is not None:
        faults += draw(prepared.task, prepared.order, conditions.fault_seed, planned.makespan_s)
    conditions, relearner = replace(conditions, faults=faults), Relearner(prepared, taught, teacher)
    scenes = list[Described]()
    on_floor = partial(_look_at, conditions.on_floor, workers, scenes)
    conditions = replace(conditions, on_floor=on_floor)
    outcome, recording = carry_out(prepared, taught.cell, order.found.sequence, conditions, teacher.tell, relearner)
    receipts = None if advice is None else advice.receipts(order)
    report = Report(
        prepared=prepared,
        taught=taught,
        sequenced=order.found,
        method=order.used,
        proven=order.proven,
        outcome=outcome,
        recording=recording,
        began_s=began,
        receipts=receipts,
        rhythm=order.rhythm,
        learning=order.learning,
    )
    teacher.tell(PhaseBegan("draw", 1))
    scene = next((scene for filmed, scene in scenes if filmed is recording), None)
    write_files(report, out, drawn, scene, workers)
    if not outcome.interrupted:
        remember(report, teacher)
        conditions.journal.tell(RunEnded(len(outcome.delivered), outcome.failure or ""))
    return report


def _look_at(and_then: Callable[[Floor], None], workers: Workers, scenes: list[Described], floor: Floor) -> None:
    """Begin to describe what the floor's recording shows: reading its meshes takes longer than all else for the replay."""
    from lab.view.scene_data import describe

    if floor.recorder is not None:
        filmed = floor.recorder.recording
        scenes.append((filmed, workers.begin(describe, filmed.bodies, filmed.camera)))
    and_then(floor)


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
