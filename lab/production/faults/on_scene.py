"""Faults that strike machines, obstacles, stations and the camera."""

from math import pi

import numpy as np

from lab.production.faults.fault import GROUND_M, Fault, Happened, out_of_sight
from lab.production.faults.where import (
    AT_STATION_M,
    CLEAR_M,
    UP,
    around,
    distance,
    is_clear,
    is_robot_away,
    parts_of,
    stack_of,
    stand,
)
from lab.production.floor import Floor
from lab.sim import models
from lab.sim.scene.places import Rectangle
from lab.sim.scene.scene import MARKER, MARKER_ABOVE, TABLE, Scene, in_grid
from lab.sim.scene.scene_check import places_of
from lab.tasks.task import Order, Task

SLOWER, OBSTACLE_M, STATION_M, BLIND_S = 1.5, 0.06, 0.02, (10.0, 60.0)
BOX_M = (0.06, 0.06, 0.34)  # as high as the paths between stations
BOX_RGBA = (0.75, 0.25, 0.2, 1.0)
ROOM_M = 0.05  # room around stations that a drawn box leaves
OUT_OF_THE_WAY_M = 0.15  # least distance of the robot when a hand moves a fixed body
DRAWS = 60


def machines_of(task: Task) -> list[str]:
    """The machines that parts are brought to."""
    return [station.name for station in task.stations if station.kind == "machine" and task.kinds_at(station.name)]


def one_of(names: list[str], rng: np.random.Generator) -> str:
    """A drawn name."""
    return names[int(rng.integers(len(names)))]


def any_way(far_m: float, rng: np.random.Generator) -> tuple[float, float]:
    """An offset of length `far_m` [m] in a drawn direction."""
    way = rng.uniform(0, 2 * pi)
    return (round(far_m * float(np.cos(way)), 3), round(far_m * float(np.sin(way)), 3))


class MachineSlow(Fault):
    """A machine takes longer from now on."""

    what = "machine slow"
    help = "a machine takes half as long again"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """One of the machines."""
        machines = machines_of(task)
        return {"station": one_of(machines, rng), "share": SLOWER} if machines else None

    def strikes(self, floor: Floor) -> Happened:
        """The machine takes longer from now on; this may strike at any time."""
        station, share = str(self.fields.station), self.fields.share or SLOWER
        floor.machines[station].slow_down(share, floor.now_s)
        words = f"'{station}' takes {share:g} times as long"
        return Happened(self.what, words, floor.now_s, station=station)


class MachineFails(Fault):
    """A machine never finishes from now on."""

    what = "machine fails"
    help = "a machine never gets done"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """One of the machines."""
        machines = machines_of(task)
        return {"station": one_of(machines, rng)} if machines else None

    def strikes(self, floor: Floor) -> Happened:
        """The machine fails now; this may strike at any time."""
        station = str(self.fields.station)
        floor.machines[station].fail(floor.now_s)
        return Happened(self.what, f"'{station}' does not get done", floor.now_s, station=station)


