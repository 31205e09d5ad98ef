"""From a scene to cells that are free, out of reach or blocked, and by what."""

import numpy as np
import pytest

from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.scene.blocked_cells import CARRIED, OUT_OF_REACH, Survey, Surveyor, in_the_way
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.tasks.task import Task
from lab.tasks.task_fields import Obstacle

Cell = tuple[int, ...]
CUBE = (0.70, 0.0)


def cell_pose(cell: Cell) -> ToolPose:
    """A line of five cells of 12 cm over y, at two heights, in front of the robot."""
    return ToolPose(0.70, -0.24 + 0.12 * cell[0], 0.10 + 0.25 * cell[1])


def surveyed(
    task: Task, *, carried: str | None, clearance: float = 0.03, cubes: int = 2, ignore: tuple[str, ...] = ()
) -> Survey:
    """A survey of those cells around one stack of cubes in the middle cell."""
    bare = task.changed(obstacles=(Obstacle(name="cube", position_m=CUBE, cubes=cubes),))
    with World() as world:
        scene = Scene(world, bare, (), Layout((CUBE,), ()))
        return Surveyor(scene, carried, clearance=clearance, ignore=ignore).grid((5, 2), cell_pose)


@pytest.mark.parametrize("carried", [None, "slice"])
def test_a_cube_blocks_the_cell_it_stands_in_and_is_named(task: Task, carried: str | None) -> None:
    survey = surveyed(task, carried=carried)
    assert survey.causes.shape == survey.blocked.shape == (5, 2)
    assert survey.causes[2, 0] == "cube"
    assert survey.causes[0, 1] == survey.causes[4, 1] == ""
    assert survey.names([(2, 0), (2, 0), (0, 1)]) == ["cube"]
    assert np.array_equal(survey.blocked, survey.causes != "")


def test_a_carried_slice_needs_more_room_below(task: Task) -> None:
    """Tips at 0.35 m: 3 cubes of 6 cm stay 17 cm below them, but only 8 cm below the slice in them."""
    assert surveyed(task, carried=None, clearance=0.1, cubes=3).causes[2, 1] == ""
    assert surveyed(task, carried="slice", clearance=0.1, cubes=3).causes[2, 1] == "cube"
    assert surveyed(task, carried="slice", clearance=0.07, cubes=3).causes[2, 1] == ""


def test_what_is_ignored_blocks_nothing(task: Task) -> None:
    assert not surveyed(task, carried="slice", ignore=("cube",)).blocked.any()


def test_without_the_cube_the_cell_is_free(task: Task) -> None:
    with World() as world:
        scene = Scene(world, task.changed(obstacles=()), (), Layout((), ()))
        assert not Surveyor(scene, "slice", clearance=0.03).grid((5, 2), cell_pose).blocked.any()


def test_a_wider_clearance_never_frees_a_cell(task: Task) -> None:
    narrow, wide = (surveyed(task, carried=None, clearance=c).blocked for c in (0.005, 0.06))
    assert np.all(wide[narrow])
    assert wide.sum() > narrow.sum()


@pytest.mark.parametrize("pose", [ToolPose(1.6, 0.0, 0.3), ToolPose(0.2, 0.1, 0.3), ToolPose(-0.8, 0.0, 0.3)])
def test_out_of_reach_is_said(task: Task, world: World, pose: ToolPose) -> None:
    scene = Scene(world, task.changed(obstacles=()), (), Layout((), ()))
    assert Surveyor(scene, None, clearance=0.01).cause(pose) == OUT_OF_REACH


def test_the_machines_block_too(task: Task, world: World) -> None:
    scene = Scene(world, task.changed(obstacles=()), (), Layout((), ()))
    surveyor = Surveyor(scene, None, clearance=0.01)
    for station in task.stations:
        x, y, yaw = station.pose
        assert surveyor.cause(ToolPose(x, y, 0.0, yaw)) == station.name
        assert surveyor.cause(ToolPose(x, y, 0.3, yaw)) == ""


def test_surveying_says_the_same_twice_and_whatever_came_before(task: Task, world: World) -> None:
    bare = task.changed(obstacles=(Obstacle(name="cube", position_m=CUBE, cubes=2),))
    scene = Scene(world, bare, (), Layout((CUBE,), ()))
    surveyor = Surveyor(scene, "slice", clearance=0.03)
    first = surveyor.grid((5, 2), cell_pose).causes
    backwards = {cell: surveyor.cause(cell_pose(cell)) for cell in reversed(list(np.ndindex(5, 2)))}
    assert all(first[cell] == cause for cell, cause in backwards.items())
    assert world.steps == 0


