"""The cell of a task: what the seed draws, where slices stand, and stations that the arm cannot serve."""

from itertools import combinations
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sim import assets
from lab.sim.kinematics import inverse
from lab.sim.scene import (
    SLAB,
    Layout,
    Scene,
    Spot,
    check_apart,
    check_scene,
    draw_layout,
    floor,
    marker_of_toaster,
    spots,
)
from lab.sim.world import World
from lab.taskfile import Station, Task

seeds = st.integers(0, 2**63)


def drawn(task: Task, toasts: int, seed: int) -> Layout:
    return draw_layout(task, toasts, np.random.default_rng(seed))


def moved(task: Task, name: str, **changed: object) -> Task:
    """The task with one station changed."""
    stations = tuple(s.model_copy(update=changed) if s.name == name else s for s in task.stations)
    return task.model_copy(update={"stations": stations})


@given(seeds, st.integers(0, 50))
def test_a_layout_stays_within_its_areas(task: Task, seed: int, toasts: int) -> None:
    layout = drawn(task, toasts, seed)
    assert len(layout.obstacles) == len(task.obstacles)
    assert len(layout.slices) == toasts
    for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
        off = np.abs(np.subtract(place, obstacle.position_m))
        assert np.all(off <= np.array(obstacle.area) + 1e-12)
    assert np.all(np.abs(np.array(layout.slices).reshape(-1, 3)) <= task.slices.area)


def test_a_layout_is_the_seeds_and_fills_its_areas(task: Task) -> None:
    assert drawn(task, 3, 5) == drawn(task, 3, 5)
    assert drawn(task, 3, 5) != drawn(task, 3, 6)
    offs = np.array([drawn(task, 1, seed).slices[0] for seed in range(200)])
    assert np.all(offs.max(axis=0) > 0.9 * np.array(task.slices.area))
    assert np.all(offs.min(axis=0) < -0.9 * np.array(task.slices.area))


def test_the_obstacles_do_not_depend_on_how_many_toasts(task: Task) -> None:
    assert drawn(task, 1, 9).obstacles == drawn(task, 4, 9).obstacles


def test_without_areas_everything_stands_where_the_file_says(task: Task) -> None:
    still = tuple(o.model_copy(update={"area": (0.0, 0.0)}) for o in task.obstacles)
    slices = task.slices.model_copy(update={"area": (0.0, 0.0, 0.0)})
    layout = drawn(task.model_copy(update={"obstacles": still, "slices": slices}), 2, 1)
    assert layout.obstacles == tuple(o.position_m for o in task.obstacles)
    assert layout.slices == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_every_station_has_as_many_spots_as_it_holds(task: Task) -> None:
    for station in task.stations:
        found = spots(station)
        assert len(found) == station.capacity
        assert all(spot.z == floor(station) and spot.yaw == station.pose[2] for spot in found)
        for one, other in combinations(found, 2):
            apart = abs(one.x - other.x), abs(one.y - other.y)
            assert apart[0] > assets.SLICE[0] + 0.01 or apart[1] > assets.SLICE[1] + 0.03
        nearest = min(hypot(s.x - station.pose[0], s.y - station.pose[1]) for s in found)
        assert hypot(found[0].x - station.pose[0], found[0].y - station.pose[1]) == pytest.approx(nearest)


def test_spots_turn_with_their_station() -> None:
    station = Station(name="plate", kind="storage", pose=(1.0, 2.0, np.pi / 2), capacity=2)
    first, second = spots(station)
    assert (first.x, first.y, first.yaw) == pytest.approx((1.0, 2.0 - 0.07, np.pi / 2))
    assert (second.x, second.y) == pytest.approx((1.0, 2.0 + 0.07))
    assert first.z == SLAB


def test_a_slices_grasp_is_below_its_top() -> None:
    pose = Spot(0.5, 0.1, 0.02, 0.3).grasp()
    assert (pose.x, pose.y, pose.z, pose.yaw) == pytest.approx((0.5, 0.1, 0.02 + 0.12 - 0.03, 0.3))


@pytest.mark.parametrize("name", ["plate", "toaster_buffer", "toaster", "butter_applier", "finished_plate"])
@pytest.mark.parametrize("pose", [(1.5, 0.6, 0.0), (0.1, 0.1, 0.0), (-0.7, 0.0, 0.0)])
def test_a_station_out_of_reach_is_refused_by_name(task: Task, name: str, pose: tuple[float, float, float]) -> None:
    with pytest.raises(BadInput, match=rf"station '{name}' is out of reach: its spot at \(.*m from the robot; the arm"):
        check_scene(moved(task, name, pose=pose))


