"""Advice on the order of the transfers: what its advisors are made from, and one that knows all values."""

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
    """The first 16 hex digits of a SHA-256 over all that defines the order that is looked for."""
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
    """A cell, its signature, the session's length, and whom the learner may ask which part to move next."""

    cell: Cell
    rng: np.random.Generator
    people: Mapping[str, Ask] = field(default_factory=dict)
    episodes: int = 1
    signature: str = ""

    def simulated(self, taus: tuple[float, ...], sign: float) -> Advisor:
        """An advisor that knows the exact values; BadInput for a cell with too many states to know."""
        return OrderAdvisor(self.cell, tau_schedule(taus, self.episodes), self.rng, sign)

    def check(self, recorded: Read) -> None:
        """BadInput for advice about another cell."""
        if recorded.session.signature != self.signature:
            raise recorded_fault(recorded, "order", self.signature)

    def answered(self, path: Path) -> Mapping[int, int]:
        """BadInput: such files are about the states of a table."""
        raise BadInput("a file of answers is about the steps of a sub-task, not the order: wanted another advisor")

    def learned(self, name: str) -> Advisor:
        """BadInput: policies in the toolbox are tables of steps."""
        raise BadInput("a policy knows the steps of a sub-task, not the order: wanted another advisor")


class OrderAdvisor:
    """A simulated advisor: draws from a softmax over the exact values; tau in units of the optimum's mean step.

    taus: of each episode, the last one's from then on. sign -1: it takes the worst for the best. Source: thesis eq. 9.1,
    taken to the high level (10.2.1 iii).
    """

    def __init__(self, cell: Cell, taus: Sequence[float], rng: np.random.Generator, sign: float = 1.0) -> None:
        self._values, self._rng, self._taus, self._sign = ExactValues(cell), rng, taus, sign
        best = optimum(cell)
        self._unit_s = best.cost / len(best.sequence) or 1.0

    def advise(self, request: SequenceRequest) -> int | None:
        """One draw among the allowed decisions."""
        left_s = self._values.of(request.run, tuple(request.allowed))
        worst_s = max((value for value in left_s if value < np.inf), default=0.0) + 10 * self._unit_s
        worth = [-self._sign * min(value, worst_s) / self._unit_s for value in left_s]
        tau = self._taus[min(request.episode, len(self._taus)) - 1]
        return request.allowed[int(self._rng.choice(len(worth), p=softmax(worth, tau)))]
