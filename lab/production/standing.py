"""The places of standing parts, and free places to set one down."""

from collections.abc import Collection, Iterator, Mapping
from math import hypot

import numpy as np

from lab.production.trouble import Trouble
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import Spot, comes_as
from lab.sim.scene.blocked_cells import OUT_OF_REACH, Surveyor
from lab.sim.scene.places import Layout, Rectangle
from lab.sim.scene.scene import TABLE, Scene, in_grid, pallet_of
from lab.sim.world import World
from lab.skills.around_part import SLOW
from lab.skills.free_way import by_free_cells
from lab.skills.place import let_go, release_pose
from lab.skills.sight import SkillFailed
from lab.skills.skill import UPRIGHT, Bench
from lab.skills.skillset import CarriedPath, SkillSet
from lab.skills.surveys import NEAR_SHAPE, NEAR_STEP_M, Surveys

ASTRAY_M = 0.15  # a part this near to a spot of a station is taken up by the station's own skill
DELIVERED_M = 0.02  # a part this near to its spot has been delivered
BESIDE_M = 0.004  # clearance between a part, or the open fingers, and the bodies beside it
ASIDE_M = 0.03  # clearance around a part that is set aside on the table


def free_spot(
    bench: Bench,
    name: str,
    way: CarriedPath,
    standing: Mapping[str, Spot],
    taken: Collection[Spot],
    lying: Collection[str],
) -> Spot:
    """The first free spot at the target of a path: not taken, and without a lying body. Raises Trouble.

    standing: the spot of each other body. lying: the bodies that may lie anywhere. A spot of a layer is free only if its
    support stands below.
    """
    scene, why = bench.scene, ""
    kind, station = scene.kinds[way.kind], scene.task.station(way.target)
    length, across = kind.footprint_m()
    for spot in scene.places.used_spots(station, len(scene.order), way.kind):
        if spot in taken or spot in standing.values():
            continue
        below = scene.places.carriers(station, spot)
        firm = {on for body, on in standing.items() if on in below and _carries(bench, body, on, lying)}
        if len(firm) < len(below):
            why = why or ": what would carry it does not stand there"
            continue
        room = Rectangle(spot.x, spot.y, length + BESIDE_M, across + BESIDE_M, spot.yaw)
        blocked = _standing_in(scene, room, spot.z, lying) or in_fingers_way(scene, kind.held_at(spot), lying)
        if not blocked:
            return spot
        why = f": {blocked} is there"
    raise Trouble(f"no spot of '{way.target}' is free{why}", name, way.target, kind="final")


def _carries(bench: Bench, body: str, spot: Spot, lying: Collection[str]) -> bool:
    """Whether a body is believed to stand on its spot, so that another one can be put on it."""
    return body not in lying and bench.stands(body, spot, DELIVERED_M)


def spots_aside(
    bench: Bench, surveys: Surveys, name: str, way: CarriedPath, spot_of: Mapping[str, Spot]
) -> Iterator[Spot]:
    """Spots on which a part in the gripper may be set down temporarily: the one from which it was taken up, unless a machine
    would start there, then free places on the table, the nearest first."""
    scene, own = bench.scene, bench.scene.bodies_of(name, way.kind)
    kind, begun, origin = scene.kinds[way.kind], spot_of.get(own[0]), scene.task.station(way.origin)
    others = [
        body for body in scene.world.names() if body not in (*own, TABLE, NAME) and not body.startswith(f"{NAME} ")
    ]
    length, across = kind.footprint_m()

    def is_free(spot: Spot, room_m: float, bodies: Collection[str]) -> bool:
        room = Rectangle(spot.x, spot.y, length + room_m, across + room_m, spot.yaw)
        tool = kind.held_at(spot)
        if scene.robot.arm.inverse(tool) is None or _standing_in(scene, room, spot.z, bodies):
            return False
        return not in_fingers_way(scene, tool, bodies)

    if (
        begun
        and origin.kind != "machine"
        and is_free(begun, BESIDE_M, [other for other in others if other != origin.name])
    ):
        yield begun
    blocked, (x, y, _) = surveys.workspace(way.kind).blocked, origin.pose
    cells = [surveys.cell_pose(cell) for cell in np.ndindex(*blocked.shape[:2], 1) if not blocked[cell]]
    kept = [room for _, room in scene.places.kept_free(len(scene.order))]
    grids = [station.grid for station in scene.task.stations if station.grid is not None]
    for cell in sorted(cells, key=lambda cell: hypot(cell.x - x, cell.y - y)):
        ground = Rectangle(cell.x, cell.y, length + ASIDE_M, across + ASIDE_M, 0.0)
        if any(in_grid(grid, (cell.x, cell.y)) for grid in grids) or any(room.meets(ground) for room in kept):
            continue
        if is_free(spot := Spot(cell.x, cell.y, 0.0, 0.0), ASIDE_M, others):
            yield spot