def test_the_slice_is_carried_where_the_fingers_hold_it(task: Task, world: World) -> None:
    scene = Scene(world, task.changed(obstacles=()), (), Layout((), ()))
    surveyor = Surveyor(scene, "slice", clearance=0.01)
    assert surveyor.cause(ToolPose(0.7, 0.1, 0.4, 0.3)) == ""
    position, turn = world.pose(CARRIED)
    assert position == pytest.approx((0.7, 0.1, 0.4 + 0.03 - 0.06))
    assert 2 * np.arctan2(turn[2], turn[3]) == pytest.approx(0.3)
    gap = world.nearest(NAME, CARRIED, 0.05)
    assert -1e-4 < gap < 2e-3  # the fingers are as wide as the slice


def test_a_pallet_is_surveyed_with_its_part_on_it(fms: Task, world: World) -> None:
    """The gripper holds the pallet 5 mm above its foot; the sign on it reaches 65 mm higher than the tips."""
    scene = Scene(world, fms.changed(obstacles=()), (), Layout((), ()))
    surveyor = Surveyor(scene, "sign on pallet", clearance=0.01)
    assert surveyor.moving == [NAME, f"{CARRIED}'s pallet", CARRIED]
    assert surveyor.cause(ToolPose(0.7, 0.1, 0.4, 0.3)) == ""
    for body, middle in ((f"{CARRIED}'s pallet", 0.010), (CARRIED, 0.020 + 0.022)):
        position, turn = world.pose(body)
        assert position == pytest.approx((0.7, 0.1, 0.395 + middle))
        assert 2 * np.arctan2(turn[2], turn[3]) == pytest.approx(0.3)
    gap = world.nearest(NAME, f"{CARRIED}'s pallet", 0.05)
    assert -1e-4 < gap < 2e-3  # the fingers are as wide as the pallet


def test_a_part_alone_is_carried_without_its_pallet(fms: Task, world: World) -> None:
    scene = Scene(world, fms.changed(obstacles=()), (), Layout((), ()))
    surveyor = Surveyor(scene, "sign", clearance=0.01)
    assert surveyor.moving == [NAME, CARRIED]
    assert set(scene.kind_of) == {CARRIED}


def test_a_pallet_reaches_farther_aside_than_the_sign_on_it(fms: Task) -> None:
    """A wall 55 mm beside the tool's axis: a sign, 30 mm long that way, passes; its pallet, 60 mm, does not."""
    wall = Obstacle(name="wall", position_m=(0.765, 0.0), size_m=(0.02, 0.3, 0.42))
    causes = {}
    for carried in ("sign", "sign on pallet"):
        with World() as world:
            scene = Scene(world, fms.changed(obstacles=(wall,)), (), Layout((wall.position_m,), ()))
            causes[carried] = Surveyor(scene, carried, clearance=0.001).cause(ToolPose(0.7, 0.0, 0.4, 0.0))
    assert causes == {"sign": "", "sign on pallet": "wall"}


def test_a_grid_says_of_each_cell_what_a_pose_alone_does(task: Task, world: World) -> None:
    bare = task.changed(obstacles=(Obstacle(name="cube", position_m=CUBE, cubes=2),))
    surveyor = Surveyor(Scene(world, bare, (), Layout((CUBE,), ())), "slice", clearance=0.03)

    def far_out(cell: Cell) -> ToolPose:
        return ToolPose(0.1 + 0.2 * cell[0], 0.0, 0.2, 0.4 * cell[1])

    causes = surveyor.grid((8, 2), far_out).causes
    assert {str(cause) for cause in causes.ravel()} == {"", OUT_OF_REACH, "cube"}
    assert all(causes[cell] == surveyor.cause(far_out(cell)) for cell in np.ndindex(8, 2))


def test_only_the_stations_own_body_is_to_be_changed() -> None:
    """What stands there is named alone; a station moves along with its own body, so that is to be changed."""
    assert in_the_way([OUT_OF_REACH], "oven") == "out of reach"
    assert in_the_way(["pillar"], "oven") == "in the way: pillar"
    assert in_the_way(["oven", "pillar"], "oven") == "in the way: oven itself, pillar"
    assert (
        in_the_way(["oven"], "oven") == "in the way: oven itself: change its body, size_m, floor_m, spots or approach"
    )
