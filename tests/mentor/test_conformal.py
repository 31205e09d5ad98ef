"""Conformal thresholds: their promises are counted out over all orders of a few episodes, by nothing of ours."""

from collections.abc import Callable
from itertools import permutations
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.mentor.conformal import Promise, few_false_alarms, many_caught


def share_above(rule: Callable[[list[float], float], Promise], share: float, n: int) -> float:
    """The share of all orders of n + 1 different peaks in which the last one is above the threshold of the first n."""
    orders = [*permutations(range(n + 1))]
    return sum(order[-1] > rule([*map(float, order[:-1])], share).threshold for order in orders) / len(orders)


@pytest.mark.parametrize(("share", "n"), [(0.2, 4), (0.25, 5), (0.5, 3), (0.4, 5)])
def test_false_alarms_stay_below_the_promised_share_over_all_orders(share: float, n: int) -> None:
    counted = share_above(few_false_alarms, share, n)
    assert counted <= share + 1e-12
    assert counted == pytest.approx(few_false_alarms([*map(float, range(n))], share).expected)
    assert counted > share - 1.0 / (n + 1)  # no more careful than the number of episodes makes it


@pytest.mark.parametrize(("share", "n"), [(0.8, 4), (0.75, 5), (0.5, 3), (0.9, 9 - 3)])
def test_as_many_failures_are_caught_as_promised_over_all_orders(share: float, n: int) -> None:
    if (n + 1) * (1 - share) < 1 - 1e-9:
        with pytest.raises(BadInput, match="failed episode"):
            many_caught([*map(float, range(n))], share)
        return
    counted = share_above(many_caught, share, n)
    assert counted >= share - 1e-12
    assert counted == pytest.approx(many_caught([*map(float, range(n))], share).expected)
    assert counted < share + 1.0 / (n + 1)


def test_the_share_of_95_percent_of_the_calibrations_is_counted_by_draws() -> None:
    rng = np.random.default_rng(3)
    n, share = 30, 0.2
    promise = few_false_alarms([*map(float, range(n))], share)
    shares = [1.0 - few_false_alarms(rng.random(n).tolist(), share).threshold for _ in range(2000)]  # of uniform doubts
    assert np.mean(np.array(shares) <= promise.in_95) == pytest.approx(0.95, abs=0.015)
    assert np.mean(shares) == pytest.approx(promise.expected, abs=0.01)


def test_too_few_episodes_promise_nothing() -> None:
    with pytest.raises(BadInput, match=r"false_alarms 0.1 \(calibrate\): 8 successful episodes: that takes 9"):
        few_false_alarms([1.0] * 8, 0.1)
    assert few_false_alarms([1.0] * 9, 0.1).threshold == 1.0
    with pytest.raises(BadInput, match=r"caught 0.9 \(calibrate\): 0 failed episodes: that takes 9"):
        many_caught([], 0.9)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan"), "a"])
def test_a_share_is_between_0_and_1(share: float) -> None:
    with pytest.raises(BadInput, match="false_alarms"):
        few_false_alarms([1.0] * 100, share)
    with pytest.raises(BadInput, match="caught"):
        many_caught([1.0] * 100, share)


@given(st.lists(st.floats(0, 10) | st.just(inf), min_size=9, max_size=30), st.floats(0.1, 0.9), st.floats(0.05, 0.9))
def test_ties_keep_the_promise_on_the_calibrating_episodes(peaks: list[float], alarms: float, caught: float) -> None:
    above = few_false_alarms(peaks, alarms).threshold
    assert sum(peak > above for peak in peaks) <= alarms * (len(peaks) + 1)
    above = many_caught(peaks, caught).threshold
    assert sum(peak > above for peak in peaks) >= caught * len(peaks)
