"""Sequence + skills -> motions: carries the order of transfers out in physics and notices what fails."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot

from lab.production.durations import TimedMove
from lab.production.floor import Floor
from lab.production.recorder import Viewer
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.simulate.run import Run
from lab.sim.frames import Recording
from lab.sim.scene import Spot, spots
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import UPRIGHT, Status
from lab.teaching.events import MoveMade, MoveRetried, Tell, unheard

MAX_TRIES = 3  # a failed step is tried again from the state reached, at most twice
ASTRAY_M = 0.15  # a slice this near to a spot of a station can be taken up again from there
DELIVERED_M = 0.02  # a slice this near to its spot has been delivered


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which toasts were delivered, retries, and why it stopped (None: it did not).

    timed: how long each move took in which nothing had to be tried again.
    """

    schedule: Schedule
    delivered: tuple[int, ...]
    dropped: tuple[int, ...]
    retries: tuple[str, ...]
    failure: str | None
    sim_s: float
    camera_deviations_m: tuple[float, ...]
    timed: tuple[TimedMove, ...] = ()


class _Stopped(Exception):
    """A step failed too often; the text says which toast, where and why."""


@dataclass
class Production:
    """One sequence being carried out on a floor: where toasts are, which spots are taken, when machines are done."""

    floor: Floor
    cell: Cell
    tell: Tell = unheard
    moves: list[Move] = field(default_factory=list)
    timed: list[TimedMove] = field(default_factory=list)
    retries: list[str] = field(default_factory=list)
    deviations_m: list[float] = field(default_factory=list)
    ready_s: dict[str, float] = field(default_factory=dict)
    toast_in: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        cell, task = self.cell, self.floor.skillset.task
        self.plan = Run(cell)  # where toasts are and may go; its times are the predicted ones
        self.place = cell.robot_start
        first = cell.names[cell.positions[cell.starts[0]].station]
        self.spot_of: dict[int, Spot] = dict(enumerate(spots(task.station(first)), start=1))

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carry the whole sequence out; None, or which toast could not be brought on, where and why."""
        try:
            for toast in sequence:
                self._bring_on(toast)
            return None
        except _Stopped as stopped:
            return str(stopped)

    def done(self) -> list[int]:
        """The toasts that reached the last station."""
        return [toast for toast, end_s in enumerate(self.plan.finished_s, start=1) if end_s is not None]

    def _bring_on(self, toast: int) -> None:
        """One decision: go to the toast, wait for its machine, carry it one stage on, start the machine there."""
        floor, names = self.floor, self.cell.names
        option = self.plan.option(toast)
        if option is None:
            raise _Stopped(self.plan.refusal(toast))
        origin, target, start, leave_s = names[option.origin], names[option.target], self.place, floor.now_s
        tried = len(self.retries)
        for skill in () if start == origin else floor.skillset.travels[start, origin]:
            self._try(toast, origin, skill)
        reach_s = floor.now_s
        if start != origin and len(self.retries) == tried:
            self.timed.append(TimedMove((start, origin), False, reach_s - leave_s))
        self._await(toast, origin)
        pick_s, tried = floor.now_s, len(self.retries)
        spot = self._free_spot(target)
        self._carry(toast, origin, target, spot)
        if len(self.retries) == tried:
            self.timed.append(TimedMove((origin, target), True, floor.now_s - pick_s))
        self.place, self.spot_of[toast] = target, spot
        process_s = self.plan.move(toast).process_s
        self.moves.append(Move(toast, start, origin, target, leave_s, reach_s, pick_s, floor.now_s, process_s))
        self._start_machine(toast, target)
        self.tell(MoveMade(self.moves[-1]))

    def _free_spot(self, station: str) -> Spot:
        """The first spot of a station on which no toast stands."""
        return next(s for s in spots(self.floor.skillset.task.station(station)) if s not in self.spot_of.values())

    def _carry(self, toast: int, origin: str, target: str, spot: Spot) -> None:
        """Pick up, carry, set down; what fails is tried again from the state reached, at most twice."""
        name, skillset = _slice(toast), self.floor.skillset
        picks = skillset.picks[origin]
        for skill in picks:
            self._try(toast, origin, skill.aim(name, spot))
        rest = [skill.aim(name, spot) for skill in skillset.legs[origin, target][len(picks) :]]
        tries, step, first = [0] * len(rest), 0, ""
        while step < len(rest):
            skill = rest[step]
            if self.floor.run(skill) is Status.SUCCESS:
                step += 1
                continue
            tries[step] += 1
            first = first or skill.reason
            self._note(f"toast {toast} at '{target}', '{skill.name}', try {tries[step]}: {skill.reason}")
            if tries[step] == MAX_TRIES:
                raise _Stopped(f"toast {toast} at '{target}': {first} (tried {MAX_TRIES} times)")
            if not self.floor.bench.holds(name):
                again = self._pick_up_again(toast, origin, target, first)
                step = 0 if again == origin else max(at for at, later in enumerate(rest) if later.carries)
        self.deviations_m += [d for skill in rest for d in skill.deviations_m]

    def _pick_up_again(self, toast: int, origin: str, target: str, why: str) -> str:
        """Take a slice that is not in the gripper from where it stands; at which of the two stations that was."""
        bench, skillset, name = self.floor.bench, self.floor.skillset, _slice(toast)
        bench.held = None
        if bench.upright(name) < UPRIGHT:
            raise _Stopped(f"toast {toast} at '{target}': {why}; {name} has fallen over")
        for station in (target, origin):
            at, foots = bench.slice_pose(name), spots(skillset.task.station(station))
            near = any(hypot(at.x - foot.x, at.y - foot.y) < ASTRAY_M for foot in foots)
            if near and all(self.floor.run(skill.aim(name)) is Status.SUCCESS for skill in skillset.picks[station]):
                return station
        raise _Stopped(f"toast {toast} at '{target}': {why}; {name} could not be taken up again from where it is")

    def _try(self, toast: int, where: str, skill: Skill) -> None:
        """Carry a skill out; when it fails it is tried again from the state reached, at most twice."""
        for attempt in range(1, MAX_TRIES + 1):
            if self.floor.run(skill) is Status.SUCCESS:
                return
            self._note(f"toast {toast} at '{where}', '{skill.name}', try {attempt}: {skill.reason}")
        raise _Stopped(f"toast {toast} at '{where}': {skill.reason} (tried {MAX_TRIES} times)")

    def _note(self, text: str) -> None:
        self.retries.append(text)
        self.tell(MoveRetried(text))

    def _await(self, toast: int, station: str) -> None:
        """Wait at a machine until it is done with its toast; a learned process that failed is tried again."""
        machine = self.floor.machines.get(station)
        tries = 0
        while True:
            if machine and machine.status is Status.FAILURE:  # now, or while the robot was elsewhere
                tries += 1
                self._note(f"toast {toast} at '{station}', try {tries}: {machine.reason}")
                if tries == MAX_TRIES:
                    raise _Stopped(f"toast {toast} at '{station}': {machine.reason} (tried {MAX_TRIES} times)")
                self.floor.start(machine)
            elif self.floor.now_s >= self.ready_s.get(station, 0.0) and not (
                machine and machine.status is Status.RUNNING
            ):
                return
            self.floor.tick()

    def _start_machine(self, toast: int, station: str) -> None:
        """Let the machine that a toast has been brought to begin: with its learned process, or for its time."""
        floor, place = self.floor, self.floor.skillset.task.station(station)
        for skill in floor.skillset.processes[station]:
            floor.start(skill.aim(_slice(toast)))
            floor.machines[station] = skill
        if place.processing_s is not None:
            self.ready_s[station] = floor.now_s + place.processing_s
            self.toast_in[station] = toast

    def watch(self) -> None:
        """After each physics step: let the recorder show what machines have done to their toasts."""
        recorder = self.floor.recorder
        if recorder is None:
            return
        for station, ready in self.ready_s.items():
            toast = self.toast_in.get(station)
            if toast is not None and self.floor.now_s >= ready:
                recorder.toast(self.toast_in.pop(station))
        for machine in self.floor.machines.values():
            if machine.status is Status.RUNNING:
                for name in machine.shown():
                    recorder.show(name)


def _slice(toast: int) -> str:
    return f"slice {toast}"


def carry_out(
    prepared: Prepared,
    cell: Cell,
    sequence: Sequence[int],
    *,
    override: float = 1.0,
    viewer: Viewer | None = None,
    tell: Tell = unheard,
) -> tuple[Outcome, Recording]:
    """Carry `sequence` (toasts from 1, one entry a move) out in physics, from slices on the first station to the end.

    override: the share of the task's speed and acceleration with which the arm moves. A toast is delivered when its slice
    stands on the last station at the end; dropped when it is nowhere upright.
    """
    with World() as world:
        floor = Floor(world, prepared.skillset, prepared.layout, cell.parts, film=True, viewer=viewer)
        floor.scene.robot.override(override)
        floor.stand(prepared.surveys.approach(cell.robot_start))
        floor.restart_clock()
        work = Production(floor, cell, tell)
        floor.on_tick = work.watch
        failure = work.carry_out(sequence)
        floor.recorder.take()  # type: ignore[union-attr]
        delivered = tuple(t for t in work.done() if floor.bench.stands(_slice(t), work.spot_of[t].grasp(), DELIVERED_M))
        fallen = (t for t in range(1, cell.parts + 1) if t not in delivered and floor.bench.held != _slice(t))
        dropped = tuple(t for t in fallen if floor.bench.upright(_slice(t)) < UPRIGHT)
        schedule = Schedule.from_moves(cell, work.moves)
        outcome = Outcome(
            schedule,
            delivered,
            dropped,
            tuple(work.retries),
            failure,
            floor.now_s,
            tuple(work.deviations_m),
            tuple(work.timed),
        )
        return outcome, floor.recorder.recording  # type: ignore[union-attr]
