"""The deep student: its values, what it learns from steps, and what a preferred action does."""

import numpy as np
import pytest

from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab_studies.comparisons.deep_student import dqn
from lab_studies.comparisons.deep_student.dqn import DeepStudent, Sight, seeing

torch = pytest.importorskip("torch")

# two states, 0 and the goal 1: action 1 leads there, action 0 stays
MDP = TabularMDP(
    np.array([[0, 1], [1, 1]]),
    np.array([[0.0, 1.0], [0.0, 0.0]]),
    np.array([False, True]),
    np.array([False, True]),
    0,
    ("stay", "go"),
)
ROWS = np.eye(2, dtype=np.float32)


def student(seed: int = 0) -> DeepStudent:
    made = seeing(Sight(2, ROWS.__getitem__, ROWS.__getitem__))
    return made([[0.0, 0.0]] * 2, LearnerSettings(discount=0.5), MDP, np.random.default_rng(seed))


def test_a_row_of_its_table_is_what_the_network_puts_out() -> None:
    deep = student()
    with torch.no_grad():
        by_torch = dqn._outputs(deep._net, torch.from_numpy(ROWS)).numpy()
    assert np.allclose([deep.q[0], deep.gauge(1)], by_torch, atol=1e-6)


def test_it_learns_the_values_of_the_steps_it_remembers() -> None:
    deep = student()
    for _ in range(20):
        deep.learn(0, 0, 0.0, 0.5, 0, 0)
        deep.learn(0, 1, 1.0, 0.0, 1, 0)
        deep.end()
    assert deep.q[0] == pytest.approx([0.5, 1.0], abs=0.1)  # half of what action 1 gives, after a step that stays


def test_a_preferred_action_becomes_the_greedy_one_without_a_reward() -> None:
    deep = student()
    worst = int(np.argmin(deep.q[0]))
    deep.prefer(0, worst, 0.1)
    deep.replay(0, worst, 0.0, 0.5, 0)
    for _ in range(10):
        deep.end()
    values = deep.q[0]
    assert values[worst] > values[1 - worst]


def test_the_same_seed_gives_the_same_network() -> None:
    values = []
    for seed in (3, 3, 4):
        deep = student(seed)
        deep.learn(0, 1, 1.0, 0.0, 1, 0)
        deep.end()
        values.append(deep.q[0])
    assert values[0] == values[1] != values[2]
