"""The learning of a job's order: the costs of episodes, the episode of the best one, and the results of the bound alone."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import WorkFailed, counted
from lab.sequencing import BESIDE_METHODS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, stuck_cost
from lab.sequencing.methods.srl_time import bound_alone, srl_time
from lab.sequencing.search import Reference, Search, SequenceResult
from lab.view.figures import beside, gap_of
from lab.view.sequencing_plots import PlotBeside, sequence_plot

BOUND_ALONE, UNBOUNDED = "its bound alone", "without its bound"


@dataclass(frozen=True)
class Beside:
    """The result of a part of a method by itself: its best cost, None without an order, and the episode of it."""

    by: str
    cost: float | None
    episode: int | None


@dataclass(frozen=True)
class OrderLearning:
    """The costs that a method, `by` (a name or one of `BESIDE_METHODS`), found by episode, beside the bound.

    beside: for srl-time, the results of its bound followed greedily without learning, and of learning without the bound.
    """

    by: str
    objective: str
    found: SequenceResult
    known: Reference
    beside: tuple[Beside, ...] = ()

    @property
    def episode(self) -> int:
        """The first episode, from 1, with the best cost."""
        return self.found.episode_costs.index(self.found.cost) + 1

    @property
    def first_cost(self) -> float:
        """The cost of the first episode."""
        return self.found.episode_costs[0]

    def to_json(self) -> dict[str, Any]:
        """The entry of `lab run --json`; the costs of the episodes are in the run's folder."""
        return {
            "by": self.by,
            "objective": self.objective,
            "cost": self.found.cost,
            "bound": self.known.bound,
            "optimum_proven": self.known.proven,
            "gap": self.known.gap(self.found.cost),
            "episodes": len(self.found.episode_costs),
            "found_at_episode": self.episode,
            "first_cost": self.first_cost,
            "beside": [vars(rival) | {"gap": self._gap(rival.cost)} for rival in self.beside],
            "lines": self.lines(),
        }

    def lines(self) -> list[str]:
        """The result in words: one line, and one more for each of `beside`."""
        known, episodes = self.known, len(self.found.episode_costs)
        cost, bound = beside(self.found.cost, known.bound, known.unit, 1)
        what = "proven optimum" if known.proven else "proven bound"
        by = BESIDE_METHODS.get(self.by, self.by)
        when = "at once" if episodes == 1 else f"in episode {self.episode} of {episodes}"
        lines = [f"{by}: {cost} {when}; {what} {bound}{self._above(self.found.cost)}"]
        if episodes > 1:
            lines.append(f"its first episode: {self.first_cost:.1f}{known.unit}{self._above(self.first_cost)}")
        for rival in self.beside:
            if rival.cost is None:
                lines.append(f"{rival.by}: no order in {counted(episodes, 'episode')}")
                continue
            when = "nothing learned" if rival.by == BOUND_ALONE else f"in episode {rival.episode}"
            lines.append(f"{rival.by}: {rival.cost:.1f}{known.unit}, {when}{self._above(rival.cost)}")
        return lines

    def drawn(self, cell: Cell) -> Callable[[Path], None]:
        """A function that draws the costs by episode, the best so far, and the result of each part of the method to a file."""

        lines = {
            f"{rival.by}: {rival.cost:.1f}{self.known.unit}": rival.cost
            for rival in self.beside
            if rival.cost is not None
        }
        return partial(
            sequence_plot,
            self.found.episode_costs,
            self.known.bound,
            ylabel="makespan [s]" if self.objective == MAKESPAN else self.objective,
            deadlock=stuck_cost(cell, self.objective),
            beside=PlotBeside(
                f"The order, as {BESIDE_METHODS.get(self.by, self.by)} learned it", lines, self.known.proven
            ),
        )

    def _gap(self, cost: float | None) -> float | None:
        return None if cost is None else self.known.gap(cost)

    def _above(self, cost: float) -> str:
        gap = self.known.gap(cost)
        return "" if gap is None else f", gap {gap_of(gap, 1)}"


def bound_shares(cell: Cell, method: str, search: Search, seed: int) -> tuple[Beside, ...]:
    """The results of the bound of srl-time without learning, and of learning without the bound; empty for other methods.

    Both use the random numbers of session 0 of this seed (see `find_sequence`).
    """
    if method != "srl-time":
        return ()
    cost = bound_alone(cell, search, np.random.default_rng([seed, 2, 0]))
    try:
        without = srl_time(cell, search, np.random.default_rng([seed, 2, 0]), bounded=False)
    except WorkFailed:
        return Beside(BOUND_ALONE, cost, None), Beside(UNBOUNDED, None, None)
    episode = without.episode_costs.index(without.cost) + 1
    return Beside(BOUND_ALONE, cost, None), Beside(UNBOUNDED, without.cost, episode)
