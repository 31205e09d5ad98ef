"""Sequence + skills -> motions: carries the order of transfers out in physics and notices what fails."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot

from lab.export.program import Program
from lab.export.recorder import MotionRecorder
from lab.production.durations import TimedMove
from lab.production.floor import Floor
from lab.production.recorder import Viewer, finish_name
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, part_of
from lab.sequencing.cell.schedule import Move, Schedule
from lab.sequencing.simulate.run import Run
from lab.sim.frames import Recording
from lab.sim.parts.kinds import Kind, Spot, comes_as, on_its_pallet
from lab.sim.scene.scene import pallet_of
from lab.sim.world import World
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared
from lab.skills.skill import UPRIGHT, Status
from lab.skills.skillset import Carried, ways_of
from lab.teaching.events import MoveMade, MoveRetried, Tell, unheard

MAX_TRIES = 3  # a failed step is tried again from the state reached, at most twice
ASTRAY_M = 0.15  # a part this near to a spot of a station can be taken up again from there
DELIVERED_M = 0.02  # a part this near to its spot has been delivered


@dataclass(frozen=True)
class Outcome:
    """A run in physics: the measured schedule, which parts were delivered, retries, and why it stopped (None: it did not).

    timed: how long each move took in which nothing had to be tried again. skipped_s: of sim_s, the time that passed without
    physics, while the robot waited and nothing moved. program: what the robot carried out, for `lab export`.
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
    program: Program | None = None


class _Stopped(Exception):
    """A step failed too often; the text says which part, where and why."""


