"""Choices and schedules, with the probabilities worked out by hand."""

from math import e, exp, isclose

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.selection import (
    choose_epsilon_greedy,
    choose_greedy,
    choose_softmax,
    exp_of,
    greedy,
    softmax,
    temperature,
    uniforms,
)

values_of_a_state = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=8)


def test_softmax_by_hand() -> None:
    np.testing.assert_allclose(softmax([1.0, 0.0], 1.0), [e / (e + 1), 1 / (e + 1)], rtol=1e-15)
    assert softmax([3.0, 3.0, 3.0, 3.0], 0.1) == [0.25] * 4


@pytest.mark.parametrize("tau", [1e-3, 1e-300, 5e-324, 0.0])
def test_a_cold_softmax_is_greedy_and_splits_ties(tau: float) -> None:
    assert softmax([1.0, 2.0, 2.0], tau) == [0.0, 0.5, 0.5]


@given(values_of_a_state, st.floats(0.0, 1e9))
def test_softmax_is_a_distribution_for_any_values(values: list[float], tau: float) -> None:
    chances = softmax(values, tau)
    assert isclose(sum(chances), 1.0, rel_tol=1e-12)
    assert max(chances) == chances[greedy(values)]


@given(values_of_a_state, st.floats(0.0, 10.0), st.floats(0.0, 1.0, exclude_max=True))
def test_the_chosen_action_has_a_chance(values: list[float], tau: float, u: float) -> None:
    assert softmax(values, tau)[choose_softmax(values, tau, u)] > 0.0


def test_u_picks_along_the_cumulated_chances() -> None:
    picks = [choose_softmax([0.0, 0.0, 0.0, 0.0], 1.0, u) for u in (0.0, 0.24, 0.26, 0.51, 0.76, 0.999)]
    assert picks == [0, 0, 1, 2, 3, 3]


def test_greedy_and_epsilon_greedy_by_hand() -> None:
    assert greedy([1.0, 3.0, 3.0]) == 1
    assert [choose_epsilon_greedy([1.0, 3.0], 0.5, u) for u in (0.0, 0.24, 0.26, 0.5, 0.99)] == [0, 0, 1, 1, 1]
    assert choose_epsilon_greedy([1.0, 3.0], 0.0, 0.0) == 1


def test_the_schedule_by_hand() -> None:
    assert [temperature(n, 1.0) for n in (1, 2, 4)] == [1.0, 0.5, 0.25]
    assert temperature(7, 0.0) == 1.0
    assert 0.0 < temperature(1_000_000, 100.0) < 1e-200


def test_uniforms_are_the_generators_own_stream() -> None:
    draw = uniforms(np.random.default_rng(3), block=4)
    np.testing.assert_array_equal([draw() for _ in range(8)], np.random.default_rng(3).random(8))


def test_equally_good_actions_are_drawn() -> None:
    assert [choose_greedy([1.0, 3.0, 3.0], 0.0, u) for u in (0.0, 0.49, 0.5, 0.99)] == [1, 1, 2, 2]
    assert [choose_epsilon_greedy([3.0, 3.0], 0.5, u) for u in (0.0, 0.26, 0.5, 0.74, 0.76)] == [0, 1, 0, 0, 1]


@given(st.floats(-1e308, 0.0))
def test_the_quick_exponential_is_good_to_2e_8(x: float) -> None:
    assert abs(exp_of(x) - exp(x)) < 2e-8
    assert exp_of(0.0) == 1.0
    assert exp_of(-1e300) == 0.0


@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=6), st.floats(1e-3, 1.0))
def test_the_choice_has_the_softmax_probabilities(values: list[float], tau: float) -> None:
    # the chance of an action is the width of the numbers u that pick it: its end lies where the softmax sums say
    ends = np.cumsum(softmax(values, tau))
    for action, end in enumerate(ends[:-1]):
        if end + 1e-6 < 1.0:
            assert choose_softmax(values, tau, end + 1e-6) > action
        if end > 1e-6:
            assert choose_softmax(values, tau, end - 1e-6) <= action
