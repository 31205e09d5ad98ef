"""Paths of the tool as joint targets, and the arm that follows them."""

from collections.abc import Iterable, Sequence
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import WorkFailed
from lab.files import assets_folder
from lab.sim.arms import kinematics
from lab.sim.arms.arm import Arm
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm, Trajectory, plan
from lab.sim.arms.tool_path import YAW_ARM
from lab.sim.models import FINGER_OPEN, SLICE
from lab.sim.parts.part_shape import shape_of
from lab.sim.world import TIME_STEP, World
from lab.tasks.part_fields import PartFields

UP6 = arm_named("up6")
FINGERS = UP6.fingers.joints
inverse, forward = UP6.inverse, UP6.forward
poses = st.builds(ToolPose, st.floats(0.45, 0.9), st.floats(-0.6, 0.6), st.floats(0.03, 0.45), st.floats(-1.5, 1.5))
speeds = st.floats(0.2, 1.5)
accelerations = st.floats(0.2, 10.0)
blends = st.sampled_from([0.0, 0.008, 0.1])


def steps(world: World, motion: Iterable[None]) -> int:
    count = 0
    for _ in motion:
        world.step()
        count += 1
    return count


def check_sound(way: Trajectory, poses: list[ToolPose], speed: float, start: np.ndarray | None = None) -> None:
    """Finite, within the joints' ranges and speeds and the tool's speed, and ending exactly at the last pose."""
    wanted = inverse(poses[-1])
    assert wanted is not None
    assert way.positions.shape == way.velocities.shape == (len(way.positions), 6)
    assert np.isfinite(way.positions).all()
    assert np.isfinite(way.velocities).all()
    assert np.all((way.positions >= kinematics.LOWER) & (way.positions <= kinematics.UPPER))
    assert np.all(np.abs(way.velocities) <= kinematics.SPEED * (1 + 1e-9))
    from_here = way.positions if start is None else np.vstack([start, way.positions])
    assert np.all(np.abs(np.diff(from_here, axis=0)) <= kinematics.SPEED * TIME_STEP * 1.05)
    assert way.positions[-1, :5] == pytest.approx(wanted[:5], abs=1e-9)
    assert np.sin((way.positions[-1, 5] - wanted[5]) / 2) == pytest.approx(0.0, abs=1e-9)  # the same turn
    tools = [forward(row) for row in way.positions]
    went = np.diff([[t.x, t.y, t.z, t.yaw * YAW_ARM] for t in tools], axis=0)
    went[:, 3] = (went[:, 3] / YAW_ARM + pi) % (2 * pi) * YAW_ARM - pi * YAW_ARM
    assert np.all(np.linalg.norm(went, axis=1) <= speed * TIME_STEP * 1.001)


def hardest(arm: Arm, joints: np.ndarray) -> float:
    """The largest acceleration [m/s2] of the tool that joints (n, k), one a physics step, hold, from rest to rest."""
    tools = arm.kinematics.tools(np.vstack([joints[:1], joints, joints[-1:], joints[-1:]]))[:, :3]
    return float(np.linalg.norm(np.diff(tools, 2, axis=0), axis=1).max()) / TIME_STEP**2


@given(st.lists(poses, min_size=2, max_size=4), speeds, accelerations, blends)
def test_a_plan_keeps_to_every_limit_and_ends_at_its_target(
    path: list[ToolPose], speed: float, acceleration: float, blend: float
) -> None:
    start = inverse(path[0])
    assert start is not None
    way = plan(UP6, path, speed, acceleration, blend, start)
    check_sound(way, path, speed, start)
    assert hardest(UP6, np.vstack([start, way.positions])) <= acceleration * (1 + 1e-6)


