"""Surveys: made once, true to the scene, and changed exactly where the scene changed."""

from collections.abc import Sequence

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot, beside
from lab.sim.scene.blocked_cells import OUT_OF_REACH
from lab.sim.scene.places import Layout
from lab.sim.scene.scene_check import places_of
from lab.skills.grasp import GOAL
from lab.skills.prepared_scene import prepare
from lab.skills.skillset import SkillSet
from lab.skills.surveys import (
    INSERT,
    NEAR_SHAPE,
    NEAR_STEP_M,
    NEAR_YAW_STEP,
    NEAR_YAWS,
    Surveys,
    corners,
    grid_of,
    near_pose,
    way_to,
)
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle, Workspace
from lab.tasks.task_file import load

ORDER = ("slice", "slice")


def signatures(surveys: Surveys) -> dict[str, str]:
    skillset = SkillSet.of(surveys.task, ("slice",))
    return {name: skill.setup(surveys).mdp.signature for name, skill in skillset.skills.items()}


@pytest.fixture(scope="module")
def before(surveys: Surveys) -> dict[str, str]:
    return signatures(surveys)


def with_obstacle_moved(surveys: Surveys, name: str, dx: float, dy: float) -> Surveys:
    places = []
    for obstacle, (x, y) in zip(surveys.task.obstacles, surveys.layout.obstacles, strict=True):
        places.append((x + dx, y + dy) if obstacle.name == name else (x, y))
    return Surveys(surveys.task, ORDER, Layout(tuple(places), ()))


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
    for carried in ("", "slice"):
        if not np.array_equal(surveys.workspace(carried).blocked, moved.workspace(carried).blocked):
            expected |= {n for n in before if n.startswith("transfer") and n.endswith("with slice") is bool(carried)}
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
    after = signatures(Surveys(task.changed(stations=stations), ORDER, layout))
    found = changed(before, after)
    assert "insert at toaster" not in found
    assert not any(n.startswith(("grasp", "butter at", "place")) for n in found)
    assert {n for n in before if n.startswith("transfer") and " butter_buffer" in n} <= found


def test_every_survey_is_made_once(surveys: Surveys) -> None:
    assert surveys.workspace("slice") is surveys.workspace("slice")
    assert surveys.around("plate", "slice", False) is surveys.around("plate", "slice", False)
    assert surveys.camera_grid("toaster", "slice") is surveys.camera_grid("toaster", "slice")
    assert surveys.layout.parts == ()


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
    for place in [s.name for s in task.stations] + [INSERT]:
        for carried in ("", "slice"):
            cell = surveys.dock(place, carried)
            pose, approach = surveys.cell_pose(cell), surveys.approach(place)
            assert not surveys.workspace(carried).blocked[cell]
            assert np.hypot(pose.x - approach.x, pose.y - approach.y) <= 1.6 * max(task.workspace.cell_m[:2])


