"""Checks of a task's cell before it is surveyed: reach, heights, layers, and stations that overlap."""

from itertools import combinations, product
from math import ceil, cos, hypot, pi, sin

import numpy as np

from lab.errors import BadInput, counted
from lab.sim import models
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import Camera
from lab.sim.frames import Vector
from lab.sim.parts.kinds import Kind, Spot, beside, comes_as, kinds_of
from lab.sim.scene import station_bodies
from lab.sim.scene.hold_trial import TURN_RAD, held
from lab.sim.scene.places import ON_TOP_M, Places, Rectangle
from lab.sim.scene.scene import in_grid, marker_of
from lab.tasks.task import Task
from lab.tasks.task_fields import CameraGrid, Station

ACROSS = 0.3  # sine of the largest angle between the fingers and the direction of entry
DETOUR = 1.5  # longest path around the arm and obstacles, as a multiple of the path along the axes
OVER_M = 0.01  # [m] clearance between a carried part and the bodies below its path
ON_M = 1e-6  # largest overhang of a part over its support: rounding errors are smaller
RESTS = 0.25  # share of the distance from a part's middle to its sides that its support must cover
TURNS = 17  # samples of a turn that are checked
INTO_M = 0.005  # [m] the same above a machine into which the part is lowered


def places_of(task: Task) -> Places:
    """The places at a task's stations for its parts as the robot grips them. Raises BadInput."""
    return Places(task, kinds_of(task, arm_of(task.robot, task.folder).gripper))


def check_scene(task: Task) -> Task:
    """The task, with a smaller grip force where its parts would creep; a force that its file gives is kept.

    BadInput when a part cannot be gripped or held, spots are out of the arm's reach, or transfers would sweep parts.
    """
    arm, places = arm_of(task.robot, task.folder), places_of(task)
    low = task.workspace.lower_m[2] + task.workspace.cell_m[2] / 2
    _check_level(task)
    _check_lowest(places, low)
    robot = held(task.robot, arm, list(places.kinds.values()), longest_way_m(places), _turn_rad(task))
    for station in task.stations:
        station_bodies.check(station, task.folder)
        if station.grid is not None:
            _check_seen(task, station, station.grid)
        _check_on_body(places, station)
        check_places(places, station)
        for kind in places.kinds_at(station.name):
            _check_grid(station, kind, places.floor(station))
            _check_side(station, kind)
            for spot in places.spots(station, kind.name):
                pose = kind.held_at(spot)
                for at in (pose, ToolPose(pose.x, pose.y, low, pose.yaw)):
                    _check_reach(arm, station, at)
                _check_turn(arm, station, at)
    return task if robot is task.robot else task.changed(robot=robot)


def _turn_rad(task: Task) -> float:
    """The turn of the tool with a part in the trial of its grip [rad].

    A turn of a level tool moves the whole arm, which few postures allow: it turns only as far as the stations do.
    """
    if task.robot.tool != "level":
        return TURN_RAD
    return min(TURN_RAD, max(abs((station.pose[2] + pi) % (2 * pi) - pi) for station in task.stations))


def _check_level(task: Task) -> None:
    """Raises BadInput if a task with a level tool needs what only a hanging tool can do."""
    if task.robot.tool != "level":
        return
    grids = [f"station '{station.name}': approach = 'camera'" for station in task.stations if station.grid is not None]
    covers = [f"processes.{name}: by = 'robot'" for name, process in task.processes.items() if process.by == "robot"]
    seen = ["perception = 'camera'"] if task.perception == "camera" else []
    if refused := [*grids, *covers, *seen]:
        sides = [station.name for station in task.stations if station.approach == "side"]
        why = f", for '{sides[0]}' has approach = 'side'" if sides else ""
        raise BadInput(f"{refused[0]} is for a tool that hangs; robot.tool is 'level'{why}")


