"""The learner's question as plain data for the teaching page: the grid, the state, the moves, and the reason."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate, pairwise
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.lazy import rich
from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, Reply, Request
from lab.learning.selection import chances
from lab.learning.updates import Table
from lab.mdp import TabularMDP
from lab.seat import request_text
from lab.seat.grid_text import Marks, StateWords, direction_of, safe_ansi
from lab.seat.page.page_console import order_of
from lab.seat.request_text import choice, leads, outcome
from lab.sequencing.search import SequenceRequest
from lab.view.value_levels import GridPlanes

Json = dict[str, Any]
LOWER, HIGHER = 4, 5  # directions along the third axis, after those in the picture: up, down, left, right
MOST_ARROWS = 1600  # cells of a layer; with more, arrows would be too small and are left out
MOST_CELLS = 1 << 14  # largest number of a layer's cells that a page draws
MOST_GOALS = 20


@lru_cache(maxsize=8)
def _planes(mdp: TabularMDP) -> GridPlanes:
    return GridPlanes(mdp)


@lru_cache(maxsize=8)
def place_of(mdp: TabularMDP) -> Json | None:
    """The constant properties of a problem's grid: rows, columns, layers and goals; None when its states are no grid.

    The result is cached and must not be changed.
    """
    shape = mdp.coverage_shape or mdp.shape
    if not shape or (planes := _planes(mdp)).rows * planes.columns > MOST_CELLS:
        return None
    goals = [] if mdp.coverage_shape else [spot(mdp, int(s)) for s in np.flatnonzero(mdp.goal)[:MOST_GOALS]]
    sizes = {"rows": planes.rows, "columns": planes.columns, "layers": planes.layers}
    return {**sizes, "goals": goals, "directions": directions(mdp)}


def spot(mdp: TabularMDP, state: int) -> list[int]:
    """The [row, column, layer] of a state as the page draws it; [] when the states are no grid."""
    cell = mdp.state_cell(state)
    return [*_planes(mdp).place(cell), _planes(mdp).layer(cell)] if cell else []


def heard_of(request: Request, text: str, moves: Sequence[int]) -> Json:
    """What was understood of a sentence: in words, and its path as cells of the page, the robot's first; [] for no path."""
    path: list[list[int]] = []
    if isinstance(request, AdviceRequest) and moves and request_text.is_known(request.mdp):
        states = accumulate(
            moves, lambda state, action: int(request.mdp.successor[state, action]), initial=request.state
        )
        path = [spot(request.mdp, state) for state in states]
    return {"text": text, "path": path if all(path) else []}


def directions(mdp: TabularMDP) -> list[int | None]:
    """The direction of each action: up, down, left, right in the picture, LOWER, HIGHER; None: none of these."""
    pointing = [direction_of(mdp, action) for action in range(mdp.n_actions)]
    if len(mdp.shape) == 3 and mdp.n_actions == 6:
        pointing[4:6] = [LOWER, HIGHER]
    return pointing


def slice_of(mdp: TabularMDP, state: int, layer: int, q: Table | None, selection: str, temperature: float) -> Json:
    """One layer: the mark, the value and the preferred action of each cell.

    "marks": one character per cell, row by row: "." free, "#" obstacle, "G" goal, "x" covered. "values": max_a Q(s, a) of
    each cell about which the learner has learned something, None elsewhere. "prefers": [cell, action, its probability] of
    these. In a coverage problem, a cell has the value of the state with the head there, all else as in `state`.
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
    """The states of a layer's cells, row by row as drawn."""
    if mdp.coverage_shape:
        heads = np.arange(prod(mdp.coverage_shape))
        mask = state & ((1 << len(heads)) - 1)
        return (heads << len(heads)) | mask | (1 << heads)
    return _planes(mdp).plane(np.arange(mdp.n_states), layer).ravel()


# ---- the question and its moves -----------------------------------------------------------------------------------------


