"""The high level: in which order one robot serves the parts of a cell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from lab.errors import unknown
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    import numpy as np

    from lab.sequencing.cell.cell import Cell
    from lab.sequencing.methods.carried_over_policy import CarriedPolicy
    from lab.sequencing.search import Search, SequenceResult
    from lab.sequencing.simulate.execution import Policy

Find = Callable[["Cell", "Search", "np.random.Generator"], "SequenceResult"]


class Reaction(NamedTuple):
    """A policy for times that are drawn, and what it does in words; replans: by which method it plans at every decision, in its
    time; None: it does not."""

    policy: "Policy"
    words: str
    replans: str | None = None


# Each method is imported when it is used: numba and OR-Tools take their time.


def _srl() -> Find:
    from lab.sequencing.methods.srl import srl

    return srl


def _srl_time() -> Find:
    from lab.sequencing.methods.srl_time import srl_time

    return srl_time


def _srl_improved() -> Find:
    from lab.sequencing.methods.srl_improved import srl_improved

    return srl_improved


def _monte_carlo() -> Find:
    from lab.sequencing.methods.monte_carlo import monte_carlo

    return monte_carlo


def _random() -> Find:
    from lab.sequencing.methods.random_search import random_search

    return random_search


def _fifo() -> Find:
    from lab.sequencing.methods.fifo import fifo

    return fifo


def _genetic() -> Find:
    from lab.sequencing.methods.genetic import genetic

    return genetic


def _anneal() -> Find:
    from lab.sequencing.methods.anneal import anneal

    return anneal


def _carried() -> Find:
    from lab.sequencing.methods.carried_over import carried

    return carried


def _portfolio() -> Find:
    from lab.sequencing.methods.portfolio import portfolio

    return portfolio


def _exact() -> Find:
    from lab.sequencing.methods.exact import exact

    return exact


def _cp_sat() -> Find:
    from lab.sequencing.methods.cp_sat import cp_sat_sequencer

    return cp_sat_sequencer


def _planned_anew(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    from lab.sequencing.methods.rollout import replan

    when = "at every decision" if cell.serial else "whenever something happens"
    return Reaction(replan(objective, planned), f"planned anew {when}, by rollout", "rollout")


def _learned_on(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    from lab.sequencing.methods.srl_time_reacting import reacting

    return Reaction(reacting(cell, objective, seed), "it goes on learning before every decision", "srl-time")


def _queued(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    from lab.sequencing.methods.fifo import first_in_first_out

    return Reaction(first_in_first_out, "a queue of tasks as they become possible")


def _carried_on(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    from lab.sequencing.methods.carried_over_weights import DEFAULT

    return carried_reaction(DEFAULT)


def carried_reaction(policy: "CarriedPolicy") -> Reaction:
    """A carried-over policy, asked at every decision."""
    from lab.sequencing.methods.carried_over import rule_of
    from lab.sequencing.methods.rollout import by_rule

    return Reaction(by_rule(rule_of(policy)), "the carried-over policy, asked at every decision")


def _asked(name: str, cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    from lab.sequencing.methods.rollout import by_rule
    from lab.sequencing.methods.rules import RULES

    return Reaction(by_rule(RULES[name]), f"the rule {name}, asked at every decision")


@dataclass(frozen=True)
class Sequencer:
    """A method; called with a cell, a search and a generator it finds a sequence.

    load: imports its function. help: what it is, in one line. drawn: where chance is asked for it looks in drawn times;
    else with the means. react: the policy in its manner, for a cell, an objective, a seed and the planned list. alone: nobody
    looks for a proof beside it unless that is asked for: it answers at once, as a rule does, or proves what can be proven itself.
    """

    load: Callable[[], Find]
    help: str
    drawn: bool = False
    react: Callable[["Cell", str, int, Sequence[int]], Reaction] = _planned_anew
    alone: bool = False

    def __call__(self, cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
        """One sequence."""
        return self.load()(cell, search, rng)


def _rule(name: str, words: str) -> Sequencer:
    """A dispatching rule: one sequence."""

    def load() -> Find:
        from lab.sequencing.methods.rules import RULES, dispatched

        return lambda cell, search, rng: dispatched(cell, RULES[name], search)

    return Sequencer(load, f"a dispatching rule: {words}", react=partial(_asked, name), alone=True)


def _adopted(name: str, thing: Any) -> Sequencer:
    if isinstance(thing, type) or not takes(thing, "cell", "search", "rng"):
        raise wanted(thing, "a function of cell, search and generator that gives a SequenceResult")
    return Sequencer(lambda: thing, first_line(thing))


_SHIPPED: dict[str, Sequencer] = {
    "srl": Sequencer(_srl, "the thesis's: learns from the reward of whole episodes, as printed", drawn=True),
    "srl-time": Sequencer(
        _srl_time,
        "Q-learning that begins at a lower bound of the full model; close to the heuristic search LRTA*",
        react=_learned_on,
    ),
    "srl-improved": Sequencer(
        _srl_improved, "our own: learns where in the order moves belong, from episodes that it improves"
    ),
    "mc": Sequencer(_monte_carlo, "Monte Carlo: averages the returns of the episodes", drawn=True),
    "random": Sequencer(_random, "the best of so many sequences drawn evenly", drawn=True),
    "fifo": Sequencer(_fifo, "first in, first out: a queue of tasks", react=_queued, alone=True),
    "ga": Sequencer(_genetic, "a genetic algorithm begun with the rules', each child improved"),
    "anneal": Sequencer(
        _anneal, "simulated annealing of a list of priorities, begun with the best rule's: a search, it learns nothing"
    ),
    "carried": Sequencer(
        _carried, "a policy learned on small cells, see --policy: no search", react=_carried_on, alone=True
    ),
    "exact": Sequencer(_exact, "best-first search (A*) to the proven optimum", alone=True),
    "cp-sat": Sequencer(_cp_sat, "constraint programming, for every objective"),
    "portfolio": Sequencer(
        _portfolio, "annealing, then the exact search that proves most, begun with what it found", alone=True
    ),
    "shortest-move": _rule("shortest-move", "the shortest move"),
    "longest-remaining-work": _rule("longest-remaining-work", "the part with the most work left"),
    "most-urgent-machine": _rule("most-urgent-machine", "what feeds or empties the machine most behind"),
    "nearest-ready": _rule("nearest-ready", "what can begin soonest"),
    "earliest-due": _rule("earliest-due", "the part that is due first"),
}
SEQUENCERS = Family("sequencers", _SHIPPED, _adopted)


BESIDE_METHODS = {  # by what an order may be that no method found alone
    "advised": "srl with advice",
    "unadvised": "srl that was never advised",
    "given": "the given order",
    "cyclic": "one cycle, repeated",
}


def method_in_words(name: str) -> str:
    """By what an order was found, such as "fifo (first in, first out: a queue of tasks)"."""
    if name in BESIDE_METHODS:
        return BESIDE_METHODS[name]
    return f"{name} ({SEQUENCERS[name].help})" if name in SEQUENCERS else name


def check_method(name: str) -> None:
    """BadInput for an unknown method."""
    if name not in SEQUENCERS:
        raise unknown("method", name, SEQUENCERS, "--method")


def find_sequence(cell: "Cell", method: str, search: "Search", seed: int, session: int = 0) -> "SequenceResult":
    """The best sequence that a method finds in a session of a seed; BadInput for an unknown method."""
    import numpy as np

    check_method(method)
    return SEQUENCERS[method](cell, search, np.random.default_rng([seed, 2, session]))
