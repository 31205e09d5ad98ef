"""The whereabouts of parts for a hand that reaches in (carried, in a machine, standing), and the free places for them."""

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

AWAY_M = 0.12  # least distance of the robot from a hand that reaches in
IN_MACHINE_M, AT_STATION_M = 0.03, 0.15  # largest distance from a spot of a part in a machine, and at a station
IN_THE_AIR_M = 0.03  # least height of a carried part above the body below it
CLEAR_M = 0.012  # room around a body that is put down
ABOVE_M = 0.001  # gap between a body that is put down and its support
LEVEL_M = 0.001  # largest difference of heights of level ground
EDGE_M = 0.003  # margin of a foot within its support
LOW_M = 0.25  # a height above all supports and below an arm that reaches over them
UP = (0.0, 0.0, 0.0, 1.0)
LYING = ((sin(pi / 4), 0.0, 0.0, cos(pi / 4)), (-sin(pi / 4), 0.0, 0.0, cos(pi / 4)))  # tilts to one side and the other
LYING_ACROSS = ((0.0, sin(pi / 4), 0.0, cos(pi / 4)), (0.0, -sin(pi / 4), 0.0, cos(pi / 4)))


@dataclass(frozen=True)
class Whereabouts:
    """A part's station ("": none) and state: "carried", "in machine", "standing", "lying" or "gone"."""

    how: str
    station: str = ""


def parts_of(floor: Floor) -> list[str]:
    """The names of the order's parts."""
    return [part_name(floor.scene.order, number) for number in range(1, len(floor.scene.order) + 1)]


def stack_of(floor: Floor, name: str) -> list[str]:
    """A part, with the pallet under it first where it stands on one."""
    scene, pallet = floor.scene, pallet_of(name)
    if pallet not in scene.kind_of:
        return [name]
    (x, y, z), (i, j, k) = (scene.world.pose(body)[0] for body in (name, pallet))
    return [pallet, name] if hypot(x - i, y - j) < IN_MACHINE_M and z > k else [name]


def whereabouts(floor: Floor, name: str) -> Whereabouts:
    """The present whereabouts of a part."""
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
    distances = [(distance(floor, station, at), station) for station in places]
    far, station = min(distances, default=(AT_STATION_M, ""))
    return station if far < AT_STATION_M else ""


def distance(floor: Floor, station: str, at: tuple[float, float]) -> float:
    """The distance from a place to the nearest spot of a station [m]."""
    spots = floor.scene.places.spots(floor.scene.task.station(station))
    return min(hypot(at[0] - spot.x, at[1] - spot.y) for spot in spots)


def is_robot_away(floor: Floor, bodies: Sequence[str], far_m: float = AWAY_M) -> bool:
    """Whether the robot is at least `far_m` [m] from all of these bodies, so that a hand can reach in."""
    return all(floor.world.nearest(NAME, body, far_m) >= far_m for body in bodies)


@dataclass(frozen=True)
class Foot:
    """The foot of a turned part: its rectangle (low, high) along its axes [m], and the height of the part's origin
    above it [m]."""

    low: tuple[float, float]
    high: tuple[float, float]
    up_m: float

    @classmethod
    def of(cls, kind: Kind, tilt: Quaternion) -> "Foot":
        """The foot of a part that is tilted by a quaternion, before its turn about the vertical axis."""
        points = kind.shape.hull @ rotation(tilt).T
        (a, b, c), (d, e, _) = points.min(axis=0), points.max(axis=0)
        return cls((float(a), float(b)), (float(d), float(e)), -float(c))

    def grid(self, at: tuple[float, float], yaw: float) -> Iterator[tuple[float, float]]:
        """Nine ground points below the foot, corners, sides and middle, for the part's origin at a place."""
        for x in (self.low[0] + EDGE_M, (self.low[0] + self.high[0]) / 2, self.high[0] - EDGE_M):
            for y in (self.low[1] + EDGE_M, (self.low[1] + self.high[1]) / 2, self.high[1] - EDGE_M):
                yield beside(at, yaw, (x, y))


def grounds(floor: Floor) -> list[str]:
    """The bodies on which a hand puts parts: the table, and stations without walls around their parts."""
    return [TABLE, *(station.name for station in floor.scene.task.stations if station.kind != "machine")]


def put_down(floor: Floor, bodies: Sequence[str], at: tuple[float, float], yaw: float, tilt: Quaternion = UP) -> bool:
    """Puts a part, or a pallet with its part, on level ground with room; returns False and moves nothing if there is
    none. tilt: applied before the turn about the vertical axis."""
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
    """Puts a part, or a pallet with its part, on the ground at a place without checks."""
    x, y, z = ground
    for body in bodies:
        kind = floor.scene.kind_of[body]
        floor.world.put(body, (x, y, z + Foot.of(kind, tilt).up_m), turned(yaw, tilt))
        z += kind.shape.height_m + ABOVE_M


def is_clear(floor: Floor, bodies: Sequence[str], but: set[str]) -> bool:
    """Whether there is room on all sides of these bodies; but: their supports, which are ignored."""
    others = [name for name in floor.world.names() if name not in (*bodies, *but)]
    return all(floor.world.nearest(body, name, CLEAR_M) >= CLEAR_M for body in bodies for name in others)


def around(off: Sequence[float]) -> Iterator[tuple[float, float]]:
    """An offset [m], then those of the same length in steps of a twelfth of a turn, then longer ones."""
    for longer in (1.0, 1.25, 1.5):
        for step in (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6):
            yield beside((0.0, 0.0), step * pi / 6, (longer * off[0], longer * off[1]))


def turned(yaw: float, tilt: Quaternion) -> Quaternion:
    """The quaternion xyzw of a tilt followed by a turn about the vertical axis."""
    s, c = sin(yaw / 2), cos(yaw / 2)
    x, y, z, w = tilt
    return (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)


def yaw_of(floor: Floor, body: str) -> float:
    """The yaw of a body [rad]."""
    x, y, z, w = floor.world.pose(body)[1]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
