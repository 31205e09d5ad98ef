"""The high level: in which order one robot serves the parts of a cell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from lab.errors import unknown
from lab.plugins.family import Family, first_line, takes, wanted
from lab.sequencing import deferred

if TYPE_CHECKING:
    import numpy as np

    from lab.sequencing.cell.cell import Cell
    from lab.sequencing.methods.carried_over_policy import CarriedPolicy
    from lab.sequencing.search import Search, SequenceResult
    from lab.sequencing.simulate.execution import Policy

Find = Callable[["Cell", "Search", "np.random.Generator"], "SequenceResult"]


class Reaction(NamedTuple):
    """A policy for times that are drawn, and what it does in words.

    replans: the method by which it plans at every decision, while the work waits; None: it does not plan.
    """

    policy: "Policy"
    words: str
    replans: str | None = None


def _planned_anew(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    when = "at every decision" if cell.serial else "whenever something happens"
    return Reaction(deferred.replan(objective, planned), f"planned anew {when}, by rollout", "rollout")


def _learned_on(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    return Reaction(deferred.reacting(cell, objective, seed), "it goes on learning before every decision", "srl-time")


def _queued(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    return Reaction(deferred.first_in_first_out, "a queue of tasks as they become possible")


def _carried_on(cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    return carried_reaction(deferred.DEFAULT)


def carried_reaction(policy: "CarriedPolicy") -> Reaction:
    """A carried-over policy, asked at every decision."""
    return Reaction(deferred.by_rule(deferred.rule_of(policy)), "the carried-over policy, asked at every decision")


def _asked(name: str, cell: "Cell", objective: str, seed: int, planned: Sequence[int]) -> Reaction:
    return Reaction(deferred.by_rule(deferred.RULES[name]), f"the rule {name}, asked at every decision")


@dataclass(frozen=True)
class Sequencer:
    """A sequencing method: called with a cell, a search and a generator, it returns a sequence.

    load: returns its function, and imports it only then, because numba and OR-Tools are slow to import. help: one line. drawn:
    whether, where chance is asked for, it searches with drawn times instead of the means. react: makes the method's policy from a
    cell, an objective, a seed and the planned list. alone: whether no bound is searched beside it unless asked for, since it
    answers at once, as a rule does, or proves its result itself.
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
        return lambda cell, search, rng: deferred.dispatched(cell, deferred.RULES[name], search)

    return Sequencer(load, f"a dispatching rule: {words}", react=partial(_asked, name), alone=True)


def _adopted(name: str, thing: Any) -> Sequencer:
    if isinstance(thing, type) or not takes(thing, "cell", "search", "rng"):
        raise wanted(thing, "a function of cell, search and generator that gives a SequenceResult")
    return Sequencer(lambda: thing, first_line(thing))


_SHIPPED: dict[str, Sequencer] = {
    "srl": Sequencer(
        lambda: deferred.srl, "the thesis's: learns from the reward of whole episodes, as printed", drawn=True
    ),
    "srl-time": Sequencer(
        lambda: deferred.srl_time,
        "Q-learning that begins at a lower bound of the full model; close to the heuristic search LRTA*",
        react=_learned_on,
    ),
    "srl-improved": Sequencer(
        lambda: deferred.srl_improved, "our own: learns where in the order moves belong, from episodes that it improves"
    ),
    "srl-linear": Sequencer(
        lambda: deferred.srl_linear,
        "srl with values that are linear in features: learns weights, which --keep-policy keeps",
    ),
    "mc": Sequencer(lambda: deferred.monte_carlo, "Monte Carlo: averages the returns of the episodes", drawn=True),
    "random": Sequencer(lambda: deferred.random_search, "the best of so many sequences drawn evenly", drawn=True),
    "fifo": Sequencer(lambda: deferred.fifo, "first in, first out: a queue of tasks", react=_queued, alone=True),
    "ga": Sequencer(lambda: deferred.genetic, "a genetic algorithm begun with the rules', each child improved"),
    "anneal": Sequencer(
        lambda: deferred.anneal,
        "simulated annealing of a list of priorities, begun with the best rule's: a search, it learns nothing",
    ),
    "carried": Sequencer(
        lambda: deferred.carried,
        "a policy learned on small cells, see --policy: no search",
        react=_carried_on,
        alone=True,
    ),
    "exact": Sequencer(lambda: deferred.exact, "best-first search (A*) to the proven optimum", alone=True),
    "cp-sat": Sequencer(lambda: deferred.cp_sat_sequencer, "constraint programming, for every objective"),
    "portfolio": Sequencer(
        lambda: deferred.portfolio,
        "annealing, then the exact search that proves most, begun with what it found",
        alone=True,
    ),
    "shortest-move": _rule("shortest-move", "the shortest move"),
    "longest-remaining-work": _rule("longest-remaining-work", "the part with the most work left"),
    "most-urgent-machine": _rule("most-urgent-machine", "what feeds or empties the machine most behind"),
    "nearest-ready": _rule("nearest-ready", "what can begin soonest"),
    "earliest-due": _rule("earliest-due", "the part that is due first"),
}
SEQUENCERS = Family("sequencers", _SHIPPED, _adopted)


BESIDE_METHODS = {  # other origins of an order, in words
    "advised": "srl with advice",
    "unadvised": "srl that was never advised",
    "given": "the given order",
    "cyclic": "one cycle, repeated",
}


def method_in_words(name: str) -> str:
    """The method that found an order, in words, such as "fifo (first in, first out: a queue of tasks)"."""
    if name in BESIDE_METHODS:
        return BESIDE_METHODS[name]
    return f"{name} ({SEQUENCERS[name].help})" if name in SEQUENCERS else name


def check_method(name: str) -> None:
    """Raises BadInput for an unknown method."""
    if name not in SEQUENCERS:
        raise unknown("method", name, SEQUENCERS, "--method")


def find_sequence(cell: "Cell", method: str, search: "Search", seed: int, session: int = 0) -> "SequenceResult":
    """The best sequence that a method finds in a session of a seed; BadInput for an unknown method."""
    check_method(method)
    return SEQUENCERS[method].load()(cell, search, deferred.default_rng([seed, 2, session]))
