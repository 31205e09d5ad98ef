"""A space around a part seen as a person sees it: from above and from the front, both through where the robot is."""

from typing import NamedTuple, Protocol

import numpy as np
from rich.text import Text

from lab.learning.requests import AdviceRequest
from lab.mdp import TabularMDP
from lab.seat.grid_text import GAP, LEGEND, STYLES, Marks, Picture, nearest_goal, window


class StateWords(Protocol):
    """What says in words where a state is, and how far each action goes; a `Skill` does."""

    def in_words(self, state: int) -> str: ...
    def moves_in_words(self) -> tuple[str, ...]: ...


class View(NamedTuple):
    """Which axis runs across and which upright in a view; mirrored: the first cell across is to the right."""

    title: str
    across: int
    upright: int
    is_mirrored: bool = False


def views_of(mdp: TabularMDP) -> tuple[View, ...]:
    """From above and from the front, by what the moves are called; () for what is no such space."""
    pairs = [mdp.action_labels[n : n + 2] for n in range(0, 6, 2)] if len(mdp.shape) > 2 else []
    if pairs == [("left", "right"), ("backward", "forward"), ("down", "up")]:
        return View("from above", 0, 1), View("from the front", 0, 2)
    if pairs == [("lower", "higher"), ("backward", "forward"), ("in", "out")]:
        return View("from above", 2, 1, is_mirrored=True), View("from the front", 2, 0, is_mirrored=True)
    return ()


def both_views(request: AdviceRequest, marks: Marks, width: int, height: int) -> Picture | None:
    """The views side by side in so many columns and lines; None where there are none."""
    views = views_of(request.mdp)
    if not views:
        return None
    drawn = [_Drawing(request, marks, view, (width - GAP * (len(views) - 1)) // len(views), height) for view in views]
    rows = max(len(one.lines) for one in drawn)
    lines = [Text(" " * GAP).join(one.line(row) for one in drawn) for row in range(rows)]
    seen = {mark for one in drawn for mark in one.seen}
    legend = [word for mark, word in {**LEGEND, "g": "g goal beyond or before"}.items() if mark in seen and mark != "r"]
    if seen & {*marks.arrows, "*"}:
        legend.append("arrow or *: the learner's own choice")
    shown = dict(part for one in drawn for part in one.cut)
    return Picture(lines, ", ".join(legend), tuple((axis, *ends) for axis, ends in sorted(shown.items())))


class _Drawing:
    """One view: its lines, the marks that are seen in it, and the axes of which a part is shown."""

    def __init__(self, request: AdviceRequest, marks: Marks, view: View, width: int, height: int) -> None:
        mdp, axes = request.mdp, (view.across, view.upright)
        here = mdp.state_cell(request.state)
        across, upright = (
            window(here[axis], mdp.shape[axis], room) for axis, room in zip(axes, (width // 2, height - 1), strict=True)
        )
        self.cut = [
            (axis, (cells.start, cells.stop - 1))
            for axis, cells in zip(axes, (across, upright), strict=True)
            if len(cells) < mdp.shape[axis]
        ]
        states = np.arange(mdp.n_states).reshape(mdp.shape)
        plane = states[tuple(slice(None) if axis in axes else here[axis] for axis in range(len(mdp.shape)))]
        plane = plane if view.across < view.upright else plane.T
        found = np.where(mdp.goal, "G", np.where(mdp.terminal, "#", marks.free))[plane]
        goal = nearest_goal(mdp, here)
        for mark, cell in (("g", goal), (_choice(request, marks, view), _entered(request)), ("R", here)):
            at = None if cell is None else (cell[view.across], cell[view.upright])
            if at is not None and (mark == "R" or found[at] in (marks.free, "g") or (mark == "g" and found[at] != "G")):
                found[at] = mark
        rows = [[str(found[x, y]) for x in (across[::-1] if view.is_mirrored else across)] for y in upright]
        self.lines = [Text(f" {view.title}"[:width], "bold"), *map(_line, reversed(rows))]
        self.seen = {mark for row in rows for mark in row}
        self._width = max(line.cell_len for line in self.lines)

    def line(self, row: int) -> Text:
        """A line in the view's whole width; those below its last one are empty."""
        line = self.lines[row].copy() if row < len(self.lines) else Text()
        line.pad_right(self._width - line.cell_len)
        return line


def _line(row: list[str]) -> Text:
    return Text.assemble(*((f" {mark}", STYLES.get(mark, "dim")) for mark in row))


def _entered(request: AdviceRequest) -> tuple[int, ...]:
    return request.mdp.state_cell(int(request.mdp.successor[request.state, request.own]))


def _choice(request: AdviceRequest, marks: Marks, view: View) -> str:
    """An arrow where the learner's own move runs in the view, else a star."""
    axis, is_further = request.own // 2, request.own % 2
    if axis == view.upright:
        return marks.arrows[0 if is_further else 1]
    return marks.arrows[2 + (is_further != view.is_mirrored)] if axis == view.across else "*"
