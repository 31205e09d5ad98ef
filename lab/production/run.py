"""A run from order to outcome, top to bottom: what `lab run` and `lab.run` do with a prepared task.

1. The skills that it needs are found in the toolbox or learned, and how long moves take is found or measured (`taught`).
2. An order of the transfers is found (`order`), and becomes the plan.
3. Faults are drawn, where any are asked for (`faults`).
4. The order is carried out in physics, move by move; the frames of that are audited (`composer`).
5. Pictures, replay and numbers are written (`report`).
6. What the run measured and used is kept in the toolbox (`remember`).
"""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.errors import LabError
from lab.production.composer import Conditions, carry_out
from lab.production.durations import RECORDS
from lab.production.faults.injector import draw
from lab.production.floor import Floor
from lab.production.order import OrderAdvice, ordered
from lab.production.recorder import show_scene
from lab.production.report import Report, begin_pictures, write_files
from lab.production.run_journal import RunEnded
from lab.production.taught import Relearner, teach_all
from lab.sequencing.simulate.follow import simulate
from lab.skills.prepared_scene import Prepared
from lab.teaching.events import PhaseBegan, PlanMade, RecordSkipped
from lab.teaching.teacher import Teacher
from lab.view.scene_data import describe
from lab.workers import Workers, WorkerTask


def run(
    prepared: Prepared,
    teacher: Teacher,
    out: Path,
    conditions: Conditions | None = None,
    workers: Workers | None = None,
) -> Report:
    """What the whole job on a prepared task came to; pictures, replay and JSON files go to `out` (see `lab.files.check_out`).

    How long moves took is kept, and the next run plans with it. Ctrl-C while it is carried out ends it with what came of it
    until then; the journal goes on from there. workers: who shares in timing and drawing, None: this process alone.
    """
    conditions, workers = conditions or Conditions(), workers or Workers()
    began, advice, tell = time.perf_counter() - prepared.wall_s, conditions.advice, teacher.tell
    if conditions.viewer is not None:
        show_scene(prepared.task, prepared.order, prepared.layout, conditions.viewer)

    # skills and durations
    taught = teach_all(prepared, teacher, conditions.journal, None if advice is None else advice.again, workers)
    drawn = begin_pictures(prepared, taught, workers)

    # the order
    tell(PhaseBegan("sequence", 1))
    people, durations = teacher.advising.people, taught.durations.to_json()
    whose = OrderAdvice() if advice is None else advice.order(people, durations)
    order = ordered(taught.cell, prepared.task.sequencing, whose, prepared.seed, tell)
    sequence = order.found.sequence
    planned = simulate(taught.cell, sequence)
    gap, proven = order.proven.gap(planned.makespan_s), order.proven.proven
    tell(PhaseBegan("carry out", len(sequence)))
    tell(PlanMade(planned, len(sequence), gap, proven, 0.0, method=order.used))

    # faults
    faults = prepared.task.faults
    if conditions.fault_seed is not None:
        faults += draw(prepared.task, prepared.order, conditions.fault_seed, planned.makespan_s)

    # carried out in physics
    described, watch = list[WorkerTask[dict[str, Any]]](), conditions.on_floor

    def on_floor(floor: Floor) -> None:
        """Begin to describe the scene for the replay: reading its meshes takes longer than all else for that."""
        if floor.recorder is not None:
            filmed = floor.recorder.recording
            described.append(workers.begin(describe, filmed.bodies, filmed.camera))
        watch(floor)

    conditions = replace(conditions, faults=faults, on_floor=on_floor)
    outcome, recording = carry_out(
        prepared, taught.cell, sequence, conditions, tell, Relearner(prepared, taught, teacher)
    )
    report = Report(
        prepared=prepared,
        taught=taught,
        sequenced=order.found,
        method=order.used,
        proven=order.proven,
        outcome=outcome,
        recording=recording,
        began_s=began,
        receipts=None if advice is None else advice.receipts(order),
        rhythm=order.rhythm,
        learning=order.learning,
    )

    # what it leaves behind
    tell(PhaseBegan("draw", 1))
    write_files(report, out, drawn, described[0] if described else None, workers)
    if not outcome.interrupted:
        remember(report, teacher)
        conditions.journal.tell(RunEnded(len(outcome.delivered), outcome.failure or ""))
    return report


def remember(report: Report, teacher: Teacher) -> None:
    """Keep in the toolbox how long moves took, and in each skill's log that it was used.

    What cannot be kept is told, and fails nothing: the run counts without it.
    """
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