def test_a_straight_way_takes_as_long_as_by_hand() -> None:
    """0.5 m at 0.5 m/s and 2 m/s2: 0.25 s to speed up, 0.25 s to slow down, 0.75 s in between."""
    way = plan(UP6, [ToolPose(0.6, -0.25, 0.3), ToolPose(0.6, 0.25, 0.3)], 0.5, 2.0)
    assert len(way.positions) * TIME_STEP == pytest.approx(1.25)
    halfway = forward(way.positions[149])
    assert halfway.y == pytest.approx(0.0, abs=1e-8)
    quarter = forward(way.positions[59])  # after 0.25 s: 1/2 * 2 * 0.25^2 m
    assert quarter.y == pytest.approx(-0.25 + 0.0625, abs=1e-9)
    assert quarter.x == pytest.approx(0.6)


def test_a_short_way_never_reaches_full_speed() -> None:
    way = plan(UP6, [ToolPose(0.6, 0.0, 0.3), ToolPose(0.6, 0.02, 0.3)], 0.5, 2.0)
    assert len(way.positions) == np.ceil(2 * np.sqrt(0.02 / 2.0) / TIME_STEP)


def test_no_way_is_one_target() -> None:
    here = ToolPose(0.6, 0.1, 0.3, 0.2)
    for path in ([here], [here, here], [here, here, here]):
        way = plan(UP6, path, 0.5, 2.0)
        assert way.positions == pytest.approx(np.array([inverse(here)]))
        assert not way.velocities.any()


def test_almost_no_way_takes_almost_no_time() -> None:
    """A micrometre at 2 m/s2 takes 1.4 ms, to and fro and to three times as long."""
    here, there = ToolPose(0.6, 0.1, 0.3), ToolPose(0.6, 0.100001, 0.3)
    for path in ([here, there, there], [here, here, there], [here, there, here, there]):
        assert len(plan(UP6, path, 0.5, 2.0).positions) <= 2


def test_blending_cuts_the_corner_but_not_the_ends() -> None:
    path = [ToolPose(0.6, -0.2, 0.3), ToolPose(0.9, -0.2, 0.3), ToolPose(0.9, 0.2, 0.3)]
    sharp, smooth = plan(UP6, path, 0.5, 2.0), plan(UP6, path, 0.5, 2.0, blend=0.1)
    corner = np.array([0.9, -0.2])

    def nearest(way: Trajectory) -> float:
        return min(float(np.hypot(*(corner - (t.x, t.y)))) for t in map(forward, way.positions))

    assert nearest(sharp) < 2e-3
    assert 0.01 < nearest(smooth) < 0.05
    assert len(smooth.positions) < len(sharp.positions)
    end = forward(smooth.positions[-1])
    assert (end.x, end.y) == pytest.approx((0.9, 0.2))


@given(st.floats(-2 * pi, 2 * pi), poses, poses)
def test_the_tool_is_never_thrown_round(turned: float, one: ToolPose, other: ToolPose) -> None:
    """Whatever whole turns the T axis has made before, it goes on from where it is, within its range."""
    start = inverse(one)
    assert start is not None
    start[5] += 2 * pi * round((turned - start[5]) / (2 * pi))
    if not kinematics.LOWER[5] <= start[5] <= kinematics.UPPER[5]:
        return
    check_sound(plan(UP6, [one, other], 0.5, 2.0, before=start), [other], 0.5, start)


def test_a_way_out_of_reach_is_refused_with_the_place() -> None:
    with pytest.raises(WorkFailed, match=r"the tool cannot reach \(1\.\d+, 0\.000, 0\.300\) m"):
        plan(UP6, [ToolPose(0.9, 0.0, 0.3), ToolPose(1.6, 0.0, 0.3)], 0.5, 2.0)
    with pytest.raises(WorkFailed, match="the tool cannot reach"):
        plan(UP6, [ToolPose(0.5, -0.1, 0.3), ToolPose(-0.5, 0.1, 0.3)], 0.5, 2.0)  # through its own foot


