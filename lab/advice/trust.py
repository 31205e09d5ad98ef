"""Trust in advisors, from where their advice has led so far; below it, their skill, judged afterwards by the optimal values.

An answer is good if it leads nearer to the goal along the paths made so far. It is bad if it does not change the state, ends the
episode without success, leaves the known paths, leads no nearer, or closes a loop of advised moves. An answer that nobody has
tried is neither, so an advisor that is seldom followed is judged mostly where it agrees with others, which flatters it. All
answers are judged by the paths known now: when a shorter one is found, old answers are judged anew.
`SkillEstimate` and everything below it know the optimal values; everything above knows only the moves that were made.
"""

from collections import Counter, deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import exp, inf, log

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.lazy import scipy
from lab.mdp import FloatArray, TabularMDP

PRIOR = 1.0  # pseudo-counts of good and of bad answers: the parameters of the Beta prior
STATE_PRIOR = 4.0  # the weight, in pseudo-answers, of the overall trust in a single state
LEVEL = 0.95  # of credible intervals
EVEN = 0.5  # below this trust, more of the advice is bad than good
ENOUGH = 10  # judged answers before an advisor may be dropped

FEWEST = 5  # answers from which a skill is estimated
TAUS = (0.001, 100.0)
SLIPS = tuple(n / 50 for n in range(6))  # shares of slips
SLIP_MEAN, GRID = 0.05, 101  # the expected share; the points in which the likelihood of a skill is looked at
SAME = 1e-9  # values that differ by less are equally good
EDGE = 1.920729410347062  # half the 95 % quantile of chi-squared with one degree of freedom

Trail = Sequence[tuple[int, int, int]]  # (state, action, state entered) of each step
Pair = tuple[int, int]  # a state and an action there
Said = Mapping[int, Mapping[int, int]]  # how often an action was said, by state


class Ways:
    """The moves made so far, and from them the fewest known moves to the goal from each of the states 0..S-1."""

    def __init__(self, states: int):
        self._entered: list[dict[int, int]] = [{} for _ in range(states)]  # the last time, by state and action
        self._left: list[set[int]] = [set() for _ in range(states)]  # from where a state was entered
        self._moves: list[float] = [inf] * states
        self._lost: set[int] = set()

    def walked(self, trail: Trail, reached: bool, over: bool) -> None:
        """Adds an episode of at least one step; over: whether it ended in a terminal state."""
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
        """Updates the fewest moves of all states that lead to these."""
        waiting = deque(states)
        while waiting:
            entered = waiting.popleft()
            for state in self._left[entered]:
                if self._moves[entered] + 1.0 < self._moves[state]:
                    self._moves[state] = self._moves[entered] + 1.0
                    waiting.append(state)

    def verdict(self, state: int, action: int) -> bool | None:
        """Whether an action leads nearer to the goal; None if it was never tried, or if no path to the goal is known."""
        entered = self._entered[state].get(action)
        if entered is None:
            return None
        if entered == state or entered in self._lost:
            return False
        if self._moves[state] == inf:
            return None
        return self._moves[entered] < self._moves[state]  # inf, without a known path from there, is no nearer

    def entered(self, state: int, action: int) -> int:
        """The state to which an action that was tried in a state led the last time."""
        return self._entered[state][action]

    def tally(self, said: Said, circled: Collection[Pair] = ()) -> tuple[int, int]:
        """(good, bad): the numbers of good and bad answers; answers in `circled` are bad if there is no other verdict."""
        counts: Counter[bool | None] = Counter()
        for state, actions in said.items():
            for action, times in actions.items():
                verdict = self.verdict(state, action)
                counts[False if verdict is None and (state, action) in circled else verdict] += times
        return counts[True], counts[False]


def circles(trail: Trail, advised: Mapping[int, int]) -> set[Pair]:
    """The (state, action) pairs of loops in which every move was advised; advised: action by step, from 1.

    A loop with moves of others proves nothing, because it may have been the way back from their mistake.
    """
    loops: set[Pair] = set()
    run: list[Pair] = []
    left: dict[int, int] = {}  # when a state was left last in this run
    for step, (state, action, entered) in enumerate(trail, start=1):
        if advised.get(step) != action:
            run, left = [], {}
            continue
        left[state] = len(run)
        run.append((state, action))
        if entered in left:
            loops.update(run[left[entered] :])
    return loops


def trust(good: int, bad: int) -> float:
    """The expected share of good advice: the mean of the Beta posterior."""
    return (PRIOR + good) / (2.0 * PRIOR + good + bad)


def trust_there(overall: float, good: int, bad: int) -> float:
    """The trust in one state: the mean of a Beta posterior whose prior has the overall trust as its mean."""
    return (STATE_PRIOR * overall + good) / (STATE_PRIOR + good + bad)


