"""The branch and bound of thesis App. IV, kept whole: what was tried, in which order, and why it was not gone on with."""

import heapq
from dataclasses import dataclass

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.robot_bound import TICKS_PER_S
from lab.sequencing.simulate.merged import Flow, Layout, State

MAX_NODES = 20_000


@dataclass(frozen=True)
class Node:
    """A state that was reached: the decisions that lead there, its time [s], and why the search ended there.

    end: "" it was branched; "finished"; "dominated", the same state was reached no later by other decisions; "bound",
    what is finished already takes no longer; "deadlock", nothing can move. Alike parts count as one: in each state the
    first that came is moved.
    """

    decisions: tuple[int, ...]
    time_s: float
    end: str


@dataclass(frozen=True)
class SearchTree:
    """All nodes, each after the one that it branches off, and the decisions of an optimal sequence."""

    nodes: tuple[Node, ...]
    optimal: tuple[int, ...]


def branch_and_bound(cell: Cell, most: int = MAX_NODES) -> SearchTree:
    """The whole search tree of a small cell, its nodes opened in the order of their times; nothing is estimated ahead.

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
    """The nodes so far, by number."""

    def __init__(self, cell: Cell, most: int) -> None:
        self.decisions: list[tuple[int, ...]] = []
        self.times_s: list[float] = []
        self.ends: list[str] = []
        self.heap: list[tuple[int, int]] = []
        self.best: tuple[int, ...] = ()
        self._flows: dict[int, Flow] = {}
        self._reached: dict[State, tuple[int, int]] = {}  # when, and by which node
        self._most, self._finished_at = most, -1
        self._add(Flow(Layout.of(cell)), ())

    def open(self, number: int, now: int) -> None:
        """Branch a node, unless something that was reached meanwhile makes that needless."""
        flow = self._flows.pop(number)
        if self._reached[flow.state()][1] != number:
            self.ends[number] = "dominated"
        elif self._finished_at >= 0 and now >= self._finished_at:
            self.ends[number] = "bound"
        else:
            branches = [(flow.branch(), action) for action in flow.actions()]
            self.ends[number] = "" if branches else "deadlock"
            for branch, action in branches:
                decision = branch.take(action)
                self._add(branch, (*self.decisions[number], decision))

    def _add(self, flow: Flow, decisions: tuple[int, ...]) -> None:
        number = len(self.decisions)
        if number == self._most:
            raise BadInput(f"search tree: it has more than {self._most} nodes; take fewer parts")
        self.decisions.append(decisions)
        self.times_s.append(flow.now / TICKS_PER_S)
        self.ends.append("dominated")
        if flow.done:
            self.ends[number] = "finished"
            if self._finished_at < 0 or flow.now < self._finished_at:
                self._finished_at, self.best = flow.now, decisions
            return
        state = flow.state()
        if state not in self._reached or flow.now < self._reached[state][0]:
            self._reached[state] = flow.now, number
            self._flows[number] = flow
            heapq.heappush(self.heap, (flow.now, number))