def _check_on_body(places: Places, station: Station) -> None:
    """BadInput when a part on a spot would stand beside the station's body, in whole or with an edge.

    A slab without a size is drawn under all its spots. A body from a file has to reach below the middle of each spot, unless
    parts stand on the table there.
    """
    (x, y, yaw), needed = station.pose, [0.0, 0.0]  # needed half length and half width [m]
    for spot in places.spots(station):
        middle, turn = beside((0.0, 0.0), -yaw, (spot.x - x, spot.y - y)), spot.yaw - yaw
        if station.stands_on not in ("slab", "box") and spot.z > 0.0:
            _check_in_bounds(station, middle, *station_bodies.bounds(station, places.task.folder))
        for along, across in (kind.footprint_m() for kind, _ in places.grounds(station, spot)):
            half = abs(cos(turn)) * along + abs(sin(turn)) * across, abs(sin(turn)) * along + abs(cos(turn)) * across
            needed = [max(most, abs(at) + own) for most, at, own in zip(needed, middle, half, strict=True)]
    size = station.size_m
    if size is not None and any(2 * most > edge + ON_M for most, edge in zip(needed, size, strict=False)):
        wanted = [max(edge, ceil(2000 * most - ON_M) / 1000) for most, edge in zip(needed, size, strict=False)]
        raise BadInput(
            f"station '{station.name}': size_m = {list(size)}: its {counted(station.capacity, 'spot')} reach beyond it, parts "
            f"would fall off: at least {[*wanted, size[2]]} needed, or a smaller capacity"
        )


def check_places(places: Places, station: Station) -> None:
    """Raises BadInput for places of the file at which parts would overlap, or of a layer with nothing below."""
    if station.places is None:
        return
    on_file_body = station.stands_on not in ("slab", "box")
    spots = {spot: places.grounds(station, spot) for spot in places.spots(station)}
    for (one, here), (other, there) in combinations(spots.items(), 2):
        for kind, ground in here:
            for above, covered in there:
                over = min(one.z + kind.height_m, other.z + above.height_m) - max(one.z, other.z)
                if over > ON_TOP_M and ground.meets(covered):
                    raise BadInput(
                        f"{_place_in_words(places, station, other)}: a {above.name} there would stand in a {kind.name} at "
                        f"{_off(station, one)}, which is {kind.height_m:g} m high: move one, or raise it"
                    )
    for spot, own in spots.items():
        below = [under for under in spots if under.z < spot.z and _meet(own, spots[under])]
        if spot.z <= places.floor(station) or (on_file_body and not below):
            continue
        _check_carried(places, station, spot, below)


def _check_carried(places: Places, station: Station, spot: Spot, below: list[Spot]) -> None:
    """Raises BadInput for a place of a layer that the places below do not support with every kind that may stand there."""
    where, own = _place_in_words(places, station, spot), places.grounds(station, spot)
    carriers = places.carriers(station, spot)
    if not carriers:
        tops = sorted(
            {round(s.z + k.height_m - places.floor(station), 4) for s in below for k, _ in places.grounds(station, s)}
        )
        what = f"below it parts reach up to {', '.join(map(str, tops))} m" if tops else "no place is below it"
        raise BadInput(
            f"{where}: {what}: wanted a place that carries it, and height_m = the height of the part on that"
        )
    for under in carriers:
        for kind, _ in places.grounds(station, under):
            if abs(under.z + kind.height_m - spot.z) > ON_TOP_M:
                raise BadInput(
                    f"{where}: a {kind.name} may stand below it, {kind.height_m:g} m high: give the place at "
                    f"{_off(station, under)} the kind that carries it"
                )
    for kind, ground in own:
        if not _rests(ground, [covered for under in carriers for _, covered in places.grounds(station, under)]):
            raise BadInput(f"{where}: a {kind.name} there would topple: its middle is not over what carries it")


def _rests(ground: Rectangle, below: list[Rectangle]) -> bool:
    """Whether a part's support extends from the middle of its foot to all four sides by at least a quarter of its half size."""
    shares = [n / 8 for n in range(-8, 9)]
    held = []
    for along, across in product(shares, shares):
        at = beside((ground.x, ground.y), ground.yaw, (along * ground.half_along, across * ground.half_across))
        if any(support.meets(Rectangle(*at, 0.0, 0.0, 0.0)) for support in below):
            held.append((along, across))
    return bool(held) and all(min(axis) <= -RESTS and max(axis) >= RESTS for axis in zip(*held, strict=True))


