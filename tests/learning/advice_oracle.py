"""Learning with advice as the thesis describes it, in plain Python: an independent program, which imports nothing of the lab.

It follows the thesis (chapters 2, 6, 8 and 9, and the listings of Appendix VII) and, where the thesis has no such rule, the
documentation (docs/teaching.md). It shares no code, no order of random draws and no table of values with the lab.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from itertools import product
from math import exp, inf, log
from random import Random
from statistics import fmean
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, ...]
Values = Sequence[float]
NO_TRACE = 1e-12  # a trace below this is dropped


# ---- worlds ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class World:
    """A grid in which each move leads to one state.

    leads_to: the next state by state and action; pays: its reward; ends: whether a state ends the episode; starts: the states in
    which episodes begin, drawn evenly; goal: the state that is to be reached; sees: whether the advisor sees a state.
    """

    leads_to: list[list[int]]
    pays: list[list[float]]
    ends: list[bool]
    starts: list[int]
    goal: int
    sees: list[bool]


def cells_world(
    shape: Cell,
    obstacles: Collection[Cell],
    starts: Sequence[Cell],
    goal: Cell,
    view: tuple[Cell, Cell] | None = None,
    deadly: bool = True,
) -> World:
    """A world of cells (sections 8.2 and 9.7): a move goes to the next cell along an axis, and a move off the grid stays.

    The goal pays 1.5, an obstacle -1 and any other move -0.1. Goal and obstacles end an episode; obstacles that are not deadly
    block the move instead. view: two opposite corners of the region in which the advisor sees the robot, None for everywhere.
    """
    cells = [*product(*map(range, shape))]
    number = {cell: n for n, cell in enumerate(cells)}
    leads_to: list[list[int]] = []
    pays: list[list[float]] = []
    for cell in cells:
        row, paid = [], []
        for axis, by in product(range(len(shape)), (-1, 1)):
            there = tuple(
                min(max(x + by * (i == axis), 0), size - 1) for i, (x, size) in enumerate(zip(cell, shape, strict=True))
            )
            if there in obstacles and not deadly:
                there = cell
            row.append(number[there])
            paid.append(1.5 if there == goal else -1.0 if there in obstacles else -0.1)
        leads_to.append(row)
        pays.append(paid)
    lower, upper = view or ((0,) * len(shape), shape)
    sees = [all(a <= x <= b for a, x, b in zip(lower, cell, upper, strict=True)) for cell in cells]
    ends = [cell == goal or (deadly and cell in obstacles) for cell in cells]
    return World(leads_to, pays, ends, [number[start] for start in starts], number[goal], sees)


def optimal_values(world: World, discount: float) -> NDArray[np.float64]:
    """The optimal action values (S, A), by value iteration."""
    leads_to, pays, goes_on = np.array(world.leads_to), np.array(world.pays), ~np.array(world.ends)
    q = np.zeros(pays.shape)
    while True:
        better: NDArray[np.float64] = pays + discount * (goes_on * q.max(axis=1))[leads_to]
        if np.abs(better - q).max() < 1e-12:
            return better
        q = better


# ---- drawing from values --------------------------------------------------------------------------------------------


def softmax(values: Values, temperature: float) -> list[float]:
    """The cumulative weights of the actions (eq. 9.1)."""
    best, total, weights = max(values), 0.0, []
    for value in values:
        total += exp((value - best) / temperature)
        weights.append(total)
    return weights


def drawn(weights: Values, random: Random) -> int:
    """An action with these cumulative weights."""
    mark = random.random() * weights[-1]
    for action, weight in enumerate(weights):
        if mark < weight:
            return action
    return len(weights) - 1


# ---- learners -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Setting:
    """Learner, rule of asking and advisor; the names are those of docs/settings.md, tau is the advisor's temperature."""

    learner: str = "q"  # q, q-lambda or afterstate
    alpha: float = 0.95
    discount: float = 0.99
    trace: float = 0.5
    beta: float = 1.3
    episodes: int = 200
    max_steps: int = 200
    count_start: bool = False
    gate: str = "ccrl"  # ccrl, ia or combined
    tau: float = 0.01
    lambda_threshold: float = 0.05
    omega: int = 7
    first_episode: int = 30
    window: int = 5
    psi: float = 1.0
    budget: int = 1_000_000_000
    judge_unhelped: bool = True
    spare_best: bool = False
    by_evidence: bool = False


