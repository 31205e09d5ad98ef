"""A learned policy as an advisor in the states that correspond to states of its own problem."""

from pathlib import Path

import numpy as np

from lab.errors import BadInput, counted
from lab.files import is_file
from lab.learning.requests import Request
from lab.mdp import IntArray, TabularMDP
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
        raise BadInput("it has visited in none of this problem's states")
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