def set_down(bench: Bench, surveys: Surveys, spot: Spot, carried: str) -> Iterator[None]:
    """Sets the part in the gripper down on a free spot, through free cells; carried: its kind. Raises SkillFailed if it does not
    stand there afterwards."""
    body, robot = bench.held, bench.scene.robot
    assert body is not None
    goal = release_pose(bench, body, spot)
    above = ToolPose(goal.x, goal.y, surveys.cell_pose((0, 0, 0)).z, goal.yaw)
    yield from by_free_cells(bench, surveys, above, carried)
    goal = release_pose(bench, body, spot)
    yield from robot.follow([goal], slow=SLOW)
    yield from let_go(bench, [above])
    if not bench.stands(body, spot, DELIVERED_M):
        raise SkillFailed(f"{body} does not stand where it was set aside")


def too_near(bench: Bench, body: str) -> str:
    """The name of a body that the arm with open fingers would touch as it descends to a part; "" for none.

    The check uses a copy of the scene with all bodies at their present poses.
    """
    scene, goal = bench.scene, bench.part_pose(body)
    own = {body, pallet_of(body), body.removesuffix(pallet_of(""))}
    with World() as world:
        copy = Scene(world, scene.task, (), Layout(scene.layout.obstacles, ()))
        for name, kind in ((name, kind) for name, kind in scene.kind_of.items() if name not in own):
            world.part(name, kind.shape, kind.part.mass_kg, kind.part.friction, (0.0, 0.0, 0.0))
            copy.solid.append(name)
        for name in copy.solid:
            world.put(name, *scene.world.pose(name))
        surveyor = Surveyor(copy, None, clearance=BESIDE_M)
        levels = 1 if scene.robot.arm.gripper.level else NEAR_SHAPE[2]
        way = (goal.shifted(dz=level * NEAR_STEP_M[2]) for level in range(levels))
        return next((cause for pose in way if (cause := surveyor.cause(pose)) not in ("", OUT_OF_REACH)), "")


def in_fingers_way(scene: Scene, tool: ToolPose, bodies: Collection[str]) -> str:
    """Which of the bodies the open fingers would touch at a tool pose; "" for none."""
    gripper = scene.robot.arm.gripper
    across = gripper.opening_m / 2 + gripper.thick_m + BESIDE_M
    room = Rectangle(tool.x, tool.y, gripper.width_m / 2 + BESIDE_M, across, tool.yaw)
    return _standing_in(scene, room, tool.z, bodies)


def _standing_in(scene: Scene, room: Rectangle, above_m: float, bodies: Collection[str]) -> str:
    """The first of the bodies that overlaps a rectangle of the ground above a height [m]; "" for none."""
    for body in bodies:
        low, high = scene.world.bounds(body)
        middle, half = (low + high) / 2, (high - low) / 2
        if high[2] > above_m and room.meets(Rectangle(middle[0], middle[1], half[0], half[1], 0.0)):
            return body
    return ""


def station_near(bench: Bench, body: str, way: CarriedPath, skillset: SkillSet) -> str:
    """The station at which a part stands, origin or target of its path; the origin if it stands at neither."""
    at, places = bench.part_pose(body), bench.scene.places
    for station in (way.origin, way.target):
        foots = places.spots(bench.scene.task.station(station))
        near = any(hypot(at.x - foot.x, at.y - foot.y) < ASTRAY_M for foot in foots)
        if near and (way.kind, station) in skillset.picks:
            return station
    return way.origin


def stands(bench: Bench, name: str, spot: Spot) -> bool:
    """Whether a part, and its pallet, really stands on its spot."""
    scene = bench.scene
    kind = comes_as(scene.kind_of[name].part)
    for body, own in zip(scene.bodies_of(name, kind), scene.kinds[kind].stack(), strict=True):
        if not bench.stands(body, spot, DELIVERED_M, truly=True):
            return False
        spot = spot.raised(own.shape.height_m)
    return True


def has_fallen(bench: Bench, name: str) -> bool:
    """Whether a part is neither held nor upright."""
    return bench.held not in (name, pallet_of(name)) and bench.upright(name) < UPRIGHT
