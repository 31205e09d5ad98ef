"""What methods know of each other that run side by side: the best order, and the best bound."""

from collections.abc import Sequence
from math import inf
from threading import Event, Lock

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import follow


class Shared:
    """The best order and the best bound that any of them found, and whose they are; told and asked from any thread.

    sequence: empty, and its cost infinite, where there is none yet. over: nobody has to go on, since it is proven, or stopped.
    """

    def __init__(self, cell: Cell, objective: str) -> None:
        self.cell, self.objective = cell, objective
        self.sequence: tuple[int, ...] = ()
        self.cost, self.found_by = inf, ""
        self.bound, self.bound_by = 0.0, "nothing"
        self.over = Event()
        self._lock = Lock()

    @property
    def proven(self) -> bool:
        """Whether no order costs less."""
        return self.cost <= self.bound + SAME

    def tell(self, by: str, sequence: Sequence[int] = (), bound: float = 0.0) -> None:
        """A complete order, which is carried out here, and a cost that none is below; either is kept if it is better."""
        value = cost(follow(self.cell, sequence), self.objective) if sequence else inf
        with self._lock:
            if value < self.cost - SAME:
                self.sequence, self.cost, self.found_by = tuple(sequence), value, by
            if bound > self.bound + SAME:
                self.bound, self.bound_by = bound, by
            if self.proven:
                self.over.set()
