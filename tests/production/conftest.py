"""Cells to sequence by command, and a task as if it had been measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.tasks.task import Order
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

# A toast takes 2 s into the oven, 10 s in it and 2 s out; the robot comes back in 1 s for the next one: 14 s, 29 s.
OVEN = """
name = "oven"
kind = "cell"
parts = 2
stations = [
  { name = "in", kind = "storage", capacity = 9 },
  { name = "hot", kind = "machine", capacity = 1, processing_s = 10 },
  { name = "out", kind = "storage", capacity = 9 },
]
robot = { start = "in" }
products = [{ name = "toast", routes = [["in", "hot", "out"]] }]
travel = { in = { hot = 1, out = 1 }, hot = { in = 1, out = 1 }, out = { in = 1, hot = 1 } }
loaded = { in = { hot = 2 }, hot = { out = 2 } }
"""
LATE = "due_s = [14, 20]\n" + OVEN  # the second toast is out after 29 s, 9 s late

# Two products that meet head-on: once each is in the machine that the other wants, nothing moves any more.
CROSSING = """
name = "crossing"
kind = "cell"
order = ["east", "west"]
stations = [
  { name = "in", kind = "storage", capacity = 2 },
  { name = "left", kind = "machine", capacity = 1, processing_s = 5 },
  { name = "right", kind = "machine", capacity = 1, processing_s = 5 },
  { name = "out", kind = "storage", capacity = 2 },
]
robot = { start = "in" }
products = [
  { name = "east", routes = [["in", "left", "right", "out"]] },
  { name = "west", routes = [["in", "right", "left", "out"]] },
]
[travel]
in = { left = 1, right = 1, out = 1 }
left = { in = 1, right = 1, out = 1 }
right = { in = 1, left = 1, out = 1 }
out = { in = 1, left = 1, right = 1 }
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to run in that holds the cells of this file, with a toolbox that is not there yet."""
    for name, text in (("oven", OVEN), ("late", LATE), ("crossing", CROSSING)):
        (tmp_path / f"{name}.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    return tmp_path


@pytest.fixture
def teacher(folder: Path) -> Teacher:
    return Teacher(Toolbox(folder / "toolbox"))


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Order, int]]:
    """The oven of the file above as if it had been measured; what was prepared: task, order, seed."""
    prepared: list[tuple[str, Order, int]] = []

    def prepare(task: Any, order: Order, seed: int) -> Order:
        prepared.append((task.name, order, seed))
        return order

    def cell(order: Order, *_: object) -> SimpleNamespace:
        stations = (Station("in", "storage", 9), Station("hot", "machine", 1, 10.0), Station("out", "storage", 9))
        step = np.ones((3, 3)) - np.eye(3)
        route = (Stage("in"), Stage("hot"), Stage("out"))
        made = tuple(Product(kind, (route,)) for kind in dict.fromkeys(order))
        return SimpleNamespace(cell=Cell(stations, made, order, step, 2 * step, one_robot("in")))

    monkeypatch.setattr("lab.skills.prepared_scene.prepare", prepare)
    monkeypatch.setattr("lab.production.taught.teach_all", cell)
    return prepared
