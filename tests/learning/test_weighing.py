"""Gates that weigh what they are told: their rules on cases that can be redone by hand."""

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lab.learning.gates import GATES, Surroundings, heard
from lab.learning.gates.weighing import Weighing
from lab.learning.selection import exp_of
from lab.learning.settings import GateSettings, LearnerSettings

LEFT, RIGHT, STAY = range(3)
EPISODES, LIMIT = 10, 20


def gate(name: str, u: float = 0.5, values: Callable[[int], list[float]] = lambda state: [0.0] * 3) -> Weighing:
    """A gate in a problem of 4 states and 3 actions, whose uniform numbers are all u."""
    around = Surroundings(lambda: u, lambda count: [], False, values, (4, 3), LearnerSettings(alpha=0.5))
    made = GATES[name].make(GateSettings(name), EPISODES, LIMIT, around)
    assert isinstance(made, Weighing)
    made.opens(1, [])
    return made


def test_novelty_asks_until_it_is_answered() -> None:
    one = gate("novelty")
    assert one.asks(2, [])
    assert one.takes(2, LEFT, None) == LEFT  # silence is no answer
    assert one.asks(2, [])
    assert one.takes(2, LEFT, RIGHT) == RIGHT
    assert not one.asks(2, [])
    assert one.asks(1, [])
    assert str(one.why) == "it was told 0 times here"


def test_fading_asks_about_fewer_steps_each_episode() -> None:
    one = gate("fading", u=0.95)  # its share is 0.97 ** (n - 1)
    asked = []
    for episode in (1, 2, 3):
        one.opens(episode, [])
        asked.append(one.asks(0, []))
    assert asked == [True, True, False]


def test_shaping_multiplies_what_was_said_with_the_own_chances() -> None:
    told = heard.blank(1, 3, 1)
    for action in (RIGHT, RIGHT, STAY):
        heard.hear(told, 0, action)
    values, odds = [1.0, 0.0, 0.0], 3.0  # weights 1, e**-1 * 9, e**-1 * 3
    weights = np.array([1.0, 9.0 * exp_of(-1.0), 3.0 * exp_of(-1.0)])
    ends = np.cumsum(weights) / weights.sum()
    marks = 0.0, ends[0] + 0.01, ends[1] - 0.01, ends[1] + 0.01
    drawn = [heard.shaped(told, 0, [*values], 1.0, odds, u) for u in marks]
    assert drawn == [LEFT, RIGHT, RIGHT, STAY]


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=6), st.floats(0.0, 1.0, exclude_max=True))
def test_shaping_draws_an_action_whatever_the_values(values: list[float], u: float) -> None:
    told = heard.blank(1, len(values), 1)
    assert 0 <= heard.shaped(told, 0, values, 1e3, 99.0, u) < len(values)


def test_reliability_follows_what_its_values_bear_out() -> None:
    table = {0: [0.0, 1.0, 0.0], 1: [2.0, 1.0, 0.0]}
    one = gate("reliability", u=0.0, values=lambda state: table[state])
    assert one.asks(0, [])
    assert one.takes(0, LEFT, RIGHT) == RIGHT  # trust 1/2 at first, above guessing's 1/3
    one.saw(0, RIGHT, 0.0, 1.0, 1, 0)  # its values say so, too: 2 of 3
    assert (one.heard.now.right, one.heard.now.wrong) == (2.0, 1.0)
    assert not one.asks(0, [])  # once a state
    for _ in range(5):
        one.takes(1, STAY, STAY)
        one.saw(1, STAY, 0.0, 1.0, 0, 0)  # LEFT is worth more
    assert (one.heard.now.right, one.heard.now.wrong) == (2.0, 6.0)
    assert one.takes(0, LEFT, None) == LEFT  # 1/4, less than what the other two actions share
    late = gate("reliability", u=0.5)
    late.opens(6, [])  # explores with chance 1 - 5/8
    assert not late.asks(0, [])


def test_two_levels_learn_what_asking_is_worth() -> None:
    one = gate("two-levels")
    assert one.asks(0, [])  # both are worth nothing yet
    one.takes(0, LEFT, RIGHT)
    one.saw(0, RIGHT, -1.0, 0.0, 1, 0)
    assert list(one.heard.worth[:2]) == [0.0, -0.5]  # alpha 0.5
    assert not one.asks(0, [])
    one.takes(0, LEFT, None)
    one.saw(0, LEFT, -2.0, 0.0, 1, 0)
    assert list(one.heard.worth[:2]) == [-1.0, -0.5]
    assert one.asks(0, [])
    assert not gate("two-levels", u=0.01).asks(0, [])  # one step in twenty tries the other