class ObstaclePut(Fault):
    """A box is put on the table."""

    what = "obstacle put"
    help = "a box is put where the robot passes"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """A place in the workspace, clear of stations, obstacles and the cameras' grids; None if no such place was drawn."""
        places, grid = places_of(task), task.workspace
        kept = [room for _, room in places.kept_free(len(order))]
        for obstacle in task.obstacles:
            (a, b), (x, y), (i, j, _) = obstacle.area, obstacle.position_m, obstacle.size
            kept.append(Rectangle(x, y, a + i / 2, b + j / 2, obstacle.yaw))
        nearest = 0.3  # [m] distance from the robot's foot
        for _ in range(DRAWS):
            x, y = (
                round(low + float(rng.random()) * count * cell, 3)
                for low, count, cell in zip(grid.lower_m[:2], grid.shape[:2], grid.cell_m[:2], strict=True)
            )
            box = Rectangle(x, y, BOX_M[0] / 2 + ROOM_M, BOX_M[1] / 2 + ROOM_M, 0.0)
            seen = any(in_grid(station.grid, (x, y)) for station in task.stations if station.grid is not None)
            if x * x + y * y > nearest**2 and not seen and not any(room.meets(box) for room in kept):
                return {"at_m": (x, y)}
        return None

    @property
    def name(self) -> str:
        """The name of the box."""
        return f"strange box {self.number}"

    def prepare(self, scene: Scene) -> None:
        """Puts the box below the table, with a marker if a camera must see it."""
        size, (x, y) = self.fields.size_m or BOX_M, out_of_sight(self.number)
        scene.world.box(self.name, size, (x, y, GROUND_M + size[2] / 2), BOX_RGBA)
        self.marked = _in_a_grid(scene.task, self.fields.at_m or (0.0, 0.0))
        if self.marked:
            at = (x, y, GROUND_M + size[2] + MARKER_ABOVE)
            scene.world.disc(f"{self.name}{MARKER}", models.MARKER_RADIUS, models.MARKER_THICK, at, models.MARKER_GREEN)

    def strikes(self, floor: Floor) -> Happened | None:
        """Puts the box on the table; returns None while another body is in its place."""
        (x, y), size, world = self.fields.at_m or (0.0, 0.0), self.fields.size_m or BOX_M, floor.world
        before = world.pose(self.name)[0]
        world.put(self.name, (x, y, size[2] / 2))
        if not (is_clear(floor, [self.name], {TABLE}) and is_robot_away(floor, [self.name])):
            world.put(self.name, before)
            return None
        if self.marked:
            world.put(f"{self.name}{MARKER}", (x, y, size[2] + MARKER_ABOVE))
        words = f"a box was put at ({x:.2f}, {y:.2f}) m"
        return Happened(self.what, words, floor.now_s, obstacle=self.name)


class ObstacleMoved(Fault):
    """An obstacle is moved."""

    what = "obstacle moved"
    help = "an obstacle is moved by 6 cm"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """One of the obstacles that the task says may stand elsewhere."""
        names = [obstacle.name for obstacle in task.obstacles if max(obstacle.area) > 0]
        return {"obstacle": one_of(names, rng), "by_m": any_way(OBSTACLE_M, rng)} if names else None

    def strikes(self, floor: Floor) -> Happened | None:
        """Moves the obstacle to a place with room; returns None while the robot is near."""
        name, world = str(self.fields.obstacle), floor.world
        if not is_robot_away(floor, [name], OUT_OF_THE_WAY_M):
            return None
        at, turn = world.pose(name)
        for dx, dy in around(self.fields.by_m or (OBSTACLE_M, 0.0)):
            world.put(name, (at[0] + dx, at[1] + dy, at[2]), turn)
            if is_clear(floor, [name], {TABLE}) and is_robot_away(floor, [name], CLEAR_M):
                _along(floor, [f"{name}{MARKER}"], dx, dy)
                far = float(np.hypot(dx, dy))
                return Happened(self.what, f"'{name}' was moved by {far:.2f} m", floor.now_s, obstacle=name)
        world.put(name, at, turn)
        return None


class ObstacleGone(Fault):
    """An obstacle is taken away."""

    what = "obstacle gone"
    help = "an obstacle is taken away"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """One of the obstacles that the task says may stand elsewhere."""
        names = [obstacle.name for obstacle in task.obstacles if max(obstacle.area) > 0]
        return {"obstacle": one_of(names, rng)} if names else None

    def strikes(self, floor: Floor) -> Happened | None:
        """Once the robot is away."""
        name, (x, y) = str(self.fields.obstacle), out_of_sight(self.number)
        if not is_robot_away(floor, [name], OUT_OF_THE_WAY_M):
            return None
        for body in (name, f"{name}{MARKER}"):
            if body in floor.world.names():
                at, turn = floor.world.pose(body)
                floor.world.put(body, (x, y, at[2] + GROUND_M), turn)
        return Happened(self.what, f"'{name}' was taken away", floor.now_s, obstacle=name)


