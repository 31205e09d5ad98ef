"""Surveys: made once, true to the scene, and changed exactly where the scene changed."""

import numpy as np
import pytest

from lab.errors import BadInput
from lab.mdp import greedy_path, optimal_values
from lab.sim.models import SLICE as SIZE
from lab.sim.scene import GRASP_DEPTH, Layout, spots
from lab.skills import Insert
from lab.skills.skillset import SkillSet
from lab.skills.surveys import INSERT_START, NEAR_SHAPE, NEAR_YAWS, Surveys, camera_view, overhead_camera
from lab.tasks.task_file import Obstacle, Task
from lab.vision import see


def signatures(surveys: Surveys) -> dict[str, str]:
    skillset = SkillSet.of(surveys.task, 1)
    return {name: skill.setup(surveys).mdp.signature for name, skill in skillset.skills.items()}


@pytest.fixture(scope="module")
def before(surveys: Surveys) -> dict[str, str]:
    return signatures(surveys)


def with_obstacle_moved(surveys: Surveys, name: str, dx: float, dy: float) -> Surveys:
    places = []
    for obstacle, (x, y) in zip(surveys.task.obstacles, surveys.layout.obstacles, strict=True):
        places.append((x + dx, y + dy) if obstacle.name == name else (x, y))
    return Surveys(surveys.task, Layout(tuple(places), ()))


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    assert before.keys() == after.keys()
    return {name for name in before if before[name] != after[name]}


@pytest.mark.parametrize(
    ("name", "dx", "dy"), [("cubes A", 0.05, 0.0), ("cubes A", 0.0, -0.05), ("tower left", -0.12, 0.0)]
)
def test_a_moved_obstacle_changes_exactly_the_problems_whose_cells_it_changes(
    name: str, dx: float, dy: float, surveys: Surveys, before: dict[str, str]
) -> None:
    moved = with_obstacle_moved(surveys, name, dx, dy)
    found = changed(before, signatures(moved))
    expected = set()
    for loaded in (False, True):
        if not np.array_equal(surveys.workspace(loaded).blocked, moved.workspace(loaded).blocked):
            expected |= {n for n in before if n.startswith("transfer") and n.endswith("with slice") is loaded}
    if name == "cubes A":  # the camera sees it; the tower stands outside of its grid
        expected.add("insert at toaster")
    assert found == expected
    assert not any(n.startswith(("grasp", "butter", "place")) for n in found)
    assert found


def test_a_nudge_within_the_cells_changes_nothing(surveys: Surveys, before: dict[str, str]) -> None:
    assert changed(before, signatures(with_obstacle_moved(surveys, "cubes A", 0.001, 0.001))) == set()


def test_a_moved_station_changes_its_own_transfers(task: Task, layout: Layout, before: dict[str, str]) -> None:
    stations = tuple(
        s.model_copy(update={"pose": (0.42, -0.68, 0.0)}) if s.name == "butter_buffer" else s for s in task.stations
    )
    after = signatures(Surveys(task.model_copy(update={"stations": stations}), layout))
    found = changed(before, after)
    assert "insert at toaster" not in found
    assert not any(n.startswith(("grasp", "butter at", "place")) for n in found)
    assert {n for n in before if n.startswith("transfer") and " butter_buffer" in n} <= found


def test_every_survey_is_made_once(surveys: Surveys) -> None:
    assert surveys.workspace(True) is surveys.workspace(True)
    assert surveys.around("plate", False) is surveys.around("plate", False)
    assert surveys.picture() is surveys.picture()
    assert surveys.layout.slices == ()


def test_cells_are_tool_poses_in_the_work_space(surveys: Surveys, task: Task) -> None:
    grid = task.workspace
    first, last = (
        surveys.cell_pose((0, 0, 0)),
        surveys.cell_pose((grid.shape[0] - 1, grid.shape[1] - 1, grid.shape[2] - 1)),
    )
    for low, size, count, one, other in zip(
        grid.lower_m, grid.cell_m, grid.shape, (first.x, first.y, first.z), (last.x, last.y, last.z), strict=True
    ):
        assert one == pytest.approx(low + size / 2)
        assert other == pytest.approx(low + (count - 0.5) * size)


def test_a_station_is_docked_at_from_a_free_cell_beside_it(surveys: Surveys, task: Task) -> None:
    for place in [s.name for s in task.stations] + [INSERT_START]:
        for loaded in (False, True):
            cell = surveys.dock(place, loaded)
            pose, approach = surveys.cell_pose(cell), surveys.approach(place)
            assert not surveys.workspace(loaded).blocked[cell]
            assert np.hypot(pose.x - approach.x, pose.y - approach.y) <= 1.6 * max(task.workspace.cell_m[:2])