def _meet(one: list[tuple[Kind, Rectangle]], other: list[tuple[Kind, Rectangle]]) -> bool:
    return any(a.meets(b) for _, a in one for _, b in other)


def _off(station: Station, spot: Spot) -> str:
    x, y = beside((0.0, 0.0), -station.pose[2], (spot.x - station.pose[0], spot.y - station.pose[1]))
    return f"({x + 0.0:.3f}, {y + 0.0:.3f}) m"


def _place_in_words(places: Places, station: Station, spot: Spot) -> str:
    return f"station '{station.name}': place at {_off(station, spot)}, height_m = {spot.z - places.floor(station):g}"


def _check_in_bounds(station: Station, at: tuple[float, float], low: Vector, high: Vector) -> None:
    if not (low[0] <= at[0] <= high[0] and low[1] <= at[1] <= high[1]):
        raise BadInput(
            f"station '{station.name}': its spot at ({at[0]:.3f}, {at[1]:.3f}) m off its pose is beside its body "
            f"{station.stands_on}, which is there from ({low[0]:.3f}, {low[1]:.3f}) to ({high[0]:.3f}, {high[1]:.3f}) m: "
            "wanted spots on it, or a smaller capacity"
        )


def longest_way_m(places: Places) -> float:
    """The longest path of a carried part between two of its stations, cell by cell and around obstacles [m]."""
    longest = 0.0
    for here, there in combinations(places.task.stations, 2):
        if set(places.task.kinds_at(here.name)) & set(places.task.kinds_at(there.name)):
            longest = max(longest, sum(abs(a - b) for a, b in zip(here.pose[:2], there.pose[:2], strict=True)))
    return DETOUR * longest


def _check_lowest(places: Places, low: float) -> None:
    """Raises BadInput if a part that is carried in the lowest cells would hit a part at a station."""
    standing = {station.name: places.top_m(station) for station in places.task.stations}
    where = max(standing, key=lambda name: standing[name])
    for kind in (places.kinds[comes_as(part)] for part in places.task.made):
        lacking_m = standing[where] + OVER_M + kind.grip.up_m - low
        if lacking_m > 0:
            lower_m = places.task.workspace.lower_m[2]
            enough_m = ceil(1000 * (lower_m + lacking_m) - 1e-6) / 1000
            raise BadInput(
                f"workspace.lower_m: the lowest tool height {low:.3f} m would sweep a carried {kind.name} "
                f"through what stands at '{where}': at least {low + lacking_m:.3f} needed, so lower_m[2] = "
                f"{enough_m:.3f} in place of {lower_m:g}"
            )


def _check_seen(task: Task, station: Station, grid: CameraGrid) -> None:
    """BadInput when a grid does not hold its start and its station's marker, or the camera does not see them."""
    assert task.camera is not None
    camera = Camera.overhead(task.camera.position_m, task.camera.field_of_view_rad, task.camera.pixels)
    marker, start = marker_of(station, grid), grid.start_m
    gripper = (start[0] + models.MARKER_OUT, start[1], grid.height_m + models.MARKER_UP)
    ends = [low + count * grid.cell_m for low, count in zip(grid.origin_m, grid.shape, strict=True)]
    for field, place, shown in (("start_m", start, gripper), ("marker_m", marker[:2], marker)):
        if not in_grid(grid, place):
            raise BadInput(
                f"station '{station.name}': grid.{field}: it is at ({place[0]:.2f}, {place[1]:.2f}) m, outside the grid: "
                f"({grid.origin_m[0]:.2f}, {grid.origin_m[1]:.2f}) to ({ends[0]:.2f}, {ends[1]:.2f}) m"
            )
        across, down, far = camera.pixel_from_world() @ (*shown, 1.0)
        if far <= 0 or not (0 <= across / far < camera.width and 0 <= down / far < camera.height):
            raise BadInput(
                f"camera.position_m = {list(task.camera.position_m)}: the marker at ({shown[0]:.2f}, {shown[1]:.2f}) m, of "
                f"{field} of the grid of '{station.name}', is out of its picture; "
                f"field_of_view_rad = {camera.field_of_view_rad:g}"
            )


