"""What a sentence can refer to: actions and named objects on a map, or parts, stations and moves of an order."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Cell = tuple[int, int]  # row and column of the picture: row 0 is the far side, column 0 the left
UP, DOWN = "up", "down"


@dataclass(frozen=True)
class SceneObject:
    """An object on the map: its id, the words that name it, and its cells in the picture."""

    id: str
    names: tuple[str, ...]
    cells: tuple[Cell, ...] = ()

    @property
    def is_goal(self) -> bool:
        """Whether it is the goal of the moves instead of something in their way."""
        return self.id == "goal"


@dataclass(frozen=True)
class GridScene:
    """A map with its actions by name, its objects, the robot's cell, the size of a cell in cm (None: unknown), and its extent."""

    actions: tuple[str, ...]
    objects: tuple[SceneObject, ...] = ()
    robot: Cell | None = None
    cell_cm: float | None = None
    extent: int = 1000  # the most steps that fit on the map in one direction

    @property
    def has_height(self) -> bool:
        """Whether up and down are heights instead of directions in the picture."""
        return UP in self.actions and "forward" in self.actions

    def object(self, id_: str) -> SceneObject:
        """The object with this id. Raises KeyError."""
        return {thing.id: thing for thing in self.objects}[id_]


@dataclass(frozen=True)
class AllowedMove:
    """An allowed move of an order: its number, part, and the stations it leaves and reaches."""

    number: int
    part: str
    origin: str
    target: str


@dataclass(frozen=True)
class OrderScene:
    """The parts, stations and allowed moves of a question about the order of transfers."""

    parts: tuple[str, ...]
    stations: tuple[str, ...]
    moves: tuple[AllowedMove, ...] = field(default=())


Scene = GridScene | OrderScene


def scene_of(record: Mapping[str, Any]) -> Scene:
    """The scene of its JSON form: {"kind": "grid" or "order", ...}, as in tests/words/scenes.json."""
    if record["kind"] == "order":
        moves = tuple(AllowedMove(m["number"], m["part"], m["from"], m["to"]) for m in record["moves"])
        return OrderScene(tuple(record["parts"]), tuple(record["stations"]), moves)
    rows: Sequence[str] = record["map"]
    robot = next(((r, row.index("R")) for r, row in enumerate(rows) if "R" in row), None)
    objects = tuple(
        SceneObject(o["id"], tuple(o["names"]), tuple((r, c) for r, c in o["cells"])) for o in record["objects"]
    )
    extent = max(len(rows), *map(len, rows))
    return GridScene(tuple(record["actions"]), objects, robot, record.get("cell_cm"), extent)
