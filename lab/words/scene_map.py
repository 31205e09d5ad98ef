"""A problem's table as the map that sentences refer to: where its states are, and its obstacles by name."""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lab.mdp import TabularMDP
from lab.words.scene import Cell, GridScene, SceneObject

Spot = tuple[int, int, int]  # row, column and level


@dataclass(frozen=True)
class Named:
    """An obstacle of a problem: its id, the words that name it, and its cells along the first axes, up to three."""

    id: str
    names: tuple[str, ...]
    cells: frozenset[tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class SceneMap:
    """A problem's table as the map that sentences refer to.

    actions: the name of each action in the picture. place: the row and column of a cell. objects: the obstacles by name.
    goal_names: the words that name the goal. cell_cm: the size of a cell, None if it is unknown.
    """

    mdp: TabularMDP
    actions: tuple[str, ...]
    place: Callable[[tuple[int, ...]], Cell]
    objects: tuple[Named, ...] = ()
    goal_names: tuple[str, ...] = ("goal",)
    cell_cm: float | None = None
    _near: dict[str, frozenset[int]] = field(default_factory=dict)

    @cached_property
    def spots(self) -> tuple[Spot, ...]:
        """The row, column and level of each state."""
        cells = [self.mdp.state_cell(state) for state in range(self.mdp.n_states)]
        return tuple((*self.place(cell), cell[2] if len(cell) > 2 else 0) for cell in cells)

    @cached_property
    def closed(self) -> NDArray[np.bool_]:
        """The states that end an episode without reaching a goal, (S,) bool."""
        return np.asarray(self.mdp.terminal & ~self.mdp.goal)

    @cached_property
    def spots_of(self) -> Mapping[str, frozenset[Spot]]:
        """The spots of each object and of the goal, by id."""
        known = {
            thing.id: frozenset((*self.place(cell), cell[2] if len(cell) > 2 else 0) for cell in thing.cells)
            for thing in self.objects
        }
        known["goal"] = frozenset(self.spots[int(state)] for state in np.flatnonzero(self.mdp.goal))
        return known

    def scene(self, state: int) -> GridScene:
        """The scene with the robot in a state."""
        ids = [(thing.id, thing.names) for thing in self.objects] + [("goal", self.goal_names)] * bool(
            self.mdp.goal.any()
        )
        objects = tuple(
            SceneObject(id_, names, tuple(sorted({(row, column) for row, column, _ in self.spots_of[id_]})))
            for id_, names in ids
        )
        return GridScene(self.actions, objects, self.spots[state][:2], self.cell_cm, max(self.mdp.shape, default=1000))

    def near(self, id_: str) -> frozenset[int]:
        """The states next to an object, diagonally too, and those in it."""
        if id_ not in self._near:
            there = {
                (row + r, column + c, level + z)
                for row, column, level in self.spots_of.get(id_, ())
                for r in (-1, 0, 1)
                for c in (-1, 0, 1)
                for z in (-1, 0, 1)
            }
            self._near[id_] = frozenset(state for state, spot in enumerate(self.spots) if spot in there)
        return self._near[id_]


def obstacles_of(mdp: TabularMDP, causes: NDArray[np.str_] | None = None) -> tuple[Named, ...]:
    """The obstacles of a grid: those with a name by `causes` ("" or names, ", " between them, of the grid's first axes).

    All other obstacles are cubes, one for each cluster of cells that touch along an axis, in the order of their first cells.
    """
    axes = min(len(mdp.shape), 3)
    if not axes:
        return ()
    closed = (mdp.terminal & ~mdp.goal).reshape(mdp.shape)
    blocked = np.asarray(closed.any(axis=tuple(range(axes, closed.ndim)))) if closed.ndim > axes else closed
    named: dict[str, set[tuple[int, ...]]] = {}
    left = {tuple(map(int, cell)) for cell in np.argwhere(blocked)}
    if causes is not None and causes.shape[:axes] == blocked.shape:
        for cell in sorted(left):
            for name in str(np.ravel(causes[cell])[0]).split(", "):
                if name:
                    named.setdefault(name.replace("_", " "), set()).add(cell)
        left -= set().union(*named.values()) if named else set()
    found = [
        Named(name, _names(name), frozenset(cells))
        for name, cells in sorted(named.items())
        if not name.startswith("out of ")
    ]
    clusters = _clusters(left)
    for number, cells in enumerate(clusters, 1):
        found.append(Named(f"cube-{number}" if len(clusters) > 1 else "cube", ("cube", "block"), cells))
    return tuple(found)


def _names(name: str) -> tuple[str, ...]:
    """A name with its kind and its singular: "cubes C" is also "cube C", "cubes" and "cube"."""
    kind = re.sub(r"[ -]?(\d+|\b[A-Za-z])$", "", name) or name
    return tuple(dict.fromkeys((name, name.replace(kind, kind.removesuffix("s"), 1), kind, kind.removesuffix("s"))))


def _clusters(cells: Collection[tuple[int, ...]]) -> list[frozenset[tuple[int, ...]]]:
    left, found = set(cells), []
    for first in sorted(cells):
        if first not in left:
            continue
        cluster, pending = {first}, [first]
        left.discard(first)
        while pending:
            cell = pending.pop()
            for axis in range(len(cell)):
                for by in (-1, 1):
                    other = (*cell[:axis], cell[axis] + by, *cell[axis + 1 :])
                    if other in left:
                        left.discard(other)
                        cluster.add(other)
                        pending.append(other)
        found.append(frozenset(cluster))
    return found