class StationMoved(Fault):
    """A machine is pushed, with all parts in it."""

    what = "station moved"
    help = "a machine is pushed by 2 cm"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """One of the machines that are approached through a camera's grid; if there are none, any machine."""
        machines = machines_of(task)
        seen = [name for name in machines if task.station(name).grid is not None]
        return {"station": one_of(seen or machines, rng), "by_m": any_way(STATION_M, rng)} if machines else None

    def strikes(self, floor: Floor) -> Happened | None:
        """Moves the station in a direction with room, once the robot is away."""
        name, world = str(self.fields.station), floor.world
        if not is_robot_away(floor, [name], OUT_OF_THE_WAY_M):
            return None
        inside = [body for part in parts_of(floor) if _is_at(floor, part, name) for body in stack_of(floor, part)]
        at, turn = world.pose(name)
        for dx, dy in around(self.fields.by_m or (STATION_M, 0.0)):
            world.put(name, (at[0] + dx, at[1] + dy, at[2]), turn)
            if is_clear(floor, [name], {TABLE, *inside}):
                _along(floor, [f"{name}{MARKER}", *inside], dx, dy)
                far = float(np.hypot(dx, dy))
                return Happened(self.what, f"'{name}' was moved by {far:.3f} m", floor.now_s, station=name)
        world.put(name, at, turn)
        return None


class StationFull(Fault):
    """A strange part stands where a part must be set down."""

    what = "station full"
    help = "a part of no order stands on a station's free spot"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """Any station except those where parts begin."""
        begins = {task.starts(kind) for kind in order}
        names = [
            station.name for station in task.stations if station.name not in begins and task.kinds_at(station.name)
        ]
        return {"station": one_of(names, rng)} if names else None

    @property
    def name(self) -> str:
        """The name of the part."""
        return f"strange part {self.number}"

    def prepare(self, scene: Scene) -> None:
        """Puts the part, without a pallet, below the table."""
        station = scene.task.station(str(self.fields.station))
        self.kind = next(iter(scene.task.kinds_at(station.name))).name
        own = scene.kinds[self.kind]
        x, y = out_of_sight(self.number)
        scene.world.part(
            self.name, own.shape, own.part.mass_kg, own.part.friction, (x, y, GROUND_M + own.shape.foot_m + 0.001)
        )
        scene.kind_of[self.name] = own

    def strikes(self, floor: Floor) -> Happened | None:
        """Puts the part on the first free spot."""
        scene, station = floor.scene, floor.scene.task.station(str(self.fields.station))
        others = [name for name in scene.kind_of if name != self.name]
        before = floor.world.pose(self.name)
        for spot in scene.places.spots(station):
            stand(floor, [self.name], (spot.x, spot.y, spot.z + 0.001), spot.yaw, UP)
            near = [floor.world.nearest(self.name, other, CLEAR_M) for other in others]
            if min(near, default=CLEAR_M) >= CLEAR_M and is_robot_away(floor, [self.name]):
                words = f"{self.name} was put on '{station.name}'"
                return Happened(self.what, words, floor.now_s, self.name, station.name)
            floor.world.put(self.name, *before)
        return None


class CameraBlind(Fault):
    """A hand covers the camera."""

    what = "camera blind"
    help = "the camera sees nothing for a while"

    @classmethod
    def drawn(cls, task: Task, order: Order, rng: np.random.Generator) -> dict[str, object] | None:
        """A duration of 10 to 60 s."""
        return None if task.camera is None else {"seconds": round(float(rng.uniform(*BLIND_S)), 1)}

    def strikes(self, floor: Floor) -> Happened:
        """The camera is covered now; this may strike at any time."""
        floor.world.dark = True
        seconds = self.fields.seconds or BLIND_S[0]
        self.until_s = floor.now_s + seconds
        return Happened(self.what, f"the camera saw nothing for {seconds:g} s", floor.now_s)

    def end(self, floor: Floor) -> None:
        """Uncovers the camera."""
        floor.world.dark = False


def _in_a_grid(task: Task, at: tuple[float, float]) -> bool:
    return any(in_grid(station.grid, at) for station in task.stations if station.grid is not None)


def _is_at(floor: Floor, part: str, station: str) -> bool:
    x, y, z = floor.world.pose(part)[0]
    return part != floor.bench.held and z > -0.1 and distance(floor, station, (float(x), float(y))) < AT_STATION_M


def _along(floor: Floor, bodies: list[str], dx: float, dy: float) -> None:
    """Moves bodies by the same offset as their support."""
    for body in bodies:
        if body in floor.world.names():
            (x, y, z), turn = floor.world.pose(body)
            floor.world.put(body, (x + dx, y + dy, z), turn)
