"""Sequence + skills -> motions: carries the order of transfers out in physics, and goes on from whatever was reached."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from lab.audit.audit import audit
from lab.audit.evidence import Evidence, Struck
from lab.audit.tracks import tracks_of
from lab.errors import LabError, WorkFailed
from lab.export.recorder import MotionRecorder
from lab.production.conditions import Conditions
from lab.production.faults.injector import Injector
from lab.production.floor import Floor
from lab.production.machine import NEVER
from lab.production.outcome import Outcome, Replanned
from lab.production.perception import Deviation, moved_off, scene_seen
from lab.production.recorder import burnt_name, finish_name
from lab.production.recovery import Recovery
from lab.production.relearning import Relearner, adopt
from lab.production.replanning import Planner, in_another, plan_again
from lab.production.run_journal import Met, Moved, RunJournal
from lab.production.standing import has_fallen, stands
from lab.production.transfers import Transfers
from lab.production.trouble import RunStopped, Trouble
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Schedule, rows_of
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.rest import Mishaps
from lab.sim.frames import Recording
from lab.sim.world import World
from lab.skills.prepared_scene import Prepared
from lab.teaching.events import Event, MachineDone, MoveMade, PlanMade, Tell, TroubleMet, unheard

PUT_RIGHT = "; put it right, then go on"  # what a person is asked
NOBODY: Mapping[int, int] = MappingProxyType({})


@dataclass
class Production:
    """One sequence being carried out on a floor.

    relearner: learns what changed in the scene, None: nobody does. planner: who orders the rest where it must be. sequence:
    the decisions still to come (see `Run`). replanned: each new order, in plain words.
    """

    floor: Floor
    cell: Cell
    tell: Tell = unheard
    relearner: Relearner | None = None
    planner: Planner = field(default_factory=Planner)
    sequence: list[int] = field(default_factory=list)
    replanned: list[Replanned] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.work = Transfers(self.floor, self.cell, self.tell)
        self.recovery = Recovery(self.work, self.replan, self.relearn)
        self.work.look = self.recovery.look
        self.floor.on_tick = self.watch

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carry the whole sequence out; None, or why not all parts were made: which, where and why.

        Where the run cannot go on by itself, or ends without a part that a person may help on, and somebody attends it, it
        waits until they have put things right.
        """
        self.sequence = [*sequence]
        while True:
            try:
                if self._next():
                    continue
                why, asked = self.recovery.failure(), self.recovery.to_put_right()
            except RunStopped as stopped:
                why = asked = str(stopped)
            if not self._put_right(asked):
                return why

    def _put_right(self, asked: str) -> bool:
        """Wait until a person has put right what is asked for; whether anybody has, and the run goes on."""
        while asked and self.floor.protected(f"{asked}{PUT_RIGHT}"):
            self.recovery.forget()
            try:
                found = self.recovery.find_again(attended=True)
                if not found:
                    self.replan("a person has put things right")
                return found or bool(self.sequence)
            except RunStopped as stopped:
                asked = str(stopped)
        return False

    def _next(self) -> bool:
        """The next move, or the answer to what keeps it from being made; False when nothing is left. Raises RunStopped."""
        try:
            if self.sequence:
                self.floor.between_moves()
            self.recovery.look()
            self.work.put_back()
            if self.sequence:
                self.work.bring_on(self.sequence)
                self.sequence.pop(0)
            elif not self.recovery.find_again():
                return False
        except Trouble as trouble:
            self.recovery.answer(trouble)
        self.floor.controls.move_ended()
        return True

    def replan(self, why: str, back: Mapping[int, int] = NOBODY) -> None:
        """Order the work that remains anew, from the state that was reached. Raises RunStopped where no order ends it.

        back: parts that had been given up and are to be brought on after all, and their positions.
        """
        work, recovery, now_s = self.work, self.recovery, self.floor.now_s
        work.begin_batches()
        first = self.sequence[0] if self.sequence and self.floor.bench.held is not None else None
        ready_s = {part: work.left_s(part) for part in range(1, self.cell.parts + 1) if work.work_on(part) is not None}
        taken_up = {*back, *work.taken_out()} - {*ready_s, *work.to_put_back}
        ready_s |= dict.fromkeys(sorted(taken_up), 0.0)
        mishaps = Mishaps(frozenset(recovery.lost), tuple(recovery.out), ready_s, back)
        try:
            found = plan_again(work.plan, mishaps, first, self.planner)
        except LabError as error:
            if first is None or not recovery.set_aside(why):
                raise RunStopped(f"{why}: {error}") from None
            self.replan(why, back)
            return
        recovery.lose(dict(found.stuck))
        self.sequence = [*found.sequence]
        work.go_by(found.run)
        gap = None
        if found.schedule is not None:
            is_proven = found.proven is not None and found.proven.proven
            gap = None if found.proven is None else found.proven.gap(found.schedule.makespan_s)
            plan = found.schedule.later(now_s)
            self.tell(PlanMade(plan, len(self.sequence), gap, is_proven, now_s, why, found.method))
        if found.method:
            self.replanned.append(Replanned(now_s, why, found.method, len(self.sequence), gap))

    def relearn(self, seen: Sequence[Deviation]) -> None:
        """Learn what changed in the scene, and go on with that. Raises LabError where nothing can be done in it."""
        if self.relearner is None:
            raise WorkFailed("nobody is there to teach what changed")
        floor, work = self.floor, self.work
        cell = self.relearner.learn(scene_seen(floor.scene.task, floor.scene.layout, [*seen]))
        adopt(floor, self.relearner.prepared, work.spot_of)
        work.go_by(in_another(work.plan, cell))

    def watch(self) -> None:
        """After each physics step: tell of machines that are done, and show what they have done to their parts.

        A machine is never done with a part that is seen not to stand in it.
        """
        floor, now_s = self.floor, self.floor.now_s
        for work in (work for machine in floor.machines.values() for work in machine.works.values()):
            if not work.told and work.done(now_s):
                if not floor.world.dark and moved_off(floor, work.part, self.work.spot_of.get(work.part)):
                    work.until_s = NEVER
                    continue
                work.told = True
                if work.skill is not None:
                    work.until_s = now_s
                at_most_s = self.work.at_most_s(work.part, work.station)
                work.burns_s = NEVER if at_most_s is None else now_s + at_most_s
                self.tell(MachineDone(work.station, work.part, now_s))
                if work.skill is None and floor.skillset.task.station(work.station).finish is not None:
                    self._show(finish_name(work.part, work.station))
            if now_s > work.burns_s:
                work.burns_s = NEVER
                self._show(burnt_name(work.part, work.station))
            if work.skill is not None and work.moves:
                self._show(*work.skill.shown())

    def _show(self, *names: str) -> None:
        if self.floor.recorder is not None:
            for name in names:
                self.floor.recorder.show(name)

    def _stands(self, name: str) -> bool:
        return stands(self.floor.bench, name, self.work.spot_of[name])

    def outcome(self, failure: str | None, interrupted: bool = False) -> Outcome:
        """What came of it."""
        work, floor = self.work, self.floor
        delivered = tuple(
            part for part in sorted(work.finished) if part not in work.spoilt and self._stands(work.name(part))
        )
        left = [part for part in range(1, self.cell.parts + 1) if part not in delivered]
        return Outcome(
            Schedule.from_moves(self.cell, work.moves),
            delivered,
            tuple(part for part in left if has_fallen(floor.bench, work.name(part))),
            tuple(self.recovery.notes),
            failure,
            floor.now_s,
            tuple(work.deviations_m),
            tuple(work.timed),
            floor.skipped_s,
            interrupted,
            replanned=tuple(self.replanned),
        )


