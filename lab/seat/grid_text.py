"""The learner's position as text: a grid, slices or views of a space, or an environment's own drawing, cut to fit."""

import re
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.text import Text

from lab.learning.requests import AdviceRequest
from lab.mdp import TabularMDP
from lab.view.value_levels import GridPlanes, is_map

Plane = NDArray[np.str_]
DIRECTIONS = ("up", "down", "left", "right")
ARROWS = "↑↓←→"
ASCII_ARROWS = "^v<>"
NAMES = {"up": 0, "north": 0, "down": 1, "south": 1, "left": 2, "west": 2, "right": 3, "east": 3}
LEGEND = {"R": "R robot", "r": "r its shadow", "G": "G goal", "g": "g the goal's shadow", "#": "# obstacle"}
COVERING = {"R": "R head", "x": "x covered"}
STYLES = {"R": "bold cyan", "r": "cyan", "G": "bold green", "g": "green", "#": "red", "x": "green"} | dict.fromkeys(
    f"*{ARROWS}{ASCII_ARROWS}", "bold magenta"
)
GAP = 3  # columns between two slices
FEWEST_COLUMNS = 9  # least width, in cells, of a slice that is cut to make room for its neighbours
_SGR = re.compile(r"\x1b\[[0-9;]*m")
_ESCAPE = re.compile(  # a colour; another sequence, a string up to its end or to that of the text; a lone escape
    r"(\x1b\[[0-9;]*m)|(?:\x1b\[|\x9b)[0-?]*[ -/]*[@-~]?|(?:\x1b[]P^_X]|[\x90\x98\x9d-\x9f]).*?(?:\x1b\\|[\x07\x9c]|\Z)"
    r"|\x1b[ -/]*[0-~]?",
    re.DOTALL,
)


@dataclass(frozen=True)
class Marks:
    """The characters of a picture, for consoles with or without Unicode; and whether the console shows colours."""

    arrows: str = ARROWS
    free: str = "·"
    chosen: str = "▸"
    bars: str = "▏▎▍▌▋▊▉█"  # the parts of a bar's last character
    coloured: bool = True

    @classmethod
    def of(cls, console: Console) -> "Marks":
        """The marks that the console's encoding can represent."""
        marks = cls() if console.encoding.lower().startswith("utf") else cls(ASCII_ARROWS, ".", ">", "=")
        return replace(marks, coloured=console.color_system is not None and not console.no_color)

    def named(self, mdp: TabularMDP, action: int) -> str:
        """An action's label, with the arrow of its direction in the picture."""
        direction = direction_of(mdp, action)
        arrow = "" if direction is None else f"{self.arrows[direction]} "
        return f"{arrow}{mdp.action_labels[action]}"


def direction_of(mdp: TabularMDP, action: int) -> int | None:
    """An action's direction in the picture, an index into DIRECTIONS; None when it leaves the picture's plane.

    Axis 0 runs down and axis 1 to the right (a grid of one axis runs to the right); on a map, axis 0 runs to the right
    and axis 1 up. If the actions have the names of all four directions, the names decide.
    """
    axes = len(mdp.coverage_shape or mdp.shape)
    if points_by_name(mdp):
        return NAMES.get(mdp.action_labels[action].lower())
    if mdp.n_actions != 2 * axes or action >= 4:
        return None
    if is_map(mdp):
        return (2, 3, 1, 0)[action]
    return action + 2 if axes == 1 else action


def points_by_name(mdp: TabularMDP) -> bool:
    """Whether the actions are named after the four directions of a picture, or of the compass, in any order."""
    known = {NAMES.get(label.lower()) for label in mdp.action_labels}
    return len(mdp.coverage_shape or mdp.shape) <= 2 and known >= {0, 1, 2, 3}


def nearest_goal(mdp: TabularMDP, cell: tuple[int, ...]) -> tuple[int, ...] | None:
    """The goal cell nearest to a cell, in steps along the axes; None when there is no goal."""
    goals = [mdp.state_cell(int(state)) for state in np.flatnonzero(mdp.goal)]
    return min(goals, key=lambda goal: sum(abs(a - b) for a, b in zip(goal, cell, strict=True)), default=None)


