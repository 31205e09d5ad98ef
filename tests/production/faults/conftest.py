"""Two toasts, prepared and taught once for all tests of faults, and floors on which faults strike."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest

from lab.production.faults.injector import Injector
from lab.production.floor import Floor, Hooks
from lab.production.taught import Taught, teach_all
from lab.sim.parts.kinds import Spot
from lab.sim.world import World
from lab.skills.prepared_scene import Prepared, prepare
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task_file import load
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

Struck = Callable[..., tuple[Floor, Injector]]


@pytest.fixture(scope="session")
def teacher(tmp_path_factory: pytest.TempPathFactory) -> Teacher:
    return Teacher(Toolbox(tmp_path_factory.mktemp("box")))


@pytest.fixture(scope="session")
def two_toasts(teacher: Teacher) -> tuple[Prepared, Taught]:
    """Seconds: the skills are learned."""
    task = load("toast")
    prepared = prepare(task, task.order(2), 0)
    return prepared, teach_all(prepared, teacher)


@pytest.fixture
def floor_with() -> Iterator[Callable[[Prepared, Sequence[dict[str, Any]]], tuple[Floor, Injector]]]:
    """A floor for a prepared task on which these faults strike, each in the first step in which it can."""
    worlds: list[World] = []

    def make(prepared: Prepared, faults: Sequence[dict[str, Any]]) -> tuple[Floor, Injector]:
        worlds.append(World())
        injector = Injector([FaultFields.model_validate(fields) for fields in faults])
        scene = prepared.skillset, prepared.layout, prepared.order
        floor = Floor(worlds[-1], *scene, hooks=Hooks(before_step=injector.tick))
        injector.prepare(floor.scene)
        return floor, injector

    yield make
    for world in worlds:
        world.close()


@pytest.fixture
def spots() -> Callable[[Floor], dict[str, Spot]]:
    """Where the parts of a task without pallets begin, by name."""

    def of(floor: Floor) -> dict[str, Spot]:
        order, places = floor.scene.order, floor.scene.places
        return {f"{kind} {n}": spot for n, (kind, spot) in enumerate(zip(order, places.begins(order), strict=True), 1)}

    return of
