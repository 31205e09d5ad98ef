"""The grid on the teaching page: where its cells are, and what the learner thinks of those of one layer, as plain data.

The page draws; here is decided which cell is where: rows run down, columns to the right, and a map is shown as from
above (see `lab.seat.grid_text`). Axes beyond the second are layers.
"""

from functools import lru_cache
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.learning.selection import chances
from lab.learning.updates import Table
from lab.mdp import TabularMDP
from lab.seat.grid_text import direction_of, is_map

Json = dict[str, Any]
LOWER, HIGHER = 4, 5  # directions along the third axis, after those in the picture: up, down, left, right
MOST_ARROWS = 1600  # cells of a layer beyond which arrows cannot be seen, and are left out
MOST_CELLS = 1 << 14  # of a layer; a page draws no more
MOST_GOALS = 20


@lru_cache(maxsize=8)
def place_of(mdp: TabularMDP) -> Json | None:
    """What stays of a problem's grid: rows, columns and layers, where goals are; None when its states are no grid.

    Not to be changed: it is kept.
    """
    shape = mdp.coverage_shape or mdp.shape
    rows, columns, layers = _sizes(shape, is_map(mdp))
    if not shape or rows * columns > MOST_CELLS:
        return None
    goals = [] if mdp.coverage_shape else [spot(mdp, int(s)) for s in np.flatnonzero(mdp.goal)[:MOST_GOALS]]
    labels = mdp.action_labels
    along = labels[4:6] if len(labels) == 2 * len(shape) and len(shape) == 3 else ("-", "+")
    pointing = directions(mdp)
    return {"rows": rows, "columns": columns, "layers": layers, "along": list(along), "goals": goals} | {
        "directions": pointing
    }


def spot(mdp: TabularMDP, state: int) -> list[int]:
    """[row, column, layer] of a state as the page draws it; [] when the states are no grid."""
    cell, shape = mdp.state_cell(state), mdp.coverage_shape or mdp.shape
    if not cell:
        return []
    if len(cell) == 1:
        return [0, cell[0], 0]
    layer = int(np.ravel_multi_index(cell[2:], shape[2:])) if len(cell) > 2 else 0
    return [shape[1] - 1 - cell[1], cell[0], layer] if is_map(mdp) else [cell[0], cell[1], layer]


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
    marks = (
        _marks(mdp, states) if not mdp.coverage_shape else "".join(".x"[c] for c in mdp.covered(state).ravel().tolist())
    )
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


def _sizes(shape: tuple[int, ...], flips: bool) -> tuple[int, int, int]:
    if len(shape) < 2:
        return 1, prod(shape), 1
    rows, columns = (shape[1], shape[0]) if flips else (shape[0], shape[1])
    return rows, columns, prod(shape[2:])


def _states(mdp: TabularMDP, state: int, layer: int) -> NDArray[np.int64]:
    """The states of a layer's cells, row by row as they are drawn."""
    if mdp.coverage_shape:
        heads = np.arange(prod(mdp.coverage_shape))
        mask = state & ((1 << len(heads)) - 1)
        return (heads << len(heads)) | mask | (1 << heads)
    return _layer_states(mdp.shape, is_map(mdp), layer)


@lru_cache(maxsize=256)
def _layer_states(shape: tuple[int, ...], flips: bool, layer: int) -> NDArray[np.int64]:
    states = np.arange(prod(shape))
    if len(shape) < 2:
        return states
    plane = states.reshape(*shape[:2], -1)[:, :, layer]
    return (plane.T[::-1] if flips else plane).ravel()


def _marks(mdp: TabularMDP, states: NDArray[np.int64]) -> str:
    return "".join(np.where(mdp.goal[states], "G", np.where(mdp.terminal[states], "#", ".")).tolist())