class QLearner:
    """Q-learning (fig. 2.2): a value for each state and action."""

    chooses_first = False  # whether the next action is chosen before the learner learns from the last step

    def __init__(self, world: World, setting: Setting):
        self.world, self.setting = world, setting
        self.q = [[0.0] * len(row) for row in world.leads_to]

    def begin(self) -> None:
        """Begins an episode."""

    def worth(self, state: int) -> Values:
        """The values of the actions, from which one is drawn."""
        return self.q[state]

    def width(self, state: int) -> float:
        """The distance between the highest and the lowest value of a state (eq. 9.3)."""
        return max(self.q[state]) - min(self.q[state])

    def error(self, state: int, action: int) -> float:
        """The temporal-difference error of a step."""
        there = self.world.leads_to[state][action]
        ahead = 0.0 if self.world.ends[there] else self.setting.discount * max(self.q[there])
        return self.world.pays[state][action] + ahead - self.q[state][action]

    def learn(self, state: int, action: int, following: int) -> None:
        """Learns from a step; following: the next action."""
        self.q[state][action] += self.setting.alpha * self.error(state, action)

    def arrives(self, state: int) -> None:
        """Receives the state that ended the episode."""


class QLambdaLearner(QLearner):
    """Q(lambda) (fig. 2.3): traces carry the error back until an action is not greedy."""

    chooses_first = True

    def begin(self) -> None:
        """Forgets all traces."""
        self.traces: dict[tuple[int, int], float] = {}

    def learn(self, state: int, action: int, following: int) -> None:
        """Learns from a step for all pairs that have a trace."""
        error, there = self.error(state, action), self.world.leads_to[state][action]
        greedy = self.q[there][following] == max(self.q[there])
        self.traces[state, action] = self.traces.get((state, action), 0.0) + 1.0
        for (s, a), trace in self.traces.items():
            self.q[s][a] += self.setting.alpha * error * trace
        decay = self.setting.discount * self.setting.trace
        left = {pair: decay * trace for pair, trace in self.traces.items() if decay * trace > NO_TRACE}
        self.traces = left if greedy else {}


class AfterstateLearner(QLearner):
    """The listing's learner: a value for each state; an action is worth what the state is that it leads to."""

    def __init__(self, world: World, setting: Setting):
        super().__init__(world, setting)
        self.v = [0.0] * len(world.ends)

    def worth(self, state: int) -> Values:
        """The values of the next states, one step later."""
        return [-0.1 + self.setting.discount * self.v[there] for there in self.world.leads_to[state]]

    def width(self, state: int) -> float:
        """The distance between the values of the next states."""
        values = [self.v[there] for there in self.world.leads_to[state]]
        return max(values) - min(values)

    def learn(self, state: int, action: int, following: int) -> None:
        """Moves the value of the state that was left towards that of the next one."""
        target = -0.1 + self.setting.discount * self.v[self.world.leads_to[state][action]]
        self.v[state] += self.setting.alpha * (target - self.v[state])

    def arrives(self, state: int) -> None:
        """The goal and an obstacle are worth their rewards once they have been entered."""
        self.v[state] = 1.5 if state == self.world.goal else -1.0


LEARNERS: dict[str, Callable[[World, Setting], QLearner]] = {
    "q": QLearner,
    "q-lambda": QLambdaLearner,
    "afterstate": AfterstateLearner,
}


# ---- when to ask ----------------------------------------------------------------------------------------------------


class Asking:
    """The three rules of asking: CCRL (fig. 6.2), introspection (IA, section 9.5), and both combined (section 9.6)."""

    def __init__(self, setting: Setting, several_starts: bool):
        self.setting, self.several_starts = setting, several_starts
        self.results: list[int] = []  # the steps of each episode
        self.starts: list[int] = []
        self.fewest: dict[int, float] = {}  # the fewest known steps to the goal from a state
        self.unguided: list[int] = []  # the steps of each episode without advice
        self.misleads, self.evidence = 0, 0.0
        self.rejected = self.converged = False
        self.last_result, self.equal_results = 0, 0

    def opens(self) -> bool:
        """Whether the next episode may ask."""
        setting, results, k = self.setting, self.results, self.setting.window
        episode = len(results) + 1
        if episode < setting.first_episode:
            return False
        if setting.gate == "ia":
            return True
        if self.rejected or len(results) < 2 * k:
            return False
        if results[-1] == self.last_result and results[-1] < setting.max_steps:
            self.equal_results += 1
            self.converged = self.converged or self.equal_results > 2 * k
        else:
            self.last_result, self.equal_results = results[-1], 0
        too_slow = fmean(results[-k:]) / fmean(results[-2 * k : -k]) > 1.0 - setting.lambda_threshold
        return too_slow and not self.converged and episode < setting.episodes  # the last one shows what was learned

    def asks(self, learner: QLearner, state: int) -> bool:
        """Whether it asks in a state of an episode that may ask."""
        return self.setting.gate == "ccrl" or learner.width(state) <= self.setting.psi

    def ended(self, walk: Sequence[int], result: int, may_ask: bool, helped: int) -> None:
        """Receives an episode and judges the advisor by it; walk: the states that were left; helped: its helped steps."""
        self.results.append(result)
        self.starts.append(walk[0])
        self._measures(walk, result)
        if self.setting.gate == "ia" or self.rejected:
            return
        if self.setting.by_evidence:
            self._weighs(result, len(walk), helped)
        elif may_ask and (helped or self.setting.judge_unhelped):
            self._counts(result)

    def _measures(self, walk: Sequence[int], result: int) -> None:
        """Updates the known distances to the goal: with one start that of the best episode, otherwise of all walks together."""
        walk = walk if self.several_starts else walk[:1]
        left = float(result - len(walk)) if result <= self.setting.max_steps else inf
        for state in reversed(walk):
            left = self.fewest[state] = min(left + 1.0, self.fewest.get(state, inf))

    def _counts(self, result: int) -> None:
        """Counts a mislead and rejects after more than Omega (eqs. 6.3 and 6.4).

        If episodes begin in several states, an earlier episode that reached the goal counts as if it had begun in the start of
        the last one: its steps grow by the difference between the known distances of both.
        """
        setting, here = self.setting, self.fewest[self.starts[-1]]
        before: list[float] = []
        for steps, start in [*zip(self.results, self.starts, strict=True)][-1 - setting.window : -1]:
            moved = here < inf and steps <= setting.max_steps
            before.append(steps + here - self.fewest[start] if moved else steps)
        best = setting.spare_best and result <= min(here, setting.max_steps)
        self.misleads += result >= fmean(before) and not best
        self.rejected = self.misleads > setting.omega

    def _weighs(self, result: int, moves: int, helped: int) -> None:
        """The sequential test of docs/teaching.md ("Whom it rejects"), for episodes that begin in one state."""
        limit = self.setting.max_steps
        if not helped:
            self.unguided.append(result)
            return
        own = self.unguided[-self.setting.window :]
        times = result * sum(steps <= limit for steps in own) / sum(own) if own else 0.0
        if result > limit and helped == moves:
            times = max(times, 3.0)
        gained = 2.0 / 3.0 * times - (log(3.0) if result <= limit else 0.0)
        before, self.evidence = self.evidence, max(self.evidence + gained, -log(50.0))
        self.misleads += self.evidence > before
        self.rejected = self.evidence > log(50.0)


