"""Gates that follow earlier advice again: their rules on cases that can be redone by hand."""

from collections.abc import Callable
from math import exp

import pytest

from lab.learning.gates import GATES, Surroundings, reuse
from lab.learning.gates.weighing import Weighing
from lab.learning.settings import GateSettings, LearnerSettings

LEFT, RIGHT, STAY = range(3)
EPISODES, LIMIT = 10, 20


def gate(
    name: str, draw: Callable[[], float], values: list[float] | None = None, factor: float = 0.5, bonus: float = 1.0
) -> Weighing:
    """A gate in a problem of 4 states and 3 actions, with the same values in each state."""
    own = values or [0.0] * 3
    around = Surroundings(draw, lambda count: [], False, lambda state: own, (4, 3), LearnerSettings(discount=0.5))
    made = GATES[name].make(GateSettings(name, reuse=factor, bonus=bonus), EPISODES, LIMIT, around)
    assert isinstance(made, Weighing)
    made.opens(1, [])
    return made


def step(one: Weighing, state: int, answer: int, own: int = LEFT) -> tuple[bool, int]:
    """Whether a step was asked about, and the action that was taken."""
    asked = one.asks(state, [])
    return asked, one.takes(state, own, answer if asked else None)


def test_an_answer_is_reused_ever_less() -> None:
    one = gate("advice-reuse", lambda: 0.3)
    assert step(one, 2, RIGHT) == (True, RIGHT)
    assert step(one, 2, RIGHT) == (False, RIGHT)  # with chance 1/2
    assert [step(one, 2, RIGHT) for _ in range(2)] == [(False, LEFT)] * 2  # 1/4, which does not shrink unused
    assert step(one, 3, STAY) == (True, STAY)


def test_an_episode_imitates_or_does_not() -> None:
    one = gate("advice-imitation", lambda: 0.3)
    taken = []
    for episode in (1, 2, 3):  # with chance 1, 1/2, 1/4
        one.opens(episode, [])
        one.begins(0)
        taken.append(step(one, 0, RIGHT)[1])
    assert taken == [RIGHT, RIGHT, LEFT]
    assert step(one, 1, STAY) == (True, STAY)  # what is new is followed all the same


def test_policy_reuse_asks_less_within_an_episode() -> None:
    one = gate("policy-reuse", lambda: 0.3)
    one.begins(0)  # both policies are alike: 1/2
    assert [step(one, 0, RIGHT)[0] for _ in range(3)] == [True, True, False]  # 1, 1/2, 1/4
    one.judges([2], True)
    assert (one.heard.now.helped, one.heard.now.rate) == (1.0, 0.25)  # 0.5 ** 2


def test_policy_reuse_prefers_the_policy_with_the_higher_mean_gain() -> None:
    one = gate("policy-reuse", lambda: 0.3)
    one.heard.now.rate, one.heard.now.own_rate = 0.5, 0.25
    assert reuse.advised_chance(one.heard, 1, 0.05) == 0.5
    assert reuse.advised_chance(one.heard, 101, 0.05) == pytest.approx(1.0 / (1.0 + exp(5.0 * -0.25)))
    one.heard.now.advised = 0.0
    one.judges([LIMIT + 1], True)  # a failed episode gains nothing
    assert (one.heard.now.own, one.heard.now.own_rate) == (1.0, 0.0)


@pytest.mark.parametrize(("u", "action"), [(0.0, LEFT), (0.2, LEFT), (0.22, RIGHT), (0.7, RIGHT), (0.8, STAY)])
def test_value_reuse_raises_the_value_of_the_answer(u: float, action: int) -> None:
    one = gate("value-reuse", lambda: u)
    assert step(one, 0, RIGHT) == (True, action)  # the weights are 1, e and 1: 0.212, 0.788


def test_the_bonus_shrinks_over_the_episodes() -> None:
    one = gate("value-reuse", lambda: 0.22, factor=0.0)
    step(one, 0, RIGHT)
    one.opens(2, [])
    assert step(one, 0, RIGHT) == (False, LEFT)  # each action has 1/3
