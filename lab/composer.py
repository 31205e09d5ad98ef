"""Sequence + skills -> motions: carries the order of transfers out in physics and notices what fails."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot

from lab.crew import Crew
from lab.line import Line, aimed
from lab.recorder import Viewer
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.simulate.run import Run
from lab.sim.scene import Layout, Spot, spots
from lab.sim.world import World
from lab.skills import Butter, Grasp, Insert, Skill
from lab.skills.skill import UPRIGHT, Status
from lab.skills.surveys import Surveys
from lab.view.frames import Recording

MAX_TRIES = 3  # a failed step is tried again from the state reached, at most twice
ASTRAY_M = 0.15  # a slice this near to a spot of a station can be taken up again from there
DELIVERED_M = 0.02  # a slice this near to its spot has been delivered


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which toasts were delivered, retries, and why it stopped (None: it did not)."""

    schedule: Schedule
    delivered: tuple[int, ...]
    dropped: tuple[int, ...]
    retries: tuple[str, ...]
    failure: str | None
    sim_s: float
    camera_deviations_m: tuple[float, ...]


class _Stopped(Exception):
    """A step failed too often; the text says which toast, where and why."""


@dataclass
class Production:
    """One sequence being carried out on a line: where toasts are, which spots are taken, when machines are done."""

    line: Line
    cell: Cell
    surveys: Surveys
    on_move: Callable[[Move], None] | None = None
    on_retry: Callable[[str], None] | None = None
    moves: list[Move] = field(default_factory=list)
    retries: list[str] = field(default_factory=list)
    deviations_m: list[float] = field(default_factory=list)
    ready_s: dict[str, float] = field(default_factory=dict)
    toast_in: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        cell, crew = self.cell, self.line.crew
        self.plan = Run(cell)  # where toasts are and may go; its times are the predicted ones
        self.place = cell.robot_start
        first = cell.names[cell.positions[cell.starts[0]].station]
        self.spot_of: dict[int, Spot] = dict(enumerate(spots(crew.task.station(first)), start=1))

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
        line, names = self.line, self.cell.names
        option = self.plan.option(toast)
        if option is None:
            raise _Stopped(self.plan.refusal(toast))
        origin, target, start, leave_s = names[option.origin], names[option.target], self.place, line.now_s
        if start != origin:
            self._try(toast, origin, line.crew.empty(start, origin))
        reach_s = line.now_s
        self._await(toast, origin)
        pick_s = line.now_s
        spot = self._free_spot(target)
        self._carry(toast, origin, target, spot)
        self.place, self.spot_of[toast] = target, spot
        process_s = self.plan.move(toast).process_s
        self.moves.append(Move(toast, start, origin, target, leave_s, reach_s, pick_s, line.now_s, process_s))
        self._start_machine(toast, target)
        if self.on_move is not None:
            self.on_move(self.moves[-1])

    def _free_spot(self, station: str) -> Spot:
        return next(s for s in spots(self.line.crew.task.station(station)) if s not in self.spot_of.values())

    def _carry(self, toast: int, origin: str, target: str, spot: Spot) -> None:
        """Grasp, carry, set down; what fails is tried again from the state reached, at most twice."""
        name = _slice(toast)
        grasp, *rest = (aimed(skill, name, spot) for skill in self.line.crew.leg(origin, target))
        self._try(toast, origin, grasp)
        tries, step, first = [0] * len(rest), 0, ""
        while step < len(rest):
            skill = rest[step]
            if self.line.run(skill) is Status.SUCCESS:
                step += 1
                continue
            tries[step] += 1
            first = first or skill.reason
            self._note(f"toast {toast} at '{target}', '{skill.name}', try {tries[step]}: {skill.reason}")
            if tries[step] == MAX_TRIES:
                raise _Stopped(f"toast {toast} at '{target}': {first} (tried {MAX_TRIES} times)")
            if not self.line.bench.holds(name):
                step = self._pick_up_again(toast, origin, target, first)
        self.deviations_m += [d for skill in rest if isinstance(skill, Insert) for d in skill.deviations_m]

    def _pick_up_again(self, toast: int, origin: str, target: str, why: str) -> int:
        """Take a slice that is not in the gripper from where it stands; which step of the rest of the leg comes next."""
        bench, crew, name = self.line.bench, self.line.crew, _slice(toast)
        bench.held = None
        if bench.upright(name) < UPRIGHT:
            raise _Stopped(f"toast {toast} at '{target}': {why}; {name} has fallen over")
        for station, step in ((target, 1), (origin, 0)):
            grasp = crew.skills[Grasp(station).name]
            at, foots = bench.slice_pose(name), spots(crew.task.station(station))
            near = any(hypot(at.x - foot.x, at.y - foot.y) < ASTRAY_M for foot in foots)
            if near and self.line.run(aimed(grasp, name, None)) is Status.SUCCESS:
                return step
        raise _Stopped(f"toast {toast} at '{target}': {why}; {name} could not be taken up again from where it is")

    def _try(self, toast: int, where: str, skill: Skill) -> None:
        """Carry a skill out; when it fails it is tried again from the state reached, at most twice."""
        for attempt in range(1, MAX_TRIES + 1):
            if self.line.run(skill) is Status.SUCCESS:
                return
            self._note(f"toast {toast} at '{where}', '{skill.name}', try {attempt}: {skill.reason}")
        raise _Stopped(f"toast {toast} at '{where}': {skill.reason} (tried {MAX_TRIES} times)")

    def _note(self, text: str) -> None:
        self.retries.append(text)
        if self.on_retry is not None:
            self.on_retry(text)

    def _await(self, toast: int, station: str) -> None:
        """Wait at a machine until it is done with its toast; a learned process that failed is tried again."""
        machine = self.line.machines.get(station)
        tries = 0
        while True:
            if machine and machine.status is Status.FAILURE:  # now, or while the robot was elsewhere
                tries += 1
                self._note(f"toast {toast} at '{station}', try {tries}: {machine.reason}")
                if tries == MAX_TRIES:
                    raise _Stopped(f"toast {toast} at '{station}': {machine.reason} (tried {MAX_TRIES} times)")
                machine.start(self.line.bench, self.line.crew.policies[machine.name])
            elif self.line.now_s >= self.ready_s.get(station, 0.0) and not (
                machine and machine.status is Status.RUNNING
            ):
                return
            self.line.tick()

    def _start_machine(self, toast: int, station: str) -> None:
        task = self.line.crew.task
        place = task.station(station)
        if place.process == "butter":
            butter = self.line.crew.skills[Butter(station).name]
            aimed(butter, _slice(toast), None)
            butter.start(self.line.bench, self.line.crew.policies[butter.name])
            self.line.machines[station] = butter
        elif place.kind == "machine":
            self.ready_s[station] = self.line.now_s + (place.processing_s or 0.0)
            self.toast_in[station] = toast

    def watch(self) -> None:
        """After each physics step: let the recorder show what machines have done to their toasts."""
        recorder = self.line.recorder
        if recorder is None:
            return
        for station, ready in self.ready_s.items():
            toast = self.toast_in.get(station)
            if toast is not None and self.line.now_s >= ready:
                recorder.toast(self.toast_in.pop(station))
        for machine in self.line.machines.values():
            if isinstance(machine, Butter) and machine.status is Status.RUNNING:
                for cell in machine.covered:
                    recorder.butter(_number(machine.slice), cell)


