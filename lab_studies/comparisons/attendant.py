"""A simulated person who attends a run: some time after a stop, it does what the run asks for, and lets it continue."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from lab.production.controls import Controls, StopKind
from lab.production.faults.fault import GROUND_M, out_of_sight
from lab.production.faults.where import ABOVE_M, around, distance, is_clear, parts_of, put_down, stack_of, stand, yaw_of
from lab.production.floor import Floor
from lab.production.standing import too_near
from lab.sim.frames import Quaternion, Vector
from lab.sim.scene.scene import MARKER, TABLE, pallet_of
from lab.skills.skill import UPRIGHT

COMES_AFTER_S = 20.0  # the time from a stop until all is put right
MOST_CALLS = 6  # in one run; then the person leaves, and the run ends as one that nobody attends
STRANGE = "strange box"  # the name of a box that a fault puts on the table
AT_STATION_M, NEAR_M = 0.10, 0.02  # a part so near to a spot stands at its station; so near to a machine, in it
MOVED_M = 0.005  # a fixed body that is farther from its place was moved
RING_M, RINGS = 0.06, 8  # rings of places for a part that cannot stand where it began
IN_THE_WAY = re.compile(r"something new|no path|approached|no room|enclosed|in the way|presses on|strange box")

NO_ROOM = re.compile(r"presses on|too near to")  # said of a part that stands where the arm cannot take it


@dataclass
class Attendant(Controls):
    """Controls with a person who knows only the run's messages and what is visible.

    asked: what the run said at each stop. did: what the person did about it, in words.
    """

    attended: bool = True
    asked: list[str] = field(default_factory=list)
    did: list[str] = field(default_factory=list)
    _since_s: float | None = None
    _stood: dict[str, tuple[Vector, Quaternion]] = field(default_factory=dict, repr=False)

    def on_floor(self, floor: Floor) -> None:
        """Record the places of the fixed bodies of a floor."""
        task = floor.scene.task
        fixed = [thing.name for thing in task.stations] + [thing.name for thing in task.obstacles]
        for body in [body for name in fixed for body in (name, f"{name}{MARKER}") if body in floor.world.names()]:
            (x, y, z), (i, j, k, w) = floor.world.pose(body)
            self._stood[body] = (float(x), float(y), float(z)), (float(i), float(j), float(k), float(w))

    def wait(self, timeout_s: float) -> None:
        """Return at once, because only the run's simulated time counts."""

    def before_step(self, floor: Floor) -> bool:
        """Put right what the run asks for, once the person has come; return whether anything in the scene was changed."""
        held = self.held
        if held is None or held.kind is not StopKind.PROTECTIVE:
            return False
        if self._since_s is None:
            self._since_s = floor.now_s
            self.asked.append(held.why)
        if floor.now_s < self._since_s + COMES_AFTER_S:
            return False
        self._since_s = None
        done = [*self._put_right(floor, held.why)]
        self.did += done
        self.attended = len(self.asked) < MOST_CALLS
        self.go_on()
        return bool(done)

    def _put_right(self, floor: Floor, why: str) -> Iterator[str]:
        """Do what the run asks for, and yield what was done, in words."""
        yield from self._clear(floor, why)
        yield from self._put_back(floor, why)
        for station, machine in floor.machines.items():
            if f"'{station}'" in why and machine.fails:
                machine.fails = False
                yield f"repaired '{station}'"
        for number, name in enumerate(parts_of(floor)):
            named = re.search(rf"{re.escape(name)}(?!\d)", why)
            off = _is_astray(floor, name) or (NO_ROOM.search(why) and not _on_spot(floor, name))
            if named and off and _stand_up(floor, number):
                yield f"stood {name} up"

    def _clear(self, floor: Floor, why: str) -> Iterator[str]:
        """Take away strange boxes if something is in the way, and parts not of the order at a named station."""
        world, own = floor.world, {body for name in parts_of(floor) for body in (name, pallet_of(name))}
        boxes = [body for body in world.names() if body.startswith(STRANGE) and not body.endswith(MARKER)]
        boxes = boxes if IN_THE_WAY.search(why) else []
        parts = [body for body in floor.scene.kind_of if body not in own and _at_named(floor, body, why)]
        for number, body in enumerate(dict.fromkeys([*boxes, *parts])):
            if world.pose(body)[0][2] < 0:
                continue
            for name in (body, f"{body}{MARKER}"):
                if name in world.names():
                    world.put(name, (*out_of_sight(number), 1.5 * GROUND_M))
            yield f"took {body} away"

    def _put_back(self, floor: Floor, why: str) -> Iterator[str]:
        """Put named obstacles and stations back to their places, with the parts in the stations."""
        world = floor.world
        for body, (at, _) in self._stood.items():
            off = np.asarray(at) - np.asarray(world.pose(body)[0])
            named = re.search(rf"(?<!\w){re.escape(body)}(?!\w)", why)
            if body.endswith(MARKER) or not named or float(np.abs(off).max()) < MOVED_M:
                continue
            near = [name for name in parts_of(floor) if floor.world.nearest(name, body, NEAR_M) < NEAR_M]
            for moved in (part for name in near for part in stack_of(floor, name) if body in floor.machines):
                where, how = world.pose(moved)
                world.put(moved, tuple(np.asarray(where) + off), how)
            for moved in (body, f"{body}{MARKER}"):
                if moved in self._stood:
                    world.put(moved, *self._stood[moved])
            yield f"put '{body}' back"