@dataclass(frozen=True)
class TextPicture:
    """A picture as lines of text, its legend, and the range of cells on each axis that is cut: (axis, low, high).

    is_fixed: an environment's own drawing, whose height cannot be changed.
    """

    lines: list[Text]
    legend: str = ""
    shown: tuple[tuple[int, int, int], ...] = ()
    hides_goal: bool = False
    is_fixed: bool = False

    @property
    def width(self) -> int:
        """The picture's width in terminal columns."""
        return max((line.cell_len for line in self.lines), default=0)


def picture_of(request: AdviceRequest, marks: Marks, width: int, height: int) -> TextPicture | None:
    """The environment's own drawing, or the grid around the robot, in `width` columns and `height` lines; None without either.

    An environment's drawing is cut in width only. Slices of a space run along axis 2, the robot's slice in the middle.
    """
    own = request.picture
    if own.strip():
        drawn = safe_ansi(own) if marks.coloured else bracketed(safe_ansi(own))
        lines = list(drawn.split("\n", allow_blank=True))
        for line in lines:
            line.truncate(width)
        return TextPicture(lines, is_fixed=True)
    return (
        _GridDrawing(request, marks).fitting(width, height) if request.mdp.shape or request.mdp.coverage_shape else None
    )


def safe_ansi(drawing: str) -> Text:
    """The text of an ANSI drawing with its colours; all other escape sequences and control characters are removed."""
    kept = _ESCAPE.sub(lambda match: match[1] or "", drawing.replace("\r\n", "\n").expandtabs().strip("\n"))
    parts = zip(_SGR.split(kept), [*_SGR.findall(kept), ""], strict=True)
    return Text.from_ansi("".join(_printable(part) + code for part, code in parts))


def bracketed(drawing: Text) -> Text:
    """A drawing in which brackets replace coloured backgrounds, such as that of the agent's cell."""
    plain, ends = drawing.plain, dict[int, str]()
    for span in drawing.spans:
        if not isinstance(span.style, str) and span.style.bgcolor is not None:
            ends[span.start], ends[span.end] = ends.get(span.start, "") + "[", "]" + ends.get(span.end, "")
    return Text("".join(ends.get(n, "") + c for n, c in enumerate(f"{plain}\0")).removesuffix("\0"))


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() or c == "\n" else " " if c.isspace() else "" for c in text)


