"""Appendix III, order by order: the makespans of each method in the flexible manufacturing system."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import LAWS, Chance, drawn_seed
from lab.sequencing.cell.stations import Arrivals
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rollout import replan
from lab.sequencing.methods.srl_time import reacting
from lab.sequencing.search import Search, SrlSettings
from lab.sequencing.simulate.execution import Policy
from lab.sequencing.simulate.several import replicate
from lab_studies.many_sessions import evaluate, run_sessions
from lab_studies.thesis.appendix_3_fifo import STARTS, queued_fifo
from lab_studies.thesis.chapter_7_cells import beta_of

Floats = NDArray[np.float64]

EPISODES, REPLICATIONS, SPREAD = 200, 50, 0.1  # App. III
LEARNED_BY = 10  # one in so many of the requested sessions is learned for each order,
SLOW_BY = 250  # and one in so many with methods that are not compiled
REACTIONS = {3: 6, 5: 2, 8: 1}  # parts -> replications of slow policies that react, for ASKED sessions
ASKED = 500
UNKNOWN = "exponential"  # the law of arrivals with which policies react
REACTING: dict[str, Policy | None] = {"reacting": None, "rollout": replan()}  # None: made for each cell
FIFO = {start: f"fifo {start}" for start in STARTS}


@dataclass(frozen=True)
class Mix:
    """An order, such as "RSR" (R a rook, S a sign), and the mean interval of its parts' arrivals [s]."""

    order: str
    mean_s: float


@dataclass(frozen=True, eq=False)
class OrderMakespans:
    """The results of all methods with an order. makespans_s: by method and law of arrivals, of each replication (n,) [s].

    Replications are the same for all methods; policies that react have fewer of them, and only with exponential arrivals.
    With constant arrivals there is one. Methods that learn have the mean over their sessions. gaps: by method with constant
    arrivals, above the proven optimum (above the bound if not `proven`), as a fraction.
    """

    makespans_s: dict[tuple[str, str], Floats]
    gaps: dict[str, float]
    proven: bool


@lru_cache(maxsize=64)
def fms(order: str, mean_s: float) -> Cell:
    """The system's cell with an order; each part arrives an interval after the pick of the one before."""
    from lab.tasks.cell_file import order_from_word
    from lab.tasks.task_file import load_cell

    file = load_cell("fms")
    cell = file.cell(order_from_word(file, order))
    return replace(cell, arrivals=Arrivals((mean_s,) * cell.parts, "pick"), due_s=None)


def order_makespans(mix: Mix, *, sessions: int, seed: int) -> OrderMakespans:
    """The results of all methods with one order; sessions: the number that the study was asked for."""
    cell = fms(mix.order, mix.mean_s)
    rng = np.random.default_rng([seed, int(mix.mean_s), *map(ord, mix.order)])
    times_seed = drawn_seed(rng)
    best = optimum(cell)
    lists, greedy_s = _lists(cell, sessions, rng)
    lists["exact"] = [best.sequence]
    makespans_s: dict[tuple[str, str], Floats] = {("srl greedy", "constant"): greedy_s}
    for law in LAWS:
        chance, count = Chance("constant", law, SPREAD), 1 if law == "constant" else REPLICATIONS
        for method, sequences in lists.items():
            makespans_s[method, law] = evaluate(cell, sequences, times_seeds(times_seed, count), chance).mean(axis=0)
        for start, method in FIFO.items():
            makespans_s[method, law] = replicate(cell, queued_fifo(start), chance, count, times_seed)
        few = min(count, max(1, REACTIONS.get(cell.parts, 1) * sessions // ASKED))
        for method, policy in REACTING.items() if law == UNKNOWN else ():
            makespans_s[method, law] = replicate(cell, policy or reacting(cell), chance, few, times_seed)
    gaps = {method: best.gap(float(costs.mean())) for (method, law), costs in makespans_s.items() if law == "constant"}
    return OrderMakespans(makespans_s, gaps, best.proven)


def times_seeds(seed: int, episodes: int) -> list[int]:
    """The seeds of the episodes of `execution.replicate`, in which lists are evaluated, too."""
    rng = np.random.default_rng(seed)
    return [drawn_seed(rng) for _ in range(episodes)]


def settings(parts: int) -> SrlSettings:
    """The settings of App. III and its listing: values per next state of the stations, type B."""
    return SrlSettings(beta=beta_of(parts), factor="B", values="states", state="stations")


def _lists(cell: Cell, sessions: int, rng: np.random.Generator) -> tuple[dict[str, list[tuple[int, ...]]], Floats]:
    """The best sequence of each session, by method, learned with constant arrivals; SRL's final greedy makespan (1,) [s]."""
    listed, seed = Search(EPISODES, settings=settings(cell.parts)), drawn_seed(rng)
    pairs = replace(listed, settings=replace(listed.settings, values="pairs"))
    lists, greedy_s = {}, np.zeros(1)
    for name, method, search in (("srl", "srl", listed), ("srl pairs", "srl", pairs), ("random", "random", listed)):
        learned = run_sessions(cell, method, search, max(1, sessions // LEARNED_BY), seed)
        lists[name] = [tuple(row[row > 0].tolist()) for row in learned.sequences]
        if name == "srl":
            greedy_s[0] = learned.final_cost.mean()
    slow = range(max(1, sessions // SLOW_BY))
    lists["srl-time"] = [SEQUENCERS["srl-time"](cell, listed, rng).sequence for _ in slow]
    return lists, greedy_s
