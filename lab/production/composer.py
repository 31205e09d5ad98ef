"""Sequence + skills -> motions: carries the order of transfers out in physics, and goes on from whatever was reached.

`carry_out` builds all that a job needs, each from what stands before it:

1. the state of the job (`run_state`), and the faults that are to strike (`faults`);
2. the floor with the scene, whose hooks let faults strike, watch machines and write the journal (`floor`);
3. what machines do with parts, what the robot does with them, and what is done about trouble (`parts_in_machines`,
   `transfers`, `recovery`).

Then it makes one move after the other (`Production`), and has the frames audited (`audited`).
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

PUT_RIGHT = "; put it right, then go on"  # what a person is asked


def nobody(floor: Floor) -> None:
    """Nobody looks at it."""


@dataclass(frozen=True)
class Conditions:
    """Under which conditions a prepared task is carried out: how fast, who watches and may stop it, and what is kept of it.

    override: the share of the task's speed and acceleration with which the arm moves. viewer: who watches live.
    faults: what goes wrong in it; fault_seed: draws more of that, None: nothing more. advice: who is asked, None: nobody
    about the order. on_floor: called with the floor when it is ready. before_step, meanwhile: called by the floor, before
    faults strike (see `Hooks`).
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
    """One job being carried out on a floor: its state, what the robot does, and what is done about trouble."""

    floor: Floor
    state: RunState
    work: Transfers
    recovery: Recovery

    @classmethod
    def of(
        cls, floor: Floor, state: RunState, relearner: Relearner | None = None, planner: Planner | None = None
    ) -> "Production":
        """A job that begins on a floor, with its parts where they stand at first.

        relearner: learns what changed in the scene, None: nobody does. planner: who orders the rest where it must be.
        """
        state.spot_of |= first_spots(floor, state)
        machines = PartsInMachines(floor, state)
        work = Transfers(floor, state, machines)
        given_up = GivenUpParts(floor, state, machines)
        recovery = Recovery(floor, state, work, machines, given_up, relearner, planner or Planner())
        return cls(floor, state, work, recovery)

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carry the whole sequence out; None, or why not all parts were made: which, where and why.

        Where the run cannot go on by itself, or ends without a part that a person may help on, and somebody attends it, it
        waits until they have put things right.
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
        """The next move, or the answer to what keeps it from being made; False when nothing is left. Raises RunStopped."""
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
        """Wait until a person has put right what is asked for; whether anybody has, and the run goes on."""
        while asked and self.floor.protected(f"{asked}{PUT_RIGHT}"):
            self.recovery.forget()
            try:
                found = self.recovery.find_again(attended=True)
                if not found:
                    self.recovery.replan("a person has put things right")
                return found or bool(self.state.sequence)
            except RunStopped as stopped:
                asked = str(stopped)
        return False

    def outcome(self, failure: str | None, interrupted: bool = False) -> Outcome:
        """What came of it, as the scene is now."""
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

    A part is delivered when it stands on its last station at the end, on its pallet if it has one; dropped when it is
    nowhere upright. Ctrl-C ends it with what came of it until then.
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


def noting(journal: RunJournal, heard: list[Event], tell: Tell) -> Callable[[Event, int], None]:
    """A listener that writes what happened, at a physics step, to the journal, keeps it in `heard`, then tells it on."""

    def hear(event: Event, step: int) -> None:
        match event:
            case MoveMade(move, part):
                journal.tell(Moved(step, part, move.origin, move.target, move.pick_s, move.drop_s))
            case TroubleMet(what, answer, part, station):
                journal.tell(Met(step, what, answer, part, station))
        heard.append(event)
        tell(event)

    return hear
