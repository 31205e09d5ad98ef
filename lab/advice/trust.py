"""Whom to believe: where actions led so far, how much of what an advisor said leads nearer to the goal, and its skill.

An answer is good when it leads nearer to the goal by the ways that have been walked; bad when it leads nowhere, to where an
episode was lost, off the known ways, no nearer, or, all by the advisor's own advice, round in a circle. What nobody has
tried is neither; so an advisor that is seldom followed is judged mostly where it agrees, which flatters it. All answers are
judged by what is known now: when a shorter way is found, an old one is judged anew.
`Skill` and what stands below it look back and know the optimal values; nothing above knows more than was walked.
"""

from collections import Counter, deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, log

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.mdp import FloatArray, TabularMDP

PRIOR = 1.0  # pseudo-answers of either kind before anything is known: an even Beta
STATE_PRIOR = 4.0  # pseudo-answers with which the trust in an advisor as a whole speaks in a state
LEVEL = 0.95  # of credible intervals
EVEN = 0.5  # trust below it: more of the advice leads away than nearer
ENOUGH = 10  # judged answers before an advisor may be dropped

FEWEST = 5  # answers from which a skill is estimated
TAUS = (0.001, 100.0)
SAME = 1e-9  # values that differ by less are equally good
EDGE = 1.920729410347062  # half the 95 % quantile of chi-squared with one degree of freedom

Trail = Sequence[tuple[int, int, int]]  # (state, action, state entered) of each step
Pair = tuple[int, int]  # a state and an action there
Said = Mapping[int, Mapping[int, int]]  # how often an action was said, by state


class Ways:
    """Where actions led, and the fewest moves to the goal along all that was walked; states 0..S-1."""

    def __init__(self, states: int):
        self._entered: list[dict[int, int]] = [{} for _ in range(states)]  # the last time, by state and action
        self._left: list[set[int]] = [set() for _ in range(states)]  # from where a state was entered
        self._moves: list[float] = [inf] * states
        self._lost: set[int] = set()

    def walked(self, trail: Trail, reached: bool, over: bool) -> None:
        """Takes in an episode of at least one step; over: it ended where no step goes on, at the goal or not."""
        for state, action, entered in trail:
            self._entered[state][action] = entered
            self._left[entered].add(state)
        last = trail[-1][2]
        if reached:
            self._moves[last] = 0.0
        elif over:
            self._lost.add(last)
        self._shorten(entered for _, _, entered in reversed(trail))

    def _shorten(self, states: Iterable[int]) -> None:
        """Looks whether the ways that lead through these states are shorter now."""
        waiting = deque(states)
        while waiting:
            entered = waiting.popleft()
            for state in self._left[entered]:
                if self._moves[entered] + 1.0 < self._moves[state]:
                    self._moves[state] = self._moves[entered] + 1.0
                    waiting.append(state)

    def verdict(self, state: int, action: int) -> bool | None:
        """Whether an action leads nearer to the goal there; None: nobody has tried it, or nothing can be said yet."""
        entered = self._entered[state].get(action)
        if entered is None:
            return None
        if entered == state or entered in self._lost:
            return False
        if self._moves[state] == inf:
            return None
        return self._moves[entered] < self._moves[state]  # without a way from there: no nearer

    def tally(self, said: Said, circled: Collection[Pair] = ()) -> tuple[int, int]:
        """How many answers were good and how many bad; those of `circled` are bad when nothing else can be said."""
        counts: Counter[bool | None] = Counter()
        for state, actions in said.items():
            for action, times in actions.items():
                verdict = self.verdict(state, action)
                counts[False if verdict is None and (state, action) in circled else verdict] += times
        return counts[True], counts[False]


def circles(trail: Trail, advised: Mapping[int, int]) -> set[Pair]:
    """The steps that closed a circle, or were part of one, in which all was as advised: an action by step, from 1 on.

    A circle in which others had a hand proves nothing: it may have been the way back from their mistake.
    """
    found: set[Pair] = set()
    run: list[Pair] = []
    left: dict[int, int] = {}  # when a state was left last in this run
    for step, (state, action, entered) in enumerate(trail, start=1):
        if advised.get(step) != action:
            run, left = [], {}
            continue
        left[state] = len(run)
        run.append((state, action))
        if entered in left:
            found.update(run[left[entered] :])
    return found


