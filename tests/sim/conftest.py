"""What the simulator's tests stand on: the shipped task, an empty world, and the arm alone in one."""

from collections.abc import Iterator

import pytest

from lab.sim.arm_models import arm_named
from lab.sim.robot import Robot
from lab.sim.world import World
from lab.tasks.task_file import Task, load


@pytest.fixture(scope="session")
def task() -> Task:
    """The task that ships."""
    return load("toast")


@pytest.fixture
def world() -> Iterator[World]:
    """A world of its own."""
    with World() as made:
        yield made


@pytest.fixture
def robot(world: World) -> Robot:
    """The arm, alone in `world`."""
    return Robot(world, arm_named("up6"), speed=0.5, acceleration=2.0, grip_force=25.0)