def test_the_arm_comes_to_rest_where_it_was_sent(robot: RobotArm, world: World) -> None:
    goal = ToolPose(0.6, -0.4, 0.2, 0.5)
    count = steps(world, robot.follow([ToolPose(0.8, 0.2, 0.35), goal], blend=0.05))
    at = robot.tool()
    assert (at.x, at.y, at.z) == pytest.approx((goal.x, goal.y, goal.z), abs=5e-4)
    assert at.yaw == pytest.approx(goal.yaw, abs=2e-3)
    assert 0 < count * TIME_STEP < 5


def test_targets_never_jump_from_one_motion_to_the_next(robot: RobotArm, world: World) -> None:
    """Also where something keeps the arm a little off them: the tool is told to go from where it is held."""
    told: list[np.ndarray] = [UP6.home, UP6.home]  # in each physics step
    drive, step = world.drive, world.step

    def drives(name: str, names: Sequence[str], positions: Sequence[float], *rest: Any, **more: Any) -> None:
        drive(name, names, positions, *rest, **more)
        if tuple(names) == UP6.joints:
            told[-1] = np.array(positions)

    def steps_on() -> None:
        step()
        told.append(told[-1])

    world.drive, world.step = drives, steps_on  # type: ignore[method-assign,assignment]
    for way in ([ToolPose(0.6, -0.2, 0.3)], [ToolPose(0.6, -0.2, 0.1), ToolPose(0.7, 0.1, 0.2, 0.4)]):
        steps(world, robot.follow(way, blend=0.05))
        world.set_joints(NAME, UP6.joints, np.array(world.joints(NAME, UP6.joints)) + 0.001)
    steps(world, robot.follow([ToolPose(0.7, 0.1, 0.3)]))
    assert hardest(UP6, np.array(told)) <= robot.acceleration * (1 + 1e-6)


def test_an_arm_that_was_moved_goes_on_from_where_it_is(robot: RobotArm, world: World) -> None:
    steps(world, robot.follow([ToolPose(0.6, -0.2, 0.3)]))
    moved = inverse(ToolPose(0.6, 0.2, 0.3))
    assert moved is not None
    world.set_joints(NAME, UP6.joints, moved)
    next(iter(robot.follow([ToolPose(0.6, 0.25, 0.3)])))
    world.step()
    assert robot.tool().y == pytest.approx(0.2, abs=1e-3)


def test_a_slower_path_takes_longer(robot: RobotArm, world: World) -> None:
    goals = [ToolPose(0.6, -0.4, 0.3), ToolPose(0.6, 0.4, 0.3)]
    steps(world, robot.follow(goals[:1]))
    fast = steps(world, robot.follow(goals[1:]))
    slow = steps(world, robot.follow(goals[:1], slow=0.5))
    assert 1.8 < slow / fast < 2.0


def test_a_target_out_of_reach_stops_the_motion_before_it_begins(robot: RobotArm, world: World) -> None:
    with pytest.raises(WorkFailed, match="cannot reach"):
        next(iter(robot.follow([ToolPose(2.0, 0.0, 0.3)])))
    assert not robot.stand(ToolPose(2.0, 0.0, 0.3))


def test_the_fingers_close_together_and_open_again(robot: RobotArm, world: World) -> None:
    steps(world, robot.follow([ToolPose(0.6, 0.0, 0.3)]))
    steps(world, robot.grip())
    was_closed, closed = robot.closed, world.joints(NAME, FINGERS)
    assert was_closed
    assert closed == pytest.approx((0, 0), abs=1e-3)
    steps(world, robot.release())
    opened = world.joints(NAME, FINGERS)
    assert not robot.closed
    assert opened == pytest.approx((FINGER_OPEN, FINGER_OPEN), abs=2e-3)
    assert opened[0] == pytest.approx(opened[1], abs=1e-3)


