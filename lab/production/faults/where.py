"""Where parts are for a hand that reaches in: carried, in a machine, standing; and where there is room to put one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

import numpy as np

from lab.production.floor import Floor
from lab.sim.arms.robot import NAME
from lab.sim.frames import Quaternion, Vector
from lab.sim.parts.kinds import Kind, beside
from lab.sim.scene.scene import TABLE, pallet_of
from lab.sim.urdf_reader import rotation
from lab.skills.skill import UPRIGHT
from lab.tasks.task import part_name

AWAY_M = 0.12  # a hand reaches in only where the robot is at least so far away
IN_MACHINE_M, AT_STATION_M = 0.03, 0.15  # from a spot: what is in the machine, and what is at the station
IN_THE_AIR_M = 0.03  # above what is below it, at least, a carried part is
CLEAR_M = 0.012  # around what is put somewhere
ABOVE_M = 0.001  # what it is put on
LEVEL_M = 0.001  # ground is level where heights differ by no more
EDGE_M = 0.003  # a foot stands so far within what it stands on
LOW_M = 0.25  # above all that parts stand on, and below an arm that reaches over it
UP = (0.0, 0.0, 0.0, 1.0)
LYING = ((sin(pi / 4), 0.0, 0.0, cos(pi / 4)), (-sin(pi / 4), 0.0, 0.0, cos(pi / 4)))  # on the one side, or the other
LYING_ACROSS = ((0.0, sin(pi / 4), 0.0, cos(pi / 4)), (0.0, -sin(pi / 4), 0.0, cos(pi / 4)))


@dataclass(frozen=True)
class Whereabouts:
    """Where a part is: the station that it is at, "" for none, and how: "carried", "in machine", "standing", "lying", "gone"."""

    how: str
    station: str = ""


def parts_of(floor: Floor) -> list[str]:
    """The parts of the order."""
    return [part_name(floor.scene.order, number) for number in range(1, len(floor.scene.order) + 1)]


def stack_of(floor: Floor, name: str) -> list[str]:
    """A part, with the pallet under it first where it stands on one."""
    scene, pallet = floor.scene, pallet_of(name)
    if pallet not in scene.kind_of:
        return [name]
    (x, y, z), (i, j, k) = (scene.world.pose(body)[0] for body in (name, pallet))
    return [pallet, name] if hypot(x - i, y - j) < IN_MACHINE_M and z > k else [name]


def whereabouts(floor: Floor, name: str) -> Whereabouts:
    """Where a part is now."""
    scene, bench = floor.scene, floor.bench
    x, y, z = scene.world.pose(name)[0]
    if z < -IN_THE_AIR_M:
        return Whereabouts("gone")
    stack = stack_of(floor, name)
    station = station_at(floor, name, (float(x), float(y)))
    if bench.held is not None and bench.held in stack:
        return Whereabouts(
            "carried" if in_the_air(floor, bench.held) and bench.holds(bench.held) else "gripped", station
        )
    if bench.upright(name) < UPRIGHT:
        return Whereabouts("lying", station)
    is_machine = station != "" and scene.task.station(station).kind == "machine"
    if is_machine and distance(floor, station, (float(x), float(y))) < IN_MACHINE_M:
        return Whereabouts("in machine", station)
    return Whereabouts("standing", station)


def is_undone(floor: Floor, name: str) -> bool:
    """Whether a machine works on a part and has not finished it."""
    work = floor.work_on(name)
    return work is not None and not work.done(floor.now_s)


def in_the_air(floor: Floor, body: str) -> bool:
    """Whether there is nothing for 3 cm below a body."""
    scene = floor.scene
    (x, y, z), foot = scene.world.pose(body)[0], scene.kind_of[body].shape.foot_m
    return scene.world.ray((x, y, z - foot - 0.001), (x, y, z - foot - IN_THE_AIR_M)) is None


def station_at(floor: Floor, name: str, at: tuple[float, float]) -> str:
    """The station of a part's routes that has the spot nearest to a place; "" where none is near."""
    places = floor.scene.kind_of[name].part.places
    found = [(distance(floor, station, at), station) for station in places]
    far, station = min(found, default=(AT_STATION_M, ""))
    return station if far < AT_STATION_M else ""


def distance(floor: Floor, station: str, at: tuple[float, float]) -> float:
    """From a place to the nearest spot of a station [m]."""
    spots = floor.scene.places.spots(floor.scene.task.station(station))
    return min(hypot(at[0] - spot.x, at[1] - spot.y) for spot in spots)


