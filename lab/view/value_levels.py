"""The values and best moves of a policy on a grid of any dimension, as one picture: a small map for each level.

Also `Planes`, the layers of a grid as rows and columns, which other views of a grid use.
"""

from collections.abc import Sequence
from math import prod
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput
from lab.lazy import matplotlib
from lab.mdp import FloatArray, TabularMDP
from lab.toolbox.policy import GOAL, ON, OUT, Policy
from lab.view.canvas import GREY, INK, ORANGE, PALE_GREY, RED, check_png, picture_file


class Grid(Protocol):
    """The attributes of a problem or a policy that `is_map` reads: the lengths of its axes, and the names of its moves."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def action_labels(self) -> tuple[str, ...]: ...


def is_map(grid: Grid) -> bool:
    """Whether axes 0 and 1 are x and y of a map seen from above, which is so if axis 0 has the moves left and right."""
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
        """The row and column of a cell."""
        first, second = (0, *cell) if len(cell) < 2 else cell[:2]
        return (self.rows - 1 - second, first) if self.flips else (first, second)

    def layer(self, cell: tuple[int, ...]) -> int:
        """The layer of a cell, counted from 0."""
        return int(np.ravel_multi_index(cell[2:], self._shape[2:])) if len(cell) > 2 else 0

    def plane(self, values: ArrayLike, layer: int = 0) -> NDArray[Any]:
        """One layer (rows, columns) of `values`, which holds one value per cell in the order of states."""
        plane = np.reshape(values, (*self._shape[:2], -1))[:, :, layer]
        return plane.T[::-1] if self.flips else plane


class GridPlanes(Planes):
    """The planes of a problem's grid; for a coverage problem, those of the grid to cover."""

    def __init__(self, mdp: TabularMDP):
        super().__init__(mdp.coverage_shape or mdp.shape, is_map(mdp))
        self.mdp = mdp

    def marks(self, layer: int, free: str = ".") -> NDArray[np.str_]:
        """The marks of one layer (rows, columns): G goal, # obstacle, otherwise `free`."""
        return self.plane(np.where(self.mdp.goal, "G", np.where(self.mdp.terminal, "#", free)), layer)


# ---- the picture of a policy's levels -----------------------------------------------------------------------------------


MAX_LEVELS = 40  # drawn; of more, those with start or goal and the most visited ones
MAX_CELLS = 10_000  # of a level
_IN_A_ROW = 5  # levels, unless a fourth axis says how many
_LEAST_SIDE = 6.0  # [pt] of a cell with a sign; in a smaller cell it would not be legible
# direction of a move in the picture, by its name: x to the right, y downwards
_ARROWS = {"left": (-1, 0), "right": (1, 0), "up": (0, -1), "down": (0, 1), "forward": (0, -1), "backward": (0, 1)}
_SIGNS = {"down": r"$\otimes$", "up": r"$\odot$", "turn right": "$↻$", "turn left": "$↺$"}  # where forward is up


class LearnedValues(NamedTuple):
    """The drawn properties of each state (S,): value and index of its best action, whether it was visited or is terminal."""

    values: FloatArray
    best: NDArray[np.int64]
    visited: NDArray[np.bool_]
    ends: NDArray[np.uint8]


def can_be_drawn(policy: Policy) -> bool:
    """Whether the policy's states form a grid whose levels fit into a picture."""
    return bool(policy.shape) and int(np.prod(policy.shape[:2])) <= MAX_CELLS


