"""Praise and blame: judgements of a learner's moves, and the rules by which it acts on them beside its action values.

A judgement h is about moves i = 1..k that were shown last. Whoever judges may be late, and the learner does not know by how many
moves, so each of them has the credit c_i = 1 / k: TAMER's credit window, with an even delay.

In the episodes that the gate opens, the learner acts by its action values and by what it was told; in all others, and in the
greedy policy that is judged in the end, by its action values alone. A judgement is no reward: these values are learned from the
moves that are made, and the best policy stays the best whatever was praised. In the n-th open episode after the first judgement
what was told has the weight FADING ** (n - 1).

Sources: Knox and Stone, Interactively shaping agents via human reinforcement: the TAMER framework, K-CAP 2009, and
Reinforcement learning from simultaneous human and MDP reward, AAMAS 2012 (action biasing and control sharing); MacGlashan et
al., Interactive learning from policy-dependent human feedback, ICML 2017 (COACH). The settings were chosen by experiment in
`insert`, `transfer` and world I.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from lab.learning.members import Member
from lab.learning.selection import SELECTIONS, Draw, chances, choose_greedy

RATE = 0.5  # the part of the difference to a judgement that is learned from it
BIAS = 10.0  # the weight of a predicted judgement of 1, in spans of the action values of a state
FADING = 0.9
MOST_VALUE, MOST_MOVES = 9, 100  # of a judgement

Judgeable = Literal["no", "also", "only"]  # whether a `Judgement` may answer a request, beside an action or alone
Move = tuple[int, int]  # a state and the action that was made there
Values = Sequence[float]


@dataclass(frozen=True, slots=True)
class Judgement:
    """A judgement of the moves that were shown last: praise if `value` is above 0, blame if it is below.

    value: -MOST_VALUE to MOST_VALUE, clearer the further from 0; moves: how many of the last moves it may be about, at most
    MOST_MOVES; 0: as many as whoever judges may be late, and the last one.
    """

    value: int
    moves: int = 0

    def __str__(self) -> str:
        word = ("clearly " if abs(self.value) > 1 else "") + ("good" if self.value > 0 else "bad")
        return f"{word}, of the last {self.moves} moves" if self.moves > 1 else word


@dataclass(frozen=True, slots=True)
class Judging:
    """How an advisor judges.

    only: whether it does nothing else; otherwise judgements may come beside its actions. late: the most moves by which a
    judgement may be late, each number up to it being equally likely; rule: by which the learner acts on it, of PRAISE_RULES.
    """

    only: bool = False
    late: int = 0
    rule: str = "biasing"


class ActionBiasing:
    """The rule "biasing", and the base class of the others: predicted judgements H(s, a) are added to the action values.

    H(s_i, a_i) += RATE c_i (h - sum_j c_j H(s_j, a_j)) for the moves i of a judgement h, as TAMER learns; the learner selects its
    action from Q(s, a) + weight BIAS H(s, a) max(tau, max_b Q(s, b) - min_b Q(s, b)).

    actions: A; selection: the name of the learner's rule. weight: in the present open episode, from 1 down.
    """

    def __init__(self, actions: int, selection: str):
        self._actions, self._selection = actions, selection
        self._select = SELECTIONS[selection].make
        self._told: dict[int, list[float]] = {}
        self.weight = 1.0

    def told(self, state: int) -> list[float]:
        """What was learned from judgements in a state, (A,), which may be changed; zeros where there were none."""
        return self._told.setdefault(state, [0.0] * self._actions)

    def hears(self, moves: Sequence[Move], value: float, values_of: Callable[[int], Values], tau: float) -> None:
        """Learns from a judgement of moves; values_of: gives the learner's action values of a state; tau: its temperature."""
        error = value - sum(self.told(state)[action] for state, action in moves) / len(moves)
        for state, action in moves:
            self.told(state)[action] += RATE * error / len(moves)

    def biased(self, state: int, values: Values, tau: float) -> Values:
        """The learner's action values (A,) of a state, shifted by what was told there."""
        if state not in self._told:
            return values
        unit = self.weight * BIAS * max(tau, max(values) - min(values))
        return [value + unit * told for value, told in zip(values, self._told[state], strict=True)]

    def choice(self, state: int, values: Values, tau: float, draw: Draw) -> int:
        """The learner's action in a state of an open episode."""
        return self._select(self.biased(state, values, tau), tau, draw())

    def chances(self, state: int, values: Values, tau: float) -> list[float]:
        """The probability of each action (A,) in a state of an open episode."""
        return chances(self._selection, self.biased(state, values, tau), tau)

    def fades(self) -> None:
        """Lowers the weight at the end of an open episode."""
        self.weight *= FADING


class ControlSharing(ActionBiasing):
    """The rule "sharing": with the chance `weight` the action with the highest H(s, a), otherwise one by Q alone."""

    def choice(self, state: int, values: Values, tau: float, draw: Draw) -> int:
        """The learner's action in a state of an open episode; in a state without judgements by Q alone."""
        if state in self._told and draw() < self.weight:
            return choose_greedy(self._told[state], 0.0, draw())
        return self._select(values, tau, draw())

    def chances(self, state: int, values: Values, tau: float) -> list[float]:
        """The probability of each action (A,) in a state of an open episode."""
        alone = chances(self._selection, values, tau)
        if state not in self._told:
            return alone
        best = chances("greedy", self._told[state], tau)
        return [self.weight * told + (1.0 - self.weight) * own for told, own in zip(best, alone, strict=True)]


class Coach(ActionBiasing):
    """The rule "coach": a judgement is the advantage of the moves over what the learner does there on average.

    H(s_i, b) += 2 RATE c_i h ((b = a_i) - pi(b | s_i)) for every action b, where pi is what the learner does in open episodes.
    """

    def hears(self, moves: Sequence[Move], value: float, values_of: Callable[[int], Values], tau: float) -> None:
        """Follows the policy gradient, with the judgement as the advantage."""
        for state, action in moves:
            policy, row = self.chances(state, values_of(state), tau), self.told(state)
            for other, chance in enumerate(policy):
                row[other] += 2.0 * RATE * value / len(moves) * ((other == action) - chance)


PRAISE_RULES: dict[str, Member[type[ActionBiasing]]] = {
    "biasing": Member(ActionBiasing, "predicted judgements are added to the action values (TAMER's action biasing)"),
    "sharing": Member(ControlSharing, "the best judged action is taken, ever more seldom (TAMER's control sharing)"),
    "coach": Member(Coach, "a judgement shifts the policy, as an advantage of the move does (COACH)"),
}
