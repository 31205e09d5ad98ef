"""Advice on the order of transfers: the level for which advisors are made, and the advisor that knows the exact values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from lab.advice.advisors import recorded_fault
from lab.advice.entries import Read
from lab.errors import BadInput
from lab.learning.praise import Judging
from lab.learning.requests import Advisor, Ask
from lab.learning.selection import softmax
from lab.learning.simulated_advice import decisive, tau_of_accuracy, tau_schedule
from lab.mdp import FloatArray
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import ExactValues, optimum
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run

DRAWN_ORDERS = 50  # whose states weigh an advisor's accuracy


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

    def of_accuracy(self, share: float) -> Advisor:
        """An advisor with this share of optimal answers over the states of orders that are drawn evenly.

        Raises BadInput for a share that an advisor has at random, and for a cell with too many states.
        """
        advisor = OrderAdvisor(self.cell, (1.0,), self.rng)
        q = advisor.drawn_values()
        advisor.taus = (tau_of_accuracy(q, decisive(q, np.ones(len(q), np.bool_)), share),)
        return advisor

    def check(self, recorded: Read) -> None:
        """Raises BadInput for advice about another cell."""
        if recorded.session.signature != self.signature:
            raise recorded_fault(recorded, "order", self.signature)

    def answered(self, path: Path) -> Mapping[int, int]:
        """Raises BadInput, because such files are about the states of a table."""
        raise BadInput("a file of answers is about the steps of a sub-task, not the order: wanted another advisor")

    def evaluator(self, advisor: Advisor, judging: Judging) -> Advisor:
        """Raises BadInput, because praise and blame are about the steps of a table."""
        raise BadInput("it judges the steps of a sub-task, not the order: wanted another advisor")

    def learned(self, name: str) -> Advisor:
        """Raises BadInput, because policies are about the steps of a sub-task."""
        raise BadInput("a policy knows the steps of a sub-task, not the order: wanted another advisor")


class OrderAdvisor:
    """A simulated advisor that draws from a softmax over the exact values.

    taus: by episode, the last one also for later episodes, in units of the optimum's mean step; sign: -1 prefers the worst.
    Source: thesis eq. 9.1, applied to the high level (10.2.1 iii).
    """

    def __init__(self, cell: Cell, taus: Sequence[float], rng: np.random.Generator, sign: float = 1.0) -> None:
        self._values, self._rng, self.taus, self._sign = ExactValues(cell), rng, taus, sign
        best = optimum(cell)
        self._unit_s = best.cost / len(best.sequence) or 1.0

    def advise(self, request: SequenceRequest) -> int | None:
        """A decision, drawn among the allowed ones."""
        worth = self._worth(request.run, tuple(request.allowed))
        tau = self.taus[min(request.episode, len(self.taus)) - 1]
        return request.allowed[int(self._rng.choice(len(worth), p=softmax(worth, tau)))]

    def _worth(self, run: Run, allowed: tuple[int, ...]) -> list[float]:
        left_s = self._values.of(run, allowed)
        worst_s = max((value for value in left_s if value < np.inf), default=0.0) + 10 * self._unit_s
        return [-self._sign * min(value, worst_s) / self._unit_s for value in left_s]

    def drawn_values(self) -> FloatArray:
        """The worth (states, decisions) of each decision in the states of DRAWN_ORDERS orders, -inf for those not allowed.

        The orders are drawn evenly, the same ones for every advisor of a cell.
        """
        rng, rows = np.random.default_rng(0), list[list[float]]()
        for _ in range(DRAWN_ORDERS):
            run = Run(self._values.cell)
            while not run.done and (allowed := run.allowed()):
                rows.append(self._worth(run, allowed))
                run.move(allowed[int(rng.integers(len(allowed)))])
        table = np.full((len(rows), max(map(len, rows))), -np.inf)
        for line, row in zip(table, rows, strict=True):
            line[: len(row)] = row
        return table
