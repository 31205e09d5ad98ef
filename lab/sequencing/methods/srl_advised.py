"""SRL with advice: when the makespan stops improving, it asks which part to move next, and rejects who misleads."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lab.advice.advisors import PEOPLE, SKILLS
from lab.errors import BadInput, unknown
from lab.learning.gates import GATES, Gate, improvement
from lab.learning.reasons import Reason
from lab.learning.requests import AdvisorLeft
from lab.learning.selection import softmax
from lab.learning.settings import GateSettings
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import drawn_seed
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.exact_values import ExactValues
from lab.sequencing.methods.sessions import Guide, learn_readably
from lab.sequencing.methods.srl import Srl
from lab.sequencing.search import LearnedSequence, Search
from lab.sequencing.simulate.run import Run

NEVER_REACHED = 10**12  # a cost that no episode has, so that a gate takes every episode for a finished one
FITTING = ("ccrl", "always", "never")  # gates that judge by episodes alone; those that compare values know steps only


@dataclass(frozen=True)
class SequenceRequest:
    """What the learner shows when it asks: where the work stands, what may be done, what it would do itself, and why.

    The means are costs over the last K episodes and the K before, None before there are 2K.
    """

    run: Run
    allowed: tuple[int, ...]
    own: int
    episode: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None
    why: Reason


class SequenceAdvisor(Protocol):
    """Whoever can be asked which part to move next."""

    def advise(self, request: SequenceRequest) -> int | None:
        """A decision among the allowed ones; None leaves it to the learner. Raises AdvisorLeft to end advice for good."""


@dataclass(frozen=True)
class AdvisedResult(LearnedSequence):
    """A sequencer's result, and the advice in it: episodes that asked, decisions taken from the advisor, misleads."""

    requests: int
    helped_steps: int
    misleads: int
    rejected_at_episode: int | None


class KnowingAdvisor:
    """A simulated advisor: draws from a softmax over the exact values; tau in units of the optimum's mean step.

    sign -1: it takes the worst for the best. Source: thesis eq. 9.1, taken to the high level (10.2.1 iii).
    """

    def __init__(self, cell: Cell, tau: float, rng: np.random.Generator, sign: float = 1.0) -> None:
        self._values, self._rng, self._tau, self._sign = ExactValues(cell), rng, tau, sign
        best = optimum(cell)
        self._unit_s = best.cost / len(best.sequence) or 1.0

    def advise(self, request: SequenceRequest) -> int | None:
        """One draw among the allowed decisions."""
        left_s = self._values.of(request.run, request.allowed)
        worst_s = max((value for value in left_s if value < np.inf), default=0.0) + 10 * self._unit_s
        worth = [-self._sign * min(value, worst_s) / self._unit_s for value in left_s]
        return request.allowed[int(self._rng.choice(len(worth), p=softmax(worth, self._tau)))]


class AskedAdvisor:
    """A person, asked through a prompt that a view brings."""

    def __init__(self, ask: Callable[[SequenceRequest], int | None]) -> None:
        self._ask = ask

    def advise(self, request: SequenceRequest) -> int | None:
        """What the person says."""
        return self._ask(request)


def check_advice(name: str, gate: str) -> None:
    """BadInput for an advisor that `sequence_advisor` does not know, and for a gate that does not judge by episodes."""
    if name not in (*SKILLS, "wrong", *PEOPLE, "none"):
        _tau(name)
    if gate not in FITTING and gate in GATES:
        allowed = f"it looks at a table of states, which sequencing has not; allowed here: {', '.join(FITTING)}"
        raise BadInput(f"gate '{gate}' (--gate): {allowed}")
    if gate not in FITTING:
        raise unknown("gate", gate, FITTING, "--gate, for sequencing")