def test_around_a_slice_the_goal_is_free_and_what_stands_beside_blocks(surveys: Surveys) -> None:
    empty = surveys.around("plate", "slice", False)
    assert empty.causes.shape == (*NEAR_SHAPE, NEAR_YAWS)
    assert not empty.blocked[2, 2, 0, NEAR_YAWS // 2]
    assert set(np.unique(empty.causes)) >= {"slice behind", "slice in front"}
    alone = surveys.around("toaster", "slice", False)  # a machine for one
    assert set(np.unique(alone.causes)) == {"", "the part"}
    assert all(empty.blocked[:, 0, 0, :].ravel())  # 2.4 cm aside a finger would stand in a slice
    loaded = surveys.around("plate", "slice", True)
    assert loaded.causes.shape == NEAR_SHAPE
    assert not loaded.blocked[2, 2, 0]
    assert not loaded.blocked[:, :, -1].any()


def test_around_a_part_is_free_what_is_free_on_each_spot_in_use(task: Task) -> None:
    """A pillar beside the second spot of the plate is in nobody's way while there is one slice only."""
    second = places_of(task).spots(task.station("plate"), "slice")[1]
    x, y = beside((second.x, second.y), second.yaw, (0.0, -0.105))
    pillar = Obstacle(name="pillar", position_m=(x, y), cubes=6)
    near = task.changed(obstacles=(pillar,))
    for slices in (1, 2):
        around = Surveys(near, ("slice",) * slices, Layout(((x, y),), ())).around("plate", "slice", False)
        assert ("pillar" in around.causes) is (slices == 2)
        assert not around.blocked[2, 2, 0, NEAR_YAWS // 2]


def test_a_scene_that_cannot_be_is_refused_at_once(task: Task, layout: Layout) -> None:
    """What is out of reach before anything is surveyed, and what cannot be gripped when the kinds are made."""
    stations = tuple(s.model_copy(update={"pose": (1.5, 0.0, 0.0)}) if s.name == "plate" else s for s in task.stations)
    with pytest.raises(BadInput, match="station 'plate' is out of reach"):
        prepare(task.changed(stations=stations), ORDER, 0, "no skill at all")
    wide = task.parts[0].model_copy(update={"size_m": (0.12, 0.06, 0.12), "look": None})
    with pytest.raises(BadInput, match="part 'slice'"):
        Surveys(task.changed(parts=(wide,)), ORDER, layout)


def test_the_carried_slice_hangs_above_the_standing_ones(surveys: Surveys) -> None:
    """A slice is 120 mm high and hangs 90 mm below the tips; what stands has a slab of 12 mm below it."""
    assert surveys.approach("plate").z - 0.090 > 0.012 + 0.120 + 0.01


def test_a_camera_grid_is_a_place_that_transfers_lead_to(task: Task) -> None:
    assert (way_to(task, "toaster"), way_to(task, "plate")) == (INSERT, "plate")
    assert grid_of(task, INSERT) == task.station("toaster").grid
    assert grid_of(task, "toaster") is grid_of(task, "plate") is None
    two = load("two-toasters")
    for name in ("toaster-1", "toaster-2"):
        assert way_to(two, name) == f"{INSERT} at {name}"
        assert grid_of(two, f"{INSERT} at {name}") == two.station(name).grid
    assert grid_of(two, INSERT) is None


# ---- pallets -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def with_pallets(fms: Task) -> Surveys:
    return Surveys(fms, ("rook", "sign"), Layout(tuple(o.position_m for o in fms.obstacles), ()))


def test_a_part_is_lifted_off_its_pallet_and_set_down_on_it(with_pallets: Surveys) -> None:
    """What stands at a place for one is the part and its pallet: nothing beside them is in the way."""
    lifted = with_pallets.around("mill-in", "sign", False)
    assert not lifted.blocked[2, 2, 0, NEAR_YAWS // 2]
    assert set(np.unique(lifted.causes)) <= {"", "the part", "the part's pallet"}
    assert "the part" in lifted.causes
    down = with_pallets.around("mill-in", "sign", True)
    assert not down.blocked[2, 2, 0]
    assert set(np.unique(down.causes)) <= {"", "the part's pallet"}  # the part itself is in the gripper


def test_a_loaded_pallet_is_taken_from_among_others(with_pallets: Surveys) -> None:
    around = with_pallets.around("incoming", "sign on pallet", False)
    assert not around.blocked[2, 2, 0, NEAR_YAWS // 2]
    assert not around.blocked[2, 2, :, NEAR_YAWS // 2].any()
    causes = {str(cause) for cause in np.unique(around.causes)} - {""}
    assert "the part's pallet" in causes
    assert causes <= {"the part", "the part's pallet"} | {name for name in causes if " on pallet " in name}


def test_in_a_machine_a_part_stands_without_its_pallet(with_pallets: Surveys) -> None:
    assert not any("pallet" in str(cause) for cause in np.unique(with_pallets.around("mill", "sign", False).causes))


def test_poses_that_are_not_free_are_named_with_what_is_in_the_way(with_pallets: Surveys) -> None:
    """The control cabinet's middle is at (0.36, 0.26) m."""
    with_pallets.check_free("vacuum", [ToolPose(0.60, 0.0, 0.3)])
    with pytest.raises(BadInput, match=r"^vacuum: at \(0\.36, 0\.26, 0\.20\) m in the way: control cabinet$"):
        with_pallets.check_free("vacuum", [ToolPose(0.60, 0.0, 0.3), ToolPose(0.36, 0.26, 0.2)])


# ---- from the side -------------------------------------------------------------------------------------------------


def test_from_the_side_levels_lead_out_and_the_first_axis_up() -> None:
    """Brought in along +y, a part comes from -y: two levels out are 6 cm before the goal, one cell along is 12 mm higher."""
    goal = ToolPose(0.5, 0.4, 0.1, np.pi / 2)
    out = near_pose(goal, (3, 2, 2), into=np.pi / 2)
    assert (out.x, out.y, out.z, out.yaw) == pytest.approx((0.5, 0.4 - 0.06, 0.112, np.pi / 2))
    aside = near_pose(goal, (2, 3, 0, 3), into=np.pi / 2)
    assert (aside.x, aside.y, aside.z, aside.yaw) == pytest.approx((0.5 - 0.012, 0.4, 0.1, np.pi / 2 + 0.06))
    assert near_pose(goal, (2, 2, 0), into=np.pi / 2) == near_pose(goal, (2, 2, 0)) == goal


def test_the_way_out_of_a_station_is_up_or_lifted_out_to_the_side_and_up(task: Task, layout: Layout) -> None:
    x, y, _ = task.station("toaster_buffer").pose
    stations = tuple(
        s.model_copy(update={"approach": "side", "pose": (x, y, np.pi / 2)}) if s.name == "toaster_buffer" else s
        for s in task.stations
    )
    side = Surveys(task.changed(stations=stations), ORDER, layout)
    assert side.into("toaster_buffer") == np.pi / 2
    assert side.into("plate") is None
    at = ToolPose(x, y, 0.1, np.pi / 2)
    lifted, out, up, end = side.exit_path("toaster_buffer", at)
    assert (lifted.x, lifted.y, lifted.z) == pytest.approx((x, y, 0.106))
    assert (out.x, out.y, out.z) == pytest.approx((x, y - 0.15, 0.106))
    assert (up.x, up.y, up.z) == pytest.approx((out.x, out.y, end.z))
    assert end == side.approach("toaster_buffer")
    assert (end.x, end.y) == pytest.approx((x, y - 0.15))
    risen, end = side.exit_path("plate", at)
    assert (risen.x, risen.y, risen.z) == (at.x, at.y, end.z)


def test_near_poses_are_relative_to_the_slice(surveys: Surveys) -> None:
    goal = surveys.kinds["slice"].held_at(Spot(0.4, 0.5, 0.012, np.pi / 2))
    assert near_pose(goal, GOAL) == goal
    ahead = near_pose(goal, (3, 2, 1, 3))
    assert (ahead.x, ahead.y) == pytest.approx((0.4, 0.5 + NEAR_STEP_M[0]))
    assert ahead.z == pytest.approx(goal.z + NEAR_STEP_M[2])
    assert ahead.yaw == pytest.approx(np.pi / 2 + NEAR_YAW_STEP)
    assert near_pose(goal, (2, 3, 0)).x == pytest.approx(0.4 - NEAR_STEP_M[1])


def test_no_way_leads_through_behind_the_arm(task: Task) -> None:
    """The first joint does not turn through there: the two cells are neighbours, and far apart for it."""
    grid = Workspace(lower_m=(-0.46, -0.18, 0.24), cell_m=(0.12, 0.18, 0.12), shape=(1, 2, 1))
    layout = Layout(tuple(o.position_m for o in task.obstacles), ())
    surveys = Surveys(task.changed(workspace=grid), (), layout)
    arm = arm_of(task.robot, task.folder)
    assert all(arm.inverse(surveys.cell_pose((0, row, 0))) is not None for row in (0, 1))
    assert set(surveys.workspace("").causes.ravel()) == {OUT_OF_REACH}


# ---- shortcuts --------------------------------------------------------------------------------------------------------


STAIRS = [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (3, 2)]


def path(*places: tuple[float, float]) -> list[ToolPose]:
    return [ToolPose(x, y, 0.0) for x, y in places]


def everywhere(line: Sequence[ToolPose]) -> bool:
    return True


def nowhere(line: Sequence[ToolPose]) -> bool:
    return False


def test_a_staircase_is_one_line_where_that_is_free() -> None:
    assert corners(path(*STAIRS), 0.1, everywhere) == (0, 5)


def test_where_no_shortcut_is_free_the_path_keeps_its_corners_and_loses_what_lies_straight_on() -> None:
    assert corners(path(*STAIRS), 0.1, nowhere) == (0, 1, 2, 3, 4, 5)
    assert corners(path((0, 0), (1, 0), (2, 0), (2, 1), (2, 2)), 0.1, nowhere) == (0, 2, 4)


def test_round_a_wall_the_way_stays_on_the_side_that_was_learned() -> None:
    """A wall from (1, 0) to (1, 2): the path goes round its end at y = 3, and so do the two lines that are left."""
    way = path((0, 0), (0, 1), (0, 2), (0, 3), (1, 3), (2, 3), (2, 2), (2, 1), (2, 0))

    def off_the_wall(line: Sequence[ToolPose]) -> bool:
        return not any(0.5 < pose.x < 1.5 and pose.y < 2.5 for pose in line)

    assert corners(way, 0.1, off_the_wall) == (0, 3, 5, 8)


def test_of_as_few_lines_the_shortest_are_taken() -> None:
    """From (0, 0) to (2, 2) only one of the corners (2, 0) and (1, 1) can be gone by: 4 m by the one, 2.8 m by the other."""
    way = path((0, 0), (2, 0), (1, 1), (2, 2))
    assert corners(way, 0.1, lambda line: not (line[0].x == 0 and line[-1].y == 2)) == (0, 2, 3)


def test_a_line_is_asked_about_from_end_to_end_at_poses_no_farther_apart_than_said() -> None:
    asked: list[Sequence[ToolPose]] = []

    def heard(line: Sequence[ToolPose]) -> bool:
        asked.append(line)
        return True

    corners([ToolPose(0, 0, 0), ToolPose(0.3, 0, 0), ToolPose(0.3, 0.4, 0, 1.0)], 0.3, heard)
    (line,) = asked  # 0.5 m, and a turn of 1 rad counts as 0.15 m: 0.52 m
    assert [(pose.x, pose.y, pose.yaw) for pose in line] == [(0, 0, 0), (0.15, 0.2, 0.5), (0.3, 0.4, 1.0)]


@pytest.mark.parametrize("far", [((0, 0),), ((0, 0), (0, 0))])
def test_a_path_that_leads_nowhere_is_one_pose(far: tuple[tuple[float, float], ...]) -> None:
    assert corners(path(*far), 0.1, nowhere) == (0,)


def test_behind_the_arm_no_shortcut_leads_from_one_side_to_the_other(surveys: Surveys) -> None:
    """Round the front of the arm from left behind it to right behind it; the straight line would lead through behind it."""
    way = tuple(ToolPose(x, y, 0.42) for x, y in ((-0.3, 0.6), (0.6, 0.6), (0.6, -0.6), (-0.3, -0.6)))
    kept = [way[n] for n in surveys.travel_corners("", way)]
    assert kept[0] == way[0]
    assert kept[-1] == way[-1]
    assert max(pose.x for pose in kept) == 0.6


def test_around_a_part_no_shortcut_leads_through_it(surveys: Surveys) -> None:
    """Over a slice that stands along x and down; the slanted line from aside would meet its edge with a finger."""
    aside, above = ((2, 4, 2, 2), (2, 2, 2, 2), (2, 2, 0, 2)), ((0, 2, 2, 2), (2, 2, 2, 2), (2, 2, 0, 2))
    assert surveys.around_corners("toaster", "slice", False, aside) == (0, 1, 2)
    assert surveys.around_corners("toaster", "slice", False, above) == (0, 2)
