"""Tile coding: linear values that neighbouring states share, for spaces too large for a table; the cells of continuous spaces.

A tiling is a grid of tiles, each `tilings` cells wide along each axis; there are `tilings` of them, each shifted by a few cells
against the previous one. A state's value is the sum of the weights of its tiles, one in each tiling. All borders of tiles are
borders of cells, so a cell's number is all that tile coding knows of a state; in a continuous space, too, the learner's state is
such a number, by which it asks, remembers and stores. With one tiling the result is a table of the cells.
The functions are also compiled by numba.
Source: Sutton and Barto 2018, section 9.5.4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.lazy import scipy

MOST_ROUNDS = 300  # iterations of the least-squares fit of weights to a table

TileArray = NDArray[np.int32]
Cell = TypeVar("Cell", int, TileArray)


def cell_along(value: float, low: float, high: float, cells: int) -> int:
    """The index, 0 to cells - 1, of the cell of a value along an axis; out of bounds, of the outermost cell."""
    return int(min(max((value - low) / (high - low) * cells, 0.0), cells - 1.0))


def shift(tiling: int, axis: int, tilings: int) -> int:
    """The shift of a tiling along an axis, in cells: by axis 1, 3, 5, ... times its number, modulo `tilings`.

    Source: Miller and Glanz 1996; Sutton and Barto 2018, section 9.5.4.
    """
    return tiling * (2 * axis + 1) % tilings


def tile_along(cell: Cell, shifted: int, tilings: int) -> Cell:
    """The index of a cell's tile along an axis of a shifted tiling; also for an array of cells."""
    return (cell + shifted) // tilings


@dataclass(frozen=True)
class Bounds:
    """The cells of a continuous space: `shape` equal intervals along each axis between low and high; numbered in C order."""

    low: tuple[float, ...]
    high: tuple[float, ...]
    shape: tuple[int, ...]

    def number(self, point: Sequence[float]) -> int:
        """The number of the cell that contains a point."""
        number = 0
        for axis, cells in enumerate(self.shape):
            number = number * cells + cell_along(point[axis], self.low[axis], self.high[axis], cells)
        return number

    def centre(self, number: int) -> tuple[float, ...]:
        """The centre of a cell."""
        cells = np.unravel_index(number, self.shape)
        ends = zip(cells, self.low, self.high, self.shape, strict=True)
        return tuple(low + (int(cell) + 0.5) * (high - low) / count for cell, low, high, count in ends)


@dataclass(frozen=True)
class TileCoding:
    """The tiles of a grid of cells, numbered tiling after tiling. Raises BadInput if the states are no grid."""

    shape: tuple[int, ...]
    tilings: int

    def __post_init__(self) -> None:
        if not self.shape:
            raise BadInput(f"tilings = {self.tilings}: the problem's states are no grid: allowed is 1, a table")

    @cached_property
    def per_tiling(self) -> tuple[int, ...]:
        """The number of tiles of a tiling along each axis: one more than cover the grid, because tilings are shifted."""
        return tuple((cells - 1 + self.tilings - 1) // self.tilings + 1 for cells in self.shape)

    @cached_property
    def count(self) -> int:
        """The number of tiles."""
        return self.tilings * prod(self.per_tiling)

    def tiles_of(self, state: int) -> list[int]:
        """The numbers of a cell's tiles, one in each tiling."""
        cells = [int(cell) for cell in np.unravel_index(state, self.shape)]
        tiles = []
        for tiling in range(self.tilings):
            number = tiling
            for axis, cell in enumerate(cells):
                shifted = shift(tiling, axis, self.tilings)
                number = number * self.per_tiling[axis] + tile_along(cell, shifted, self.tilings)
            tiles.append(number)
        return tiles

    @cached_property
    def active(self) -> TileArray:
        """The numbers of the tiles of all cells, (S, tilings) int32."""
        cells = np.indices(self.shape, np.int32).reshape(len(self.shape), -1)
        tiles = np.empty((cells.shape[1], self.tilings), np.int32)
        for tiling in range(self.tilings):
            number = np.full(cells.shape[1], tiling, np.int32)
            for axis, cell in enumerate(cells):
                number = number * self.per_tiling[axis] + tile_along(
                    cell, shift(tiling, axis, self.tilings), self.tilings
                )
            tiles[:, tiling] = number
        return tiles

    def values(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """The action values (S, A) of all cells for weights (count, A), summed tiling after tiling."""
        total = np.zeros((len(self.active), weights.shape[1]))
        for tiling in range(self.tilings):
            total += weights[self.active[:, tiling]]
        return total

    def weights(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """The weights (count, A) whose values fit given ones (S, A) best (least squares); exact for tile-coded values."""
        if (values == values[0, 0]).all():
            return np.full((self.count, values.shape[1]), values[0, 0] / self.tilings)
        rows = np.arange(0, self.active.size + 1, self.tilings)
        shape = (len(self.active), self.count)
        lsqr = scipy.sparse.linalg.lsqr
        matrix = scipy.sparse.csr_matrix((np.ones(self.active.size), self.active.ravel(), rows), shape=shape)
        return np.stack(
            [lsqr(matrix, column, atol=1e-13, btol=1e-13, iter_lim=MOST_ROUNDS)[0] for column in values.T], axis=1
        )