def carry_out(
    prepared: Prepared,
    cell: Cell,
    sequence: Sequence[int],
    conditions: Conditions | None = None,
    tell: Tell = unheard,
    relearner: Relearner | None = None,
) -> tuple[Outcome, Recording]:
    """Carry `sequence` (one decision a move, see `Run`) out in physics, from parts on their first stations to the end.

    A part is delivered when it stands on its last station at the end, on its pallet if it has one; dropped when it is
    nowhere upright. Ctrl-C ends it with what came of it until then.
    """
    conditions = conditions or Conditions()
    with World() as world:
        floor, injector = Floor(world, prepared.skillset, prepared.layout, prepared.order), Injector(conditions.faults)
        injector.prepare(floor.scene)
        floor.scene.robot.override(conditions.override)
        floor.stand(prepared.surveys.approach(cell.robot_start))
        floor.restart_clock()
        floor.record(conditions.viewer)  # its times begin with the floor's, too
        motions = MotionRecorder(floor.scene.robot)  # its times begin with the floor's
        floor.hand = lambda: injector.tick(floor)
        journal = conditions.journal
        heard: list[Event] = []
        noted = noting(floor, journal, heard, tell)
        floor.tell = noted
        floor.controls = conditions.controls
        floor.stops.note = journal.note_stops
        floor.stops.again(journal.stops(), journal.last_step())
        conditions.on_floor(floor)
        planner = Planner(prepared.task.sequencing, prepared.seed)
        production = Production(floor, cell, noted, relearner, planner)
        interrupted = False
        try:
            failure = production.carry_out(sequence)
        except KeyboardInterrupt:
            failure, interrupted = "stopped by Ctrl-C", True
        floor.recorder.take()  # type: ignore[union-attr]
        outcome = replace(
            production.outcome(failure, interrupted),
            happened=tuple(injector.happened),
            heard=tuple(heard),
            program=motions.program(prepared.task, prepared.seed, production.work.moves, cell.part_name),
        )
        recording = floor.recorder.recording  # type: ignore[union-attr]
        return audited(outcome, recording, prepared, cell, sequence), recording


def audited(
    outcome: Outcome, recording: Recording, prepared: Prepared, cell: Cell, sequence: Sequence[int] = ()
) -> Outcome:
    """What came of a run after the audit: delivered is only what the frames show, else it fails for what they show.

    sequence: what was to be carried out; empty where it was made up on the way.
    """
    names = {cell.part_name(part): part for part in range(1, cell.parts + 1)}
    claimed = [name for name, part in names.items() if part in outcome.delivered]
    struck = tuple(Struck(one.what, one.part, one.station) for one in outcome.happened)
    rows = rows_of(outcome.schedule, cell, "measured")
    kept = sequence and not any(isinstance(event, TroubleMet) for event in outcome.heard)
    planned = rows_of(simulate(cell, sequence), cell, "planned") if kept else ()
    found = audit(Evidence(prepared.task, prepared.order, tracks_of(recording), rows, claimed, struck, planned))
    delivered = tuple(names[name] for name in found.delivered)
    return replace(outcome, audit=found, delivered=delivered, failure=outcome.failure or found.failure)


def noting(floor: Floor, journal: RunJournal, heard: list[Event], tell: Tell) -> Tell:
    """Tells on what happens, once it is in the journal."""

    def noted(event: Event) -> None:
        match event:
            case MoveMade(move, part):
                journal.tell(Moved(floor.steps, part, move.origin, move.target, move.pick_s, move.drop_s))
            case TroubleMet(what, answer, part, station):
                journal.tell(Met(floor.steps, what, answer, part, station))
        heard.append(event)
        tell(event)

    return noted