def window(at: int, size: int, room: int) -> range:
    """A range of at most `room` of `size` places, centred on `at` as far as the ends allow it."""
    room = max(1, min(room, size))
    low = min(max(at - room // 2, 0), size - room)
    return range(low, low + room)


class _GridDrawing:
    """The grid of one request as planes of axes 0 and 1, one for each layer of axis 2.

    R robot, G goal, # obstacle, x covered; g is the projection of a goal in another plane. An arrow marks the cell that
    the learner itself would enter.
    """

    def __init__(self, request: AdviceRequest, marks: Marks):
        self.request, self.mdp, self.marks = request, request.mdp, marks
        mdp = self.mdp
        self.shape = mdp.coverage_shape or mdp.shape
        self.cell = mdp.state_cell(request.state)
        self.entered = mdp.state_cell(int(mdp.successor[request.state, request.own]))
        self.goal = None if mdp.coverage_shape else nearest_goal(mdp, self.cell)
        self.layers, self.layer = (self.shape[2], self.cell[2]) if len(self.shape) > 2 else (1, 0)
        self.grid = GridPlanes(mdp)
        self.rows, self.columns, self._place = self.grid.rows, self.grid.columns, self.grid.place

    def plane(self, layer: int) -> Plane:
        """The marks of one layer, row by row as shown."""
        mdp, free, here = self.mdp, self.marks.free, self._place(self.cell)
        if mdp.coverage_shape:
            plane = np.where(mdp.covered(self.request.state), "x", free)
        else:
            plane = self.grid.marks(
                self.grid.layer((*self.cell[:2], layer, *self.cell[3:])[: len(self.shape)]), free
            ).copy()
        own = layer == self.layer
        if own and self.goal is not None and plane[self._place(self.goal)] == free:
            plane[self._place(self.goal)] = "g"
        self._mark_choice(plane, layer)
        if own:
            plane[here] = "R"
        elif plane[here] == free:
            plane[here] = "r"
        return plane

    def _mark_choice(self, plane: Plane, layer: int) -> None:
        """Mark the cell that the learner itself would enter: an arrow, or a star if the move comes from another layer."""
        request, entered = self.request, self.entered
        if entered == self.cell or entered[3:] != self.cell[3:] or entered[2:3] not in ((), (layer,)):
            return
        there = self._place(entered)
        direction = direction_of(self.mdp, request.own) if entered[2:] == self.cell[2:] else None
        if plane[there] in (self.marks.free, "x", "g"):
            plane[there] = "*" if direction is None else self.marks.arrows[direction]

    def _room(self, width: int) -> tuple[range, int]:
        """The layers to show, and the columns of each: as many whole layers as fit, else three that are cut."""
        title = len(f" [level {self.layers}]") if self.layers > 1 else 0
        whole = min((width + GAP) // (max(2 * self.columns, title) + GAP), self.layers)
        third = (width - 2 * GAP) // 3
        fewest = max(title, 2 * min(self.columns, FEWEST_COLUMNS))
        if self.layers > 1 and whole < min(3, self.layers) and third >= fewest:
            return window(self.layer, self.layers, 3), third // 2
        if whole % 2 == 0 and whole < self.layers:
            whole -= 1  # an odd number: as many layers below as above
        return window(self.layer, self.layers, whole), min(self.columns, width // 2)

    def fitting(self, width: int, height: int) -> TextPicture:
        """The picture with the slices that fit into `width` columns and `height` lines."""
        layers, room = self._room(width)
        titled = self.layers > 1
        row, column = self._place(self.cell)
        rows, columns = window(row, self.rows, height - titled), window(column, self.columns, room)
        planes = {k: self.plane(k)[rows.start : rows.stop, columns.start : columns.stop] for k in layers}
        blocks = [self._block(plane, layer if titled else None) for layer, plane in planes.items()]
        widest = max(line.cell_len for block in blocks for line in block)
        for line in chain.from_iterable(blocks[:-1]):
            line.pad_right(widest - line.cell_len)
        lines = [Text(" " * GAP).join(side) for side in zip(*blocks, strict=True)]
        seen = {str(mark) for plane in planes.values() for mark in plane.ravel()}
        hides_goal = self.goal is not None and not seen & {"G"}
        return TextPicture(
            lines, self._legend(seen), self._shown(rows, columns, layers if titled else None), hides_goal
        )

    def _block(self, plane: Plane, layer: int | None) -> list[Text]:
        rows = [Text.assemble(*((f" {mark}", STYLES.get(str(mark), "dim")) for mark in row)) for row in plane]
        if layer is None:
            return rows
        own = layer == self.layer
        return [Text(f" [level {layer}]" if own else f" level {layer}", "bold" if own else "dim"), *rows]

    def _legend(self, seen: set[str]) -> str:
        words = COVERING if self.mdp.coverage_shape else LEGEND
        named = [word for mark, word in words.items() if mark in seen]
        if "r" in seen:
            named = [word.replace("goal's shadow", "goal's") for word in named]
        own = "arrow" if seen & set(self.marks.arrows) else "*" if "*" in seen else ""
        return ", ".join([*named, f"{own}: the learner's own choice"] if own else named)

    def _shown(self, rows: range, columns: range, layers: range | None) -> tuple[tuple[int, int, int], ...]:
        """The axes that are cut, each with its first and last shown cell."""
        if self.grid.flips:
            ranges = {0: columns, 1: range(self.rows - rows.stop, self.rows - rows.start)}
        else:
            ranges = {0: columns} if len(self.shape) == 1 else {0: rows, 1: columns}
        if layers is not None:
            ranges[2] = layers
        return tuple((a, r.start, r.stop - 1) for a, r in ranges.items() if len(r) < self.shape[a])


# ---- a space from above and from the front, side by side ----------------------------------------------------------------


class StateWords(Protocol):
    """Describes in words a state's position and the length of each action; a `Skill` does."""

    def in_words(self, state: int) -> str: ...
    def moves_in_words(self) -> tuple[str, ...]: ...


def skill_of(place: Any, name: str) -> StateWords | None:
    """The skill of this name in a prepared task, which describes its states in words; None if the place has none."""
    skillset = getattr(place, "skillset", None)
    skill: StateWords | None = None if skillset is None else skillset.skills.get(name)
    return skill


class GridAxes(NamedTuple):
    """A view: which axis runs across and which up; mirrored: whether the first cell across is on the right."""

    title: str
    across: int
    upright: int
    is_mirrored: bool = False


def views_of(mdp: TabularMDP) -> tuple[GridAxes, ...]:
    """The views from above and from the front, chosen by the names of the moves; () for other problems."""
    pairs = [mdp.action_labels[n : n + 2] for n in range(0, 6, 2)] if len(mdp.shape) > 2 else []
    if pairs == [("left", "right"), ("backward", "forward"), ("down", "up")]:
        return GridAxes("from above", 0, 1), GridAxes("from the front", 0, 2)
    if pairs == [("lower", "higher"), ("backward", "forward"), ("in", "out")]:
        return GridAxes("from above", 2, 1, is_mirrored=True), GridAxes("from the front", 2, 0, is_mirrored=True)
    return ()


def both_views(request: AdviceRequest, marks: Marks, width: int, height: int) -> TextPicture | None:
    """The views side by side in `width` columns and `height` lines; None when there are none."""
    views = views_of(request.mdp)
    if not views:
        return None
    drawn = [_Drawing(request, marks, view, (width - GAP * (len(views) - 1)) // len(views), height) for view in views]
    rows = max(len(plane.lines) for plane in drawn)
    lines = [Text(" " * GAP).join(plane.line(row) for plane in drawn) for row in range(rows)]
    seen = {mark for plane in drawn for mark in plane.seen}
    legend = [word for mark, word in {**LEGEND, "g": "g goal beyond or before"}.items() if mark in seen and mark != "r"]
    if seen & {*marks.arrows, "*"}:
        legend.append("arrow or *: the learner's own choice")
    shown = dict(part for plane in drawn for part in plane.cut)
    return TextPicture(lines, ", ".join(legend), tuple((axis, *ends) for axis, ends in sorted(shown.items())))


class _Drawing:
    """One view: its lines, the marks in it, and the axes that are cut."""

    def __init__(self, request: AdviceRequest, marks: Marks, view: GridAxes, width: int, height: int) -> None:
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
        marked = np.where(mdp.goal, "G", np.where(mdp.terminal, "#", marks.free))[plane]
        goal = nearest_goal(mdp, here)
        for mark, cell in (("g", goal), (_choice(request, marks, view), _entered(request)), ("R", here)):
            at = None if cell is None else (cell[view.across], cell[view.upright])
            if at is not None and (
                mark == "R" or marked[at] in (marks.free, "g") or (mark == "g" and marked[at] != "G")
            ):
                marked[at] = mark
        rows = [[str(marked[x, y]) for x in (across[::-1] if view.is_mirrored else across)] for y in upright]
        self.lines = [Text(f" {view.title}"[:width], "bold"), *map(_line, reversed(rows))]
        self.seen = {mark for row in rows for mark in row}
        self._width = max(line.cell_len for line in self.lines)

    def line(self, row: int) -> Text:
        """A line of the view, padded to its width; lines below the last one are empty."""
        line = self.lines[row].copy() if row < len(self.lines) else Text()
        line.pad_right(self._width - line.cell_len)
        return line


def _line(row: list[str]) -> Text:
    return Text.assemble(*((f" {mark}", STYLES.get(mark, "dim")) for mark in row))


def _entered(request: AdviceRequest) -> tuple[int, ...]:
    return request.mdp.state_cell(int(request.mdp.successor[request.state, request.own]))


def _choice(request: AdviceRequest, marks: Marks, view: GridAxes) -> str:
    """The mark of the learner's own move: an arrow if it lies in the view's plane, else a star."""
    axis, is_further = request.own // 2, request.own % 2
    if axis == view.upright:
        return marks.arrows[0 if is_further else 1]
    return marks.arrows[2 + (is_further != view.is_mirrored)] if axis == view.across else "*"
