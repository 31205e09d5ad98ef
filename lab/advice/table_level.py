"""Advice about the steps in a table: what its advisors are made from, and what they see."""

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
    """The action said in each state of a problem, from a JSON object {"state": "action"}; both as labels or as numbers.

    Raises BadInput for a file that cannot be read, is too large or no such object, and for states or actions that there are not.
    """
    try:
        said = json_of(read_limited(path, MOST_BYTES))
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror}") from None
    except ValueError:
        raise BadInput(f"'{path}' is no JSON: wanted an object of states and actions") from None
    if not isinstance(said, dict) or not said:
        raise BadInput(f'\'{path}\': wanted an object of states and actions, such as {{"(0, 1)": "right"}}')
    states = {mdp.state_label(state): state for state in range(mdp.n_states)}
    actions = {label: action for action, label in enumerate(mdp.action_labels)}
    numbers = {str(action): action for action in actions.values()}
    found = {}
    for name, what in said.items():
        is_number = name.isascii() and name.isdigit() and len(name) <= MOST_DIGITS and int(name) < mdp.n_states
        state = int(name) if is_number else states.get(name)
        if state is None:
            raise unknown("state", name, states, str(path))
        word = str(what) if isinstance(what, str | int | float | None) else f"a {type(what).__name__}"
        if word not in actions and word not in numbers:
            raise unknown("action", word, actions, f"{path}, state {name}")
        found[state] = actions[word] if word in actions else numbers[word]
    return found


# ---- table level ------------------------------------------------------------------------------------------------------


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