def _check_grid(station: Station, kind: Kind, floor: float) -> None:
    """BadInput when a carried part would hit the machine to which the camera's grid leads."""
    if station.grid is None:
        return
    lowest = max(station.grid.marker_m[2], floor) + kind.grip.up_m + INTO_M
    if station.grid.height_m < lowest:
        raise BadInput(
            f"station '{station.name}': grid.height_m {station.grid.height_m}: a carried {kind.name} would hit it, "
            f"at least {lowest:.3f} needed"
        )


def _check_side(station: Station, kind: Kind) -> None:
    """BadInput when a finger would stand in the way of a part that is brought in from the side."""
    if station.approach == "side" and abs(sin(kind.grip.yaw)) > ACROSS:
        raise BadInput(
            f"station '{station.name}': approach = 'side': the fingers hold a {kind.name} before and behind, at yaw "
            f"{kind.grip.yaw:.2f}: only what is held at its sides, at yaw 0, can be brought in along its x axis"
        )


def _check_reach(arm: Arm, station: Station, at: ToolPose) -> None:
    if arm.inverse(at) is None or hypot(at.x, at.y) < arm.nearest_m:
        raise BadInput(
            f"station '{station.name}' is out of reach: its spot at ({at.x:.2f}, {at.y:.2f}) m, by "
            f"pose = {list(station.pose)}, is {hypot(at.x, at.y):.2f} m from the robot; "
            f"the arm '{arm.name}' {arm.reach_in_words(at.z)}"
        )


def _check_turn(arm: Arm, station: Station, above: ToolPose) -> None:
    """Raises BadInput if the last joint's range ends before the tool reaches a station's yaw, or the grip's yaw over a spot."""
    x, y, yaw = station.pose
    came, over = ToolPose(x, y, above.z, 0.0), ToolPose(x, y, above.z, yaw)
    for begun, ended in ((came, over), (over, above)):
        turn = (ended.yaw - begun.yaw + pi) % (2 * pi) - pi
        shares = np.linspace(0.0, 1.0, TURNS)[:, None]
        poses = [begun.x, begun.y, begun.z, begun.yaw] + shares * [ended.x - begun.x, ended.y - begun.y, 0.0, turn]
        if station.approach != "side" and np.isnan(arm.inverse_path(poses)).all():
            raise BadInput(
                f"station '{station.name}': pose = {list(station.pose)}: over its spot at ({above.x:.2f}, {above.y:.2f}) m the "
                f"arm '{arm.name}' cannot turn its tool from yaw {begun.yaw:.2f} to {ended.yaw:.2f}: its last joint goes from "
                f"{arm.lower[-1]:.2f} to {arm.upper[-1]:.2f} rad; wanted another yaw, of the station or of the grip"
            )


def check_apart(task: Task, parts: int) -> None:
    """Raises BadInput when two stations overlap, with the spots that so many parts need."""
    places = places_of(task)
    ground = {station.name: _ground(places, station, parts) for station in task.stations}
    for (one, here), (other, there) in combinations(ground.items(), 2):
        for a in here:
            for b in there:
                if a.meets(b):
                    raise BadInput(
                        f"stations '{one}' and '{other}' overlap: at ({a.x:.2f}, {a.y:.2f}) and ({b.x:.2f}, {b.y:.2f}) m "
                        f"parts, machines and the gripper around them need {2 * a.half_along:.2f} x "
                        f"{2 * a.half_across:.2f} and {2 * b.half_along:.2f} x {2 * b.half_across:.2f} m: change the pose of one"
                    )


def _ground(places: Places, station: Station, parts: int) -> list[Rectangle]:
    """The ground that a station covers: its machine's body, and a part with the gripper around each spot in use."""
    along, across = places.room(station)

    def around(spot: Spot) -> Rectangle:
        return Rectangle(spot.x, spot.y, along, across, spot.yaw)

    spots = places.spots(station)
    areas = [around(spot) for spot in (spots if station.places is not None else spots[:parts])]
    return [*areas, places.body(station, parts)] if station.kind == "machine" else areas