def value_levels(policy: Policy, path: Path) -> None:
    """Draw the values and the best moves of a policy's cells, one map per level, into a PNG file.

    Moves with known names have a sign. Raises BadInput when the states are not a grid or the grid is too large, and for a
    path that is no PNG file.
    """
    check_png(path)
    if not can_be_drawn(policy):
        raise BadInput(f"value map of '{policy.name}': a grid with up to {MAX_CELLS} cells a level is needed")
    planes = Planes(policy.shape, is_map(policy))
    ends = policy.ends
    learned = LearnedValues(policy.q.max(axis=1), policy.q.argmax(axis=1), policy.visits.sum(axis=1) > 0, ends)
    start = tuple(int(i) for i in np.unravel_index(policy.start, policy.shape))
    levels = _chosen(planes, learned, planes.layer(start))
    columns = policy.shape[3] if len(policy.shape) == 4 else -(-len(levels) // -(-len(levels) // _IN_A_ROW))
    rows = -(-len(levels) // columns)
    wide_inch = 4.4 if len(levels) == 1 else min(3.0, max(1.25, 0.26 * planes.columns))
    tall_inch = wide_inch * planes.rows / planes.columns
    with picture_file(path, max(5.2, wide_inch * columns + 1.3), (tall_inch + 0.3) * rows + 0.8) as figure:
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in grid[len(levels) :]:
            axes.remove()
        shown = learned.values[learned.visited & (ends == ON)]
        scale = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
        pen = Pen(72 * wide_inch / planes.columns, planes, policy.action_labels, scale)
        for axes, level in zip(grid, levels, strict=False):
            tint = pen.draw_level(axes, learned, level)
            axes.set_title(_level_name(policy.shape, level), fontsize=8)
            if level == planes.layer(start):
                pen.draw_start(axes, planes.place(start))
        figure.colorbar(
            tint, ax=list(grid[: len(levels)]), shrink=0.8, aspect=30, label="value of the best move, max Q"
        )
        figure.legend(handles=_legend(policy, learned), loc="outside lower center", ncols=4)


def _chosen(planes: Planes, learned: LearnedValues, first: int) -> list[int]:
    """The levels to draw, in order: that of the start, those with a goal, then the most visited ones."""
    visits = np.array([planes.plane(learned.visited, level).sum() for level in range(planes.layers)])
    goals = np.array([(planes.plane(learned.ends, level) == GOAL).any() for level in range(planes.layers)])
    order: list[int] = np.lexsort((-visits, ~goals, np.arange(planes.layers) != first)).tolist()
    return sorted(order[:MAX_LEVELS])


def _level_name(shape: tuple[int, ...], level: int) -> str:
    """The name of a level: its index along the third and each further axis."""
    cell = np.unravel_index(level, shape[2:]) if len(shape) > 2 else ()
    names = ("level", "turn") if len(cell) <= 2 else tuple(f"axis {axis}" for axis in range(2, len(shape)))
    return ", ".join(f"{name} {int(at)}" for name, at in zip(names, cell, strict=False))


class Pen(NamedTuple):
    """The drawing settings of levels: a cell's side [pt], the planes, the names of moves, the least and largest value."""

    side: float
    planes: Planes
    labels: tuple[str, ...]
    scale: tuple[float, float]

    def draw_level(
        self, axes: "matplotlib.axes.Axes", learned: LearnedValues, level: int
    ) -> "matplotlib.collections.QuadMesh":
        """Draw one level's colours and signs; returns the mesh of its colours."""
        values, best, visited, ends = (self.planes.plane(table, level) for table in learned)
        seen = visited & (ends == ON)
        colours = np.ma.masked_where(~seen, values)
        tint = axes.pcolormesh(colours, cmap="viridis", vmin=self.scale[0], vmax=self.scale[1], alpha=0.7)
        axes.pcolormesh(np.ma.masked_where(ends != OUT, ends), cmap=_one_colour(GREY))
        axes.set(facecolor=PALE_GREY, xlim=(0, self.planes.columns), ylim=(self.planes.rows, 0), xticks=[], yticks=[])
        axes.set_aspect("equal")
        if self.side >= _LEAST_SIDE:
            self._draw_moves(axes, np.where(seen, best, -1))
        self._mark(axes, ends == GOAL, "*", 0.85, ORANGE)
        return tint

    def draw_start(self, axes: "matplotlib.axes.Axes", place: tuple[int, int]) -> None:
        """Draw a ring around the start cell."""
        at = np.zeros((self.planes.rows, self.planes.columns), bool)
        at[place] = True
        self._mark(axes, at, "o", 0.8, "none", RED)

    def _draw_moves(self, axes: "matplotlib.axes.Axes", best: NDArray[np.int64]) -> None:
        """Draw an arrow for moves to a neighbouring cell, and a sign for other moves."""
        signs = _signs(self.labels)
        length: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0}
        look: dict[str, Any] = {
            "width": 0.09 * self.side,
            "units": "dots",
            "color": INK,
            "headwidth": 4,
            "headlength": 4,
        }
        for action, name in enumerate(self.labels):
            if name in signs:
                self._mark(axes, best == action, signs[name], 0.6, INK)
            elif name in _ARROWS:
                x, y = _ARROWS[name]
                rows, columns = np.nonzero(best == action)
                tails = columns + 0.5 - 0.3 * x, rows + 0.5 - 0.3 * y
                axes.quiver(*tails, np.full(len(rows), 0.6 * x), np.full(len(rows), 0.6 * y), **length, **look)

    def _mark(
        self,
        axes: "matplotlib.axes.Axes",
        where: NDArray[np.bool_],
        marker: str,
        size: float,
        face: str,
        edge: str = INK,
    ) -> None:
        """Draw a marker in some cells; `size`: as a share of a cell's side."""
        rows, columns = np.nonzero(where)
        axes.scatter(
            columns + 0.5, rows + 0.5, (size * self.side) ** 2, face, marker=marker, edgecolors=edge, linewidths=0.5
        )


def _one_colour(colour: str) -> "matplotlib.colors.ListedColormap":
    return matplotlib.colors.ListedColormap([colour])


def _legend(policy: Policy, learned: LearnedValues) -> list["matplotlib.lines.Line2D"]:
    """The legend of the signs that are not plain arrows."""

    def sign(name: str, marker: str, face: str, edge: str = INK) -> matplotlib.lines.Line2D:
        return matplotlib.lines.Line2D(
            [], [], linestyle="none", marker=marker, color=face, markeredgecolor=edge, markersize=8, label=name
        )

    signs = [sign("start", "o", "none", RED), sign("goal", "*", ORANGE)]
    signs += [sign("never visited", "s", PALE_GREY, GREY)] * bool((~learned.visited & (learned.ends == ON)).any())
    signs += [sign("ends without the goal", "s", GREY, GREY)] * bool((learned.ends == OUT).any())
    return signs + [sign(name, marker, INK) for name, marker in _signs(policy.action_labels).items()]


def _signs(labels: Sequence[str]) -> dict[str, str]:
    """The signs of the moves out of the plane; up and down are such moves only where forward points up in the picture."""
    return {name: _SIGNS[name] for name in labels if name in _SIGNS and "forward" in labels}
