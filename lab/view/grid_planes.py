"""Where the cells of a problem's grid stand in its picture: one rule for drawings in text, on the page and by Gymnasium."""

from math import prod
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.mdp import TabularMDP


class Grid(Protocol):
    """What `is_map` reads of a problem, or of a policy: the lengths of its axes, and what its moves are called."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def action_labels(self) -> tuple[str, ...]: ...


def is_map(grid: Grid) -> bool:
    """Whether axes 0 and 1 are the x and y of a map seen from above: the moves along axis 0 are called left and right."""
    return len(grid.shape) >= 2 and grid.action_labels[:2] == ("left", "right")


class Planes:
    """Planes of axes 0 and 1: rows run down and columns to the right, but on a map x runs to the right and y up.

    A single axis is one row; the axes beyond the second make `layers`.
    """

    def __init__(self, shape: tuple[int, ...], flips: bool):
        self.flips = flips
        self._shape = (1, *shape) if len(shape) < 2 else shape
        self.rows, self.columns = self._shape[1::-1] if flips else self._shape[:2]
        self.layers = prod(self._shape[2:])

    def place(self, cell: tuple[int, ...]) -> tuple[int, int]:
        """Row and column of a cell."""
        first, second = (0, *cell) if len(cell) < 2 else cell[:2]
        return (self.rows - 1 - second, first) if self.flips else (first, second)

    def layer(self, cell: tuple[int, ...]) -> int:
        """The layer of a cell, counted from 0."""
        return int(np.ravel_multi_index(cell[2:], self._shape[2:])) if len(cell) > 2 else 0

    def plane(self, values: ArrayLike, layer: int = 0) -> NDArray[Any]:
        """What one layer (rows, columns) has of a value a cell, given in the order of states."""
        plane = np.reshape(values, (*self._shape[:2], -1))[:, :, layer]
        return plane.T[::-1] if self.flips else plane


class GridPlanes(Planes):
    """The planes of a problem's grid; of a coverage problem it is the grid to cover."""

    def __init__(self, mdp: TabularMDP):
        super().__init__(mdp.coverage_shape or mdp.shape, is_map(mdp))
        self.mdp = mdp

    def marks(self, layer: int, free: str = ".") -> NDArray[np.str_]:
        """One layer (rows, columns): G goal, # obstacle, else `free`."""
        return self.plane(np.where(self.mdp.goal, "G", np.where(self.mdp.terminal, "#", free)), layer)
