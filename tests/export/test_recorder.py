"""What is written down of what a robot does, also where it is broken off; and that nothing changes by it."""

from collections.abc import Iterable, Iterator
from itertools import islice

import numpy as np
import pytest

from lab.export import program_formats
from lab.export.play import deviation
from lab.export.program import ArmRest, Motion, Options, Press, Program
from lab.export.recorder import SEEN_EVERY, MotionRecorder, tips
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import GRIP_STEPS, RobotArm
from lab.sim.world import TIME_STEP, World
from lab.tasks.task_file import load

UP6 = arm_named("up6")
HIGH = ToolPose(0.5, 0.1, 0.3, 0.0)


@pytest.fixture
def robot() -> Iterator[RobotArm]:
    with World() as world:
        robot = RobotArm(world, UP6, 0.5, 2.0, 25.0)
        robot.stand(HIGH)
        yield robot


def run(robot: RobotArm, motion: Iterable[None]) -> int:
    steps = 0
    for _ in motion:
        robot.world.step()
        steps += 1
    return steps


def written(recorder: MotionRecorder) -> Program:
    return recorder.program(load("toast"), 0, [], "slice {}".format)


def test_every_target_is_written_down_with_when_it_is_reached(robot: RobotArm) -> None:
    recorder = MotionRecorder(robot)
    low = HIGH.shifted(dz=-0.1)
    steps = run(robot, robot.follow([low]))
    program = written(recorder)
    (motion,) = program.motions
    rows = steps - 12 + 1  # without the settling after it, with where it began
    assert (motion.first, motion.last, motion.complete) == (0, rows, True)
    assert motion.poses == ((low.x, low.y, low.z, low.yaw),)
    assert program.at_s == pytest.approx(np.arange(rows) * TIME_STEP)
    assert program.joints[0] == pytest.approx(UP6.inverse(HIGH), abs=1e-6)
    assert program.joints[-1] == pytest.approx(UP6.inverse(low), abs=1e-9)
    assert not program.closed.any()


def test_the_tool_is_seen_on_its_way_and_when_it_is_at_rest(robot: RobotArm) -> None:
    recorder = MotionRecorder(robot)
    run(robot, robot.follow([HIGH.shifted(dy=-0.2)]))
    program, tool = written(recorder), robot.tool()
    assert program.seen[0, :3] == pytest.approx([HIGH.x, HIGH.y, HIGH.z], abs=1e-4)
    assert program.seen[-1, :3] == pytest.approx([tool.x, tool.y, tool.z], abs=1e-7)
    assert set(np.rint(np.diff(program.seen_at_s[:-2]) / TIME_STEP)) <= {1.0, float(SEEN_EVERY)}
    assert np.all(np.diff(program.seen_at_s) > 0)


def test_tips_stand_where_the_tip_is_in_its_link() -> None:
    """A tip 0.2 m out along the link's x; the link at (1, 0, 0), turned by a quarter about z: the tip is at (1, 0.2, 0)."""
    tip = np.eye(4)
    tip[0, 3] = 0.2
    half = np.sqrt(0.5)
    assert tips(np.array([[1.0, 0.0, 0.0, 0.0, 0.0, half, half]]), tip)[0] == pytest.approx(
        [1, 0.2, 0, 0, 0, half, half]
    )


def test_the_gripper_and_rests_are_written_down_with_their_times(robot: RobotArm) -> None:
    recorder = MotionRecorder(robot)
    run(robot, robot.grip())
    run(robot, robot.rest(24))
    run(robot, robot.follow([HIGH.shifted(dz=-0.1)]))
    program = written(recorder)
    grip, rest, motion = program.carried.actions
    assert grip == Press(at_s=0.0, closed=True)
    assert rest == ArmRest(at_s=GRIP_STEPS * TIME_STEP, seconds=24 * TIME_STEP)
    assert isinstance(motion, Motion)
    assert motion.at_s == pytest.approx((GRIP_STEPS + 24) * TIME_STEP)
    assert program.closed.all()


@pytest.mark.parametrize("after", ["a motion", "a grip", "nothing"])
def test_a_motion_that_is_broken_off_is_written_down_as_far_as_it_came(robot: RobotArm, after: str) -> None:
    """As by an emergency stop: 30 steps of a motion, then the arm stays, and goes on with something else, or not."""
    recorder = MotionRecorder(robot)
    run(robot, islice(robot.follow([HIGH.shifted(dy=-0.3)]), 30))
    for _ in range(100):
        robot.world.step()
    if after == "a motion":
        run(robot, robot.follow([HIGH]))
    elif after == "a grip":
        run(robot, robot.grip())
    program, still = written(recorder), robot.world.joints("robot", UP6.joints)
    motion = program.motions[0]
    assert (motion.first, motion.last, motion.complete) == (
        0,
        32,
        False,
    )  # where it began, 30 targets, where it stopped
    assert program.at_s[31] == pytest.approx(130 * TIME_STEP)
    if after != "a motion":
        assert program.joints[31] == pytest.approx(still, abs=1e-4)
    assert [one.complete for one in written(recorder).motions[1:]] == [True] * (after == "a motion")


def test_a_target_that_is_set_in_the_very_step_of_a_stop_is_none(robot: RobotArm) -> None:
    recorder = MotionRecorder(robot)
    motion = robot.follow([HIGH.shifted(dy=-0.3)])
    run(robot, islice(motion, 30))
    next(motion)
    robot.brake()
    run(robot, robot.grip())
    program = written(recorder)
    assert program.motions[0].last == 32
    assert program.at_s[-2:] == pytest.approx([30 * TIME_STEP] * 2)
    assert program.carried.actions[1].at_s == pytest.approx(30 * TIME_STEP)


@pytest.mark.parametrize("name", program_formats())
def test_a_run_that_was_stopped_is_exported_with_its_stop(robot: RobotArm, name: str) -> None:
    """An emergency stop at full speed; the arm stays for a while, and goes on to somewhere else."""
    recorder = MotionRecorder(robot)
    run(robot, islice(robot.follow([HIGH.shifted(dy=-0.4)]), 120))
    robot.brake()
    for _ in range(100):
        robot.world.step()
    run(robot, robot.follow([HIGH.shifted(dz=-0.1)]))
    program = written(recorder)
    off = deviation(
        program, program_formats()[name].read(program_formats()[name].write(program, Options(any_arm=True)), UP6)
    )
    ways = 1 if name in ("jbi", "urscript") else 2  # a job goes on where it was stopped
    assert (off.motions, off.near_enough) == (ways, True), off


def test_a_motion_that_was_never_driven_is_none(robot: RobotArm) -> None:
    recorder = MotionRecorder(robot)
    motion = robot.follow([HIGH.shifted(dy=-0.3)])
    del motion
    assert written(recorder).motions == []


def test_writing_down_changes_nothing() -> None:
    joints = []
    for heard in (False, True):
        with World() as world:
            robot = RobotArm(world, UP6, 0.5, 2.0, 25.0)
            robot.stand(HIGH)
            if heard:
                MotionRecorder(robot)
            run(robot, robot.follow([HIGH.shifted(dz=-0.1), HIGH.shifted(dy=0.2)], blend=0.05))
            run(robot, robot.grip())
            joints.append(world.joints("robot", UP6.joints))
    assert np.array_equal(joints[0], joints[1])
