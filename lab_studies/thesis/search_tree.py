"""Pictures of the tree of a branch-and-bound search, with the reason why each branch ended (thesis figs. IV.2, IV.3)."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.run import Run
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE_GREEN, PALE_GREY, RED, picture_bytes, seconds, tip

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_NODES = 3000
EDGE_INCH, HEAD_INCH, FOOT_INCH, NARROWEST_INCH = 0.15, 0.95, 0.4, 7.0
CUT_INK = "#777777"


@dataclass(frozen=True)
class Branch:
    """A node as it is drawn. parent: the index of its parent, smaller than its own; None: the root.

    move: the move that leads here; when: its time; says: the tooltip. end: "" if the search continued from here, else why it
    ended (see LOOKS). optimal: whether the node is on the way to the optimum.
    """

    parent: int | None
    move: str
    when: str
    says: str
    end: str = ""
    optimal: bool = False


@dataclass(frozen=True)
class Look:
    """How a node is drawn: the words of the legend, and the colours of its box, its rim and its text."""

    says: str
    face: str
    rim: str
    ink: str = INK


LOOKS: dict[str, Look] = {  # why the search ended at a node -> its look
    "optimal": Look("on the way to the optimum", BLUE, BLUE, "white"),
    "": Look("branched", "white", GREY),
    "finished": Look("finished, no sooner", PALE_GREEN, GREEN),
    "bound": Look("cut off: cannot be better", PALE_GREY, PALE_GREY, CUT_INK),
    "dominated": Look("cut off: the same was reached no later", "#FBEFD6", "#FBEFD6", CUT_INK),
    "deadlock": Look("deadlock", "white", RED, RED),
}


@dataclass(frozen=True)
class Scale:
    """Sizes [inch]: distance of leaves, height of boxes, gap of columns, font [points], width of a character."""

    row: float
    box: float
    gap: float
    font: float
    character: float
    between: str  # the text between move and time on a box

    def words(self, branch: Branch) -> str:
        """The text on a box."""
        return f"{branch.move}{self.between}{branch.when}"

    def width(self, branches: Sequence[Branch]) -> float:
        """The width of all boxes, that of the longest line on them."""
        longest = max(len(line) for branch in branches for line in self.words(branch).split("\n"))
        return longest * self.character + 0.08


FEW, MANY = Scale(0.42, 0.34, 0.4, 8.0, 0.067, "\n"), Scale(0.125, 0.1, 0.45, 5.5, 0.0465, ", ")
FEW_LEAVES = 40


def branch_picture(branches: Sequence[Branch], *, title: str = "", near: bool = False) -> bytes:
    """A tree as SVG bytes, from the root at the left, a column for each move; the way to the optimum is bold, cuts are pale.

    near: only the way to the optimum and the nodes that branch off it, as in fig. IV.3. Raises BadInput for no nodes, for more
    than MAX_NODES, and for a parent that does not come before its child. Source: thesis figs. IV.2, IV.3.
    """
    draw, size_inch = _drawing(branches, title, near)
    return picture_bytes(draw, *size_inch)


def _drawing(
    branches: Sequence[Branch], title: str, near: bool
) -> tuple[Callable[["Figure"], None], tuple[float, float]]:
    """The function that draws the tree on a figure, and the figure's width and height [inch]."""
    columns, rows = layout(branches)
    if near:
        branches = _near(branches)
        columns, rows = layout(branches)
    if len(branches) > MAX_NODES:
        raise BadInput(f"search tree of {len(branches)} nodes: allowed are {MAX_NODES}, or only those near the optimum")
    leaves = int(max(rows)) + 1
    scale = FEW if leaves <= FEW_LEAVES else MANY
    wide = scale.width(branches)
    step = wide + scale.gap
    width_inch = max(NARROWEST_INCH, 2 * EDGE_INCH + (max(columns) + 1) * step - scale.gap)
    height_inch = HEAD_INCH + leaves * scale.row + FOOT_INCH
    middles = [HEAD_INCH + (row + 0.5) * scale.row for row in rows]
    places = [(EDGE_INCH + column * step, middle) for column, middle in zip(columns, middles, strict=True)]

    def draw(figure: "Figure") -> None:
        figure.set_layout_engine("none")  # one unit is one inch
        axes = figure.add_axes((0, 0, 1, 1), xlim=(0, width_inch), ylim=(height_inch, 0))
        axes.set_axis_off()
        _draw_edges(axes, branches, places, wide, scale.gap)
        for branch, place in zip(branches, places, strict=True):
            _draw_node(axes, branch, place, wide, scale)
        for column in range(max(columns) + 1):
            words = f"{column} move{'s' * (column != 1)}" if column else "start"
            for y in (HEAD_INCH - 0.12, height_inch - 0.15):
                axes.text(EDGE_INCH + column * step, y, words, fontsize=7.5, color=GREY)
        _draw_head(axes, branches, title, width_inch)

    return draw, (width_inch, height_inch)


