"""Advice on the order of transfers: the level for which advisors are made, and the advisor that knows the exact values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from lab.advice.advisors import recorded_fault
from lab.advice.entries import Read
from lab.errors import BadInput
from lab.learning.requests import Advisor, Ask
from lab.learning.selection import softmax
from lab.learning.simulated_advice import tau_schedule
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import ExactValues, optimum
from lab.sequencing.search import SequenceRequest


def signature_of(cell: Cell, objective: str) -> str:
    """The first 16 hex digits of a SHA-256 over cell and objective, which define the sequencing problem."""
    parts = (
        cell.stations,
        cell.products,
        cell.order,
        cell.robot_start,
        cell.arrivals,
        cell.buffers,
        cell.due_s,
        objective,
        cell.begins,
        cell.closed,
        cell.precedences,
    )
    return sha256(repr(parts).encode() + cell.empty_s.tobytes() + cell.loaded_s.tobytes()).hexdigest()[:16]


@dataclass(frozen=True)
class OrderLevel:
    """The level of the order of transfers: cell, generator, people, the session's length, and the problem's signature."""

    cell: Cell
    rng: np.random.Generator
    people: Mapping[str, Ask] = field(default_factory=dict)
    episodes: int = 1
    signature: str = ""

    def simulated(self, taus: tuple[float, ...], sign: float) -> Advisor:
        """An advisor that knows the exact values. Raises BadInput for a cell with too many states."""
        return OrderAdvisor(self.cell, tau_schedule(taus, self.episodes), self.rng, sign)

    def check(self, recorded: Read) -> None:
        """Raises BadInput for advice about another cell."""
        if recorded.session.signature != self.signature:
            raise recorded_fault(recorded, "order", self.signature)

    def answered(self, path: Path) -> Mapping[int, int]:
        """Raises BadInput, because such files are about the states of a table."""
        raise BadInput("a file of answers is about the steps of a sub-task, not the order: wanted another advisor")

    def learned(self, name: str) -> Advisor:
        """Raises BadInput, because policies are about the steps of a sub-task."""
        raise BadInput("a policy knows the steps of a sub-task, not the order: wanted another advisor")


class OrderAdvisor:
    """A simulated advisor that draws from a softmax over the exact values.

    taus: by episode, the last one also for later episodes, in units of the optimum's mean step; sign: -1 prefers the worst.
    Source: thesis eq. 9.1, applied to the high level (10.2.1 iii).
    """

    def __init__(self, cell: Cell, taus: Sequence[float], rng: np.random.Generator, sign: float = 1.0) -> None:
        self._values, self._rng, self._taus, self._sign = ExactValues(cell), rng, taus, sign
        best = optimum(cell)
        self._unit_s = best.cost / len(best.sequence) or 1.0

    def advise(self, request: SequenceRequest) -> int | None:
        """A decision, drawn among the allowed ones."""
        left_s = self._values.of(request.run, tuple(request.allowed))
        worst_s = max((value for value in left_s if value < np.inf), default=0.0) + 10 * self._unit_s
        worth = [-self._sign * min(value, worst_s) / self._unit_s for value in left_s]
        tau = self._taus[min(request.episode, len(self._taus)) - 1]
        return request.allowed[int(self._rng.choice(len(worth), p=softmax(worth, tau)))]