def trust(good: int, bad: int) -> float:
    """The share of an advisor's advice that is expected to be good: the mean of its Beta."""
    return (PRIOR + good) / (2.0 * PRIOR + good + bad)


def trust_there(overall: float, good: int, bad: int) -> float:
    """Trust in one state, from the answers there; the overall trust is the mean of its prior."""
    return (STATE_PRIOR * overall + good) / (STATE_PRIOR + good + bad)


def bounds(good: int, bad: int, level: float = LEVEL) -> tuple[float, float]:
    """Between which shares the trust lies, believed at this level: the quantiles of its Beta."""
    from scipy.special import betaincinv

    tail = (1.0 - level) / 2.0
    low, high = (float(betaincinv(PRIOR + good, PRIOR + bad, at)) for at in (tail, 1.0 - tail))
    return low, high


def is_bad(good: int, bad: int) -> bool:
    """Whether, beyond doubt, more of the advice leads away than nearer."""
    return good + bad >= ENOUGH and bounds(good, bad)[1] < EVEN


def is_good(good: int, bad: int) -> bool:
    """Whether, beyond doubt, more of the advice leads nearer than away."""
    return bounds(good, bad)[0] > EVEN


@dataclass(frozen=True)
class Skill:
    """An advisor's tau of thesis eq. 9.1 within TAUS, its 95 % interval, the nearest of SKILL_TAUS, and from how many answers."""

    tau: float
    low: float
    high: float
    word: str
    answers: int

    def __str__(self) -> str:
        """The estimate in one line of plain text."""
        word = "no better than chance" if self.tau == TAUS[1] else f"nearest to {self.word}"
        return f"tau {self.tau:.3g} ({self.low:.3g} to {self.high:.3g}, from {self.answers} answers): {word}"


def skill_of(answers: Sequence[Pair], values: FloatArray) -> Skill | None:
    """The tau that makes these answers likeliest, drawn from the softmax over values (S, A), with its likelihood interval.

    Only states in which one action is better than another count; None with fewer than FEWEST. Source: thesis eq. 9.1.
    """
    from scipy.optimize import brentq, minimize_scalar

    table = values[[state for state, _ in answers]] if answers else values[:0]
    below = table - table.max(axis=1, keepdims=True)
    telling = below.min(axis=1) < -SAME
    if telling.sum() < FEWEST:
        return None
    below = below[telling]
    said = below[np.arange(len(below)), np.array([action for _, action in answers])[telling]]

    def likelihood(log_tau: float) -> float:
        tau = exp(log_tau)
        return float(said.sum() / tau - np.log(np.exp(below / tau).sum(axis=1)).sum())

    ends = log(TAUS[0]), log(TAUS[1])  # one peak: the likelihood is concave in 1/tau
    found = float(minimize_scalar(lambda at: -likelihood(at), bounds=ends, method="bounded").x)
    best = max((*ends, found), key=lambda at: likelihood(at) + SAME * (at in ends))
    floor = likelihood(best) - EDGE
    low, high = (
        end if likelihood(end) >= floor else float(brentq(lambda at: likelihood(at) - floor, *sorted((end, best))))
        for end in ends
    )
    word = min(SKILL_TAUS, key=lambda name: abs(log(SKILL_TAUS[name]) - best))
    tau, lowest, highest = (TAUS[ends.index(at)] if at in ends else exp(at) for at in (best, low, high))
    return Skill(tau, lowest, highest, word, len(below))


@dataclass(frozen=True)
class Difference:
    """A state where something was said that is not among the best actions, and how often; actions by label."""

    state: int
    label: str
    said: str
    best: tuple[str, ...]
    times: int


def worse(pairs: Iterable[Pair], values: FloatArray) -> Counter[Pair]:
    """How often something was said that is worse than another action there."""
    return Counter(pair for pair in pairs if values[pair] < values[pair[0]].max() - SAME)


def differences(wrong: Mapping[Pair, int], mdp: TabularMDP, values: FloatArray, most: int) -> tuple[Difference, ...]:
    """The most frequent of what is worse than the best, in words."""
    labels = mdp.action_labels
    return tuple(
        Difference(
            state,
            mdp.state_label(state),
            labels[action],
            tuple(labels[n] for n in np.flatnonzero(values[state] >= values[state].max() - SAME)),
            times,
        )
        for (state, action), times in sorted(wrong.items(), key=lambda one: (-one[1], one[0]))[:most]
    )
