"""Paths of the tool as joint targets, and the arm that follows them."""

from collections.abc import Iterable
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import WorkFailed
from lab.files import assets_folder
from lab.sim.arms import kinematics
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, Robot, Trajectory, plan
from lab.sim.arms.tool_path import YAW_ARM
from lab.sim.models import FINGER_OPEN, SLICE
from lab.sim.world import TIME_STEP, World

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


@given(st.lists(poses, min_size=2, max_size=4), speeds, accelerations, blends, st.booleans())
def test_a_plan_keeps_to_every_limit_and_ends_at_its_target(
    path: list[ToolPose], speed: float, acceleration: float, blend: float, gently: bool
) -> None:
    start = inverse(path[0])
    assert start is not None
    way = plan(UP6, path, speed, acceleration, blend, start, gently)
    check_sound(way, path, speed, start)


@pytest.mark.parametrize("gently", [False, True])
def test_a_straight_way_takes_as_long_as_by_hand(gently: bool) -> None:
    """0.5 m at 0.5 m/s and 2 m/s2: 0.25 s to speed up, 0.25 s to slow down, 0.75 s in between."""
    way = plan(UP6, [ToolPose(0.6, -0.25, 0.3), ToolPose(0.6, 0.25, 0.3)], 0.5, 2.0, gently=gently)
    off = 1e-4 if gently else 1e-9  # which speeds up between two points less than it may
    assert len(way.positions) * TIME_STEP == pytest.approx(1.25, abs=gently * TIME_STEP)
    halfway = forward(way.positions[149])
    assert halfway.y == pytest.approx(0.0, abs=10 * off)
    quarter = forward(way.positions[59])  # after 0.25 s: 1/2 * 2 * 0.25^2 m
    assert quarter.y == pytest.approx(-0.25 + 0.0625, abs=off)
    assert quarter.x == pytest.approx(0.6)


def test_a_short_way_never_reaches_full_speed() -> None:
    way = plan(UP6, [ToolPose(0.6, 0.0, 0.3), ToolPose(0.6, 0.02, 0.3)], 0.5, 2.0)
    assert len(way.positions) == np.ceil(2 * np.sqrt(0.02 / 2.0) / TIME_STEP)


@pytest.mark.parametrize("gently", [False, True])
def test_no_way_is_one_target(gently: bool) -> None:
    here = ToolPose(0.6, 0.1, 0.3, 0.2)
    for path in ([here], [here, here], [here, here, here]):
        way = plan(UP6, path, 0.5, 2.0, gently=gently)
        assert way.positions == pytest.approx(np.array([inverse(here)]))
        assert not way.velocities.any()


@pytest.mark.parametrize("gently", [False, True])
def test_almost_no_way_takes_almost_no_time(gently: bool) -> None:
    here, there = ToolPose(0.6, 0.1, 0.3), ToolPose(0.6, 0.100001, 0.3)
    for path in ([here, there, there], [here, here, there], [here, there, here, there]):
        assert len(plan(UP6, path, 0.5, 2.0, gently=gently).positions) <= 2


@pytest.mark.parametrize(
    ("gently", "corner", "back"), [(False, (5.0, 20.0), (25.0, 200.0)), (True, (2.0, 3.2), (2.0, 3.2))]
)
def test_a_gentle_way_slows_down_for_its_corners(
    gently: bool, corner: tuple[float, float], back: tuple[float, float]
) -> None:
    """2 m/s2 along and 2 across are up to 2.8 together, over 8 steps; a way back is a stop."""
    for end, (least, most) in ((ToolPose(0.9, 0.2, 0.3), corner), (ToolPose(0.6, -0.19, 0.3), back)):
        path = [ToolPose(0.6, -0.2, 0.3), ToolPose(0.9, -0.2, 0.3), end]
        way = plan(UP6, path, 0.5, 2.0, blend=0.1, gently=gently)
        tools = np.array([(tool.x, tool.y) for tool in map(forward, way.positions)])
        speeds = np.diff(tools, axis=0) / TIME_STEP
        felt = np.linalg.norm(speeds[8:] - speeds[:-8], axis=1) / (8 * TIME_STEP)
        assert least <= felt.max() <= most


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


def test_the_arm_comes_to_rest_where_it_was_sent(robot: Robot, world: World) -> None:
    goal = ToolPose(0.6, -0.4, 0.2, 0.5)
    count = steps(world, robot.follow([ToolPose(0.8, 0.2, 0.35), goal], blend=0.05))
    at = robot.tool()
    assert (at.x, at.y, at.z) == pytest.approx((goal.x, goal.y, goal.z), abs=5e-4)
    assert at.yaw == pytest.approx(goal.yaw, abs=2e-3)
    assert 0 < count * TIME_STEP < 5


def test_a_slower_path_takes_longer(robot: Robot, world: World) -> None:
    goals = [ToolPose(0.6, -0.4, 0.3), ToolPose(0.6, 0.4, 0.3)]
    steps(world, robot.follow(goals[:1]))
    fast = steps(world, robot.follow(goals[1:]))
    slow = steps(world, robot.follow(goals[:1], slow=0.5))
    assert 1.8 < slow / fast < 2.0


def test_a_target_out_of_reach_stops_the_motion_before_it_begins(robot: Robot, world: World) -> None:
    with pytest.raises(WorkFailed, match="cannot reach"):
        next(iter(robot.follow([ToolPose(2.0, 0.0, 0.3)])))
    assert not robot.stand(ToolPose(2.0, 0.0, 0.3))


def test_the_fingers_close_together_and_open_again(robot: Robot, world: World) -> None:
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


def test_friction_alone_holds_a_slice_that_is_swung_about(robot: Robot, world: World) -> None:
    """Held still it does not creep; swung through 1 m and turned it slides by millimetres at most."""
    angle = 0.4
    pose = ToolPose(0.7 * cos(angle), 0.7 * sin(angle), 0.3, 0.1)
    robot.stand(pose)
    robot.open_at_once(SLICE[1] / 2 + 0.001)
    world.box("table", (1.0, 1.0, 0.1), (0.7, 0.0, pose.z - 0.09 - 0.05), (1, 1, 1, 1))
    world.load("slice", assets_folder() / "slice.urdf", (pose.x, pose.y, pose.z + 0.03 - 0.06), 0.1, fixed=False)
    world.friction("slice", 0.8, spinning=0.001)
    steps(world, robot.grip())
    before = _hangs(robot, world)
    way = [pose.shifted(dz=0.2), ToolPose(0.6, -0.5, 0.4, -0.8), ToolPose(0.8, 0.3, 0.3, 0.6)]
    steps(world, robot.follow(way, blend=0.1))
    swung = _hangs(robot, world)
    assert np.linalg.norm(swung - before) < 4e-3
    steps(world, robot.rest(240))
    assert np.linalg.norm(_hangs(robot, world) - swung) < 1e-4


def _hangs(robot: Robot, world: World) -> np.ndarray:
    """Where the slice's middle is as the tool sees it [m]."""
    tool, at = robot.tool(), world.pose("slice")[0] - (robot.tool().x, robot.tool().y, robot.tool().z)
    c, s = cos(tool.yaw), sin(tool.yaw)
    return np.array([c * at[0] + s * at[1], -s * at[0] + c * at[1], at[2]])
