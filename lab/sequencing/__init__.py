"""The high level: in which order one robot serves the parts of a cell."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from lab.sequencing.cell.cell import Cell
    from lab.sequencing.search import Search, SequenceResult

Sequencer = Callable[["Cell", "Search", "np.random.Generator"], "SequenceResult"]

# Each sequencer is imported when it is used: numba and OR-Tools take their time.


def _srl(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.srl import srl

    return srl(cell, search, rng)


def _srl_time(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.srl_time import srl_time

    return srl_time(cell, search, rng)


def _monte_carlo(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.monte_carlo import monte_carlo

    return monte_carlo(cell, search, rng)


def _random(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.random_search import random_search

    return random_search(cell, search, rng)


def _fifo(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.fifo import fifo

    return fifo(cell, search, rng)


def _genetic(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.genetic import genetic

    return genetic(cell, search, rng)


def _exact(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.exact import exact

    return exact(cell, search, rng)


def _cp_sat(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
    from lab.sequencing.methods.cp_sat import cp_sat_sequencer

    return cp_sat_sequencer(cell, search, rng)


def _rule(name: str) -> Sequencer:
    def sequencer(cell: "Cell", search: "Search", rng: "np.random.Generator") -> "SequenceResult":
        from lab.sequencing.methods.rules import RULES, dispatched

        return dispatched(cell, RULES[name], search)

    return sequencer


# name -> function(cell, search, rng); the last ones are dispatching rules, one sequence each.
SEQUENCERS: Mapping[str, Sequencer] = MappingProxyType(
    {
        "srl": _srl,
        "srl-time": _srl_time,
        "mc": _monte_carlo,
        "random": _random,
        "fifo": _fifo,
        "ga": _genetic,
        "exact": _exact,
        "cp-sat": _cp_sat,
        "shortest-move": _rule("shortest-move"),
        "longest-remaining-work": _rule("longest-remaining-work"),
        "most-urgent-machine": _rule("most-urgent-machine"),
        "nearest-ready": _rule("nearest-ready"),
        "earliest-due": _rule("earliest-due"),
    }
)
# Methods that, where chance is asked for, look in drawn times; the others look with the means.
DRAWN = ("srl", "mc", "random")