def branches_of(cell: Cell, nodes: Iterable[tuple[Sequence[int], str]], optimal: Sequence[int]) -> list[Branch]:
    """The nodes of a search as they are drawn.

    nodes: the decisions that lead to each, and why the search ended there; each comes after its parent, and the root, without
    decisions, is the first. optimal: the decisions of the optimum. Raises BadInput for a node before its parent, and for a
    decision that is not allowed.
    """
    nodes_drawn: list[Branch] = []
    index: dict[tuple[int, ...], int] = {}
    for decisions, end in nodes:
        taken = tuple(decisions)
        if taken and taken[:-1] not in index:
            raise BadInput(f"search tree: node {list(taken)} comes before its parent {list(taken[:-1])}")
        index[taken] = len(nodes_drawn)
        run = Run(cell)
        move = [run.move(decision) for decision in taken][-1:]
        name = f"{cell.part_name(move[0].part)} \N{RIGHTWARDS ARROW} {move[0].target}" if move else "start"
        if move and move[0].carries == "pallet":
            name = f"pallet of {name}"
        places = (cell.names[cell.positions[location].station] for location in run.locations)
        parts = ", ".join(f"{cell.part_name(part)} at {place}" for part, place in enumerate(places, 1))
        says = f"after {list(taken)}, {seconds(run.now_s)}: {parts}"
        on_way = taken == tuple(optimal[: len(taken)])
        nodes_drawn.append(
            Branch(index.get(taken[:-1]) if taken else None, name, seconds(run.now_s), says, end, on_way)
        )
    return nodes_drawn


def _near(branches: Sequence[Branch]) -> list[Branch]:
    """The nodes on the way to the optimum and their children, with the number of nodes below that are left out."""
    below = [0] * len(branches)
    for index in reversed(range(1, len(branches))):
        below[branches[index].parent or 0] += 1 + below[index]
    new: dict[int, int] = {}
    nodes_near: list[Branch] = []
    for index, branch in enumerate(branches):
        if branch.parent is None or branch.optimal or branches[branch.parent].optimal:
            hidden = 0 if branch.optimal or branch.parent is None else below[index]
            parent = None if branch.parent is None else new[branch.parent]
            new[index] = len(nodes_near)
            nodes_near.append(
                replace(branch, parent=parent, when=branch.when + f" (+{counted(hidden, 'node')})" * (hidden > 0))
            )
    return nodes_near


def layout(branches: Sequence[Branch]) -> tuple[list[int], list[float]]:
    """The column (number of moves) and the row of each node: leaves follow one another, others are amid their children."""
    children: list[list[int]] = [[] for _ in branches]
    columns: list[int] = []
    for index, branch in enumerate(branches):
        if branch.parent is None and index == 0:
            columns.append(0)
        elif branch.parent is not None and 0 <= branch.parent < index:
            columns.append(columns[branch.parent] + 1)
            children[branch.parent].append(index)
        else:
            raise BadInput(
                f"search tree: node {index} has parent {branch.parent}; allowed are None for node 0, else an earlier node"
            )
    if not branches:
        raise BadInput("search tree: there are no nodes")
    rows = [0.0] * len(branches)
    for row, leaf in enumerate(_leaves(children)):
        rows[leaf] = float(row)
    for index in reversed(range(len(branches))):
        if own := children[index]:
            rows[index] = (rows[own[0]] + rows[own[-1]]) / 2
    return columns, rows


def _leaves(children: Sequence[Sequence[int]]) -> Iterator[int]:
    """The nodes without children, in depth-first order."""
    waiting = [0]
    while waiting:
        index = waiting.pop()
        if not children[index]:
            yield index
        waiting.extend(reversed(children[index]))


def _draw_edges(
    axes: "Axes", branches: Sequence[Branch], places: Sequence[tuple[float, float]], wide: float, gap: float
) -> None:
    """Draw curves from each box's right side to its children; those to the optimum are bold."""
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path as Curve

    codes = [Curve.MOVETO, Curve.CURVE4, Curve.CURVE4, Curve.CURVE4]
    for optimal, colour, width in ((False, "#BBBBBB", 0.5), (True, BLUE, 2.0)):
        curves = []
        for branch, (x, y) in zip(branches, places, strict=True):
            if branch.parent is not None and branch.optimal == optimal:
                left, above = places[branch.parent]
                curves.append(Curve([(left + wide, above), (x - gap / 2, above), (x - gap / 2, y), (x, y)], codes))
        axes.add_collection(PathCollection(curves, facecolor="none", edgecolor=colour, linewidth=width, zorder=1))


def _draw_node(axes: "Axes", branch: Branch, place: tuple[float, float], wide: float, scale: Scale) -> None:
    from matplotlib.patches import Rectangle

    look, (x, y) = _look(branch), place
    rim: dict[str, Any] = {"facecolor": look.face, "edgecolor": look.rim, "linewidth": 0.5, "zorder": 2}
    box = Rectangle((x, y - scale.box / 2), wide, scale.box, **rim)
    tip(box, branch.says)
    axes.add_patch(box)
    words: dict[str, Any] = {"fontsize": scale.font, "color": look.ink, "parse_math": False, "linespacing": 1.1}
    middle = "center" if "\n" in scale.between else "center_baseline"
    axes.text(x + 0.04, y, scale.words(branch), va=middle, zorder=3, **words)


def _draw_head(axes: "Axes", branches: Sequence[Branch], title: str, width_inch: float) -> None:
    """Draw the title, and below it the legend of colours with their numbers of nodes."""
    from matplotlib.patches import Patch

    axes.text(EDGE_INCH, 0.26, title, fontsize=10, parse_math=False)
    looks = [_look(branch) for branch in branches]
    handles = [
        Patch(facecolor=look.face, edgecolor=look.rim, label=f"{look.says} ({looks.count(look)})")
        for look in dict.fromkeys([*LOOKS.values(), *looks])
        if look in looks
    ]
    where: dict[str, Any] = {"bbox_to_anchor": (EDGE_INCH, 0.34), "bbox_transform": axes.transData, "borderaxespad": 0}
    axes.legend(handles=handles, loc="upper left", ncols=max(1, int(width_inch / 2.3)), fontsize=7.5, **where)


def _look(branch: Branch) -> Look:
    if branch.optimal:
        return LOOKS["optimal"]
    return LOOKS.get(branch.end) or Look(f"cut off: {branch.end}", PALE_GREY, ORANGE, CUT_INK)
