"""One decision at a time: go to a part, wait for its machine, take it up, carry it on; from whatever state was reached."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from math import hypot

from lab.production.durations import TimedMove
from lab.production.floor import Floor
from lab.production.machine import Work
from lab.production.perception import moved_off
from lab.production.standing import free_spot, set_down, spots_aside, station_near
from lab.production.trouble import Trouble
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, part_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.follow import closes
from lab.sequencing.simulate.run import NO_WAIT, Run, Wait, Windowless, branch
from lab.sequencing.simulate.waits import waits_of
from lab.sim.parts.kinds import Spot, comes_as, on_its_pallet
from lab.sim.scene.scene import pallet_of
from lab.sim.world import TIME_STEP
from lab.skills import Skill
from lab.skills.free_way import by_free_cells
from lab.skills.skill import Status
from lab.skills.skillset import WINDOW_MARGIN_S, Carried, ways_of
from lab.teaching.events import (
    MachineBegan,
    MoveBegan,
    MoveMade,
    PartDone,
    PartLost,
    SkillBegan,
    Tell,
    TroubleMet,
    unheard,
)

BEGINS_M = 0.05  # a tool this near to where a skill begins need not be brought there
ON_TIME_S = 2 * TIME_STEP  # a window is kept that is not overrun by more: what a machine does is noticed a step later
LATE_S = 1.0  # a machine that takes so much longer than it should is late
MOST_ASIDE = 3  # places at which it is tried to set a part aside


def _unseen() -> None:
    """Nobody looks."""


@dataclass
class _UnderWay:
    """The times [s] of a move under way; leg: what of the carrying comes next; smooth: nothing had to be done twice.

    stayed_s: how long it has waited above its target.
    picked: when it reached its part, was served and took it up for the first time; None: not yet.
    """

    what: tuple[str, Carried]
    start: str
    leave_s: float
    reach_s: float = 0.0
    served_s: float = 0.0
    pick_s: float = 0.0
    leg: int = 0
    stayed_s: float = 0.0
    smooth: bool = True
    picked: tuple[float, float, float] | None = None


@dataclass
class Transfers:
    """Parts being brought on upon a floor: where they are, and which spots are taken.

    spot_of: by body, a part's or its pallet's. place: the station at whose approach the tool is; "": it is somewhere else.
    taken: spots on which something stands that belongs to nobody. finished: when a part reached the end of its route [s].
    to_put_back: parts that were moved from where they were brought. left_lying: parts that were given up. spoilt: why a
    part was, which is brought on all the same. waiting: parts in a machine whose batch has not begun. look: called while the
    robot waits; raises Trouble.
    """

    floor: Floor
    cell: Cell
    tell: Tell = unheard
    moves: list[Move] = field(default_factory=list)
    timed: list[TimedMove] = field(default_factory=list)
    deviations_m: list[float] = field(default_factory=list)
    spot_of: dict[str, Spot] = field(default_factory=dict)
    taken: set[Spot] = field(default_factory=set)
    finished: dict[int, float] = field(default_factory=dict)
    to_put_back: list[int] = field(default_factory=list)
    left_lying: set[str] = field(default_factory=set)
    spoilt: dict[int, str] = field(default_factory=dict)
    waiting: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.go_by(Run(self.cell))
        self.place = self.cell.robot_start
        self.look: Callable[[], None] = _unseen
        self._under_way: _UnderWay | None = None
        # how each part was brought to where it stands, and how long it is worked on there [s]
        self._last: dict[str, tuple[Carried, float]] = {}
        self._left_s: dict[str, float] = {}  # when parts that were set aside left their stations
        self._served: set[str] = set()  # parts for which the robot's service is done
        scene = self.floor.scene
        for number, spot in enumerate(scene.places.begins(scene.order), start=1):
            for body in scene.bodies_of(self.name(number), comes_as(scene.task.part(scene.order[number - 1]))):
                self.spot_of[body] = spot

    def go_by(self, state: Run) -> None:
        """From now on a run is the plan: it says where parts are and may go. Its clock is the floor's, so much later."""
        self.plan = Windowless(state.cell, state.times, state)
        self._later_s = self.floor.now_s - state.now_s

    def name(self, part: int) -> str:
        """What a part is called."""
        return self.cell.part_name(part)

    def comes_as(self, part: int) -> str:
        """The kind that a part is as it comes, on its pallet if it has one."""
        return comes_as(self.floor.scene.task.part(self.cell.order[part - 1]))

    def bring_on(self, sequence: Sequence[int]) -> None:
        """Carry the first of the decisions out that are still to come; what was done of it is not done again. Raises Trouble."""
        decision, ahead = sequence[0], len(sequence)
        option = self.plan.option(decision)
        if option is None:
            raise Trouble(self.plan.refusal(decision), final=True)
        part, floor = part_of(decision, self.cell.parts), self.floor
        way, name = self.way(part, option), self.name(part)
        move = self._begin(name, way, ahead)
        spot = self._spot_for(part, way)
        if floor.bench.held != floor.scene.body_of(name, way.kind):
            if floor.bench.held is not None:
                raise Trouble(f"the robot still holds {floor.bench.held}", name, way.origin)
            self._go(way.origin, name, move)
            if option.waits:
                self._await(name, way.origin)
            self._stay(self._waits(sequence, way.origin, floor.now_s).pick_s, name, way.origin)
            move.served_s = floor.now_s
            if option.service_s:
                self._serve(part, way.origin)
            move.pick_s = floor.now_s
            self.check_window(part)
            self._take_up(name, way, spot)
            move.picked = move.picked or (move.reach_s, move.served_s, move.pick_s)
        else:
            move.smooth = False  # it was taken up before this move, or before it was interrupted
        self._bring(way, spot, move, sequence)
        self._finish(sequence, way, spot, move)

    @property
    def under_way(self) -> bool:
        """Whether a move was begun and not ended."""
        return self._under_way is not None

    def put_back(self) -> None:
        """Bring parts again to where they were moved from, on a spot that is free by now; their machines begin anew. Raises
        Trouble."""
        while self.to_put_back and self.floor.bench.held in (None, self.name(self.to_put_back[0])):
            part = self.to_put_back[0]
            name = self.name(part)
            way, process_s = self._last[name]
            spot = self._spot_for(part, way)
            move = self._under_way = _UnderWay((name, way), self.place, self.floor.now_s, smooth=False)
            if self.floor.bench.held is None:
                self._take_up(name, way, spot)
            self._bring(way, spot, move)
            self._under_way = None
            self.spot_of |= dict.fromkeys(self.floor.scene.bodies_of(name, way.kind), spot)
            self._left_s.pop(name, None)
            self.to_put_back.pop(0)
            if self.cell.index(way.target) not in self.cell.batches:
                self._start_machine(name, way.target, process_s)
            elif self.floor.machines[way.target].works:
                self.waiting.add(name)
                self._begin_batch(way.target)

    def set_aside(self) -> bool:
        """Set what is in the gripper down where it was taken up, or on a free place of the table; whether that was done."""
        bench, skillset = self.floor.bench, self.floor.skillset
        if self._under_way is None or bench.held is None:
            return False
        (name, way), surveys = self._under_way.what, next(iter(skillset.skills.values())).surveys
        bodies, self.place = self.floor.scene.bodies_of(name, way.kind), ""
        for spot in islice(spots_aside(bench, surveys, name, way, self.spot_of), MOST_ASIDE):
            why = self.floor.follow(set_down(bench, surveys, spot, way.kind))
            if why and bench.held is not None:
                continue
            if spot != self.spot_of.get(bodies[0]):
                self._left_s.setdefault(name, self._under_way.pick_s)
            self._under_way = None
            self.spot_of |= dict.fromkeys(bodies, spot)
            return True
        return False

    def clear_away(self, body: str, station: str) -> bool:
        """Take up what stands at a station and belongs to nobody, and set it aside; whether that was done. Raises Trouble."""
        bench, kind = self.floor.bench, self.floor.scene.kind_of[body].part.name
        skills = self.floor.skillset.picks.get((kind, station), ())
        if bench.held is not None or bench.sight is not None or not skills:
            return False
        self.over_to(station)
        self.place, now_s = "", self.floor.now_s
        for skill in skills:
            self._do(skill.aim(body), body, station)
        self._under_way = _UnderWay((body, Carried(station, station, kind)), station, now_s, smooth=False)
        return self.set_aside()

    def begin_again(self, part: int, stands: bool) -> None:
        """Let the machine begin a part anew that it had not finished; stands: where it was brought, else it is put back first."""
        name = self.name(part)
        way, process_s = self._last[name]
        self.floor.take_out(name)
        if stands:
            self._start_machine(name, way.target, process_s)
        else:
            self.to_put_back.append(part)

    def _start_machine(self, name: str, station: str, process_s: float) -> None:
        """Let the machine begin that a part has been brought to."""
        floor = self.floor
        self._served.discard(name)
        if station in floor.machines:
            work = floor.begin(station, name, process_s)
            self.tell(MachineBegan(station, name, work.begun_s, work.expected_s))

    def begin_batches(self) -> None:
        """Let machines begin with the parts that wait in them for others of their batch: nothing more is to come."""
        for station in [self.cell.names[index] for index in sorted(self.cell.batches)]:
            if any(self.name(part) in self.waiting for part in self.plan.inside(self.cell.index(station))):
                self._begin_batch(station)

    def _begin_batch(self, station: str) -> None:
        """Let a machine begin with all parts in it that it is not done with, for the longest of their times."""
        inside = [part for part in self.plan.inside(self.cell.index(station)) if part not in self.to_put_back]
        working = {name for name, work in self.floor.machines[station].works.items() if not work.done(self.floor.now_s)}
        names = [name for name in map(self.name, inside) if name in self.waiting | working]
        longest_s = max((self._last[name][1] for name in names), default=0.0)
        for name in names:
            self._start_machine(name, station, longest_s)
        self.waiting -= {*names}

    def _begin(self, name: str, way: Carried, ahead: int) -> _UnderWay:
        """The times of the move, which begins now or was interrupted. A part that was on its way to another station then, and is
        still in the gripper, left its origin when it was taken up."""
        now_s, move = self.floor.now_s, self._under_way
        if move is not None and move.what == (name, way):
            move.smooth = False
            return move
        if move is not None and self.floor.bench.held == self.floor.scene.body_of(name, way.kind):
            move = replace(move, what=(name, way), leg=0)
        else:
            move = _UnderWay((name, way), self.place or way.origin, now_s, now_s, now_s, now_s)
        self._under_way = move
        number = len(self.moves) + 1
        self.tell(MoveBegan(number, number - 1 + ahead, name, self.place, way.origin, way.target, now_s))
        return move

    def _finish(self, sequence: Sequence[int], way: Carried, spot: Spot, move: _UnderWay) -> None:
        """The part stands where it was to be brought: all that knows of it is told."""
        decision, *following = sequence
        part, floor, name = part_of(decision, self.cell.parts), self.floor, move.what[0]
        if move.smooth:
            self.timed.append(TimedMove(way, floor.now_s - move.pick_s - move.stayed_s))
        self.place, self._under_way = way.target, None
        for body in floor.scene.bodies_of(name, way.kind):
            self.spot_of[body] = spot
        planned = self.plan.move(decision)
        self.plan.robots_s = [floor.now_s - self._later_s]
        reach_s, served_s, pick_s = move.picked or (move.reach_s, move.served_s, move.pick_s)
        pick_s = self._left_s.pop(name, pick_s)  # of a part that was set aside on its way: when it left its station
        leave_s, reach_s, served_s = (min(at_s, pick_s) for at_s in (move.leave_s, reach_s, served_s))
        times_s = leave_s, reach_s, pick_s, floor.now_s, planned.process_s, pick_s - served_s
        self.moves.append(Move(part, move.start, way.origin, way.target, *times_s, planned.carries))
        if planned.carries == "part":
            self._last[name] = way, planned.process_s
            batch = self.cell.index(way.target) in self.cell.batches
            if not batch:
                self._start_machine(name, way.target, planned.process_s)
            self.waiting |= {name} if batch else set()
            if batch and closes(self.plan, self.cell.index(way.target), following):
                self._begin_batch(way.target)
        later_s = self._later_s
        self.plan.ready_s = [self._ready_s(n, s + later_s) - later_s for n, s in enumerate(self.plan.ready_s, 1)]
        self.tell(MoveMade(self.moves[-1], name))
        if self.plan.finished_s[part - 1] is not None:
            self.finished[part] = floor.now_s
            self.tell(PartDone(name, floor.now_s))

    # ---- ways and spots ------------------------------------------------------------------------------------------

    def way(self, part: int, option: Option) -> Carried:
        """From where to where an option leads, and what the gripper then holds."""
        names, own = self.cell.names, self.floor.skillset.task.part(self.cell.order[part - 1])
        origin, target = names[option.origin], names[option.target]
        if option.carries == "pallet":
            return Carried(origin, target, str(own.pallet))
        return next(way for way in ways_of(own) if way[:2] == (origin, target) and way.kind != own.pallet)

    def _spot_for(self, part: int, way: Carried) -> Spot:
        """Where to set it down: where its pallet waits for it, or the first spot on which nothing stands."""
        scene, name = self.floor.scene, self.name(part)
        if on_its_pallet(scene.task, way.kind, way.target):
            return self.spot_of[pallet_of(name)]
        own, spots = scene.bodies_of(name, way.kind), scene.places.spots(scene.task.station(way.target))
        others = {body: spot for body, spot in self.spot_of.items() if body not in own}
        in_the_way = self.left_lying | {self.name(one) for one in self.to_put_back}
        in_the_way |= {body for body, spot in others.items() if spot not in spots}  # they stand astray
        return free_spot(self.floor.bench, name, way, others, self.taken, in_the_way - {*own})

    # ---- what a move is made of ------------------------------------------------------------------------------------

    def _go(self, station: str, name: str, move: _UnderWay) -> None:
        """Bring the empty gripper to a station: by the learned way, or by free cells from where none leads."""
        if self.place == station:
            move.reach_s = self.floor.now_s
            return
        leave_s, learned = self.floor.now_s, self.floor.skillset.travels.get((self.place, station), ())
        start, self.place = self.place, ""
        for skill in learned:
            self._do(skill, name, station)
        if not learned:
            self.over_to(station)
        elif move.smooth:
            self.timed.append(TimedMove((start, station), self.floor.now_s - leave_s))
        self.place, move.reach_s = station, self.floor.now_s

    def over_to(self, station: str) -> None:
        """Take the tool to a station's approach by free cells, from wherever it is. Raises Trouble."""
        surveys = next(iter(self.floor.skillset.skills.values())).surveys
        self.place = ""
        why = self.floor.follow(by_free_cells(self.floor.bench, surveys, surveys.approach(station)))
        if why:
            raise Trouble(why, station=station, held=self.floor.was_held)
        self.place = station

    def _await(self, name: str, station: str) -> None:
        """Wait until the machine is done with the part; Trouble when it fails, once when it is late, and when it takes far too
        long."""
        floor, work = self.floor, self.floor.work_on(name)
        if work is None or work.station != station:
            return
        while not work.done(floor.now_s):
            if work.failed:
                raise Trouble(work.failed, name, station)
            late_s = floor.now_s - work.expected_s
            if floor.now_s > work.given_up_s:
                raise Trouble(f"it is not done {late_s:.0f} s after it should be", name, station, final=True)
            if late_s > LATE_S and not work.late:
                work.late = True
                raise Trouble("it is not done when it should be", name, station, late=True)
            floor.wait(work.expected_s if late_s < 0 else floor.now_s + 1.0)
            self.look()

    def _waits(self, sequence: Sequence[int], origin: str, at_s: float) -> Wait:
        """How long the first of the decisions still to come has to wait on purpose, if its work at its origin begins at a time:
        so that no part is left too long in a machine, by what the machines have really begun and done."""
        if not self.plan.cell.has_windows:
            return NO_WAIT
        run = branch(self.plan)
        run.robots_at, run.robots_s = [self.cell.index(origin)], [at_s]
        run.ready_s = [self._ready_s(part, at_s) for part in range(1, self.cell.parts + 1)]
        for beyond_s in (0.0, WINDOW_MARGIN_S):
            if waits := waits_of(run, sequence, beyond_s):
                return waits[0]
        return NO_WAIT

    def _ready_s(self, part: int, else_s: float) -> float:
        """When the machine that a part stands in is done with it; of a part that stands in none, and of a spoilt one, another
        time."""
        work, now_s = self.work_on(part), self.floor.now_s
        if work is None or part in self.spoilt:
            return else_s
        return work.until_s if work.done(now_s) else max(now_s, work.expected_s)

    def _stay_above(self, sequence: Sequence[int], way: Carried, move: _UnderWay) -> None:
        """Wait with what is in the gripper, so that what follows is not left too long in the machine that it comes to."""
        option = self.plan.option(sequence[0])
        assert option is not None
        carry_s = self.plan.carry_s(option)
        taken_s = max(self.floor.now_s, move.pick_s + carry_s) - carry_s - option.service_s
        began_s = self.floor.now_s
        self._stay(sum(self._waits(sequence, way.origin, taken_s)), move.what[0], way.target)
        move.stayed_s += self.floor.now_s - began_s

    def _stay(self, seconds: float, name: str, station: str) -> None:
        """Let the arm rest. Raises Trouble where it is stopped."""
        steps = round(seconds / TIME_STEP)
        if steps and (why := self.floor.follow(self.floor.scene.robot.rest(steps))):
            raise Trouble(why, name, station, held=self.floor.was_held)

    def work_on(self, part: int) -> Work | None:
        """What the machine that a part stands in does with it, or has done; None where it stands in none."""
        return self.floor.work_on(self.name(part))

    def taken_out(self) -> list[int]:
        """The parts that a machine is done with and that are not in it any more, though not at their next station either."""
        laid_out, names = self.cell.laid_out, self.cell.names
        places = [(part, place) for part, place in enumerate(self.plan.locations, 1) if place < len(laid_out)]
        in_machine = [part for part, place in places if names[laid_out[place].station] in self.floor.machines]
        return [part for part in in_machine if part not in self.to_put_back and self.work_on(part) is None]

    def left_s(self, part: int) -> float:
        """How long until the machine of a part should be done, or, when it is late, is given up [s]; below 0: it has been done
        for so long, and the part must not wait on without end. A spoilt part may."""
        work, now_s = self.work_on(part), self.floor.now_s
        assert work is not None
        if not work.done(now_s):
            return max(0.0, (work.given_up_s if work.late else work.expected_s) - now_s)
        left_s = work.until_s - now_s
        self.check_window(part)
        waits = self.cell.at_most_s(part, work.station) is None or part in self.spoilt
        return max(0.0, left_s) if waits else left_s

    def check_window(self, part: int) -> None:
        """Notice a part that its machine has been done with for longer than it may stay there: it is spoilt."""
        work, name = self.work_on(part), self.name(part)
        if work is None or part in self.spoilt or work.moves:
            return
        at_most_s, late_s = self.at_most_s(name, work.station), self.floor.now_s - work.until_s
        if at_most_s is None or late_s <= at_most_s + ON_TIME_S:
            return
        what = f"it is burnt: fetched {late_s:.1f} s after it was done, allowed are {at_most_s:g}"
        self.spoilt[part] = f"{name} at '{work.station}': {what}"
        self.tell(TroubleMet(what, "brings it on, but it counts as lost", name, work.station, self.floor.now_s))
        self.tell(PartLost(name, what, self.floor.now_s))

    def at_most_s(self, name: str, station: str) -> float | None:
        """How long a part may stay in a machine that is done with it, by the task [s]; None: as long as it is left there."""
        task = self.floor.skillset.task
        routes = self.floor.scene.kind_of[name].part.routes
        own = [s.at_most_s for route in routes for s in route if s.station == station and s.at_most_s is not None]
        return own[0] if own else task.station(station).at_most_s

    def _serve(self, part: int, station: str) -> None:
        """What the robot does at a station before it takes a part out, once."""
        name = self.name(part)
        if name not in self._served:
            for skill in self._service(part, station):
                self._do(skill, name, station)
            self.look()  # the part may have been taken away meanwhile
            self._served.add(name)

    def _service(self, part: int, station: str) -> Sequence[Skill]:
        return self.floor.skillset.services.get((self.cell.order[part - 1], station), ())

    def to_be_served(self, part: int, station: str) -> bool:
        """Whether the robot has yet to do something at a station for a part that is there."""
        return bool(self._service(part, station)) and self.name(part) not in self._served

    def _take_up(self, name: str, way: Carried, spot: Spot) -> None:
        """Take a part up: by the way of the station that it stands near to, or of its own where it stands astray."""
        bench, skillset, body = self.floor.bench, self.floor.skillset, self.floor.scene.body_of(name, way.kind)
        if self.floor.world.dark and moved_off(self.floor, name, self.spot_of.get(name)):
            raise Trouble(f"{name} is not where it was, and the camera sees nothing", name, way.origin)
        self.look()  # before the arm goes down to where it is believed
        near = station_near(bench, body, way, skillset)
        if near != way.origin:
            self.over_to(near)
        self.place = ""
        for skill in skillset.picks[way.kind, near]:
            self._do(skill.aim(name, spot), name, near)
        self.place = near
        if near in self.floor.machines and near == way.origin:
            self._note_work(name)
            self.floor.machines[near].clear(name)
        assert bench.held == body

    def _note_work(self, name: str) -> None:
        """Write down for how long a machine has really worked on a part that is taken out of it."""
        work = self.floor.work_on(name)
        own = [n for n, move in enumerate(self.moves) if move.carries == "part" and self.name(move.part) == name]
        if work is None or not own or not work.done(self.floor.now_s):
            return
        brought = self.moves[own[-1]]
        batch = self.cell.index(brought.target) in self.cell.batches
        worked_s = work.until_s - (work.begun_s if batch else brought.drop_s)
        if abs(worked_s - brought.process_s) > TIME_STEP:
            self.moves[own[-1]] = replace(brought, process_s=worked_s)

    def _bring(self, way: Carried, spot: Spot, move: _UnderWay, sequence: Sequence[int] = ()) -> None:
        """Carry what is in the gripper to its target and set it down; from a station near the target, that is all.

        sequence: what is still to be done, this first; above the target the robot waits as long as that wants.
        """
        name, legs = move.what[0], [skill for skill in self.floor.skillset.legs[way] if skill.carries]
        if self.place:
            move.leg = len(legs) - 1 if self.place == way.target else 0
        for skill in legs[move.leg :]:
            if skill is legs[-1]:
                if sequence:
                    self._stay_above(sequence, way, move)
                self.look()  # before anything is set down
            self._to_begin(skill, name, way.target)
            self.place = ""
            self._do(skill.aim(name, spot), name, way.target)
            self.deviations_m += skill.deviations_m
            move.leg += 1
        self.place = way.target

    def _to_begin(self, skill: Skill, name: str, where: str) -> None:
        """Bring the tool to where a skill begins, by free cells, when it is far from there as after an interruption."""
        begin, tool = skill.begins_at(), self.floor.scene.robot.tool()
        if begin is None or self._under_way is None or self._under_way.smooth:
            return
        if hypot(tool.x - begin.x, tool.y - begin.y, tool.z - begin.z) > BEGINS_M:
            way = by_free_cells(self.floor.bench, skill.surveys, begin, skill.kind if skill.carries else "")
            if why := self.floor.follow(way):
                raise Trouble(why, name, where, held=self.floor.was_held)

    def _do(self, skill: Skill, name: str, where: str) -> None:
        """Carry a skill out; Trouble when it fails."""
        self.tell(SkillBegan(skill.name, skill.does(name), name, self.floor.now_s))
        if self.floor.run(skill) is not Status.SUCCESS:
            raise Trouble(skill.reason, name, where, held=self.floor.was_held, skill=skill.name)
