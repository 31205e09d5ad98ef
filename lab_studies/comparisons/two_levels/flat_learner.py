"""Q-learning of the whole task as one flat problem, compiled with numba, and the makespan known after a budget of steps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.learning.compiled import compiled
from lab.mdp import BoolArray, FloatArray, IntArray
from lab_studies.comparisons.two_levels.kitchen import FlatWorld

Count = NDArray[np.int64]


class FlatSettings(NamedTuple):
    """How the flat problem is learned: by Q-learning with alpha 1, as nothing is random; values begin at 0.

    cost: of each step. goal: the reward at the end. In episode n a random action has the probability epsilon * n ** -beta,
    but at least `least`. After an episode its steps are learned from again, from the last to the first; an episode is cut
    off after `longest` steps.
    """

    cost: float
    goal: float
    discount: float
    epsilon: float = 0.0
    beta: float = 0.0
    least: float = 0.0
    longest: int = 20_000


class _Problem(NamedTuple):
    successor: IntArray  # (S, A)
    terminal: BoolArray  # (S,)
    start: int


def learn_flat(
    world: FlatWorld, settings: FlatSettings, budgets: tuple[int, ...], cap: int, rng: np.random.Generator
) -> Count:
    """The makespans (budgets,) known after each budget of learning steps, -1 if none is at most `cap`; budgets ascend.

    A makespan is that of the greedy policy or of the best episode so far, whichever is shorter: nothing is random, so that
    an episode can be repeated.
    """
    problem = _Problem(world.mdp.successor, world.mdp.terminal, world.mdp.start)
    return np.asarray(_session(problem, settings, np.array(budgets, np.int64), cap, rng))


@compiled
def _session(problem: _Problem, settings: FlatSettings, budgets: Count, cap: int, rng: np.random.Generator) -> Count:
    q = np.zeros(problem.successor.shape)
    makespans = np.full(len(budgets), -1)
    episode = np.zeros((settings.longest, 2), np.int32)  # states and actions of the one under way
    state, length, number, used, best = problem.start, 0, 1, 0, cap + 1
    for stop in range(len(budgets)):
        while used < budgets[stop]:
            epsilon = max(settings.least, settings.epsilon * number**-settings.beta)
            action = _choose(q, state, epsilon, rng)
            episode[length, 0], episode[length, 1] = state, action
            _learn(problem, settings, q, state, action)
            state = problem.successor[state, action]
            length += 1
            used += 1
            if problem.terminal[state]:
                best = min(best, length)
            if problem.terminal[state] or length == len(episode):
                for step in range(length - 1, -1, -1):
                    _learn(problem, settings, q, episode[step, 0], episode[step, 1])
                state, length, number = problem.start, 0, number + 1
        shortest = min(best, _greedy_steps(problem, q, cap))
        if shortest <= cap:
            makespans[stop] = shortest
    return makespans


@compiled
def _choose(q: FloatArray, state: int, epsilon: float, rng: np.random.Generator) -> int:
    """The best action, a random one of equally good ones, or with probability epsilon any action."""
    actions = q.shape[1]
    if epsilon > 0.0 and rng.random() < epsilon:
        return int(rng.random() * actions)
    top, ties, best = -np.inf, 0, 0
    for action in range(actions):
        if q[state, action] > top:
            top, ties, best = q[state, action], 1, action
        elif q[state, action] == top:
            ties += 1
    left = int(rng.random() * ties) if ties > 1 else 0
    while left:
        best += 1
        left -= q[state, best] == top
    return best


@compiled
def _learn(problem: _Problem, settings: FlatSettings, q: FloatArray, state: int, action: int) -> None:
    """Update Q(s,a) = r + gamma max Q(s',.), the rule of `lab.learning.updates.QLearning` with alpha 1."""
    entered = problem.successor[state, action]
    value = settings.goal
    if not problem.terminal[entered]:
        top = q[entered, 0]
        for other in range(1, q.shape[1]):
            top = max(top, q[entered, other])
        value = settings.discount * top
    q[state, action] = value - settings.cost


@compiled
def _greedy_steps(problem: _Problem, q: FloatArray, cap: int) -> int:
    """The steps of the greedy policy to the end (ties: the lowest index); cap + 1 if it takes more."""
    state = problem.start
    for steps in range(cap + 1):
        if problem.terminal[state]:
            return steps
        state = problem.successor[state, int(q[state].argmax())]
    return cap + 1