def _at_named(floor: Floor, body: str, why: str) -> bool:
    """Whether a body stands at a station that the run has named."""
    x, y, _ = floor.world.pose(body)[0]
    named = [station.name for station in floor.scene.task.stations if f"'{station.name}'" in why]
    return any(distance(floor, station, (float(x), float(y))) < AT_STATION_M for station in named)


def _stand_up(floor: Floor, number: int) -> bool:
    """Stand up a part of an order that has fallen, is gone or too far away; return whether there was room.

    It is put where it began or, if it cannot stand there, beside where it is, clear of all else and within reach.
    """
    scene, name = floor.scene, parts_of(floor)[number]
    (x, y, z), yaw, pallet = floor.world.pose(name)[0], yaw_of(floor, name), pallet_of(name)
    before = floor.world.pose(name)
    spot = scene.places.begins(scene.order)[number]
    ground = spot.z
    if pallet in scene.kind_of:
        (i, j, k), own = floor.world.pose(pallet)[0], scene.kind_of[pallet]
        spot, ground = replace(spot, x=float(i), y=float(j)), float(k) - own.shape.foot_m + own.shape.height_m
    stand(floor, [name], (spot.x, spot.y, ground + ABOVE_M), spot.yaw)
    under = {TABLE, pallet, *(station.name for station in scene.task.stations)}
    if ground > 0 and is_clear(floor, [name], under):
        return True
    floor.world.put(name, *before)
    if z < 0 or floor.scene.robot.arm.inverse(floor.bench.part_pose(name)) is None:
        x, y = spot.x, spot.y
    for ring in range(RINGS):
        for dx, dy in around((ring * RING_M, 0.0)):
            if put_down(floor, [name], (float(x) + dx, float(y) + dy), yaw):
                if scene.robot.arm.inverse(floor.bench.part_pose(name)) is not None and not too_near(floor.bench, name):
                    return True
                floor.world.put(name, *before)
    return False


def _on_spot(floor: Floor, name: str) -> bool:
    """Whether a part stands on a spot of a station."""
    x, y, _ = floor.world.pose(name)[0]
    stations = [station.name for station in floor.scene.task.stations]
    return any(distance(floor, station, (float(x), float(y))) < NEAR_M for station in stations)


def _is_astray(floor: Floor, name: str) -> bool:
    """Whether a part has fallen, or is out of the arm's reach."""
    gone = floor.world.pose(name)[0][2] < 0
    reached = not gone and floor.scene.robot.arm.inverse(floor.bench.part_pose(name)) is not None
    return floor.bench.held != name and (not reached or floor.bench.upright(name) < UPRIGHT)