def bounds(good: int, bad: int, level: float = LEVEL) -> tuple[float, float]:
    """(low, high): the credible interval of the share of good advice, from quantiles of the Beta posterior."""
    tail = (1.0 - level) / 2.0
    low, high = (float(scipy.special.betaincinv(PRIOR + good, PRIOR + bad, at)) for at in (tail, 1.0 - tail))
    return low, high


def is_bad(good: int, bad: int) -> bool:
    """Whether significantly more of the advice is bad than good."""
    return good + bad >= ENOUGH and bounds(good, bad)[1] < EVEN


def is_good(good: int, bad: int) -> bool:
    """Whether significantly more of the advice is good than bad."""
    return bounds(good, bad)[0] > EVEN


@dataclass(frozen=True)
class SkillEstimate:
    """The estimate of an advisor's tau (thesis eq. 9.1) within TAUS: 95 % interval, nearest of SKILL_TAUS, number of answers."""

    tau: float
    low: float
    high: float
    word: str
    answers: int

    def __str__(self) -> str:
        """The estimate in one line of plain text."""
        word = "no better than chance" if self.tau == TAUS[1] else f"nearest to {self.word}"
        return f"tau {self.tau:.3g} ({self.low:.3g} to {self.high:.3g}, from {self.answers} answers): {word}"


def skill_of(answers: Sequence[Pair], values: FloatArray) -> SkillEstimate | None:
    """The maximum-likelihood tau of answers drawn from a softmax over values (S, A), with its likelihood interval.

    A share of the answers may be slips, drawn evenly from the actions, so that a single one that costs much does not outweigh
    many best ones: each tau has the share of SLIPS that makes the answers likeliest, with an exponential prior. Only states
    count in which the actions differ in value; None for fewer than FEWEST of them. Source: thesis eq. 9.1.
    """
    table = values[[state for state, _ in answers]] if answers else values[:0]
    below = table - table.max(axis=1, keepdims=True)
    telling = below.min(axis=1) < -SAME
    if telling.sum() < FEWEST:
        return None
    below = below[telling]
    chosen = below[np.arange(len(below)), np.array([action for _, action in answers])[telling]]

    def likelihood(log_tau: float) -> float:
        tau = exp(log_tau)
        meant = np.exp(chosen / tau) / np.exp(below / tau).sum(axis=1)
        with np.errstate(divide="ignore"):
            by_share = (np.log((1.0 - slips) * meant + slips / actions).sum() - slips / SLIP_MEAN for slips in SLIPS)
            return max(map(float, by_share))

    actions = below.shape[1]

    ends = log(TAUS[0]), log(TAUS[1])
    optimize = scipy.optimize
    grid = np.linspace(*ends, GRID)  # there may be several peaks
    levels = [likelihood(at) for at in grid]
    peak = int(np.argmax(levels))
    around = grid[max(peak - 1, 0)], grid[min(peak + 1, GRID - 1)]
    inner = float(optimize.minimize_scalar(lambda at: -likelihood(at), bounds=around, method="bounded").x)
    best = max((*ends, inner), key=lambda at: likelihood(at) + SAME * (at in ends))
    floor = likelihood(best) - EDGE
    low, high = (
        end
        if likelihood(end) >= floor
        else float(optimize.brentq(lambda at: likelihood(at) - floor, *sorted((end, best))))
        for end in ends
    )
    word = min(SKILL_TAUS, key=lambda name: abs(log(SKILL_TAUS[name]) - best))
    tau, lowest, highest = (TAUS[ends.index(at)] if at in ends else exp(at) for at in (best, low, high))
    return SkillEstimate(tau, lowest, highest, word, len(below))


@dataclass(frozen=True)
class Difference:
    """An answer that was not among the best actions of a state, and how often it was given; actions are labels."""

    state: int
    label: str
    said: str
    best: tuple[str, ...]
    times: int


def worse(pairs: Iterable[Pair], values: FloatArray) -> Counter[Pair]:
    """The number of times by (state, action) that an answer was not among the best actions."""
    return Counter(pair for pair in pairs if values[pair] < values[pair[0]].max() - SAME)


def differences(wrong: Mapping[Pair, int], mdp: TabularMDP, values: FloatArray, most: int) -> tuple[Difference, ...]:
    """The `most` frequent answers that were not the best, with labels."""
    labels = mdp.action_labels
    return tuple(
        Difference(
            state,
            mdp.state_label(state),
            labels[action],
            tuple(labels[n] for n in np.flatnonzero(values[state] >= values[state].max() - SAME)),
            times,
        )
        for (state, action), times in sorted(wrong.items(), key=lambda item: (-item[1], item[0]))[:most]
    )
