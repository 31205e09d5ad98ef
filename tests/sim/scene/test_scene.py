"""The cell of a task in physics: everything is there, stands as it was put, and pallets come with their parts."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from lab.sim import models
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot
from lab.sim.scene.places import SLAB, Layout
from lab.sim.scene.scene import Scene, in_grid, marker_of, pallet_of
from lab.sim.scene.scene_check import check_scene, places_of
from lab.sim.world import World
from lab.tasks.task import Order, Task
from lab.tasks.task_file import load

Moved = Callable[..., Task]
SLICE = (0.12, 0.015, 0.12)  # [m]


def as_written(task: Task, *offs: tuple[float, float, float]) -> Layout:
    """Every obstacle where the file has it, and parts off their spots."""
    return Layout(tuple(o.position_m for o in task.obstacles), offs)


def turned(turn: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return float(2 * np.arctan2(turn[2], turn[3]))


def test_a_built_scene_holds_everything_and_stays_as_it_was_put(task: Task, world: World) -> None:
    order: Order = ("slice", "slice")
    places = places_of(task)
    layout = places.draw(order, np.random.default_rng(4))
    scene = Scene(world, task, order, layout)
    names = {body.name for body in world.bodies()}
    wanted = (
        {"table", "robot", "slice 1", "slice 2"} | {s.name for s in task.stations} | {o.name for o in task.obstacles}
    )
    assert wanted <= names
    assert {"cubes A marker", "cubes B marker", "cubes C marker", "toaster marker"} <= names
    assert "tower left marker" not in names  # the camera's grid does not hold it
    assert set(scene.solid) == {s.name for s in task.stations} | {o.name for o in task.obstacles}
    assert {name: kind.name for name, kind in scene.kind_of.items()} == {"slice 1": "slice", "slice 2": "slice"}
    for _ in range(240):
        world.step()
    for number, off in enumerate(layout.parts, start=1):
        spot = places.spots(task.station("plate"))[number - 1]
        position, turn = world.pose(f"slice {number}")
        at = (spot.x + off[0], spot.y + off[1], spot.z + SLICE[2] / 2)
        assert position == pytest.approx(at, abs=1.5e-3)
        assert turned(turn) == pytest.approx(off[2], abs=5e-3)
    for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
        assert tuple(world.pose(obstacle.name)[0][:2]) == place


def test_parts_that_are_removed_and_added_again_stand_as_before_bit_for_bit(fms: Task, world: World) -> None:
    """Also a part on its pallet, whose two bodies get their old numbers in the engine."""
    scene = Scene(world, fms, (), as_written(fms))
    spot, poses = scene.places.begins(("rook",))[0], []
    for _ in range(2):
        scene.add("rook 1", "rook on pallet", spot)
        for _ in range(40):
            world.step()
        poses.append([world.pose(body) for body in ("rook 1's pallet", "rook 1")])
        scene.remove_parts()
        assert not set(world.names()) & {"rook 1's pallet", "rook 1"}
    assert np.array_equal(
        np.concatenate([*map(np.concatenate, poses[0])]), np.concatenate([*map(np.concatenate, poses[1])])
    )


def test_each_part_is_held_by_a_force_of_its_own(world: World) -> None:
    """A slice of 5 g is taken with 150 N/kg, a cup of 1.5 kg in the same task with 61.9 N: 6 x 1.5 kg x 11.01 m/s2 / 1.6."""
    task, masses = load("breakfast"), {"slice": 0.005, "cup": 1.5}
    parts = tuple(part.model_copy(update={"mass_kg": masses[part.name]}) for part in task.parts)
    task = task.changed(parts=parts, robot=task.robot.model_copy(update={"grip_force_n": None}))
    check_scene(task)
    scene = Scene(world, task, (), as_written(task))
    assert scene.grips_n["slice"] == pytest.approx(0.75)
    assert scene.grips_n["cup"] == pytest.approx(61.9, abs=0.1)
    assert scene.robot.grip_force == scene.grips_n["cup"]


@pytest.mark.parametrize(("name", "order"), [("breakfast", ("slice", "cup")), ("fms-arm", ("rook", "sign", "rook"))])
def test_parts_of_every_kind_stand_on_the_spots_where_they_begin(name: str, order: Order, world: World) -> None:
    task = load(name)
    scene = Scene(world, task, order, as_written(task, *[(0.0, 0.0, 0.0)] * len(order)))
    for _ in range(240):
        world.step()
    for number, (kind, spot) in enumerate(zip(order, scene.places.begins(order), strict=True), start=1):
        part, pallet = f"{kind} {number}", f"{kind} {number}'s pallet"
        foot = spot if task.part(kind).pallet is None else spot.raised(0.020)
        x, y, z = world.pose(part)[0]
        assert (x, y) == pytest.approx((spot.x, spot.y), abs=1e-3)
        assert z - scene.kind_of[part].shape.foot_m == pytest.approx(foot.z, abs=2e-3)
        assert (pallet in scene.kind_of) is (task.part(kind).pallet is not None)


def test_a_plate_is_under_every_slice_that_may_come(task: Task, world: World) -> None:
    toasts = 9
    scene = Scene(world, task, ("slice",) * toasts, as_written(task, *[(0.0, 0.0, 0.0)] * toasts))
    for number in range(1, toasts + 1):
        world.put(f"slice {number}", (0.0, 0.0, -5.0))
    for station in task.stations:
        if station.kind == "machine":
            continue
        for spot in scene.places.spots(station)[:toasts]:
            hit = world.ray((spot.x, spot.y, 0.2), (spot.x, spot.y, -0.2))
            assert hit is not None
            assert (hit[0], pytest.approx(SLAB, abs=1e-4)) == (station.name, hit[1][2])


# ---- pallets -----------------------------------------------------------------------------------------------------


def test_a_part_on_its_pallet_is_two_bodies_and_the_gripper_holds_the_pallet(fms: Task, world: World) -> None:
    scene = Scene(world, fms, (), as_written(fms))
    names = {"rook": ["rook 1"], "pallet": ["rook 1's pallet"], "rook on pallet": ["rook 1's pallet", "rook 1"]}
    for kind, bodies in names.items():
        assert scene.bodies_of("rook 1", kind) == bodies
        assert scene.body_of("rook 1", kind) == bodies[0]
    assert pallet_of("rook 1") == "rook 1's pallet"


def test_a_pallet_and_its_part_are_stood_on_one_another_off_the_spot_together(fms: Task, world: World) -> None:
    scene = Scene(world, fms, (), as_written(fms))
    scene.add("sign 3", "sign on pallet", Spot(0.42, 0.68, 0.012, np.pi / 2), (0.02, 0.01, 0.1))
    assert {name: kind.name for name, kind in scene.kind_of.items()} == {"sign 3": "sign", "sign 3's pallet": "pallet"}
    for _ in range(120):
        world.step()
    for body, middle in (("sign 3's pallet", 0.010), ("sign 3", 0.020 + 0.022)):
        position, turn = world.pose(body)
        assert position == pytest.approx((0.42 - 0.01, 0.68 + 0.02, 0.012 + middle), abs=1.5e-3)
        assert turned(turn) == pytest.approx(np.pi / 2 + 0.1, abs=5e-3)
    assert world.touching("sign 3", "sign 3's pallet")


def test_put_moves_a_part_and_all_that_is_carried_with_it_to_where_the_tool_would_hold_it(
    fms: Task, world: World
) -> None:
    """The gripper's tips are 5 mm above the pallet's foot; the pallet is 20 mm high, and the rook 50 mm."""
    scene = Scene(world, fms, (), as_written(fms))
    scene.add("rook 1", "rook on pallet", Spot(0.42, 0.68, 0.012, 0.0))
    scene.put("rook 1", "rook on pallet", ToolPose(0.5, 0.1, 0.305, 0.3))
    for body, middle in (("rook 1's pallet", 0.010), ("rook 1", 0.020 + 0.025)):
        position, turn = world.pose(body)
        assert position == pytest.approx((0.5, 0.1, 0.300 + middle))
        assert turned(turn) == pytest.approx(0.3)
    scene.put("rook 1", "rook", ToolPose(0.6, 0.1, 0.32, 0.0))  # lifted off: held 20 mm above its own foot
    assert world.pose("rook 1")[0] == pytest.approx((0.6, 0.1, 0.3 + 0.025))
    assert world.pose("rook 1's pallet")[0] == pytest.approx((0.5, 0.1, 0.310))
    assert world.steps == 0


# ---- markers -----------------------------------------------------------------------------------------------------


def test_the_toasters_marker_is_on_its_top_beside_the_slot(task: Task, moved: Moved) -> None:
    station = moved(task, "toaster", pose=(0.9, 0.1, np.pi / 2)).station("toaster")
    assert station.grid is not None
    x, y, z = marker_of(station, station.grid)
    assert z == pytest.approx(models.TOASTER[2] + 0.002)
    assert y == pytest.approx(0.1)
    assert models.TOASTER_SLOT[1] / 2 + models.MARKER_RADIUS < 0.9 - x < models.TOASTER[1] / 2 - models.MARKER_RADIUS


def test_a_grid_holds_what_is_within_its_borders(task: Task) -> None:
    """12 cells of 5 cm from (0.50, -0.30) on."""
    grid = task.station("toaster").grid
    assert grid is not None
    for place in ((0.50, -0.30), (1.09, 0.29), (0.8, 0.0)):
        assert in_grid(grid, place)
    for place in ((0.49, 0.0), (1.11, 0.0), (0.8, -0.31), (0.8, 0.31)):
        assert not in_grid(grid, place)


def test_with_two_grids_each_machine_and_what_stands_in_either_has_a_marker(world: World) -> None:
    task = load("two-toasters")
    Scene(world, task, (), as_written(task))
    marked = {body.name.removesuffix(" marker") for body in world.bodies() if body.name.endswith(" marker")}
    assert marked == {"toaster-1", "toaster-2", "cubes A", "cubes B", "cubes C"}
    for name in ("toaster-1", "toaster-2"):
        x, y, _ = task.station(name).pose
        assert world.pose(f"{name} marker")[0] == pytest.approx((x, y + 0.03825, 0.1 + 0.002))


def test_stations_look_and_grip_alike_by_kind(fms: Task, world: World) -> None:
    Scene(world, fms, (), as_written(fms))
    colors = {body.name: body.shapes[0].rgba for body in world.bodies() if body.shapes}
    for kind in ("storage", "buffer", "machine"):
        names = [station.name for station in fms.stations if station.kind == kind]
        assert all(colors[a] == colors[b] for a, b in pairwise(names))
    assert len({colors[name] for name in ("incoming", "mill-in", "mill")}) == 3
