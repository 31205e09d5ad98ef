"""The grid on the teaching page: where its cells are, and what the learner thinks of those of one layer, as plain data.

The page draws; here is decided which cell is where: rows run down, columns to the right, and a map is shown as from
above (see `lab.view.grid_planes`). Axes beyond the second are layers.
"""

from functools import lru_cache
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.learning.selection import chances
from lab.learning.updates import Table
from lab.mdp import TabularMDP
from lab.seat.grid_text import direction_of
from lab.view.grid_planes import GridPlanes

Json = dict[str, Any]
LOWER, HIGHER = 4, 5  # directions along the third axis, after those in the picture: up, down, left, right
MOST_ARROWS = 1600  # cells of a layer beyond which arrows cannot be seen, and are left out
MOST_CELLS = 1 << 14  # of a layer; a page draws no more
MOST_GOALS = 20


@lru_cache(maxsize=8)
def _planes(mdp: TabularMDP) -> GridPlanes:
    return GridPlanes(mdp)


@lru_cache(maxsize=8)
def place_of(mdp: TabularMDP) -> Json | None:
    """What stays of a problem's grid: rows, columns and layers, where goals are; None when its states are no grid.

    Not to be changed: it is kept.
    """
    shape = mdp.coverage_shape or mdp.shape
    if not shape or (planes := _planes(mdp)).rows * planes.columns > MOST_CELLS:
        return None
    goals = [] if mdp.coverage_shape else [spot(mdp, int(s)) for s in np.flatnonzero(mdp.goal)[:MOST_GOALS]]
    sizes = {"rows": planes.rows, "columns": planes.columns, "layers": planes.layers}
    return {**sizes, "goals": goals, "directions": directions(mdp)}


def spot(mdp: TabularMDP, state: int) -> list[int]:
    """[row, column, layer] of a state as the page draws it; [] when the states are no grid."""
    cell = mdp.state_cell(state)
    return [*_planes(mdp).place(cell), _planes(mdp).layer(cell)] if cell else []


def directions(mdp: TabularMDP) -> list[int | None]:
    """Where each action points: up, down, left, right in the picture, a layer lower, a layer higher; None: nowhere."""
    pointing = [direction_of(mdp, action) for action in range(mdp.n_actions)]
    if len(mdp.shape) == 3 and mdp.n_actions == 6:
        pointing[4:6] = [LOWER, HIGHER]
    return pointing


def slice_of(mdp: TabularMDP, state: int, layer: int, q: Table | None, selection: str, temperature: float) -> Json:
    """One layer: what stands in each cell, its value and what the learner would rather do there.

    "marks": a character a cell, row by row: "." free, "#" obstacle, "G" goal, "x" covered. "values": max_a Q(s, a) of each
    cell that the learner has an opinion of, None elsewhere. "prefers": [cell, action, its chance] of these. In a problem of
    covering, a cell is worth what the head there would be, all else as in `state`.
    """
    states = _states(mdp, state, layer)
    seen = np.where(mdp.covered(state), "x", ".") if mdp.coverage_shape else _planes(mdp).marks(layer)
    marks = "".join(seen.ravel().tolist())
    values: list[float | None] = [None] * len(states)
    prefers: list[list[float]] = []
    if q is not None:
        over = mdp.terminal
        for cell, own in enumerate(states.tolist()):
            row = q[own]
            best = max(row)
            if over[own] or best == min(row):
                continue
            values[cell] = float(f"{best:.4g}")
            if len(states) <= MOST_ARROWS:
                likely = chances(selection, row, temperature)
                action = likely.index(max(likely))
                prefers.append([cell, action, round(likely[action], 2)])
    return {"layer": layer, "marks": marks, "values": values, "prefers": prefers}


def _states(mdp: TabularMDP, state: int, layer: int) -> NDArray[np.int64]:
    """The states of a layer's cells, row by row as they are drawn."""
    if mdp.coverage_shape:
        heads = np.arange(prod(mdp.coverage_shape))
        mask = state & ((1 << len(heads)) - 1)
        return (heads << len(heads)) | mask | (1 << heads)
    return _planes(mdp).plane(np.arange(mdp.n_states), layer).ravel()
