"""Advice about the steps in a table: what its advisors are made from, and what they see."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.advice.advisors import AdvisorName, make_advisor, recorded_fault
from lab.advice.answers_file import answers_of
from lab.advice.entries import Read
from lab.advice.policy_advisor import PolicyAdvisor, policy_of
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest, Advisor, Ask
from lab.learning.selection import uniforms
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances, tau_schedule
from lab.mdp import BoolArray, FloatArray, TabularMDP, optimal_values
from lab.toolbox.registry import Toolbox


@dataclass(frozen=True)
class TableLevel:
    """A problem with the learner's discount and episodes (the session's length), and whom it may ask.

    people: who can be asked, by name; region (S,): where anybody is heard; values: where the optimal action values come
    from, by default the problem's table; toolbox: where policies that advise are, None: the user's own.
    """

    mdp: TabularMDP
    discount: float
    rng: np.random.Generator
    people: Mapping[str, Ask] = field(default_factory=dict)
    region: BoolArray | None = None
    episodes: int = 1
    values: Callable[[float], FloatArray] | None = None
    toolbox: Toolbox | None = None

    def simulated(self, taus: tuple[float, ...], sign: float) -> Advisor:
        """An advisor that knows the exact optimal values, or (sign -1) takes the worst for the best."""
        known = optimal_values(self.mdp, self.discount) if self.values is None else self.values(self.discount)
        chances = advice_chances(sign * known, tau_schedule(taus, self.episodes))
        return TableAdvisor(Advice.of(chances, self.region), uniforms(self.rng))

    def check(self, recorded: Read) -> None:
        """BadInput for advice about another problem, or in states that this one has not."""
        if recorded.session.signature != self.mdp.signature:
            raise recorded_fault(recorded, "problem", self.mdp.signature)
        for state, action in recorded.said().items():
            if not (0 <= state < self.mdp.n_states and 0 <= action < self.mdp.n_actions):
                raise BadInput(f"state {state}, action {action} do not exist")

    def answered(self, path: Path) -> Mapping[int, int]:
        """The action by state that a file of answers holds: see `answers_of`."""
        return answers_of(path, self.mdp)

    def learned(self, name: str) -> Advisor:
        """A policy that says what it would do, silent where it has never been."""
        return PolicyAdvisor(policy_of(name, self.toolbox), self.mdp)

    def advisor(self, name: AdvisorName) -> Advisor | None:
        """`make_advisor`, heard in the region only."""
        made = make_advisor(name, self)
        if made is None or self.region is None or isinstance(made, TableAdvisor):
            return made
        return LimitedView(made, self.region)


class LimitedView:
    """Any advisor, a person too, who is heard only where the robot is in a region; (S,) bool."""

    def __init__(self, advisor: Advisor, region: BoolArray):
        self._advisor, self._region = advisor, region

    def advise(self, request: AdviceRequest) -> int | None:
        """What the advisor says, nothing outside the region."""
        return self._advisor.advise(request) if self._region[request.state] else None
