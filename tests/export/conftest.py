"""Programs that a robot has really carried out, short ones: there and back with a turn, a grip, a rest and a wait."""

from collections.abc import Callable, Iterable
from functools import lru_cache
from math import pi
from pathlib import Path

import pytest

from lab.export.program import Program
from lab.export.recorder import MotionRecorder
from lab.sequencing.cell.schedule import Move
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm
from lab.sim.parts.holding import USUAL_N
from lab.sim.world import World
from lab.tasks.task_file import load

ARMS = {"up6": "toast", "panda": "toast-panda", "xarm6": "toast-xarm6"}  # and a task that has it
HIGH = ToolPose(0.5, 0.1, 0.3, 0.0)


def run(world: World, motion: Iterable[None]) -> None:
    for _ in motion:
        world.step()


@lru_cache
def carried_out(arm: str = "up6") -> Program:
    """Two transfers: a part is gripped beside the arm and taken round a corner; it waits for the toaster, and turns."""
    task = load(ARMS[arm])
    with World() as world:
        settings = task.robot
        robot = RobotArm(
            world, arm_of(settings), settings.speed_m_s, settings.acceleration_m_s2, settings.grip_force_n or USUAL_N
        )
        assert robot.stand(HIGH)
        recorder = MotionRecorder(robot)
        now_s: Callable[[], float] = lambda: world.time_s  # noqa: E731
        run(world, robot.follow([HIGH.shifted(dz=-0.15)], slow=0.6))
        run(world, robot.grip())
        run(world, robot.follow([HIGH, HIGH.shifted(dy=-0.2), HIGH.shifted(dx=0.1, dy=-0.2)], blend=0.1))
        run(world, robot.release())
        first_s = now_s()
        run(world, robot.follow([HIGH.shifted(dyaw=pi / 2)]))
        reach_s = now_s()
        run(world, robot.rest(240))  # until the toaster is done
        run(world, robot.follow([HIGH.shifted(dyaw=pi)]))
        run(world, robot.rest(60))
        moves = [
            Move(1, "plate", "plate", "toaster", 0.0, 0.0, 0.5, first_s, 60.0),
            Move(1, "toaster", "toaster", "butter_applier", first_s, reach_s, reach_s + 1.0, now_s()),
        ]
        return recorder.program(task, 0, moves, "slice {}".format)


@pytest.fixture(params=ARMS)
def program(request: pytest.FixtureRequest) -> Program:
    """Of each arm."""
    return carried_out(request.param)


@pytest.fixture
def up6() -> Program:
    """Of the lab's own arm."""
    return carried_out()


@pytest.fixture
def folder(up6: Program, tmp_path: Path) -> Path:
    """A run's folder."""
    up6.save(tmp_path)
    return tmp_path
