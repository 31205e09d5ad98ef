"""The perceived poses of parts, obstacles, stations and strange parts, compared with those that the run believes.

Bodies' poses stand for a camera that looks at the whole table; while the camera is covered, nothing is seen.
"""

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin
from typing import Literal

from lab.production.floor import Floor
from lab.production.run_state import LOOK_S, RunState
from lab.production.standing import DELIVERED_M
from lab.production.trouble import Trouble
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import Spot
from lab.sim.scene import station_bodies
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import MARKER, TABLE
from lab.skills.skill import UPRIGHT
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle

PART_M = 0.035  # a part farther than this from its spot was moved
FIXED_M, FIXED_RAD = 0.006, 0.05  # the same for fixed bodies
ON_SPOT_M = 0.10  # a strange part this near to a spot of a station stands on it
BELOW_M = -0.05  # bodies below this height are not on the table
FELL_M = 0.02  # a part this far below its spot is off it

Sort = Literal[
    "camera blind",
    "part moved",
    "part fallen",
    "part gone",
    "part out of reach",
    "strange part",
    "obstacle moved",
    "obstacle gone",
    "obstacle new",
    "station moved",
]


@dataclass(frozen=True)
class Deviation:
    """A difference between the perceived and the believed scene: the body, the difference in words, the station ("": none).

    at: the perceived place of a part's foot, a fixed body's middle, or a station; by_m: the distance [m]; None and 0 for a
    missing body. obstacle: the record of a new one.
    """

    sort: Sort
    name: str
    words: str
    station: str = ""
    at: Spot | None = None
    by_m: float = 0.0
    obstacle: Obstacle | None = None


def look(floor: Floor, state: RunState) -> None:
    """Checks once a second whether all bodies are where they are believed. Raises Trouble for the first deviation."""
    if floor.now_s - state.looked_s < LOOK_S:
        return
    state.looked_s = floor.now_s
    if deviations := new_deviations(floor, state):
        raise Trouble(deviations[0].words, deviations[0].name, deviations[0].station, kind="seen")
    if not floor.world.dark:
        state.right_s = floor.now_s


def new_deviations(floor: Floor, state: RunState) -> list[Deviation]:
    """The deviations that are new to a run, without those of given-up parts and of known strange parts."""
    delivered = {state.name(part) for part in state.finished}
    deviations = perceive(floor, floor.scene.task, floor.scene.layout, state.spot_of, delivered)
    return [
        deviation for deviation in deviations if deviation.sort != "camera blind" and not _is_known(state, deviation)
    ]


def _is_known(state: RunState, seen: Deviation) -> bool:
    part = state.part_of(seen.name)
    if part is None:
        return seen.name in state.strange and seen.sort != "part gone"
    return part in state.lost or (part in state.to_put_back and seen.sort == "part moved")


def perceive(
    floor: Floor, task: Task, layout: Layout, spot_of: Mapping[str, Spot], delivered: Container[str] = ()
) -> list[Deviation]:
    """All deviations: of fixed things from the task and the layout, of parts from their spots.

    delivered: the parts that must stay within DELIVERED_M of their spots. Held bodies are left out. The order is that of
    `Sort` for parts, then strange parts, obstacles and stations.
    """
    if floor.world.dark:
        return [Deviation("camera blind", "", "the camera sees nothing")]
    deviations = [*_parts(floor, task, spot_of, delivered), *_strange_parts(floor, task, spot_of)]
    return [*deviations, *_obstacles(floor, task, layout), *_stations(floor, task)]


def _parts(floor: Floor, task: Task, spot_of: Mapping[str, Spot], delivered: Container[str]) -> Iterator[Deviation]:
    held = _held(floor)
    for body, spot in spot_of.items():
        if body in held:
            continue
        at = seen_at(floor, body)
        far, upright = hypot(at.x - spot.x, at.y - spot.y), floor.bench.upright(body) >= UPRIGHT
        strayed = far > (DELIVERED_M if body in delivered else PART_M) or at.z < spot.z - FELL_M
        if at.z >= BELOW_M and upright and not strayed:
            continue
        where, seen = station_of(floor, task, spot), f"({at.x:.2f}, {at.y:.2f}) m"
        station = f"'{where}'" if where else f"({spot.x:.2f}, {spot.y:.2f}) m"
        if at.z < BELOW_M:
            yield Deviation("part gone", body, f"{body} is nowhere on the table", where)
        elif not upright:
            yield Deviation("part fallen", body, f"{body} lies on its side at {seen}", where, at, far)
        else:
            words = f"{body} is not at {station}: seen {far:.2f} m away at {seen}"
            if floor.scene.robot.arm.inverse(floor.bench.part_pose(body)) is None:
                yield Deviation("part out of reach", body, f"{words}, out of reach", where, at, far)
            else:
                yield Deviation("part moved", body, words, where, at, far)


def moved_off(floor: Floor, name: str, spot: Spot | None) -> bool:
    """Whether a part is no longer on its spot, independent of the camera; False if no spot is known."""
    x, y, _ = floor.world.pose(name)[0]
    return spot is not None and hypot(float(x) - spot.x, float(y) - spot.y) > PART_M


