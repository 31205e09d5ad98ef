"""Rules against a person's takeovers, in recordings of a cart that are counted by hand."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.mentor.takeovers import alarms, rules_compared, stretches
from lab.recordings.episode import Episode, Recording
from tests.mentor.conftest import Run


def cart(episodes: Sequence[Episode]) -> Recording:
    return Recording(1, "cart", ("x",), ("dx",), episodes)


def test_a_stretch_ends_well_unless_somebody_took_over_or_it_failed(run: Run) -> None:
    assert stretches(run([0, 1, 2, 3, 4], corrected=[2, 3])) == [(0, 2, False), (4, 5, True)]
    assert stretches(run([0, 1, 2], success=False)) == [(0, 3, False)]
    assert stretches(run([0, 1, 2], success=None)) == [(0, 3, True)]
    assert stretches(run([0, 1], corrected=[0, 1])) == []
    assert stretches(run([0, 1, 2], corrected=[0])) == [(1, 3, True)]


def test_an_alarm_begins_anew_after_a_window_or_a_takeover(run: Run) -> None:
    doubts = np.array([0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0])
    assert alarms(doubts, 1.0, run([0] * 7), window=3) == [1, 4]
    assert alarms(doubts, 1.0, run([0] * 7, corrected=[2, 3]), window=9) == [1, 4]
    assert alarms(doubts, 2.0, run([0] * 7), window=3) == []


@pytest.fixture
def strays(run: Run) -> Recording:
    """Twelve ways that go straight, and four on which the cart strays to 5 in two steps, and is taken back."""
    straight = [0.1 * step for step in range(11)]
    strayed = [0.0, 0.1, 0.2, 5.0, 5.1, 0.3, 0.4, 0.5]  # the person has the cart in steps 5 and 6
    return cart([run(straight) for _ in range(12)] + [run(strayed, corrected=[5, 6]) for _ in range(4)])


def test_straying_is_caught_two_steps_before_the_person_takes_over(strays: Recording) -> None:
    result = rules_compared(strays, window_s=3, false_alarms=0.1, rules=["distance", "clock"])
    distance, clock = result.rules
    assert result.takeovers == 4
    assert result.minutes == pytest.approx((12 * 11 + 4 * 6) / 60)
    assert [list(steps) for steps in distance.asked] == [[]] * 12 + [[3]] * 4
    assert (distance.alarms, distance.right, distance.caught) == (4, 4, 4)
    assert list(distance.lead_s) == [2.0] * 4
    assert distance.precision == 1.0
    # positives: three steps before each takeover; of them two are farther off than all others, one is as near as they are
    assert distance.auroc is not None
    assert distance.auroc > 0.75
    assert clock.caught == 0
    assert clock.precision is None
    assert distance.curve[0].tolist() == [0.0, 0.0]
    assert distance.curve[-1, 1] == 1.0


def test_chance_is_what_as_many_random_alarms_reach(strays: Recording) -> None:
    (rule,) = rules_compared(strays, window_s=3, false_alarms=0.1, rules=["distance"]).rules
    steps = 12 * 11 + 4 * 6
    assert rule.chance_precision == pytest.approx(4 * 3 / steps)
    assert rule.chance_recall == pytest.approx(1 - (1 - 4 / steps) ** 3)


def test_no_episode_is_measured_by_what_was_learned_from_it(run: Run) -> None:
    """A place that one episode alone has been to is far for the mentor of that episode, though it ended well."""
    straight = [0.1 * step for step in range(11)]
    odd = run([0.0, 0.1, 7.0, 0.2, 0.3])
    recording = cart([run(straight) for _ in range(12)] + [odd, run([0.0, 0.1, 0.1], corrected=[2])])
    (rule,) = rules_compared(recording, window_s=1, rules=["distance"]).rules
    assert rule.doubts[12].argmax() == 2
    assert rule.doubts[12][2] > 10 * max(doubts.max() for doubts in rule.doubts[:12])


def test_a_rule_that_the_recording_cannot_feed_is_left_out_and_told(strays: Recording) -> None:
    result = rules_compared(strays, rules=["chunk", "distance"])
    assert [rule.name for rule in result.rules] == ["distance"]
    assert any("chunk" in note for note in result.notes)


@pytest.mark.parametrize("corrected", [[], [1]])
def test_a_recording_without_takeovers_or_others_is_refused(run: Run, corrected: list[int]) -> None:
    with pytest.raises(BadInput, match="recording"):
        rules_compared(cart([run([0, 1, 2], corrected=corrected)]))


def test_the_same_seed_compares_the_same(strays: Recording) -> None:
    first, again = (rules_compared(strays, rules=["ensemble", "failure"], seed=5) for _ in range(2))
    for one, other in zip(first.rules, again.rules, strict=True):
        assert [d.tolist() for d in one.doubts] == [d.tolist() for d in other.doubts]


@given(
    st.lists(st.booleans(), min_size=1, max_size=30),
    st.lists(st.booleans(), min_size=30, max_size=30),
    st.integers(1, 9),
)
def test_alarms_are_apart_and_never_during_a_takeover(corrected: list[bool], high: list[bool], window: int) -> None:
    n = len(corrected)
    episode = Episode("go", np.zeros((n, 1), np.float32), np.zeros((n, 1), np.float32), np.array(corrected), True)
    asked = alarms(np.array(high[:n], float), 0.5, episode, window)
    assert all(high[step] and not corrected[step] for step in asked)
    for one, other in pairwise(asked):
        assert other - one >= window or any(corrected[one:other])