def test_friction_alone_holds_a_slice_that_is_swung_about(robot: RobotArm, world: World) -> None:
    """Lifted and held still it does not creep; swung through 1 m, turned, and held it slides by millimetres at most."""
    angle = 0.4
    pose = ToolPose(0.7 * cos(angle), 0.7 * sin(angle), 0.3, 0.1)
    robot.stand(pose)
    robot.open_at_once(SLICE[1] / 2 + 0.001)
    world.box("table", (1.0, 1.0, 0.1), (0.7, 0.0, pose.z - 0.09 - 0.05), (1, 1, 1, 1))
    world.load("slice", assets_folder() / "slice.urdf", (pose.x, pose.y, pose.z + 0.03 - 0.06), 0.1, fixed=False)
    world.friction("slice", 0.8, spinning=0.001)
    steps(world, robot.grip())
    steps(world, robot.follow([pose.shifted(dz=0.1)]))
    before = _hangs(robot, world)
    steps(world, robot.rest(240))
    assert np.linalg.norm(_hangs(robot, world) - before) < 1e-4
    way = [pose.shifted(dz=0.2), ToolPose(0.6, -0.5, 0.4, -0.8), ToolPose(0.8, 0.3, 0.3, 0.6)]
    steps(world, robot.follow(way, blend=0.1))
    assert np.linalg.norm(_hangs(robot, world) - before) < 4e-3
    steps(world, robot.rest(240))
    assert np.linalg.norm(_hangs(robot, world) - before) < 4e-3


@pytest.mark.parametrize("turn", [pi / 2, pi])
def test_the_fingers_do_not_push_what_they_turn_out_of_their_middle(turn: float) -> None:
    """A contact that kept its direction in the world pushes a can aside: by 27 mm and 5 mm here.

    As it is, the can moves by 1 to 3 mm, by the processor's arithmetic.
    """
    can = shape_of(PartFields(name="can", shape="cylinder", size_m=(0.036, 0.09), mass_kg=0.08), assets_folder())
    at, held = ToolPose(0.7, 0.0, 0.123), ToolPose(0.7, 0.0, 0.173)
    with World() as world:
        robot = RobotArm(world, arm_named("up6"), 0.5, 2.0, 12.0, fine=True)
        world.box("table", (0.4, 0.4, 0.1), (0.7, 0.0, 0.05), (1.0, 1.0, 1.0, 1.0))
        world.part("can", can, 0.08, 0.8, (0.7, 0.0, 0.1 + can.foot_m))
        robot.stand(at)
        for motion in (robot.rest(60), robot.grip(), robot.follow([held]), robot.follow([held.shifted(dyaw=turn)])):
            steps(world, motion)
        steps(world, robot.release())
        assert world.pose("can")[0][:2] == pytest.approx((0.7, 0.0), abs=0.004)


def _hangs(robot: RobotArm, world: World) -> np.ndarray:
    """Where the slice's middle is as the tool sees it [m]."""
    tool, at = robot.tool(), world.pose("slice")[0] - (robot.tool().x, robot.tool().y, robot.tool().z)
    c, s = cos(tool.yaw), sin(tool.yaw)
    return np.array([c * at[0] + s * at[1], -s * at[0] + c * at[1], at[2]])


def test_a_streamed_trajectory_ends_with_its_last_row(robot: RobotArm, world: World) -> None:
    """There is a step for each row and none for a rest; an arm that is put where it waits is as it was loaded."""
    home = robot.arm.home
    rows = home + np.linspace(0.0, 0.05, 25)[1:, None] * np.eye(6)[0]
    way = Trajectory(rows, np.full((24, 1), 0.5) * np.eye(6)[0])
    assert steps(world, robot.along(way)) == 24
    joints = world.joints(NAME, robot.arm.joints)
    assert joints[0] == pytest.approx(0.05, abs=0.005)
    steps(world, robot.grip())
    robot.wait_open()
    assert world.joints(NAME, robot.arm.joints) == pytest.approx(home)
    assert not robot.closed
    assert world.joints(NAME, FINGERS) == pytest.approx(robot.arm.fingers.at(robot.arm.fingers.open_m))