def _slice(toast: int) -> str:
    return f"slice {toast}"


def _number(name: str) -> int:
    return int(name.rpartition(" ")[2])


def carry_out(
    crew: Crew,
    surveys: Surveys,
    layout: Layout,
    cell: Cell,
    sequence: Sequence[int],
    *,
    viewer: Viewer | None = None,
    on_move: Callable[[Move], None] | None = None,
    on_retry: Callable[[str], None] | None = None,
) -> tuple[Outcome, Recording]:
    """Carry `sequence` (toasts from 1, one entry a move) out in physics, from slices on the first station to the end.

    A toast is delivered when its slice stands on the last station at the end; dropped when it is nowhere upright.
    """
    with World() as world:
        line = Line(world, crew, layout, cell.parts, film=True, viewer=viewer)
        line.at(cell.robot_start, surveys)
        line.restart_clock()
        work = Production(line, cell, surveys, on_move, on_retry)
        line.on_tick = work.watch
        failure = work.carry_out(sequence)
        line.recorder.take()  # type: ignore[union-attr]
        delivered = tuple(t for t in work.done() if line.bench.stands(_slice(t), work.spot_of[t].grasp(), DELIVERED_M))
        fallen = (t for t in range(1, cell.parts + 1) if t not in delivered and line.bench.held != _slice(t))
        dropped = tuple(t for t in fallen if line.bench.upright(_slice(t)) < UPRIGHT)
        schedule = Schedule.from_moves(cell, work.moves)
        outcome = Outcome(
            schedule, delivered, dropped, tuple(work.retries), failure, line.now_s, tuple(work.deviations_m)
        )
        return outcome, line.recorder.recording  # type: ignore[union-attr]