def is_robot_away(floor: Floor, bodies: Sequence[str], far_m: float = AWAY_M) -> bool:
    """Whether the robot is far enough from all of these bodies for a hand to reach in."""
    return all(floor.world.nearest(NAME, body, far_m) >= far_m for body in bodies)


@dataclass(frozen=True)
class Foot:
    """What a part that is turned so touches the ground with: its rectangle (low, high) along its axes [m], and how high the
    part's origin is above it [m]."""

    low: tuple[float, float]
    high: tuple[float, float]
    up_m: float

    @classmethod
    def of(cls, kind: Kind, tilt: Quaternion) -> "Foot":
        """Of a part that is tilted by a quaternion, before it is turned about the vertical axis."""
        points = kind.shape.hull @ rotation(tilt).T
        (a, b, c), (d, e, _) = points.min(axis=0), points.max(axis=0)
        return cls((float(a), float(b)), (float(d), float(e)), -float(c))

    def grid(self, at: tuple[float, float], yaw: float) -> Iterator[tuple[float, float]]:
        """Nine points of the ground below it, corners, sides and middle, for its origin at a place."""
        for x in (self.low[0] + EDGE_M, (self.low[0] + self.high[0]) / 2, self.high[0] - EDGE_M):
            for y in (self.low[1] + EDGE_M, (self.low[1] + self.high[1]) / 2, self.high[1] - EDGE_M):
                yield beside(at, yaw, (x, y))


def grounds(floor: Floor) -> list[str]:
    """The bodies on which a hand puts parts: the table, and stations without sides around what stands on them."""
    return [TABLE, *(station.name for station in floor.scene.task.stations if station.kind != "machine")]


def put_down(floor: Floor, bodies: Sequence[str], at: tuple[float, float], yaw: float, tilt: Quaternion = UP) -> bool:
    """Put a part, or a pallet with its part, where there is level ground and room; False, and nothing moves, where there is
    none. tilt: before it is turned about the vertical axis."""
    world, before = floor.world, {body: floor.world.pose(body) for body in bodies}
    for number, body in enumerate(bodies):
        world.put(body, (0.0, 0.0, 5.0 + number))
    kind = floor.scene.kind_of[bodies[0]]
    foot = Foot.of(kind, tilt)
    hits = [world.ray((x, y, LOW_M), (x, y, -0.1)) for x, y in foot.grid(at, yaw)]
    names = {hit[0] for hit in hits if hit is not None}
    heights = [float(hit[1][2]) for hit in hits if hit is not None]
    good = None not in hits and names <= set(grounds(floor)) and max(heights) - min(heights) < LEVEL_M
    if good:
        stand(floor, bodies, (*at, max(heights) + ABOVE_M), yaw, tilt)
        good = is_clear(floor, bodies, names)
    if not good:
        for body, (position, turn) in before.items():
            world.put(body, position, turn)
    return good


def stand(floor: Floor, bodies: Sequence[str], ground: Vector, yaw: float, tilt: Quaternion = UP) -> None:
    """Put a part, or a pallet and its part on it, on the ground at a place, whatever is there."""
    x, y, z = ground
    for body in bodies:
        kind = floor.scene.kind_of[body]
        floor.world.put(body, (x, y, z + Foot.of(kind, tilt).up_m), turned(yaw, tilt))
        z += kind.shape.height_m + ABOVE_M


def is_clear(floor: Floor, bodies: Sequence[str], but: set[str]) -> bool:
    """Whether there is room on all sides of these bodies; but: what they stand on."""
    others = [name for name in floor.world.names() if name not in (*bodies, *but)]
    return all(floor.world.nearest(body, name, CLEAR_M) >= CLEAR_M for body in bodies for name in others)


def around(off: Sequence[float]) -> Iterator[tuple[float, float]]:
    """An offset [m], then the others that are as far, a twelfth of a turn apart, then farther ones."""
    for longer in (1.0, 1.25, 1.5):
        for step in (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6):
            yield beside((0.0, 0.0), step * pi / 6, (longer * off[0], longer * off[1]))


def turned(yaw: float, tilt: Quaternion) -> Quaternion:
    """A tilt, then a turn about the vertical axis, as one quaternion xyzw."""
    s, c = sin(yaw / 2), cos(yaw / 2)
    x, y, z, w = tilt
    return (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)


def yaw_of(floor: Floor, body: str) -> float:
    """How a body is turned about the vertical axis [rad]."""
    x, y, z, w = floor.world.pose(body)[1]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
