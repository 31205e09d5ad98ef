"""Advice on the steps of a table: files of answers, the level for which advisors are made, and limited views."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.advice.advisors import AdvisorName, make_advisor, recorded_fault
from lab.advice.entries import Read
from lab.advice.evaluator import Evaluator
from lab.errors import BadInput, counted, unknown
from lab.files import is_file, json_of, read_limited
from lab.learning.praise import Judging
from lab.learning.requests import AdviceRequest, Advisor, Ask, Reply, Request
from lab.learning.selection import uniforms
from lab.learning.simulated_advice import (
    Advice,
    TableAdvisor,
    advice_chances,
    decisive,
    tau_of_accuracy,
    tau_schedule,
)
from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP, optimal_values
from lab.toolbox.names import SUFFIX
from lab.toolbox.policy import ON, Policy
from lab.toolbox.registry import Toolbox

SILENT = -1


class PolicyAdvisor:
    """An advisor that answers with a policy's greedy action, and does not answer in states that the policy never visited.

    said: (S,) int32, the answer in each state, SILENT for none; known: the number of states with an answer; of: the number of
    nonterminal states; here: whether the policy was learned in exactly this problem.
    """

    def __init__(self, policy: Policy, mdp: TabularMDP):
        self.name, self.here = policy.name, policy.signature == mdp.signature
        self.said = advice_of(policy, mdp)
        self.known, self.of = int((self.said != SILENT).sum()), int((~mdp.terminal).sum())

    def advise(self, request: Request) -> int | None:
        """The policy's greedy action."""
        action = int(self.said[request.state])
        return action if action in request.allowed else None

    def __str__(self) -> str:
        where = "this problem" if self.here else "another problem, its cells matched by their place"
        return f"'{self.name}' knows {self.known} of {counted(self.of, 'state')}: it learned in {where}"


def advice_of(policy: Policy, mdp: TabularMDP) -> IntArray:
    """The policy's greedy action in each state of a problem, (S,) int32, SILENT in states that it never visited.

    If the problem is not the policy's own, grid cells are matched by their indices (both grids need the same number of axes) and
    actions by their labels. Raises BadInput if nothing matches, or if no matching state was visited.
    """
    own_state = np.arange(mdp.n_states, dtype=np.int32) if policy.signature == mdp.signature else _places(policy, mdp)
    visited = policy.visits.max(axis=1) > 0
    if policy.ends is not None:
        visited &= policy.ends == ON
    labels = {label: action for action, label in enumerate(mdp.action_labels)}
    named = np.array([labels.get(label, SILENT) for label in policy.action_labels], np.int32)
    speaks = (own_state >= 0) & visited[own_state] & ~mdp.terminal
    said = np.where(speaks, named[policy.q.argmax(axis=1)][own_state], SILENT).astype(np.int32)
    if not (said != SILENT).any():
        raise BadInput("it has visited none of this problem's states")
    return said


def _places(policy: Policy, mdp: TabularMDP) -> IntArray:
    """The policy's state for each state of a problem, (S,), -1 for none. Raises BadInput if the problems cannot be matched."""
    if not (policy.shape and mdp.shape) or mdp.coverage_shape:
        raise BadInput("it learned in another problem, and only the cells of grids can be matched")
    if len(policy.shape) != len(mdp.shape):
        raise BadInput(f"it learned in a grid with {len(policy.shape)} axes, this one has {len(mdp.shape)}")
    if not {*policy.action_labels} & {*mdp.action_labels}:
        own, here = ", ".join(policy.action_labels), ", ".join(mdp.action_labels)
        raise BadInput(f"it has none of this problem's actions: {own}; wanted {here}")
    cells = np.indices(mdp.shape).reshape(len(mdp.shape), -1)
    inside = (cells < np.array(policy.shape)[:, None]).all(axis=0)
    own_state = np.full(mdp.n_states, -1, np.int32)
    own_state[inside] = np.ravel_multi_index(tuple(cells[:, inside]), policy.shape)
    return own_state


def policy_of(name: str, toolbox: Toolbox | None) -> Policy:
    """The policy in use under a name, or in a file. Raises BadInput if there is neither."""
    box = toolbox or Toolbox()
    if name.endswith(SUFFIX) and is_file(name):
        return box.load(Path(name))
    version = box.versions(name).in_use()
    if version is None:
        raise BadInput(f"nothing is in use under this name: it was removed (toolbox {box.address})")
    return version.policy


# ---- advice on the actions of a table ---------------------------------------------------------------------------------


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
        chances = advice_chances(sign * self._known(), tau_schedule(taus, self.episodes))
        return TableAdvisor(Advice.of(chances, self.region), uniforms(self.rng))

    def of_accuracy(self, share: float) -> Advisor:
        """An advisor with this share of optimal answers over the states in which an answer matters.

        Raises BadInput for a share that an advisor has at random.
        """
        known = self._known()
        tau = tau_of_accuracy(known, decisive(known, ~self.mdp.terminal), share)
        return TableAdvisor(Advice.of(advice_chances(known, tau), self.region), uniforms(self.rng))

    def _known(self) -> FloatArray:
        return optimal_values(self.mdp, self.discount) if self.values is None else self.values(self.discount)

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

    def evaluator(self, advisor: Advisor, judging: Judging) -> Advisor:
        """An evaluator; moves of the same optimal value are the same to it if it judges by a simulated advisor."""
        values = self._known() if isinstance(advisor, TableAdvisor) else None
        return Evaluator(advisor, judging, uniforms(self.rng), values)


class LimitedView:
    """An advisor that is asked only in the states of a region, (S,) bool."""

    def __init__(self, advisor: Advisor, region: BoolArray):
        self._advisor, self._region = advisor, region
        self.judging: Judging | None = getattr(advisor, "judging", None)

    def advise(self, request: AdviceRequest) -> Reply:
        """The advisor's answer, None outside the region."""
        return self._advisor.advise(request) if self._region[request.state] else None
