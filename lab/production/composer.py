"""Sequence + skills -> motions: carries the order of transfers out in physics, and goes on from whatever was reached."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from lab.production.conditions import Conditions
from lab.production.durations import TimedMove
from lab.production.faults.fault import Happened
from lab.production.faults.injector import Injector
from lab.production.floor import Floor
from lab.production.recorder import finish_name
from lab.production.recovery import Recovery
from lab.production.run_journal import Met, Moved, RunJournal
from lab.production.transfers import Transfers
from lab.production.trouble import RunStopped, Trouble
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.simulate.run import branch
from lab.sim.frames import Recording
from lab.sim.world import World
from lab.skills.prepared_scene import Prepared
from lab.teaching.events import Event, MachineDone, MoveMade, Tell, TroubleMet, unheard


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which parts were delivered, retries, and why it stopped (None: it did not).

    timed: how long each move took in which nothing had to be tried again. skipped_s: of sim_s, the time that passed without
    physics, while the robot waited and nothing moved. interrupted: by Ctrl-C; all else is what came of it until then.
    happened: the faults that struck.
    """

    schedule: Schedule
    delivered: tuple[int, ...]
    dropped: tuple[int, ...]
    retries: tuple[str, ...]
    failure: str | None
    sim_s: float
    camera_deviations_m: tuple[float, ...]
    timed: tuple[TimedMove, ...] = ()
    skipped_s: float = 0.0
    interrupted: bool = False
    happened: tuple[Happened, ...] = ()


@dataclass
class Production:
    """One sequence being carried out on a floor; sequence: the decisions still to come (see `Run`)."""

    floor: Floor
    cell: Cell
    tell: Tell = unheard
    sequence: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.work = Transfers(self.floor, self.cell, self.tell)
        self.recovery = Recovery(self.work, self.replan)
        self.work.look = self.recovery.look
        self.floor.on_tick = self.watch

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carry the whole sequence out; None, or why not all parts were made: which, where and why."""
        self.sequence = [*sequence]
        while True:
            try:
                self.floor.between_moves()
                self.recovery.look()
                if not self.sequence:
                    return self.recovery.failure()
                self.work.bring_on(self.sequence[0], len(self.sequence))
                self.sequence.pop(0)
            except Trouble as trouble:
                try:
                    self.recovery.answer(trouble)
                except RunStopped as stopped:
                    return str(stopped)

    def replan(self, why: str) -> None:
        """Order the work that remains anew, from the state that was reached."""
        left = branch(self.work.plan)
        kept = []
        for decision in self.sequence:
            if part_of(decision, self.cell.parts) not in self.recovery.lost and left.option(decision) is not None:
                left.move(decision)
                kept.append(decision)
        self.sequence = kept

    def watch(self) -> None:
        """After each physics step: tell of machines that are done, and show what they have done to their parts."""
        floor = self.floor
        for machine in floor.machines.values():
            if not machine.told and machine.done(floor.now_s):
                machine.told = True
                self.tell(MachineDone(machine.station, machine.part, floor.now_s))
                if machine.skill is None and floor.skillset.task.station(machine.station).finish is not None:
                    self._show(finish_name(machine.part, machine.station))
            if machine.skill is not None and machine.moves:
                self._show(*machine.skill.shown())

    def _show(self, *names: str) -> None:
        if self.floor.recorder is not None:
            for name in names:
                self.floor.recorder.show(name)

    def outcome(self, failure: str | None, interrupted: bool = False) -> Outcome:
        """What came of it."""
        work, floor = self.work, self.floor
        delivered = tuple(part for part in work.done() if work.stands(part))
        left = [part for part in range(1, self.cell.parts + 1) if part not in delivered]
        return Outcome(
            Schedule.from_moves(self.cell, work.moves),
            delivered,
            tuple(part for part in left if work.has_fallen(part)),
            tuple(self.recovery.notes),
            failure,
            floor.now_s,
            tuple(work.deviations_m),
            tuple(work.timed),
            floor.skipped_s,
            interrupted,
        )


def carry_out(
    prepared: Prepared,
    cell: Cell,
    sequence: Sequence[int],
    conditions: Conditions | None = None,
    tell: Tell = unheard,
) -> tuple[Outcome, Recording]:
    """Carry `sequence` (one decision a move, see `Run`) out in physics, from parts on their first stations to the end.

    A part is delivered when it stands on its last station at the end, on its pallet if it has one; dropped when it is
    nowhere upright. Ctrl-C ends it with what came of it until then.
    """
    conditions = conditions or Conditions()
    with World() as world:
        floor, injector = Floor(world, prepared.skillset, prepared.layout, prepared.order), Injector(conditions.faults)
        injector.prepare(floor.scene)
        floor.record(conditions.viewer)
        floor.scene.robot.override(conditions.override)
        floor.stand(prepared.surveys.approach(cell.robot_start))
        floor.restart_clock()
        floor.hand = lambda: injector.tick(floor)
        journal = conditions.journal
        noted = _noting(floor, journal, tell)
        floor.tell = noted
        floor.controls = conditions.controls
        floor.stops.note = journal.note_stops
        floor.stops.again(journal.stops(), journal.last_step())
        production = Production(floor, cell, noted)
        interrupted = False
        try:
            failure = production.carry_out(sequence)
        except KeyboardInterrupt:
            failure, interrupted = "stopped by Ctrl-C", True
        floor.recorder.take()  # type: ignore[union-attr]
        outcome = replace(production.outcome(failure, interrupted), happened=tuple(injector.happened))
        return outcome, floor.recorder.recording  # type: ignore[union-attr]


def _noting(floor: Floor, journal: RunJournal, tell: Tell) -> Tell:
    """Tells on what happens, once it is in the journal."""

    def noted(event: Event) -> None:
        match event:
            case MoveMade(move, part):
                journal.tell(Moved(floor.steps, part, move.origin, move.target, move.pick_s, move.drop_s))
            case TroubleMet(what, answer, part, station):
                journal.tell(Met(floor.steps, what, answer, part, station))
        tell(event)

    return noted
