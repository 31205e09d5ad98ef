"""A cell in which three moves make a toast within seconds, its skills learned once."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from lab.production.composer import Conditions
from lab.production.operation.operation import Operation
from lab.production.run_journal import RunBegan, RunJournal
from lab.tasks.task import Task
from lab.tasks.task_fields import Stage
from lab.tasks.task_file import load
from lab.teaching.events import Event
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

Made = Callable[..., Operation]


@pytest.fixture(scope="session")
def brisk() -> Task:
    shipped = load("toast")
    still = tuple(o.model_copy(update={"area": (0.0, 0.0)}) for o in shipped.obstacles)
    stations = tuple(
        s.model_copy(update={"processing_s": 4.0} if s.name == "toaster" else {}) for s in shipped.stations
    )
    quick = {name: p.model_copy(update={"speed_m_s": 0.2, "dwell_s": 0.05}) for name, p in shipped.processes.items()}
    route = tuple(Stage(station=stage.station) for stage in shipped.parts[0].routes[0])
    slices = shipped.parts[0].model_copy(update={"routes": (route,)})
    return shipped.changed(obstacles=still, stations=stations, processes=quick, parts=(slices,))


@pytest.fixture(scope="session")
def toolbox(tmp_path_factory: pytest.TempPathFactory) -> Toolbox:
    return Toolbox(tmp_path_factory.mktemp("box"))


@pytest.fixture
def heard() -> list[Event]:
    return []


@pytest.fixture
def made(brisk: Task, toolbox: Toolbox, heard: list[Event], tmp_path: Path) -> Iterator[Made]:
    """A new operation with so many slices, its journal in a folder of that name; box: another toolbox than the shared one."""
    all_made: list[tuple[Operation, RunJournal]] = []

    def make(parts: int = 1, folder: str = "run", box: Toolbox = toolbox) -> Operation:
        journal = RunJournal.begin(tmp_path / folder, RunBegan({}, brisk.name, ""))
        teacher = Teacher(box, tell=heard.append)
        operation = Operation(brisk, brisk.order(parts), 0, teacher, Conditions(journal=journal))
        all_made.append((operation, journal))
        return operation

    yield make
    for operation, journal in all_made:
        operation.close()
        journal.close()