def _tau(name: str) -> float:
    try:
        tau = float(name.removeprefix("tau=")) if name.startswith("tau=") else 0.0
    except ValueError:
        tau = 0.0
    if not 0.0 < tau < np.inf:
        raise unknown("advisor", name, [*SKILLS, "wrong", *PEOPLE, "none", "tau=X"], "--advisor")
    return tau


def sequence_advisor(
    name: str,
    cell: Cell,
    rng: np.random.Generator,
    people: Mapping[str, Callable[[SequenceRequest], int | None]] | None = None,
) -> SequenceAdvisor | None:
    """The advisor of that name: one of the four skills, "tau=X", "wrong", a person ("terminal", "web"), "none".

    Raises BadInput for other names, for a person who is not there, and for a cell with too many states to know.
    """
    if name == "none":
        return None
    if name in PEOPLE:
        if people is None or name not in people:
            raise BadInput(f"advisor '{name}': there is no {PEOPLE[name]} to ask a person through")
        return AskedAdvisor(people[name])
    if name == "wrong":
        return KnowingAdvisor(cell, SKILLS["expert"], rng, sign=-1.0)
    return KnowingAdvisor(cell, SKILLS[name] if name in SKILLS else _tau(name), rng)


def advised_srl(
    cell: Cell, search: Search, rng: np.random.Generator, gate: GateSettings, advisor: SequenceAdvisor | None
) -> AdvisedResult:
    """SRL as printed that asks for advice when the gate says so; an advised decision is learned from as its own.

    The gates are those of the low level: the step counts that they compare are costs here (makespans [s]). Raises
    BadInput for a gate that does not judge by episodes, and as `srl` does. Source: thesis 10.2.1 iii with fig. 6.2.
    """
    check_advice("none", gate.gate)
    session = _Advised(GATES[gate.gate](gate, search.episodes, NEVER_REACHED, None), gate, advisor)
    learned = learn_readably(cell, search, drawn_seed(rng), Srl, session)
    log = learned.log
    log.check(cell)
    return AdvisedResult(
        log.best,
        log.best_cost,
        tuple(log.costs),
        learned.final_cost,
        session.requests,
        session.helped_steps,
        session.gate.misleads,
        session.rejected_at,
    )


class _Advised(Guide):
    """What a session asks before it takes its own decision, and tells when an episode has ended."""

    def __init__(self, gate: Gate, settings: GateSettings, advisor: SequenceAdvisor | None) -> None:
        self.gate, self._settings, self._advisor = gate, settings, advisor
        self.requests = self.helped_steps = 0
        self.rejected_at: int | None = None
        self._costs: list[float] = []
        self._open = self._asked = False
        self._helped = 0

    def begins(self, episode: int) -> None:
        """An episode begins: may it ask?"""
        self._open = self._advisor is not None and self.gate.opens(episode, self._costs)
        self._asked, self._helped = False, 0

    def decide(self, run: Run, allowed: tuple[int, ...], own: int) -> int:
        """The advisor's decision where the episode is open and there is a choice, else the learner's own."""
        if not self._open or self._advisor is None or len(allowed) == 1:
            return own
        self.requests += not self._asked
        self._asked = True
        means = improvement(self._costs, self._settings.window)
        rate, current, previous = (means.rate, means.current_mean, means.previous_mean) if means else (None, None, None)
        number = len(self._costs) + 1
        try:
            said = self._advisor.advise(
                SequenceRequest(run, allowed, own, number, rate, current, previous, self.gate.why)
            )
        except AdvisorLeft:
            self._advisor = None
            return own
        if said is None:
            return own
        if said not in allowed:
            raise BadInput(f"the advisor named {said}: allowed {', '.join(map(str, allowed))}")
        self._helped += 1
        return said

    def ends(self, cost: float) -> None:
        """An episode has ended: was it better than those before?"""
        self._costs.append(cost)
        self.helped_steps += self._helped
        self.gate.judges(self._costs, self._open and self._helped > 0)
        if self.gate.rejected and self.rejected_at is None:
            self.rejected_at = len(self._costs)