def _held(floor: Floor) -> set[str]:
    """The bodies in the gripper and on top of the held one."""
    held = floor.bench.held
    if held is None:
        return set()
    top = floor.world.pose(held)[0]
    near = [body for body in floor.scene.kind_of if hypot(*(floor.world.pose(body)[0] - top)[:2]) < PART_M]
    return {held, *(body for body in near if floor.world.pose(body)[0][2] > top[2])}


def _strange_parts(floor: Floor, task: Task, spot_of: Mapping[str, Spot]) -> Iterator[Deviation]:
    for body in floor.scene.kind_of:
        at = seen_at(floor, body)
        if body in spot_of or at.z < BELOW_M:
            continue
        where = station_of(floor, task, at)
        place = f"on '{where}'" if where else f"at ({at.x:.2f}, {at.y:.2f}) m"
        yield Deviation("strange part", body, f"a part that is not of this order stands {place}", where, at)


def _obstacles(floor: Floor, task: Task, layout: Layout) -> Iterator[Deviation]:
    world = floor.world
    for obstacle, (x, y) in zip(task.obstacles, layout.obstacles, strict=True):
        at, name = _fixed_at(floor, obstacle.name), obstacle.name
        far = hypot(at.x - x, at.y - y)
        if at.z < BELOW_M:
            yield Deviation("obstacle gone", name, f"'{name}' is gone from ({x:.2f}, {y:.2f}) m")
        elif far > FIXED_M:
            yield Deviation(
                "obstacle moved", name, f"'{name}' stands {far:.2f} m off where it was surveyed", "", at, far
            )
    stations = {station.name for station in task.stations}
    known = {TABLE, NAME, *stations, *floor.scene.kind_of, *(fixed.name for fixed in task.obstacles)}
    for name in world.names():
        looks = world.looks(name)
        if name in known or name.endswith(MARKER) or name.startswith(f"{NAME} ") or not looks or looks[0].kind != "box":
            continue
        at = _fixed_at(floor, name)
        if at.z > BELOW_M:
            length, width, height = looks[0].size
            box = Obstacle(name=name, position_m=(at.x, at.y), size_m=(length, width, height), yaw=at.yaw)
            words = f"something new stands at ({at.x:.2f}, {at.y:.2f}) m"
            yield Deviation("obstacle new", name, words, "", at, 0.0, box)


def _stations(floor: Floor, task: Task) -> Iterator[Deviation]:
    places = floor.scene.places
    for station in task.stations:
        middle, yaw = station_bodies.stands_at(station, places.slab(station, len(floor.scene.order)))
        at = _fixed_at(floor, station.name)
        dx, dy, turn = at.x - middle[0], at.y - middle[1], (at.yaw - yaw + pi) % (2 * pi) - pi
        far = hypot(dx, dy)
        if far > FIXED_M or abs(turn) > FIXED_RAD:
            x, y, own = station.pose  # the station was turned about the middle of its body
            off, across = x - middle[0], y - middle[1]
            pose = (
                at.x + cos(turn) * off - sin(turn) * across,
                at.y + sin(turn) * off + cos(turn) * across,
                station.pose[2] + turn if abs(turn) > FIXED_RAD else own,
            )
            words = f"'{station.name}' stands {far:.3f} m off where it was surveyed"
            yield Deviation(
                "station moved", station.name, words, station.name, Spot(pose[0], pose[1], 0.0, pose[2]), far
            )


def seen_at(floor: Floor, body: str) -> Spot:
    """The present place of a part's foot, with its yaw."""
    (x, y, z), turn = floor.world.pose(body)
    foot = floor.scene.kind_of[body].shape.foot_m
    return Spot(float(x), float(y), float(z) - foot, 2.0 * atan2(float(turn[2]), float(turn[3])))


def _fixed_at(floor: Floor, body: str) -> Spot:
    (x, y, z), turn = floor.world.pose(body)
    return Spot(float(x), float(y), float(z), 2.0 * atan2(float(turn[2]), float(turn[3])))


def station_of(floor: Floor, task: Task, at: Spot) -> str:
    """The station that has the spot nearest to a place; "" where none is near."""
    far, name = min(
        (hypot(at.x - spot.x, at.y - spot.y), station.name)
        for station in task.stations
        for spot in floor.scene.places.spots(station)
    )
    return name if far < ON_SPOT_M else ""


def scene_seen(task: Task, layout: Layout, deviations: list[Deviation]) -> tuple[Task, Layout]:
    """The task and layout with obstacles and stations where they were seen; Raises BadInput for an impossible scene."""
    seen = {deviation.name: deviation for deviation in deviations}
    stations = []
    for station in task.stations:
        moved = seen.get(station.name)
        pose = moved and moved.sort == "station moved" and moved.at and (moved.at.x, moved.at.y, moved.at.yaw)
        stations.append(station.model_copy(update={"pose": pose}) if pose else station)
    obstacles: list[Obstacle] = []
    at: list[tuple[float, float]] = []
    for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
        one = seen.get(obstacle.name)
        if one is None or one.sort != "obstacle gone":
            obstacles.append(obstacle)
            at.append(place if one is None or one.at is None else (one.at.x, one.at.y))
    for one in deviations:
        if one.obstacle is not None:
            obstacles.append(one.obstacle)
            at.append(one.obstacle.position_m)
    return task.changed(stations=tuple(stations), obstacles=tuple(obstacles)), Layout(tuple(at), layout.parts)