def test_what_check_scene_passes_the_arm_reaches(task: Task) -> None:
    check_scene(task)
    for station in task.stations:
        assert all(inverse(spot.grasp()) is not None for spot in spots(station))


def test_a_machine_for_two_is_refused(task: Task) -> None:
    with pytest.raises(BadInput, match="machine 'toaster' has the capacity 2: the machines of this cell hold 1 slice"):
        check_scene(moved(task, "toaster", capacity=2))


def test_a_workspace_that_sweeps_slices_away_is_refused(task: Task) -> None:
    x, y, z = task.workspace.lower_m
    low = task.workspace.model_copy(update={"lower_m": (x, y, z - 0.1)})
    with pytest.raises(BadInput, match="would sweep a carried slice through standing ones"):
        check_scene(task.model_copy(update={"workspace": low}))


def test_a_built_scene_holds_everything_and_stays_as_it_was_put(task: Task, world: World) -> None:
    layout = drawn(task, 2, 4)
    scene = Scene(world, task, 2, layout)
    names = {body.name for body in world.bodies()}
    wanted = (
        {"table", "robot", "slice 1", "slice 2"} | {s.name for s in task.stations} | {o.name for o in task.obstacles}
    )
    assert wanted <= names
    assert {"cubes A marker", "cubes B marker", "cubes C marker", "toaster marker"} <= names
    assert "tower left marker" not in names  # the camera's grid does not hold it
    assert set(scene.solid) == {s.name for s in task.stations} | {o.name for o in task.obstacles}
    for _ in range(240):
        world.step()
    for number, off in enumerate(layout.slices, start=1):
        spot = spots(task.station("plate"))[number - 1]
        position, turn = world.pose(f"slice {number}")
        at = (spot.x + off[0], spot.y + off[1], spot.z + assets.SLICE[2] / 2)
        assert position == pytest.approx(at, abs=1.5e-3)
        assert 2 * np.arctan2(turn[2], turn[3]) == pytest.approx(off[2], abs=5e-3)
    for obstacle, place in zip(task.obstacles, layout.obstacles, strict=True):
        assert tuple(world.pose(obstacle.name)[0][:2]) == place


def test_a_plate_is_under_every_slice_that_may_come(task: Task, world: World) -> None:
    toasts = 9
    Scene(world, task, toasts, Layout(tuple(o.position_m for o in task.obstacles), ()))
    for station in task.stations:
        if station.kind == "machine":
            continue
        for spot in spots(station)[:toasts]:
            hit = world.ray((spot.x, spot.y, 0.2), (spot.x, spot.y, -0.2))
            assert hit is not None
            assert (hit[0], pytest.approx(SLAB, abs=1e-4)) == (station.name, hit[1][2])


def test_the_toasters_marker_is_on_its_top_beside_the_slot(world: World) -> None:
    station = Station(
        name="toaster", kind="machine", pose=(0.9, 0.1, np.pi / 2), capacity=1, processing_s=1.0, process=None
    )
    x, y, z = marker_of_toaster(station)
    assert z == pytest.approx(assets.TOASTER[2] + 0.002)
    assert y == pytest.approx(0.1)
    assert assets.TOASTER_SLOT[1] / 2 + assets.MARKER_RADIUS < 0.9 - x < assets.TOASTER[1] / 2 - assets.MARKER_RADIUS


def test_a_second_toaster_is_refused(task: Task) -> None:
    second = task.station("toaster").model_copy(update={"name": "grill", "pose": (0.8, 0.4, 0.0)})
    with pytest.raises(
        BadInput, match=r"machines 'toaster' and 'grill' both have processing_s: .* leads to one toaster"
    ):
        check_scene(task.model_copy(update={"stations": (*task.stations, second)}))


def test_a_way_so_low_that_the_slice_would_hit_the_toaster_is_refused(task: Task) -> None:
    low = task.insert.model_copy(update={"height_m": 0.19})
    with pytest.raises(
        BadInput, match=r"insert\.height_m 0\.19: a carried slice would hit the toaster, at least 0\.195"
    ):
        check_scene(task.model_copy(update={"insert": low}))


def test_slices_of_neighbouring_stations_must_not_meet(task: Task) -> None:
    """0.2 m along y the buffer's slots come within a row of each other once three toasts are under way."""
    check_apart(task, 50)
    x, y, yaw = task.station("toaster_buffer").pose
    near = moved(task, "butter_buffer", pose=(x, y - 0.2, yaw))
    check_apart(near, 1)
    with pytest.raises(
        BadInput, match="stations 'toaster_buffer' and 'butter_buffer' overlap: with 4 toasts, slices may"
    ):
        check_apart(near, 4)