# ---- a session ------------------------------------------------------------------------------------------------------


class Told(NamedTuple):
    """What a session tells: the mean steps of its episodes, those of the last one, and counts over all episodes."""

    mean_steps: float
    last_steps: int
    helped_steps: int
    guided_episodes: int
    misleads: int
    rejected: bool


class Session:
    """A session of learning with advice; advice: the cumulative weights of the advisor's answers by state."""

    def __init__(self, world: World, setting: Setting, advice: Sequence[Values], seed: int):
        self.world, self.setting, self.advice, self.random = world, setting, advice, Random(seed)
        self.learner, self.asking = LEARNERS[setting.learner](world, setting), Asking(setting, len(world.starts) > 1)
        self.helped_steps = self.guided_episodes = 0

    def run(self) -> Told:
        """Runs all episodes."""
        for episode in range(1, self.setting.episodes + 1):
            self._episode(episode**-self.setting.beta)
        results, asked = self.asking.results, self.asking
        counts = self.helped_steps, self.guided_episodes, asked.misleads, asked.rejected
        return Told(fmean(results), results[-1], *counts)

    def _chosen(self, state: int, temperature: float, may_ask: bool) -> tuple[int, bool]:
        """The action in a state, and whether it was advised (eqs. 9.1 and 9.2)."""
        may = may_ask and self.helped_steps < self.setting.budget and self.world.sees[state]
        if may and self.asking.asks(self.learner, state):
            return drawn(self.advice[state], self.random), True
        return drawn(softmax(self.learner.worth(state), temperature), self.random), False

    def _episode(self, temperature: float) -> None:
        """An episode, until it reaches the goal, hits a deadly obstacle or has the most steps."""
        world, learner, may_ask = self.world, self.learner, self.asking.opens()
        most_moves = self.setting.max_steps - self.setting.count_start
        learner.begin()
        there, walk, helped = self.random.choice(world.starts), list[int](), 0
        action, advised = self._chosen(there, temperature, may_ask)
        while not world.ends[there] and len(walk) < most_moves:
            walk.append(there)
            helped += advised
            self.helped_steps += advised
            state, there, taken = there, world.leads_to[there][action], action
            goes_on = not world.ends[there] and len(walk) < most_moves
            if learner.chooses_first and goes_on:
                action, advised = self._chosen(there, temperature, may_ask)
            learner.learn(state, taken, action)
            if not learner.chooses_first and goes_on:
                action, advised = self._chosen(there, temperature, may_ask)
        if world.ends[there]:
            learner.arrives(there)
        self.guided_episodes += helped > 0
        result = len(walk) + self.setting.count_start if there == world.goal else self.setting.max_steps + 1
        self.asking.ended(walk, result, may_ask, helped)


def sessions(world: World, setting: Setting, count: int, seed: int = 0) -> list[Told]:
    """As many sessions with an advisor who draws from the optimal values at temperature tau (section 9.2)."""
    advice = [softmax(row, setting.tau) for row in optimal_values(world, setting.discount).tolist()]
    return [Session(world, setting, advice, seed * count + n).run() for n in range(count)]
