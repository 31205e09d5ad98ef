"""Choices and updates as plain functions of numbers."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.methods.session_updates import average, best_of, explore, gain, log_factor, log_of, log_sum

BELOW_ONE = math.nextafter(1.0, 0.0)


def test_exploring_divides_what_is_below_epsilon_evenly() -> None:
    assert [explore(u, 0.2, 4) for u in (0.0, 0.04, 0.05, 0.1, 0.19)] == [0, 0, 1, 2, 3]
    assert explore(math.nextafter(0.1, 0.0), 0.1, 3) == 2


def test_the_best_and_between_equals_by_the_uniform_number() -> None:
    values = [1.0, 3.0, 2.0, 3.0, 3.0]
    assert [best_of(values, 5, u) for u in (0.0, 0.33, 0.34, 0.66, 0.67, BELOW_ONE)] == [1, 1, 3, 3, 4, 4]
    assert best_of(values, 1, 0.9) == 0  # only the first so many count
    assert best_of([-math.inf, -math.inf], 2, 0.5) == 1


@given(st.floats(-50, 50), st.floats(-50, 50))
def test_log_sum_is_the_logarithm_of_the_sum(a: float, b: float) -> None:
    assert log_sum(a, b) == log_sum(b, a) == pytest.approx(math.log(math.exp(a) + math.exp(b)), abs=1e-12)


def test_log_sum_far_out() -> None:
    assert log_sum(-1e6, -1e6) == -1e6 + math.log(2)
    assert log_sum(-1e6, -2e6) == -1e6
    assert log_sum(-math.inf, -3.0) == -3.0
    assert log_sum(-math.inf, -math.inf) == -math.inf


def test_reward_factors_by_hand() -> None:
    """Eq. 5.3: 20 s late is 1 / 25 + 0.8; eq. 5.4: 1 / T."""
    assert math.exp(log_factor(520.0, 500.0, True, 0.0)) == pytest.approx(0.84)
    assert log_factor(500.0, 500.0, True, 0.0) == log_factor(400.0, 500.0, True, 0.0) == 0.0
    assert log_factor(900.0, math.inf, True, 0.0) == 0.0  # the first episode
    assert math.exp(log_factor(500.0, 400.0, False, 0.0)) == pytest.approx(1 / 500)
    assert math.exp(log_factor(0.0, 0.0, False, 1.0)) == gain(0.0, 1.0) == 1.0


def test_small_things() -> None:
    assert average(2.0, 3, 6.0) == 3.0
    assert log_of(0.0) == -math.inf
    assert log_of(1.0) == 0.0
