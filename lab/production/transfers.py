"""The robot's transfers, one decision at a time, from any reached state: go to a part, wait for it, pick, carry, place."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import hypot

from lab.production.durations import TimedMove
from lab.production.floor import Floor
from lab.production.parts_in_machines import PartsInMachines
from lab.production.perception import look, moved_off
from lab.production.run_state import RunState, UnderWay
from lab.production.standing import free_spot, set_down, spots_aside, station_near
from lab.production.trouble import Trouble
from lab.sequencing.cell.routes import Option, part_of
from lab.sequencing.cell.schedule import Move
from lab.sim.parts.kinds import Spot, comes_as, on_its_pallet
from lab.sim.scene.scene import pallet_of
from lab.sim.world import TIME_STEP
from lab.skills import Skill
from lab.skills.free_way import by_free_cells
from lab.skills.skill import Status
from lab.skills.skillset import CarriedPath, ways_of
from lab.teaching.events import MoveBegan, MoveMade, PartDone, SkillBegan

BEGINS_M = 0.05  # a tool this near to a skill's start is not moved there first
MOST_ASIDE = 3  # most places that are tried to set a part aside


def first_spots(floor: Floor, state: RunState) -> dict[str, Spot]:
    """The first spots of the bodies of all parts, by body."""
    scene, spots = floor.scene, dict[str, Spot]()
    for part, spot in enumerate(scene.places.begins(scene.order), start=1):
        spots |= dict.fromkeys(bodies_of(floor, state, part), spot)
    return spots


def bodies_of(floor: Floor, state: RunState, part: int) -> list[str]:
    """The bodies of a part as it arrives: its pallet, if it has one, and the part."""
    scene = floor.scene
    return scene.bodies_of(state.name(part), comes_as(scene.task.part(state.cell.order[part - 1])))


@dataclass(frozen=True)
class Transfers:
    """The robot's motions on a floor that bring parts on, put them back and set them aside; the results are in the
    state."""

    floor: Floor
    state: RunState
    machines: PartsInMachines

    def bring_on(self, sequence: Sequence[int]) -> None:
        """Carries out the first of the remaining decisions, without repeating the finished part of it. Raises Trouble."""
        decision, ahead = sequence[0], len(sequence)
        option = self.state.plan.option(decision)
        if option is None:
            raise Trouble(self.state.plan.refusal(decision), kind="final")
        part, floor = part_of(decision, self.state.cell.parts), self.floor
        way, name = self.way(part, option), self.state.name(part)
        move = self._begin(name, way, ahead)
        spot = self._spot_for(part, way)
        if floor.bench.held != floor.scene.body_of(name, way.kind):
            if floor.bench.held is not None:
                raise Trouble(f"the robot still holds {floor.bench.held}", name, way.origin)
            self._go(way.origin, name, move)
            if option.waits:
                self.machines.wait_for(name, way.origin)
            self._stay(self.machines.waits(sequence, way.origin, floor.now_s).pick_s, name, way.origin)
            move.served_s = floor.now_s
            if option.service_s:
                self._serve(part, way.origin)
            move.pick_s = floor.now_s
            self.machines.check_window(part)
            self._take_up(name, way, spot)
            move.picked = move.picked or (move.reach_s, move.served_s, move.pick_s)
        else:
            move.smooth = False  # it was taken up before this move, or before it was interrupted
        self._bring(way, spot, move, sequence)
        self._finish(sequence, way, spot, move)

    def put_back(self) -> None:
        """Brings moved parts back to their stations, onto a free spot, where their machines start again. Raises
        Trouble."""
        state = self.state
        while state.to_put_back and self.floor.bench.held in (None, state.name(state.to_put_back[0])):
            part = state.to_put_back[0]
            name = state.name(part)
            way, process_s = state.brought[name]
            spot = self._spot_for(part, way)
            move = state.under_way = UnderWay((name, way), state.place, self.floor.now_s, smooth=False)
            if self.floor.bench.held is None:
                self._take_up(name, way, spot)
            self._bring(way, spot, move)
            state.under_way = None
            state.spot_of |= dict.fromkeys(self.floor.scene.bodies_of(name, way.kind), spot)
            state.left_s.pop(name, None)
            state.to_put_back.pop(0)
            self.machines.brought_back(name, way.target, process_s)

    def set_aside(self) -> bool:
        """Sets the held part down where it was taken up, or on a free place of the table; returns whether it succeeded."""
        state = self.state
        bench, skillset = self.floor.bench, self.floor.skillset
        if state.under_way is None or bench.held is None:
            return False
        (name, way), surveys = state.under_way.what, next(iter(skillset.skills.values())).surveys
        bodies, state.place = self.floor.scene.bodies_of(name, way.kind), ""
        for spot in islice(spots_aside(bench, surveys, name, way, state.spot_of), MOST_ASIDE):
            why = self.floor.follow(set_down(bench, surveys, spot, way.kind))
            if why and bench.held is not None:
                continue
            if spot != state.spot_of.get(bodies[0]):
                state.left_s.setdefault(name, state.under_way.pick_s)
            state.under_way = None
            state.spot_of |= dict.fromkeys(bodies, spot)
            return True
        return False

    def clear_away(self, body: str, station: str) -> bool:
        """Takes up a strange body at a station and sets it aside; returns whether it succeeded. Raises Trouble."""
        bench, kind = self.floor.bench, self.floor.scene.kind_of[body].part.name
        skills = self.floor.skillset.picks.get((kind, station), ())
        if bench.held is not None or bench.sight is not None or not skills:
            return False
        self.over_to(station)
        self.state.place, now_s = "", self.floor.now_s
        for skill in skills:
            self._do(skill.aim(body), body, station)
        self.state.under_way = UnderWay((body, CarriedPath(station, station, kind)), station, now_s, smooth=False)
        return self.set_aside()

    def _begin(self, name: str, way: CarriedPath, ahead: int) -> UnderWay:
        """The times of the move, which begins now or was interrupted. A part that is still in the gripper from an interrupted
        move left its origin when it was taken up."""
        state = self.state
        now_s, move = self.floor.now_s, state.under_way
        if move is not None and move.what == (name, way):
            move.smooth = False
            return move
        if move is not None and self.floor.bench.held == self.floor.scene.body_of(name, way.kind):
            move = replace(move, what=(name, way), leg=0)
        else:
            move = UnderWay((name, way), state.place or way.origin, now_s, now_s, now_s, now_s)
        state.under_way = move
        number = len(state.moves) + 1
        self.floor.tell(MoveBegan(number, number - 1 + ahead, name, state.place, way.origin, way.target, now_s))
        return move

    def _finish(self, sequence: Sequence[int], way: CarriedPath, spot: Spot, move: UnderWay) -> None:
        """Updates state, plan and machines after a part was placed at its target."""
        state = self.state
        decision, *following = sequence
        part, floor, name = part_of(decision, state.cell.parts), self.floor, move.what[0]
        if move.smooth:
            state.timed.append(TimedMove(way, floor.now_s - move.pick_s - move.stayed_s))
        state.place, state.under_way = way.target, None
        for body in floor.scene.bodies_of(name, way.kind):
            state.spot_of[body] = spot
        planned = state.plan.move(decision)
        state.plan.robots_s = [floor.now_s - state.later_s]
        reach_s, served_s, pick_s = move.picked or (move.reach_s, move.served_s, move.pick_s)
        pick_s = state.left_s.pop(name, pick_s)  # of a part that was set aside on its way: when it left its station
        leave_s, reach_s, served_s = (min(at_s, pick_s) for at_s in (move.leave_s, reach_s, served_s))
        times_s = leave_s, reach_s, pick_s, floor.now_s, planned.process_s, pick_s - served_s
        state.moves.append(Move(part, move.start, way.origin, way.target, *times_s, planned.carries))
        if planned.carries == "part":
            state.brought[name] = way, planned.process_s
            self.machines.brought(name, way.target, planned.process_s, following)
        later_s = state.later_s
        state.plan.ready_s = [
            self.machines.ready_s(n, s + later_s) - later_s for n, s in enumerate(state.plan.ready_s, 1)
        ]
        self.floor.tell(MoveMade(state.moves[-1], name))
        if state.plan.finished_s[part - 1] is not None:
            state.finished[part] = floor.now_s
            self.floor.tell(PartDone(name, floor.now_s))

    # ---- ways and spots ------------------------------------------------------------------------------------------

    def way(self, part: int, option: Option) -> CarriedPath:
        """The path of an option: its origin, its target, and the kind in the gripper."""
        names, own = self.state.cell.names, self.floor.skillset.task.part(self.state.cell.order[part - 1])
        origin, target = names[option.origin], names[option.target]
        if option.carries == "pallet":
            return CarriedPath(origin, target, str(own.pallet))
        return next(way for way in ways_of(own) if way[:2] == (origin, target) and way.kind != own.pallet)

    def _spot_for(self, part: int, way: CarriedPath) -> Spot:
        """The spot to place a part on: that of its waiting pallet, or the first free one."""
        state = self.state
        scene, name = self.floor.scene, state.name(part)
        if on_its_pallet(scene.task, way.kind, way.target):
            return state.spot_of[pallet_of(name)]
        own, spots = scene.bodies_of(name, way.kind), scene.places.spots(scene.task.station(way.target))
        others = {body: spot for body, spot in state.spot_of.items() if body not in own}
        in_the_way = state.left_lying | {state.name(part_back) for part_back in state.to_put_back}
        in_the_way |= {body for body, spot in others.items() if spot not in spots}  # they stand astray
        return free_spot(self.floor.bench, name, way, others, state.taken, in_the_way - {*own})

    # ---- what a move is made of ------------------------------------------------------------------------------------

    def _go(self, station: str, name: str, move: UnderWay) -> None:
        """Moves the empty gripper to a station, by the learned path or, if there is none, through free cells."""
        if self.state.place == station:
            move.reach_s = self.floor.now_s
            return
        leave_s, learned = self.floor.now_s, self.floor.skillset.travels.get((self.state.place, station), ())
        start, self.state.place = self.state.place, ""
        for skill in learned:
            self._do(skill, name, station)
        if not learned:
            self.over_to(station)
        elif move.smooth:
            self.state.timed.append(TimedMove((start, station), self.floor.now_s - leave_s))
        self.state.place, move.reach_s = station, self.floor.now_s

    def over_to(self, station: str) -> None:
        """Moves the tool to a station's approach through free cells, from anywhere. Raises Trouble."""
        surveys = next(iter(self.floor.skillset.skills.values())).surveys
        self.state.place = ""
        why = self.floor.follow(by_free_cells(self.floor.bench, surveys, surveys.approach(station)))
        if why:
            raise Trouble(why, station=station, kind=self.floor.trouble_kind)
        self.state.place = station

    def _stay_above(self, sequence: Sequence[int], way: CarriedPath, move: UnderWay) -> None:
        """Waits with the part in the gripper, so that a later part does not stay too long in its machine."""
        option = self.state.plan.option(sequence[0])
        assert option is not None
        carry_s = self.state.plan.carry_s(option)
        taken_s = max(self.floor.now_s, move.pick_s + carry_s) - carry_s - option.service_s
        began_s = self.floor.now_s
        self._stay(sum(self.machines.waits(sequence, way.origin, taken_s)), move.what[0], way.target)
        move.stayed_s += self.floor.now_s - began_s

    def _stay(self, seconds: float, name: str, station: str) -> None:
        """Lets the arm rest. Raises Trouble if it is stopped."""
        steps = round(seconds / TIME_STEP)
        if steps and (why := self.floor.follow(self.floor.scene.robot.rest(steps))):
            raise Trouble(why, name, station, kind=self.floor.trouble_kind)

    def _serve(self, part: int, station: str) -> None:
        """Carries out, once, the robot's service at a station before it takes a part out."""
        name = self.state.name(part)
        if name not in self.state.served:
            for skill in self.machines.service(part, station):
                self._do(skill, name, station)
            look(self.floor, self.state)  # the part may have been taken away meanwhile
            self.state.served.add(name)

    def _take_up(self, name: str, way: CarriedPath, spot: Spot) -> None:
        """Takes a part up with the skill of the station near it, or directly if it stands astray."""
        bench, skillset, body = self.floor.bench, self.floor.skillset, self.floor.scene.body_of(name, way.kind)
        if self.floor.world.dark and moved_off(self.floor, name, self.state.spot_of.get(name)):
            raise Trouble(f"{name} is not where it was, and the camera sees nothing", name, way.origin)
        look(self.floor, self.state)  # before the arm goes down to where it is believed
        near = station_near(bench, body, way, skillset)
        if near != way.origin:
            self.over_to(near)
        self.state.place = ""
        for skill in skillset.picks[way.kind, near]:
            self._do(skill.aim(name, spot), name, near)
        self.state.place = near
        if near in self.floor.machines and near == way.origin:
            self.machines.fetched(name, near)
        assert bench.held == body

    def _bring(self, way: CarriedPath, spot: Spot, move: UnderWay, sequence: Sequence[int] = ()) -> None:
        """Carries the part in the gripper to its target and places it.

        sequence: the remaining decisions, this one first; above the target the robot makes their deliberate waits.
        """
        name, legs = move.what[0], [skill for skill in self.floor.skillset.legs[way] if skill.carries]
        if self.state.place:
            move.leg = len(legs) - 1 if self.state.place == way.target else 0
        for skill in legs[move.leg :]:
            if skill is legs[-1]:
                if sequence:
                    self._stay_above(sequence, way, move)
                look(self.floor, self.state)  # before anything is set down
            self._to_begin(skill, name, way.target)
            self.state.place = ""
            self._do(skill.aim(name, spot), name, way.target)
            self.state.deviations_m += skill.deviations_m
            move.leg += 1
        self.state.place = way.target

    def _to_begin(self, skill: Skill, name: str, where: str) -> None:
        """Moves the tool through free cells to a skill's start if it is far from it, as after an interruption."""
        begin, tool = skill.begins_at(), self.floor.scene.robot.tool()
        if begin is None or self.state.under_way is None or self.state.under_way.smooth:
            return
        if hypot(tool.x - begin.x, tool.y - begin.y, tool.z - begin.z) > BEGINS_M:
            way = by_free_cells(self.floor.bench, skill.surveys, begin, skill.kind if skill.carries else "")
            if why := self.floor.follow(way):
                raise Trouble(why, name, where, kind=self.floor.trouble_kind)

    def _do(self, skill: Skill, name: str, where: str) -> None:
        """Carries a skill out. Raises Trouble if it fails."""
        self.floor.tell(SkillBegan(skill.name, skill.does(name), name, self.floor.now_s))
        if self.floor.run(skill) is not Status.SUCCESS:
            raise Trouble(skill.reason, name, where, kind=self.floor.trouble_kind, skill=skill.name)