def question_of(request: Request, known: StateWords | None = None) -> Json:
    """The question: the learner's position, the moves, its own choice, and the reason; known: describes states in words."""
    if isinstance(request, AdviceRequest):
        shown = step_of(request, known)
    else:
        assert isinstance(request, SequenceRequest)
        shown = order_of(request)
    lately = request.improvement
    judges = {} if request.judgement == "no" else {"judges": request.judgement}
    return (
        shown
        | judges
        | {
            "own": request.own,
            "why": str(request.reason or ""),
            "rate": None if lately is None else lately.rate,
            "current": None if lately is None else lately.current_mean,
            "previous": None if lately is None else lately.previous_mean,
        }
    )


def step_of(request: AdviceRequest, known: StateWords | None = None) -> Json:
    """The step of a tabular lesson: the learner's state, its allowed actions, and how certain it is."""
    mdp, state = request.mdp, request.state
    return {
        "kind": "step",
        "title": f"Episode {request.episode}, step {request.step}"
        + (f": at {mdp.state_label(state)}" if known is None else ""),
        "where": "" if known is None else known.in_words(state),
        "at": spot(mdp, state),
        "moves": moves_of(request, () if known is None else known.moves_in_words()),
        "would": choice(request, Marks()),
        "temperature": request.temperature,
        "selection": request.selection,
        "picture": picture_of(request.picture),
        "shapes": request.shapes,
    }


def said_of(request: Request, action: Reply) -> str:
    """The answer to a request in words, and its outcome if that is unusual; None: the step was left to the learner."""
    if isinstance(action, Judgement):
        return f"The answer was {action}."
    if isinstance(request, AdviceRequest):
        marks, done = Marks(), request.own if action is None else action
        where = leads(request, done)
        move = marks.named(request.mdp, done) + (f"; that {where}" if where else "")
    else:
        move = f"move {request.own if action is None else action}"
    return f"Left to the learner: it chose {move}." if action is None else f"The answer was {move}."


def moves_of(request: AdviceRequest, sizes: Sequence[str] = ()) -> list[Json]:
    """The record of each action: label, length, direction, the learner's probability and value of it, and its outcome."""
    mdp, state = request.mdp, request.state
    rows = zip(mdp.action_labels, directions(mdp), request.chances, request.q[state], strict=True)
    return [
        {
            "action": action,
            "label": label,
            "size": sizes[action] if sizes else "",
            "direction": direction,
            "chance": round(chance, 3),
            "value": float(f"{value:.4g}"),
            "leads": "" if request.picture else outcome(request, action),
        }
        for action, (label, direction, chance, value) in enumerate(rows)
    ]


def picture_of(drawing: str) -> list[list[list[str]]]:
    """An environment's own drawing: lines of [text, classes], such as "bg-1 bold"; [] for none.

    Colours are those of a terminal: 1 red, 2 green, 3 yellow, 4 blue, 5 magenta, 6 cyan, 7 white.
    """
    if not drawing.strip():
        return []
    return [_runs(line) for line in safe_ansi(drawing).split("\n", allow_blank=True)]


def _runs(line: "rich.text.Text") -> list[list[str]]:
    """A line of text as runs of equal style."""
    edges = {0, len(line.plain)} | {edge for span in line.spans for edge in (span.start, span.end)}
    return [[line.plain[start:end], _classes(line, start)] for start, end in pairwise(sorted(edges))]


def _classes(line: "rich.text.Text", at: int) -> str:
    classes: dict[str, str] = {}
    for span in line.spans:
        style = span.style
        if isinstance(style, str) or not span.start <= at < span.end:
            continue
        classes |= {"bold": "bold"} if style.bold else {}
        for kind, color in (("fg", style.color), ("bg", style.bgcolor)):
            if color is not None and color.number is not None and color.number < 16:
                classes[kind] = f"{kind}-{color.number % 8}"
    return " ".join(sorted(classes.values()))
