"""Update rules on tables of two or three states, redone by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning.settings import LearnerSettings
from lab.learning.updates import UPDATES, Row
from lab.learning.updates.tabular import afterstate_value, is_greedy, q_target, sarsa_target
from lab.learning.updates.update import towards
from lab.mdp import TabularMDP

Table = list[Row]

MDP = TabularMDP(  # four states, two actions; only the learners on afterstates look at it
    np.array([[1, 2], [0, 3], [2, 2], [3, 3]]),
    np.array([[-0.25, -1.0], [-0.25, 2.0], [0.0, 0.0], [0.0, 0.0]]),
    np.array([False, False, True, True]),
    np.array([False, False, False, True]),
    0,
    ("on", "off"),
)
ON_TABLE = ("q", "sarsa", "q-lambda", "sarsa-lambda", "monte-carlo")  # learners that keep a value per state and action
HALF = LearnerSettings(alpha=0.5, discount=0.5, trace=0.5)
Step = tuple[int, int, float, float, int, int]  # s_tm1, a_tm1, r_t, discount_t, s_t, a_t


def learned(name: str, steps: list[Step], q: Table, settings: LearnerSettings = HALF) -> Table:
    table = [list(row) for row in q]
    update = UPDATES[name].make(table, settings, MDP)
    update.begin()
    for step in steps:
        update.learn(*step)
    update.end()
    return table


def test_targets_by_hand() -> None:
    assert q_target(-1.0, 0.5, [2.0, 4.0]) == 1.0
    assert sarsa_target(-1.0, 0.5, [2.0, 4.0], 0) == 0.0
    assert q_target(1.5, 0.0, [9.0]) == sarsa_target(1.5, 0.0, [9.0], 0) == 1.5
    assert afterstate_value(-1.0, 0.5, 4.0) == 1.0
    assert towards(1.0, 3.0, 0.25) == 1.5
    assert is_greedy([1.0, 1.0], 1)
    assert not is_greedy([1.0, 0.0], 1)


@pytest.mark.parametrize(("name", "expected"), [("q", 1.5), ("sarsa", 1.0), ("q-lambda", 1.5), ("sarsa-lambda", 1.0)])
def test_one_step_by_hand(name: str, expected: float) -> None:
    # Q(0,0) = 1; r = 0, gamma = .5, next values (2, 4), next action 0:
    # q and q-lambda: 1 + .5 (0 + .5*4 - 1) = 1.5; sarsa: 1 + .5 (0 + .5*2 - 1) = 1
    assert learned(name, [(0, 0, 0.0, 0.5, 1, 0)], [[1.0, 0.0], [2.0, 4.0]]) == [[expected, 0.0], [2.0, 4.0]]


@pytest.mark.parametrize("name", ON_TABLE)
def test_a_terminal_step_learns_the_reward_alone(name: str) -> None:
    assert learned(name, [(0, 1, 2.0, 0.0, 1, 0)], [[0.0, 0.0], [7.0, 7.0]])[0] == [0.0, 1.0]


WALK: list[Step] = [(0, 1, -1.0, 0.5, 1, 1), (1, 1, 2.0, 0.0, 2, 0)]


def test_dyna_q_learns_from_earlier_moves_again_the_newest_first() -> None:
    # step 1: Q(0,1) = -.5, and again: -.75. Step 2: Q(1,1) = 1, again: 1.5, then step 1: -.75 + .5 (-1 + .5*1.5 + .75)
    assert learned("dyna-q", WALK, [[0.0, 0.0]] * 3) == [[0.0, -0.5], [0.0, 1.5], [0.0, 0.0]]
    none = replace(HALF, planning=0)
    assert learned("dyna-q", WALK, [[0.0, 0.0]] * 3, none) == learned("q", WALK, [[0.0, 0.0]] * 3)


def test_dyna_q_remembers_what_a_move_led_to_last() -> None:
    # alpha 1: the move is worth 1, and by the newer outcome 3; a third move learns from it once more
    settings = LearnerSettings(alpha=1.0, discount=0.5, planning=2)
    steps: list[Step] = [(0, 1, 1.0, 0.0, 2, 0), (0, 1, 3.0, 0.0, 2, 0), (1, 1, 0.0, 0.5, 0, 0)]
    assert learned("dyna-q", steps, [[0.0, 0.0]] * 3, settings) == [[0.0, 3.0], [0.0, 1.5], [0.0, 0.0]]


def test_q_lambda_carries_the_goal_back() -> None:
    # step 1: delta -1, Q(0,1) = -.5, e(0,1) decays to .25; step 2: delta 2, Q(1,1) = 1, Q(0,1) = -.5 + .5*2*.25
    assert learned("q-lambda", WALK, [[0.0, 0.0]] * 3) == [[0.0, -0.25], [0.0, 1.0], [0.0, 0.0]]


def test_q_lambda_cuts_the_trace_at_a_move_that_is_not_greedy() -> None:
    # step 1: delta = -1 + .5*1 = -.5, Q(0,1) = -.25; action 1 is not the best of state 1, so step 2 moves Q(1,1) alone
    assert learned("q-lambda", WALK, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]) == [[0.0, -0.25], [1.0, 1.0], [0.0, 0.0]]


def test_q_lambda_accumulates_on_a_second_visit() -> None:
    # delta -1: Q = -.5, e = .25; then delta = -1 + 0 + .5 = -.5, e = 1.25: Q = -.5 - .5*.5*1.25
    stay: Step = (0, 0, -1.0, 0.5, 0, 0)
    assert learned("q-lambda", [stay, stay], [[0.0, 0.0]]) == [[-0.8125, 0.0]]


def test_q_lambda_forgets_between_episodes() -> None:
    table = [[0.0, 0.0] for _ in range(3)]
    update = UPDATES["q-lambda"].make(table, HALF, MDP)
    update.begin()
    update.learn(*WALK[0])
    update.begin()
    update.learn(*WALK[1])
    assert table == [[0.0, -0.5], [0.0, 1.0], [0.0, 0.0]]


states, actions, discounts = st.integers(0, 3), st.integers(0, 1), st.sampled_from([0.9, 0.9, 0.9, 0.0])
walks = st.lists(st.tuples(states, actions, st.floats(-1, 1), discounts, states, actions), max_size=40)


@given(walks)
def test_q_lambda_without_trace_is_q_learning(steps: list[Step]) -> None:
    settings = LearnerSettings(alpha=0.7, discount=0.9, trace=0.0)
    start = [[0.0, 0.0]] * 4
    assert learned("q-lambda", steps, start, settings) == learned("q", steps, start, settings)


@given(walks)
def test_q_lambda_equals_the_printed_algorithm(steps: list[Step]) -> None:
    settings = LearnerSettings(alpha=0.4, discount=0.9, trace=0.8)
    q, e = np.zeros((4, 2)), np.zeros((4, 2))
    for s, a, r, discount, s_next, a_next in steps:
        follow = discount > 0 and q[s_next, a_next] == q[s_next].max()
        delta = r + discount * q[s_next].max() - q[s, a]
        e[s, a] += 1.0
        q += settings.alpha * delta * e
        e = settings.discount * settings.trace * e if follow else np.zeros_like(e)
    np.testing.assert_allclose(learned("q-lambda", steps, [[0.0, 0.0]] * 4, settings), q, atol=1e-4)


def test_sarsa_lambda_follows_moves_that_are_not_greedy() -> None:
    # step 1: delta = -1 + .5*0 = -1, Q(0,1) = -.5, e = .25; step 2: delta 2, Q(1,1) = 1, Q(0,1) = -.5 + .5*2*.25
    start = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]
    assert learned("sarsa-lambda", WALK, start) == [[0.0, -0.25], [1.0, 1.0], [0.0, 0.0]]


@pytest.mark.parametrize("name", ["q-lambda", "sarsa-lambda"])
def test_a_replacing_trace_never_exceeds_one(name: str) -> None:
    # delta -1: Q = -.5, e = .25; then delta = -1 + .5*-.5 + .5 = -.75 and e = 1, not 1.25: Q = -.5 - .5*.75
    stay: Step = (0, 0, -1.0, 0.5, 0, 0)
    replacing = LearnerSettings(alpha=0.5, discount=0.5, trace=0.5, replacing=True)
    assert learned(name, [stay, stay], [[0.0, -9.0]], replacing) == [[-0.875, -9.0]]


def test_monte_carlo_learns_from_first_visits_when_the_episode_is_over() -> None:
    # returns: the last step 2, before it -1 + .5*2 = 0, the first one 4 + .5*0 = 4; (0,1) was visited twice: 4 counts
    steps: list[Step] = [(0, 1, 4.0, 0.5, 0, 0), (0, 1, -1.0, 0.5, 1, 0), (1, 1, 2.0, 0.0, 2, 0)]
    assert learned("monte-carlo", steps, [[0.0, 0.0]] * 3) == [[0.0, 2.0], [0.0, 1.0], [0.0, 0.0]]


def test_afterstate_by_hand() -> None:
    # V = 0 everywhere. 0 -> 1: V(0) = .5 (-.25 + .5*0) = -.125. 1 -> 3, whose worth shows only now:
    # V(1) = .5 (-.25 + 0) = -.125, then V(3) = 2. 1 -> 3 again: V(1) = -.125 + .5 (-.25 + .5*2 + .125) = .3125
    update = UPDATES["afterstate"].make([[0.0, 0.0] for _ in range(4)], HALF, MDP)
    for step in [(0, 0, -0.25, 0.5, 1, 0), (1, 1, 2.0, 0.0, 3, 0), (1, 1, 2.0, 0.0, 3, 0)]:
        update.learn(*step)
    assert update.gauge(0) == [0.3125, 0.0]
    assert update.gauge(1) == [-0.125, 2.0]
    assert list(update.q) == [
        [-0.25 + 0.5 * 0.3125, -0.25],
        [-0.25 - 0.5 * 0.125, -0.25 + 0.5 * 2.0],
        [0.0] * 2,
        [0.0] * 2,
    ]
    again = UPDATES["afterstate"].make([list(row) for row in update.q], HALF, MDP)
    np.testing.assert_allclose(list(again.q), list(update.q))  # learned on from its own table
    assert update.q[0:2] == [update.q[0], update.q[1]]


def test_afterstate_needs_one_reward_for_all_ordinary_moves() -> None:
    uneven = TabularMDP(
        MDP.successor, MDP.reward - [[0, 0], [1, 0], [0, 0], [0, 0]], MDP.terminal, MDP.goal, 0, ("a", "b")
    )
    with pytest.raises(BadInput, match=r"the rewards -1\.25 to -0\.25: wanted one"):
        UPDATES["afterstate"].make([[0.0, 0.0] for _ in range(4)], HALF, uneven)


@pytest.mark.parametrize("name", UPDATES)
def test_scattered_values_lie_within_a_half(name: str) -> None:
    update = UPDATES[name].make([[0.0, 0.0] for _ in range(4)], HALF, MDP)
    update.scatter(iter(np.linspace(0.0, 0.99, 8).tolist()).__next__)
    assert all(-0.5 <= value < 0.5 for state in range(2) for value in update.gauge(state))
    assert update.gauge(0) != [0.0, 0.0]
