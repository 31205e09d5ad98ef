"""Sequence + skills -> motions: carries the order of transfers out in physics, and continues from any reached state.

`carry_out` builds the objects of a job, each from those before it:

1. the state of the job (`run_state`), and its faults (`faults`);
2. the floor with the scene, whose hooks let faults strike, watch machines and write the journal (`floor`);
3. the work of machines, the transfers of the robot, and the recovery from trouble (`parts_in_machines`,
   `transfers`, `recovery`).

Then it makes the moves one by one (`Production`), and has the frames audited (`audited`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from lab.audit.audit import audit
from lab.audit.evidence import Evidence, Struck
from lab.audit.tracks import tracks_of
from lab.export.recorder import MotionRecorder
from lab.production.controls import Controls
from lab.production.faults.injector import Injector
from lab.production.floor import Floor, Hooks, idle, untouched
from lab.production.given_up_parts import GivenUpParts
from lab.production.outcome import Outcome
from lab.production.parts_in_machines import PartsInMachines, watch_machines
from lab.production.perception import look
from lab.production.recorder import Viewer
from lab.production.recovery import Recovery
from lab.production.replanning import Planner
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import Met, Moved, RunJournal
from lab.production.run_state import RunState
from lab.production.standing import has_fallen, stands
from lab.production.taught import Relearner
from lab.production.transfers import Transfers, first_spots
from lab.production.trouble import RunStopped, Trouble
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Schedule, rows_of
from lab.sequencing.simulate.follow import simulate
from lab.sim.frames import Recording
from lab.sim.world import World
from lab.skills.prepared_scene import Prepared
from lab.tasks.fault_fields import FaultFields
from lab.teaching.events import Event, MoveMade, Tell, TroubleMet, unheard

PUT_RIGHT = "; put it right, then go on"  # the text that asks a person to put something right


def nobody(floor: Floor) -> None:
    """Does nothing: nobody watches."""


@dataclass(frozen=True)
class Conditions:
    """The conditions of a run: its speed, its viewer, its controls, its faults, and its journal.

    override: the share of the task's speed and acceleration with which the arm moves. viewer: shows the run live.
    faults: the given faults; fault_seed: draws more of them, None: none. advice: the advice on the order, None: none.
    on_floor: called with the floor when it is ready. before_step, meanwhile: called by the floor, before faults strike
    (see `Hooks`).
    """

    override: float = 1.0
    viewer: Viewer | None = None
    controls: Controls = field(default_factory=Controls)
    journal: RunJournal = field(default_factory=RunJournal)
    faults: tuple[FaultFields, ...] = ()
    fault_seed: int | None = None
    advice: RunAdvice | None = None
    on_floor: Callable[[Floor], None] = nobody
    before_step: Callable[[Floor], bool] = untouched
    meanwhile: Callable[[], bool] = idle


@dataclass(frozen=True)
class Production:
    """One job that is carried out on a floor: its state, its transfers, and its recovery from trouble."""

    floor: Floor
    state: RunState
    work: Transfers
    recovery: Recovery

    @classmethod
    def of(
        cls, floor: Floor, state: RunState, relearner: Relearner | None = None, planner: Planner | None = None
    ) -> "Production":
        """The job at its beginning, with the parts on their first spots.

        relearner: learns the changed problems of the scene; None: they are not learned. planner: replans the remaining work.
        """
        state.spot_of |= first_spots(floor, state)
        machines = PartsInMachines(floor, state)
        work = Transfers(floor, state, machines)
        given_up = GivenUpParts(floor, state, machines)
        recovery = Recovery(floor, state, work, machines, given_up, relearner, planner or Planner())
        return cls(floor, state, work, recovery)

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carries the whole sequence out; returns why not all parts were made, by part, station and reason, or None.

        If the run is attended and cannot continue by itself, or ends without a part that a person could help, it waits until
        the person has put things right.
        """
        self.state.sequence = [*sequence]
        while True:
            try:
                if self._next():
                    continue
                why, asked = self.state.failure(), self.state.to_put_right()
            except RunStopped as stopped:
                why = asked = str(stopped)
            if not self._put_right(asked):
                return why

    def _next(self) -> bool:
        """Makes the next move or answers its trouble; returns False when no work is left. Raises RunStopped."""
        state = self.state
        try:
            if state.sequence:
                self.floor.between_moves()
            look(self.floor, state)
            self.work.put_back()
            if state.sequence:
                self.work.bring_on(state.sequence)
                state.sequence.pop(0)
            elif not self.recovery.find_again():
                return False
        except Trouble as trouble:
            self.recovery.answer(trouble)
        self.floor.controls.move_ended()
        return True

    def _put_right(self, asked: str) -> bool:
        """Waits until a person has put right what `asked` names; returns whether somebody did, so that the run continues."""
        while asked and self.floor.protected(f"{asked}{PUT_RIGHT}"):
            self.recovery.forget()
            try:
                any_back = self.recovery.find_again(attended=True)
                if not any_back:
                    self.recovery.replan("a person has put things right")
                return any_back or bool(self.state.sequence)
            except RunStopped as stopped:
                asked = str(stopped)
        return False

    def outcome(self, failure: str | None, interrupted: bool = False) -> Outcome:
        """The outcome of the run, from the present scene."""
        state, bench, cell = self.state, self.floor.bench, self.state.cell
        finished = [part for part in sorted(state.finished) if part not in state.spoilt]
        names = {part: state.name(part) for part in range(1, cell.parts + 1)}
        delivered = tuple(part for part in finished if stands(bench, names[part], state.spot_of[names[part]]))
        return Outcome(
            schedule=Schedule.from_moves(cell, state.moves),
            delivered=delivered,
            dropped=tuple(part for part in names if part not in delivered and has_fallen(bench, names[part])),
            retries=tuple(state.notes),
            failure=failure,
            sim_s=self.floor.now_s,
            camera_deviations_m=tuple(state.deviations_m),
            timed=tuple(state.timed),
            skipped_s=self.floor.skipped_s,
            interrupted=interrupted,
            replanned=tuple(state.replanned),
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

    A part is delivered if it stands at its last station at the end, on its pallet if it has one; dropped if it stands
    nowhere upright. After Ctrl-C the outcome until then is returned.
    """
    conditions = conditions or Conditions()
    journal, before_step, heard = conditions.journal, conditions.before_step, list[Event]()
    state, injector = RunState.of(cell), Injector(conditions.faults)
    hooks = Hooks(
        before_step=lambda floor: before_step(floor) | injector.tick(floor),
        after_step=partial(watch_machines, state),
        meanwhile=conditions.meanwhile,
        hear=noting(journal, heard, tell),
        note_stops=journal.note_stops,
    )
    with World() as world:
        scene = prepared.skillset, prepared.layout, prepared.order
        floor = Floor(world, *scene, controls=conditions.controls, hooks=hooks)
        injector.prepare(floor.scene)
        floor.scene.robot.override(conditions.override)
        floor.stand(prepared.surveys.approach(cell.robot_start))
        floor.restart_clock()
        recorder = floor.record(conditions.viewer)  # its times begin with the floor's, too
        motions = MotionRecorder(floor.scene.robot)  # its times begin with the floor's
        floor.stops.again(journal.stops(), journal.last_step())
        conditions.on_floor(floor)
        production = Production.of(floor, state, relearner, Planner(prepared.task.sequencing, prepared.seed))
        interrupted = False
        try:
            failure = production.carry_out(sequence)
        except KeyboardInterrupt:
            failure, interrupted = "stopped by Ctrl-C", True
        recorder.take()
        outcome = replace(
            production.outcome(failure, interrupted),
            happened=tuple(injector.happened),
            heard=tuple(heard),
            program=motions.program(prepared.task, prepared.seed, state.moves, cell.part_name),
        )
        return audited(outcome, recorder.recording, prepared, cell, sequence), recorder.recording


def audited(
    outcome: Outcome, recording: Recording, prepared: Prepared, cell: Cell, sequence: Sequence[int] = ()
) -> Outcome:
    """The outcome after the audit: only parts whose delivery the frames show are delivered; a finding is a failure.

    sequence: the planned decisions; empty if they were chosen during the run.
    """
    names = {cell.part_name(part): part for part in range(1, cell.parts + 1)}
    claimed = [name for name, part in names.items() if part in outcome.delivered]
    struck = tuple(Struck(fault.what, fault.part, fault.station) for fault in outcome.happened)
    rows = rows_of(outcome.schedule, cell, "measured")
    kept = sequence and not any(isinstance(event, TroubleMet) for event in outcome.heard)
    planned = rows_of(simulate(cell, sequence), cell, "planned") if kept else ()
    judged = audit(Evidence(prepared.task, prepared.order, tracks_of(recording), rows, claimed, struck, planned))
    delivered = tuple(names[name] for name in judged.delivered)
    return replace(outcome, audit=judged, delivered=delivered, failure=outcome.failure or judged.failure)


def noting(journal: RunJournal, heard: list[Event], tell: Tell) -> Callable[[Event, int], None]:
    """A listener that writes each event, with its physics step, to the journal, appends it to `heard`, and passes it on."""

    def hear(event: Event, step: int) -> None:
        match event:
            case MoveMade(move, part):
                journal.tell(Moved(step, part, move.origin, move.target, move.pick_s, move.drop_s))
            case TroubleMet(what, answer, part, station):
                journal.tell(Met(step, what, answer, part, station))
        heard.append(event)
        tell(event)

    return hear