def test_around_a_slice_the_goal_is_free_and_what_stands_beside_blocks(surveys: Surveys) -> None:
    empty = surveys.around("plate", False)
    assert empty.causes.shape == (*NEAR_SHAPE, NEAR_YAWS)
    assert not empty.blocked[2, 2, 0, NEAR_YAWS // 2]
    assert set(np.unique(empty.causes)) >= {"slice behind", "slice in front"}
    alone = surveys.around("toaster", False)  # a machine holds one slice
    assert set(np.unique(alone.causes)) == {"", "the slice"}
    assert all(empty.blocked[:, 0, 0, :].ravel())  # 2.4 cm aside a finger would stand in a slice
    loaded = surveys.around("plate", True)
    assert loaded.causes.shape == NEAR_SHAPE
    assert not loaded.blocked[2, 2, 0]
    assert not loaded.blocked[:, :, -1].any()


def test_what_the_camera_sees_is_where_it_stands(surveys: Surveys, task: Task) -> None:
    seen = see(surveys.picture(), camera_view(task))
    kinds = [m.kind for m in seen.markers]
    assert kinds.count("obstacle") == 3
    for marker in seen.markers:
        if marker.kind == "gripper":
            at = task.insert.start_m
        elif marker.kind == "toaster":
            at = task.station("toaster").pose[:2]
        else:
            at = min(surveys.layout.obstacles, key=lambda p: np.hypot(*np.subtract(p, marker.world_m)))
        assert np.hypot(*np.subtract(at, marker.world_m)) < 2e-3
    assert surveys.picture().shape == (task.camera.pixels, task.camera.pixels, 3)
    assert overhead_camera(task, 100).width == 100


def test_a_turned_toaster_is_seen_in_its_place_too(task: Task) -> None:
    stations = tuple(
        s.model_copy(update={"pose": (0.9, 0.1, 0.7)}) if s.name == "toaster" else s for s in task.stations
    )
    bare = task.model_copy(update={"stations": stations, "obstacles": ()})
    seen = see(Surveys(bare, Layout((), ())).picture(), camera_view(bare))
    toaster = next(m for m in seen.markers if m.kind == "toaster")
    assert toaster.world_m == pytest.approx((0.9, 0.1), abs=2e-3)


def test_cubes_of_several_heights_in_the_picture_are_refused(task: Task) -> None:
    made = (
        Obstacle(name="low", position_m=(0.725, -0.075), cubes=2),
        Obstacle(name="high", position_m=(0.775, 0.075), cubes=3),
        Obstacle(name="far", position_m=(0.2, 0.9), cubes=9),
    )
    with pytest.raises(
        BadInput, match=r"obstacles in the camera's grid must be equally high, got \[0\.122, 0\.182\] m"
    ):
        camera_view(task.model_copy(update={"obstacles": made}))
    camera_view(task.model_copy(update={"obstacles": made[1:]}))


def test_a_start_out_of_reach_is_refused(task: Task, layout: Layout) -> None:
    far = task.insert.model_copy(update={"start_m": (1.6, 0.0)})
    with pytest.raises(BadInput, match=r"insert\.start_m \[1\.6, 0\.0\]: out of the arm's reach"):
        Surveys(task.model_copy(update={"insert": far}), layout).picture()


def test_a_scene_that_cannot_be_is_refused_at_once(task: Task, layout: Layout) -> None:
    stations = tuple(
        s.model_copy(update={"pose": (1.5, 0.0, 0.0)}) if s.name == "toaster" else s for s in task.stations
    )
    with pytest.raises(BadInput, match="station 'toaster' is out of reach"):
        Surveys(task.model_copy(update={"stations": stations}), layout)


def test_the_carried_slice_hangs_above_the_standing_ones(surveys: Surveys) -> None:
    assert surveys.approach("plate").z + GRASP_DEPTH - SIZE[2] > 0.012 + SIZE[2] + 0.01


def test_a_start_with_a_cube_in_the_way_of_the_slice_is_refused(task: Task) -> None:
    x, y = task.insert.start_m
    near = Obstacle(name="cube", position_m=(x + 0.08, y), cubes=3)
    beside = Surveys(task.model_copy(update={"obstacles": (near,)}), Layout((near.position_m,), ()))
    with pytest.raises(
        BadInput, match=r"insert\.start_m \[0\.\d+, -0\.\d+\]: cube is in the way of a carried slice there"
    ):
        beside.picture()


def with_buffer_at(task: Task, pose: tuple[float, float, float]) -> Task:
    stations = tuple(s.model_copy(update={"pose": pose}) if s.name == "butter_buffer" else s for s in task.stations)
    return task.model_copy(update={"stations": stations, "obstacles": ()})


def test_waiting_slices_block_the_grid_where_a_carried_one_would_hit_them(task: Task) -> None:
    """The buffer itself is low; the slices that wait in it reach 7 mm above the foot of a carried one."""
    surveys = Surveys(with_buffer_at(task, (0.60, -0.02, 0.0)), Layout((), ()))
    causes = surveys.over_grid(frozenset()).causes
    for spot in spots(surveys.task.station("butter_buffer")):
        steps = zip((spot.x, spot.y), task.insert.origin_m, strict=True)
        cell = tuple(int((at - low) / task.insert.cell_m) for at, low in steps)
        assert causes[cell].startswith("slice ")
        assert causes[cell].endswith(" at butter_buffer")
    problem = Insert("toaster").setup(surveys)
    crossed = {problem.mdp.state_cell(s) for s in greedy_path(optimal_values(problem.mdp, 0.99), problem.mdp, 99)[0]}
    assert not any(causes[cell] for cell in crossed)


def test_slices_that_wait_far_from_the_grid_change_nothing(task: Task, surveys: Surveys) -> None:
    """The shipped stations stand clear of it: the nearest block no cell, and the plates are not even looked at."""
    assert {str(name) for name in np.unique(surveys.over_grid(frozenset()).causes)} <= {
        "",
        "out of reach",
        "cubes A",
        "cubes B",
        "cubes C",
    }
    assert not any("plate" in name for name in surveys._waiting())


def test_a_slice_waits_on_every_spot_that_the_toasts_need(task: Task) -> None:
    roomy = with_buffer_at(task, (0.60, -0.02, 0.0))
    stations = tuple(s.model_copy(update={"capacity": 6}) if s.name == "butter_buffer" else s for s in roomy.stations)
    roomy = roomy.model_copy(update={"stations": stations})
    still = (0.0, 0.0, 0.0)
    for toasts, waiting in ((0, 4), (5, 5), (9, 6)):
        names = Surveys(roomy, Layout((), (still,) * toasts))._waiting()
        assert sum(name.endswith(" at butter_buffer") for name in names) == waiting
        assert sum(name.endswith(" at butter_applier") for name in names) == 1