@dataclass
class Production:
    """One sequence being carried out on a floor: where parts are, which spots are taken, when machines are done.

    spot_of: by body, a part's or its pallet's. ready_s: by part, until when its machine works on it [s]; begun: which one.
    """

    floor: Floor
    cell: Cell
    tell: Tell = unheard
    moves: list[Move] = field(default_factory=list)
    timed: list[TimedMove] = field(default_factory=list)
    retries: list[str] = field(default_factory=list)
    deviations_m: list[float] = field(default_factory=list)
    ready_s: dict[str, float] = field(default_factory=dict)
    begun: dict[str, str] = field(default_factory=dict)
    spot_of: dict[str, Spot] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.plan = Run(self.cell)  # where parts are and may go; its times are the predicted ones
        self.place = self.cell.robot_start
        scene = self.floor.scene
        for number, spot in enumerate(scene.places.begins(scene.order), start=1):
            for body in scene.bodies_of(self._name(number), comes_as(scene.task.part(scene.order[number - 1]))):
                self.spot_of[body] = spot

    def carry_out(self, sequence: Sequence[int]) -> str | None:
        """Carry the whole sequence out; None, or which part could not be brought on, where and why."""
        try:
            for decision in sequence:
                self._bring_on(decision)
            return None
        except _Stopped as stopped:
            return str(stopped)

    def done(self) -> list[int]:
        """The parts that reached the end of their route."""
        return [part for part, end_s in enumerate(self.plan.finished_s, start=1) if end_s is not None]

    def _name(self, part: int) -> str:
        return self.cell.part_name(part)

    def _bring_on(self, decision: int) -> None:
        """One decision: go to the part, or its pallet, wait for its machine, do what is to be done there, carry it on."""
        floor = self.floor
        option = self.plan.option(decision)
        if option is None:
            raise _Stopped(self.plan.refusal(decision))
        part = part_of(decision, self.cell.parts)
        way = self._way(part, option)
        start, leave_s = self.place, floor.now_s
        tried = len(self.retries)
        for skill in () if start == way.origin else floor.skillset.travels[start, way.origin]:
            self._try(part, way.origin, skill)
        reach_s = floor.now_s
        if start != way.origin and len(self.retries) == tried:
            self.timed.append(TimedMove((start, way.origin), reach_s - leave_s))
        if option.waits:
            self._await(part, way.origin)
        served_s = floor.now_s
        for skill in (
            floor.skillset.services.get((self.cell.order[part - 1], way.origin), ()) if option.service_s else ()
        ):
            self._try(part, way.origin, skill)
        pick_s, tried = floor.now_s, len(self.retries)
        spot = self._spot_for(part, way)
        self._carry(part, way, spot)
        if len(self.retries) == tried:
            self.timed.append(TimedMove(way, floor.now_s - pick_s))
        self.place = way.target
        for body in floor.scene.bodies_of(self._name(part), way.kind):
            self.spot_of[body] = spot
        process_s = self.plan.move(decision).process_s
        times_s = leave_s, reach_s, pick_s, floor.now_s, process_s, pick_s - served_s
        self.moves.append(Move(part, start, way.origin, way.target, *times_s, option.carries))
        if floor.skillset.task.station(way.target).kind == "machine" and option.carries == "part":
            self._start_machine(part, way.target, process_s)
        self.tell(MoveMade(self.moves[-1], self._name(part)))

    def _way(self, part: int, option: Option) -> Carried:
        """From where to where an option leads, and what the gripper then holds."""
        names, own = self.cell.names, self.floor.skillset.task.part(self.cell.order[part - 1])
        origin, target = names[option.origin], names[option.target]
        if option.carries == "pallet":
            return Carried(origin, target, str(own.pallet))
        return next(way for way in ways_of(own) if way[:2] == (origin, target) and way.kind != own.pallet)

    def _spot_for(self, part: int, way: Carried) -> Spot:
        """Where to set it down: where its pallet waits for it, or the first spot on which nothing stands."""
        scene, name = self.floor.scene, self._name(part)
        if on_its_pallet(scene.task, way.kind, way.target):
            return self.spot_of[pallet_of(name)]
        own = scene.bodies_of(name, way.kind)
        taken = [spot for body, spot in self.spot_of.items() if body not in own]
        return next(s for s in scene.places.spots(scene.task.station(way.target)) if s not in taken)

    def _carry(self, part: int, way: Carried, spot: Spot) -> None:
        """Pick up, carry, set down; what fails is tried again from the state reached, at most twice."""
        name, skillset, scene = self._name(part), self.floor.skillset, self.floor.scene
        picks = skillset.picks[way.kind, way.origin]
        for skill in picks:
            self._try(part, way.origin, skill.aim(name, spot))
        rest = [skill.aim(name, spot) for skill in skillset.legs[way][len(picks) :]]
        tries, step, first = [0] * len(rest), 0, ""
        while step < len(rest):
            skill = rest[step]
            if self.floor.run(skill) is Status.SUCCESS:
                step += 1
                continue
            tries[step] += 1
            first = first or skill.reason
            self._note(f"{name} at '{way.target}', '{skill.name}', try {tries[step]}: {skill.reason}")
            if tries[step] == MAX_TRIES:
                raise _Stopped(f"{name} at '{way.target}': {first} (tried {MAX_TRIES} times)")
            if not self.floor.bench.holds(scene.body_of(name, way.kind)):
                again = self._pick_up_again(name, way, first)
                step = 0 if again == way.origin else max(at for at, later in enumerate(rest) if later.carries)
        self.deviations_m += [d for skill in rest for d in skill.deviations_m]

    def _pick_up_again(self, name: str, way: Carried, why: str) -> str:
        """Take a part that is not in the gripper from where it stands; at which of the two stations that was."""
        bench, skillset, scene = self.floor.bench, self.floor.skillset, self.floor.scene
        body = scene.body_of(name, way.kind)
        bench.held = None
        if bench.upright(body) < UPRIGHT:
            raise _Stopped(f"{name} at '{way.target}': {why}; {body} has fallen over")
        for station in (way.target, way.origin):
            at, foots = bench.part_pose(body), scene.places.spots(skillset.task.station(station))
            near = any(hypot(at.x - foot.x, at.y - foot.y) < ASTRAY_M for foot in foots)
            picks = skillset.picks.get((way.kind, station), ())
            if near and picks and all(self.floor.run(skill.aim(name)) is Status.SUCCESS for skill in picks):
                return station
        raise _Stopped(f"{name} at '{way.target}': {why}; {body} could not be taken up again from where it is")

    def _try(self, part: int, where: str, skill: Skill) -> None:
        """Carry a skill out; when it fails it is tried again from the state reached, at most twice."""
        for attempt in range(1, MAX_TRIES + 1):
            if self.floor.run(skill) is Status.SUCCESS:
                return
            self._note(f"{self._name(part)} at '{where}', '{skill.name}', try {attempt}: {skill.reason}")
        raise _Stopped(f"{self._name(part)} at '{where}': {skill.reason} (tried {MAX_TRIES} times)")

    def _note(self, text: str) -> None:
        self.retries.append(text)
        self.tell(MoveRetried(text))

    def _await(self, part: int, station: str) -> None:
        """Wait until the machine is done with a part; a learned process that failed is tried again."""
        name, machine = self._name(part), self.floor.machines.get(station)
        tries = 0
        while True:
            if machine and machine.status is Status.FAILURE:  # now, or while the robot was elsewhere
                tries += 1
                self._note(f"{name} at '{station}', try {tries}: {machine.reason}")
                if tries == MAX_TRIES:
                    raise _Stopped(f"{name} at '{station}': {machine.reason} (tried {MAX_TRIES} times)")
                self.floor.start(machine)
            elif self.floor.now_s >= self.ready_s.get(name, 0.0) and not (machine and machine.status is Status.RUNNING):
                return
            self.floor.wait(self.ready_s.get(name, 0.0))

    def _start_machine(self, part: int, station: str, process_s: float) -> None:
        """Let the machine that a part has been brought to begin: with its learned process, or for its time."""
        floor, name = self.floor, self._name(part)
        skills = floor.skillset.processes[station]
        for skill in skills:
            floor.start(skill.aim(name))
            floor.machines[station] = skill
        if not skills:
            self.ready_s[name] = floor.now_s + process_s
            self.begun[name] = station

    def stands(self, part: int) -> bool:
        """Whether a part, and its pallet, stands where it was set down last."""
        scene, name = self.floor.scene, self._name(part)
        spot = self.spot_of[name]
        for body, own in zip(scene.bodies_of(name, comes_as(scene.kind_of[name].part)), self._stack(part), strict=True):
            if not self.floor.bench.stands(body, spot, DELIVERED_M):
                return False
            spot = spot.raised(own.shape.height_m)
        return True

    def has_fallen(self, part: int) -> bool:
        """Whether a part is neither held nor upright."""
        bench, name = self.floor.bench, self._name(part)
        return bench.held not in (name, pallet_of(name)) and bench.upright(name) < UPRIGHT

    def _stack(self, part: int) -> list[Kind]:
        scene = self.floor.scene
        return scene.kinds[comes_as(scene.kind_of[self._name(part)].part)].stack()

    def watch(self) -> None:
        """After each physics step: let the recorder show what machines have done to their parts."""
        recorder = self.floor.recorder
        if recorder is None:
            return
        for name, station in [*self.begun.items()]:
            if self.floor.now_s >= self.ready_s[name]:
                del self.begun[name]
                if self.floor.skillset.task.station(station).finish is not None:
                    recorder.show(finish_name(name, station))
        for machine in self.floor.machines.values():
            if machine.status is Status.RUNNING:
                for name in machine.shown():
                    recorder.show(name)


