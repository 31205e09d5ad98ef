"""Advice on the steps of a table: files of answers, the level for which advisors are made, and limited views."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.advice.advisors import AdvisorName, make_advisor, recorded_fault
from lab.advice.entries import Read
from lab.advice.policy_advisor import PolicyAdvisor, policy_of
from lab.errors import BadInput, unknown
from lab.files import json_of, read_limited
from lab.learning.requests import AdviceRequest, Advisor, Ask
from lab.learning.selection import uniforms
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances, tau_schedule
from lab.mdp import BoolArray, FloatArray, TabularMDP, optimal_values
from lab.toolbox.registry import Toolbox

MOST_BYTES = 10_000_000
MOST_DIGITS = 9


def answers_of(path: Path, mdp: TabularMDP) -> dict[int, int]:
    """The answers by state in a file with a JSON object {"state": "action"}; both are labels or numbers.

    Raises BadInput for a file that cannot be read, is too large or holds no such object, and for unknown states or actions.
    """
    try:
        document = json_of(read_limited(path, MOST_BYTES))
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror}") from None
    except ValueError:
        raise BadInput(f"'{path}' is no JSON: wanted an object of states and actions") from None
    if not isinstance(document, dict) or not document:
        raise BadInput(f'\'{path}\': wanted an object of states and actions, such as {{"(0, 1)": "right"}}')
    states = {mdp.state_label(state): state for state in range(mdp.n_states)}
    actions = {label: action for action, label in enumerate(mdp.action_labels)}
    numbers = {str(action): action for action in actions.values()}
    actions_by_state = {}
    for name, action_name in document.items():
        is_number = name.isascii() and name.isdigit() and len(name) <= MOST_DIGITS and int(name) < mdp.n_states
        state = int(name) if is_number else states.get(name)
        if state is None:
            raise unknown("state", name, states, str(path))
        word = (
            str(action_name) if isinstance(action_name, str | int | float | None) else f"a {type(action_name).__name__}"
        )
        if word not in actions and word not in numbers:
            raise unknown("action", word, actions, f"{path}, state {name}")
        actions_by_state[state] = actions[word] if word in actions else numbers[word]
    return actions_by_state


# ---- the level ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TableLevel:
    """The level of a table: the problem, and what its advisors are made from.

    discount: the learner's; episodes: the session's length; people: the functions that ask people, by name; region: (S,) bool,
    the states in which advice counts, None for all; values: returns the optimal action values for a discount, by default those
    of the table; toolbox: holds the policies that advise, None for the user's own.
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
        """An advisor that draws from the optimal values; sign: -1 prefers the worst action."""
        known = optimal_values(self.mdp, self.discount) if self.values is None else self.values(self.discount)
        chances = advice_chances(sign * known, tau_schedule(taus, self.episodes))
        return TableAdvisor(Advice.of(chances, self.region), uniforms(self.rng))

    def check(self, recorded: Read) -> None:
        """Raises BadInput for advice about another problem, or about states that this one does not have."""
        if recorded.session.signature != self.mdp.signature:
            raise recorded_fault(recorded, "problem", self.mdp.signature)
        for state, action in recorded.said().items():
            if not (0 <= state < self.mdp.n_states and 0 <= action < self.mdp.n_actions):
                raise BadInput(f"state {state}, action {action} do not exist")

    def answered(self, path: Path) -> Mapping[int, int]:
        """The answers by state in a file: see `answers_of`."""
        return answers_of(path, self.mdp)

    def learned(self, name: str) -> Advisor:
        """A policy as an advisor: see `PolicyAdvisor`."""
        return PolicyAdvisor(policy_of(name, self.toolbox), self.mdp)

    def advisor(self, name: AdvisorName) -> Advisor | None:
        """The advisor of that name, whose advice counts in the region only."""
        made = make_advisor(name, self)
        if made is None or self.region is None or isinstance(made, TableAdvisor):
            return made
        return LimitedView(made, self.region)


class LimitedView:
    """An advisor that is asked only in the states of a region, (S,) bool."""

    def __init__(self, advisor: Advisor, region: BoolArray):
        self._advisor, self._region = advisor, region

    def advise(self, request: AdviceRequest) -> int | None:
        """The advisor's answer, None outside the region."""
        return self._advisor.advise(request) if self._region[request.state] else None
