"""Who advises: simulated advisors of any skill, a person at a terminal, or nobody."""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from math import isfinite
from typing import Protocol

import numpy as np

from lab.errors import BadInput, unknown
from lab.learning.selection import softmax, uniforms
from lab.learning.updates import Table
from lab.mdp import FloatArray, TabularMDP, optimal_values


@dataclass(frozen=True, slots=True)
class AdviceRequest:
    """What a learner shows when it asks: where it is, what it thinks, and how it has been doing.

    q: its live action values, q[state][action], not to be changed; step counts from 1; learner_action: what it
    would do itself; the means are step counts over the last K episodes and the K before, None (like the rate)
    before there are 2K.
    """

    mdp: TabularMDP
    q: Table
    state: int
    episode: int
    step: int
    learner_action: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None


class AdvisorLeft(Exception):
    """The advisor ends its advice for the session."""


Ask = Callable[[AdviceRequest], int | None]


class Advisor(Protocol):
    """Whoever can be asked."""

    def advise(self, request: AdviceRequest) -> int | None:
        """The action to take; None leaves this step to the learner. Raises AdvisorLeft to end advice for good."""


class SkilledAdvisor:
    """Draws from a softmax of temperature tau over a table of action values (thesis, section 9.2).

    q: (S, A) float64, usually `optimal_values`; tau > 0: .01 is an expert, 1 a novice.
    """

    def __init__(self, q: FloatArray, tau: float, rng: np.random.Generator):
        self._q, self._tau = q, tau
        self._draw = uniforms(rng)
        self._thresholds: dict[int, list[float]] = {}

    def advise(self, request: AdviceRequest) -> int | None:
        """One draw for the state asked about."""
        thresholds = self._thresholds.get(request.state)
        if thresholds is None:
            thresholds = list(accumulate(softmax(self._q[request.state].tolist(), self._tau)))
            self._thresholds[request.state] = thresholds
        return min(bisect_right(thresholds, self._draw() * thresholds[-1]), len(thresholds) - 1)


class TerminalAdvisor:
    """A person, asked through a prompt that a view brings (see lab/view/terminal.py)."""

    def __init__(self, ask: Ask):
        self._ask = ask

    def advise(self, request: AdviceRequest) -> int | None:
        """What the person says."""
        return self._ask(request)


@dataclass(frozen=True)
class Workbench:
    """What an advisor is made from."""

    mdp: TabularMDP
    discount: float
    rng: np.random.Generator
    ask: Ask | None


def _skilled(bench: Workbench, tau: float) -> Advisor:
    return SkilledAdvisor(optimal_values(bench.mdp, bench.discount), tau, bench.rng)


def _terminal(bench: Workbench) -> Advisor:
    if bench.ask is None:
        raise BadInput("advisor 'terminal': this command has no prompt to ask a person through")
    return TerminalAdvisor(bench.ask)


def _nobody(bench: Workbench) -> None:
    return None


SKILLS = {"expert": 0.01, "moderate": 0.1, "limited": 0.3, "novice": 1.0}

ADVISORS: dict[str, Callable[[Workbench], Advisor | None]] = {
    **{name: partial(_skilled, tau=tau) for name, tau in SKILLS.items()},
    "terminal": _terminal,
    "none": _nobody,
}


def check_advisor(name: str, where: str = "advisor") -> float | None:
    """Raises BadInput unless the name is in ADVISORS or is "tau=X" with X > 0; returns X, or None for a plain name."""
    if name in ADVISORS:
        return None
    if not name.startswith("tau="):
        raise unknown("advisor", name, [*ADVISORS, "tau=X"], where)
    try:
        tau = float(name[4:])
    except ValueError:
        tau = 0.0
    if not (isfinite(tau) and tau > 0.0):
        raise BadInput(f"advisor '{name}' ({where}): tau must be a number above 0, such as tau=0.05")
    return tau


def make_advisor(
    name: str, mdp: TabularMDP, discount: float, rng: np.random.Generator, ask: Ask | None = None
) -> Advisor | None:
    """The advisor of that name for a problem, None for "none".

    Simulated advisors know the problem's exact optimal values for `discount`; `ask` is the prompt behind "terminal".
    Raises BadInput for an unknown name, and for "terminal" without `ask`.
    """
    tau = check_advisor(name)
    bench = Workbench(mdp, discount, rng, ask)
    return ADVISORS[name](bench) if tau is None else _skilled(bench, tau)