def carry_out(
    prepared: Prepared,
    cell: Cell,
    sequence: Sequence[int],
    *,
    override: float = 1.0,
    viewer: Viewer | None = None,
    tell: Tell = unheard,
) -> tuple[Outcome, Recording]:
    """Carry `sequence` (one decision a move, see `Run`) out in physics, from parts on their first stations to the end.

    override: the share of the task's speed and acceleration with which the arm moves. A part is delivered when it stands
    on its last station at the end, on its pallet if it has one; dropped when it is nowhere upright.
    """
    with World() as world:
        floor = Floor(world, prepared.skillset, prepared.layout, prepared.order, film=True, viewer=viewer)
        floor.scene.robot.override(override)
        floor.stand(prepared.surveys.approach(cell.robot_start))
        floor.restart_clock()
        motions = MotionRecorder(floor.scene.robot)
        work = Production(floor, cell, tell)
        floor.on_tick = work.watch
        failure = work.carry_out(sequence)
        floor.recorder.take()  # type: ignore[union-attr]
        delivered = tuple(part for part in work.done() if work.stands(part))
        left = [part for part in range(1, cell.parts + 1) if part not in delivered]
        dropped = tuple(part for part in left if work.has_fallen(part))
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
            floor.skipped_s,
            motions.program(
                prepared.task, prepared.seed, work.moves, [cell.part_name(n + 1) for n in range(cell.parts)]
            ),
        )
        return outcome, floor.recorder.recording  # type: ignore[union-attr]
