"""The cell of a task: what the seed draws, where slices stand, and stations that the arm cannot serve."""

from itertools import combinations
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sim import models
from lab.sim.arm_models import arm_named
from lab.sim.scene import (
    APPLIER_BASE,
    SLAB,
    Layout,
    Rectangle,
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
from lab.tasks.task_file import Obstacle, Station, Task

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
            assert apart[0] > models.SLICE[0] + 0.01 or apart[1] > models.SLICE[1] + 0.03
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
        assert all(arm_named("up6").inverse(spot.grasp()) is not None for spot in spots(station))


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
        at = (spot.x + off[0], spot.y + off[1], spot.z + models.SLICE[2] / 2)
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
    assert z == pytest.approx(models.TOASTER[2] + 0.002)
    assert y == pytest.approx(0.1)
    assert models.TOASTER_SLOT[1] / 2 + models.MARKER_RADIUS < 0.9 - x < models.TOASTER[1] / 2 - models.MARKER_RADIUS


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


def with_obstacle(task: Task, at: tuple[float, float], area: tuple[float, float] = (0.0, 0.0)) -> Task:
    """The task with one obstacle only, 6 cm a side."""
    return task.model_copy(update={"obstacles": (Obstacle(name="brick", position_m=at, area=area),)})


@pytest.mark.parametrize(
    ("station", "at"),
    [
        ("plate", (0.07, 0.80)),
        ("plate", (0.0, 0.80)),
        ("finished_plate", (-0.07, -0.80)),
        ("toaster_buffer", (0.42, 0.66)),  # its fourth spot
        ("butter_buffer", (0.32, -0.56)),  # beside the slice, in the gripper's way
        ("toaster", (0.975, 0.175)),
        ("toaster", (1.09, 0.175)),
        ("butter_applier", (0.80, -0.66)),
    ],
)
def test_an_obstacle_on_a_station_is_refused_by_both_names(task: Task, station: str, at: tuple[float, float]) -> None:
    with pytest.raises(BadInput, match=rf"obstacle 'brick' stands on station '{station}' or too near .* at \("):
        drawn(with_obstacle(task, at), 1, 3)


@pytest.mark.parametrize("at", [(0.42, 0.76), (0.31, -0.56), (1.11, 0.175), (0.80, -0.80), (0.60, 0.0), (0.0, 0.6)])
def test_an_obstacle_beside_a_station_is_not(task: Task, at: tuple[float, float]) -> None:
    assert drawn(with_obstacle(task, at), 1, 3).obstacles == (at,)


def test_only_spots_that_the_toasts_need_are_kept_free(task: Task) -> None:
    far = with_obstacle(task, (0.0, 0.6))
    drawn(far, 4, 3)
    with pytest.raises(BadInput, match="obstacle 'brick' stands on station 'plate'"):
        drawn(far, 50, 3)


def test_a_machine_is_kept_free_as_it_is_turned(task: Task) -> None:
    """Turned by 90 degrees, the applier's long base lies along +x of its groove instead of along -y."""
    x, y, _ = task.station("butter_applier").pose
    turned = moved(task, "butter_applier", pose=(x, y, np.pi / 2))
    out = APPLIER_BASE[1] / 2 - APPLIER_BASE[2]
    drawn(with_obstacle(turned, (x, y - 0.2)), 1, 3)
    drawn(with_obstacle(turned, (x + out + 0.031, y)), 1, 3)
    with pytest.raises(BadInput, match="obstacle 'brick' stands on station 'butter_applier'"):
        drawn(with_obstacle(turned, (x + out + 0.029, y)), 1, 3)


def test_the_appliers_base_is_as_large_as_its_model(task: Task, world: World) -> None:
    Scene(world, task, 1, drawn(task, 1, 3))
    world.step()
    x, y, _ = task.station("butter_applier").pose
    for side_x, side_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        for inside in (True, False):
            off = 0.002 if inside else -0.002
            at_x = x + side_x * (APPLIER_BASE[0] / 2 - off)
            at_y = y + APPLIER_BASE[2] + side_y * (APPLIER_BASE[1] / 2 - off)
            hit = world.ray((at_x, at_y, 0.3), (at_x, at_y, -0.2))
            assert hit is not None
            assert (hit[0] == "butter_applier") is inside


@pytest.mark.parametrize("toasts", [1, 4, 12, 50])
def test_the_shipped_task_can_always_be_laid_out(task: Task, toasts: int) -> None:
    for seed in range(20):
        drawn(task, toasts, seed)


def test_an_obstacle_drawn_onto_a_station_is_drawn_again(task: Task) -> None:
    """About a third of these places are too near to the buffer's fourth spot, at y = 0.67 m."""
    wide = with_obstacle(task, (0.42, 0.76), (0.0, 0.1))
    ys = [drawn(wide, 1, seed).obstacles[0][1] for seed in range(50)]
    assert min(ys) >= 0.56 + 0.11 + 0.05 + 0.03
    assert max(ys) > 0.84


def test_rectangles_meet_by_hand() -> None:
    """A square of side 2 reaches 1 along its axes and sqrt(2) along its diagonal."""
    square = Rectangle(0.0, 0.0, 1.0, 1.0, 0.0)
    assert square.meets(Rectangle(1.9, 0.0, 1.0, 1.0, 0.0))
    assert not square.meets(Rectangle(2.1, 0.0, 1.0, 1.0, 0.0))
    assert square.meets(Rectangle(2.3, 0.0, 1.0, 1.0, np.pi / 4))
    assert not square.meets(Rectangle(2.5, 0.0, 1.0, 1.0, np.pi / 4))
    assert not square.meets(Rectangle(1.8, 1.8, 1.0, 1.0, np.pi / 4))  # boxes around both would overlap
    assert square.meets(Rectangle(0.0, 0.0, 5.0, 0.1, 1.0))


@given(*[st.floats(-3, 3)] * 3, *[st.floats(0.01, 2)] * 4, *[st.floats(-7, 7)] * 2)
def test_meeting_is_mutual(
    x: float, y: float, z: float, a: float, b: float, c: float, d: float, e: float, f: float
) -> None:
    one, other = Rectangle(0.0, z, a, b, e), Rectangle(x, y, c, d, f)
    assert one.meets(other) == other.meets(one)
    assert one.meets(Rectangle(0.0, z, c, d, f))
