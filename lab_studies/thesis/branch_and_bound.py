"""The branch and bound of thesis App. IV with its whole tree: the nodes in order, and why the search ended at each."""

import heapq
from dataclasses import dataclass

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.ways import TICKS_PER_S
from lab.sequencing.simulate.merged import MergedCell, MergedKey, MergedState

MAX_NODES = 20_000


@dataclass(frozen=True)
class Node:
    """A state that was reached: the decisions that lead to it, its time [s], and why the search ended there.

    end: "" if it was branched; "finished"; "dominated": the same state was reached no later by other decisions; "bound": the
    incumbent takes no longer; "deadlock": nothing can move. Alike parts count as one: in each state the first that came is
    moved.
    """

    decisions: tuple[int, ...]
    time_s: float
    end: str


@dataclass(frozen=True)
class SearchTree:
    """All nodes, each after its parent, and the decisions of an optimal sequence."""

    nodes: tuple[Node, ...]
    optimal: tuple[int, ...]


def branch_and_bound(cell: Cell, most: int = MAX_NODES) -> SearchTree:
    """The whole search tree of a small cell, whose nodes are branched in the order of their times, without an estimate.

    Raises BadInput for a tree of more than `most` nodes. Source: thesis App. IV, figs. IV.2 and IV.3.
    """
    tree = _Tree(cell, most)
    while tree.heap:
        now, number = heapq.heappop(tree.heap)
        tree.open(number, now)
    return SearchTree(
        tuple(Node(*node) for node in zip(tree.decisions, tree.times_s, tree.ends, strict=True)), tree.best
    )


class _Tree:
    """The nodes so far, by number, and the incumbent."""

    def __init__(self, cell: Cell, most: int) -> None:
        self.decisions: list[tuple[int, ...]] = []
        self.times_s: list[float] = []
        self.ends: list[str] = []
        self.heap: list[tuple[int, int]] = []
        self.best: tuple[int, ...] = ()
        self._cell = MergedCell(cell)
        self._states: dict[int, MergedState] = {}
        self._reached: dict[MergedKey, tuple[int, int]] = {}  # when, and by which node
        self._most, self._finished_at = most, -1
        self._add(self._cell.start(named=True), ())

    def open(self, number: int, now: int) -> None:
        """Branch a node, unless it is dominated or reaches the bound by now."""
        state = self._states.pop(number)
        if self._reached[self._cell.key(state)][1] != number:
            self.ends[number] = "dominated"
        elif self._finished_at >= 0 and now >= self._finished_at:
            self.ends[number] = "bound"
        else:
            branches = list(self._cell.successors(state))
            self.ends[number] = "" if branches else "deadlock"
            for branch in branches:
                self._add(branch, (*self.decisions[number], self._cell.decision(branch)))

    def _add(self, state: MergedState, decisions: tuple[int, ...]) -> None:
        number = len(self.decisions)
        if number == self._most:
            raise BadInput(f"search tree: it has more than {self._most} nodes; take fewer parts")
        self.decisions.append(decisions)
        self.times_s.append(state.now / TICKS_PER_S)
        self.ends.append("dominated")
        if self._cell.done(state):
            self.ends[number] = "finished"
            if self._finished_at < 0 or state.now < self._finished_at:
                self._finished_at, self.best = state.now, decisions
            return
        key = self._cell.key(state)
        if key not in self._reached or state.now < self._reached[key][0]:
            self._reached[key] = state.now, number
            self._states[number] = state
            heapq.heappush(self.heap, (state.now, number))
