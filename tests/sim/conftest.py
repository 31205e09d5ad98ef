"""What the simulator's tests stand on: tasks that ship, changed stations, an empty world, and the arm alone in one."""

from collections.abc import Callable, Iterator

import pytest

from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.robot import RobotArm
from lab.sim.world import World
from lab.tasks.task import Task
from lab.tasks.task_file import load


@pytest.fixture(scope="session")
def task() -> Task:
    """The task that ships."""
    return load("toast")


@pytest.fixture(scope="session")
def fms() -> Task:
    """The task with pallets: rooks and signs come on them, are lifted off into machines, and go on them."""
    return load("fms-arm")


@pytest.fixture(scope="session")
def palletise() -> Task:
    """The task with places in two layers: boxes of 60 x 30 x 50 mm."""
    return load("palletise")


@pytest.fixture(scope="session")
def breakfast() -> Task:
    """The task with two kinds of parts, slices and cups."""
    return load("breakfast")


@pytest.fixture(scope="session")
def moved() -> Callable[..., Task]:
    """A task with one station changed: moved(task, "plate", capacity=2)."""

    def change(task: Task, name: str, **changed: object) -> Task:
        stations = tuple(s.model_copy(update=changed) if s.name == name else s for s in task.stations)
        return task.changed(stations=stations)

    return change


@pytest.fixture
def world() -> Iterator[World]:
    """A world of its own."""
    with World() as made:
        yield made


@pytest.fixture
def robot(world: World) -> RobotArm:
    """The arm, alone in `world`."""
    return RobotArm(world, arm_named("up6"), speed=0.5, acceleration=2.0, grip_force=25.0)
