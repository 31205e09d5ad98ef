"""The sequencing methods by name, each imported on first use, because numba and OR-Tools are slow to import."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from numpy.random import default_rng

    from lab.sequencing.methods.anneal import anneal
    from lab.sequencing.methods.carried_over import carried, rule_of
    from lab.sequencing.methods.carried_over_policy import DEFAULT
    from lab.sequencing.methods.cp_sat import cp_sat_sequencer
    from lab.sequencing.methods.exact import exact
    from lab.sequencing.methods.fifo import fifo, first_in_first_out
    from lab.sequencing.methods.genetic import genetic
    from lab.sequencing.methods.monte_carlo import monte_carlo
    from lab.sequencing.methods.portfolio import portfolio
    from lab.sequencing.methods.random_search import random_search
    from lab.sequencing.methods.rollout import by_rule, replan
    from lab.sequencing.methods.rules import RULES, dispatched
    from lab.sequencing.methods.srl import srl
    from lab.sequencing.methods.srl_advised import AdvisedResult, advised_srl, check_gate
    from lab.sequencing.methods.srl_improved import srl_improved
    from lab.sequencing.methods.srl_linear import srl_linear
    from lab.sequencing.methods.srl_time import reacting, srl_time

TABLE = {
    "lab.sequencing.methods.anneal": ("anneal",),
    "lab.sequencing.methods.carried_over": ("carried", "rule_of"),
    "lab.sequencing.methods.carried_over_policy": ("DEFAULT",),
    "lab.sequencing.methods.cp_sat": ("cp_sat_sequencer",),
    "lab.sequencing.methods.exact": ("exact",),
    "lab.sequencing.methods.fifo": ("fifo", "first_in_first_out"),
    "lab.sequencing.methods.genetic": ("genetic",),
    "lab.sequencing.methods.monte_carlo": ("monte_carlo",),
    "lab.sequencing.methods.portfolio": ("portfolio",),
    "lab.sequencing.methods.random_search": ("random_search",),
    "lab.sequencing.methods.rollout": ("by_rule", "replan"),
    "lab.sequencing.methods.rules": ("RULES", "dispatched"),
    "lab.sequencing.methods.srl": ("srl",),
    "lab.sequencing.methods.srl_advised": ("AdvisedResult", "advised_srl", "check_gate"),
    "lab.sequencing.methods.srl_improved": ("srl_improved",),
    "lab.sequencing.methods.srl_linear": ("srl_linear",),
    "lab.sequencing.methods.srl_time": ("reacting", "srl_time"),
    "numpy.random": ("default_rng",),
}

if not TYPE_CHECKING:  # so that mypy knows the names of the table alone
    __getattr__ = loader(__name__, TABLE)
