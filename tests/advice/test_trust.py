"""Trust: where actions led, what is good and bad advice by it, Beta counts, and the skill that shows in answers."""

from math import inf, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.advice.advisors import SKILL_TAUS
from lab.advice.trust import (
    EDGE,
    Ways,
    bounds,
    circles,
    differences,
    is_bad,
    is_good,
    skill_of,
    trust,
    trust_there,
    worse,
)
from lab.learning.simulated_advice import advice_chances as chances_of
from lab.mdp import grid, optimal_values
from lab_studies.thesis.chapter_9_sessions import world

LEFT, RIGHT = 0, 1
TO_THE_GOAL = [(0, RIGHT, 1), (1, RIGHT, 2), (2, RIGHT, 3)]  # a corridor 0-1-2-3, the goal is 3


def test_what_leads_nearer_is_good() -> None:
    ways = Ways(4)
    assert ways.verdict(0, RIGHT) is None  # nobody has tried it
    ways.walked([(1, LEFT, 0), (0, LEFT, 0), *TO_THE_GOAL], reached=True, over=True)
    assert [ways.verdict(state, RIGHT) for state in (0, 1, 2)] == [True, True, True]
    assert ways.verdict(1, LEFT) is False  # no nearer
    assert ways.verdict(0, LEFT) is False  # nowhere
    assert ways.verdict(2, LEFT) is None


def test_an_old_answer_is_judged_anew_when_a_shorter_way_is_found() -> None:
    """0-1-2-3 takes three moves until somebody goes from 0 to 3 at once."""
    ways, across = Ways(4), 2
    ways.walked(TO_THE_GOAL, reached=True, over=True)
    assert ways.verdict(0, RIGHT) is True
    ways.walked([(0, across, 3)], reached=True, over=True)
    assert ways.verdict(0, across) is True
    assert ways.verdict(0, RIGHT) is False
    assert ways.verdict(1, RIGHT) is True


def test_a_way_is_known_also_to_those_who_came_by_earlier() -> None:
    ways = Ways(4)
    ways.walked([(0, RIGHT, 1), (1, RIGHT, 2)], reached=False, over=False)
    assert ways.verdict(0, RIGHT) is None  # the goal has not been seen
    ways.walked([(2, RIGHT, 3)], reached=True, over=True)
    assert ways.verdict(0, RIGHT) is True


def test_lost_and_off_the_known_ways() -> None:
    ways = Ways(6)
    ways.walked([(0, LEFT, 5)], reached=False, over=True)
    assert ways.verdict(0, LEFT) is False  # an obstacle
    ways.walked([(1, LEFT, 4)], reached=False, over=False)
    assert ways.verdict(1, LEFT) is None  # the step limit: nothing can be said
    ways.walked(TO_THE_GOAL, reached=True, over=True)
    assert ways.verdict(1, LEFT) is False  # from 4 nobody has come to the goal, from 1 somebody has


def test_answers_are_counted() -> None:
    ways = Ways(4)
    ways.walked([(1, LEFT, 0), *TO_THE_GOAL], reached=True, over=True)
    assert ways.tally({0: {RIGHT: 3}, 1: {LEFT: 2, RIGHT: 1}, 2: {LEFT: 5}}) == (4, 2)
    assert ways.tally({2: {LEFT: 5}}, circled={(2, LEFT)}) == (0, 5)
    assert ways.tally({0: {RIGHT: 3}}, circled={(0, RIGHT)}) == (3, 0)  # what leads to the goal is no circle


def test_circles_that_one_advisor_led_round() -> None:
    round_and_on = [(0, RIGHT, 1), (1, LEFT, 0), (0, RIGHT, 1), (1, RIGHT, 2)]
    assert circles(round_and_on, {1: RIGHT, 2: LEFT, 3: RIGHT, 4: RIGHT}) == {(0, RIGHT), (1, LEFT)}
    assert circles(round_and_on, {1: LEFT, 2: LEFT, 4: RIGHT}) == set()  # others went right: it led back
    assert circles([(3, LEFT, 2), (2, LEFT, 2)], {1: LEFT, 2: LEFT}) == {(2, LEFT)}  # what led there is not part of it
    assert circles([], {}) == set()


@given(st.data())
def test_the_shortest_known_ways_are_those_of_all_steps_together(data: st.DataObject) -> None:
    """Walks through a random problem of 8 states and 3 actions, the goal is 7; distances by relaxing to the end."""
    table = data.draw(st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=3), min_size=7, max_size=7))
    ways, known = Ways(8), set()
    for actions in data.draw(st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=12), max_size=6)):
        trail, state = [], 0
        for action in actions:
            trail.append((state, action, table[state][action]))
            state = table[state][action]
            if state == 7:
                break
        ways.walked(trail, reached=state == 7, over=state == 7)
        known |= set(trail)
    moves = [inf] * 7 + [0.0 if any(entered == 7 for _, _, entered in known) else inf]
    for _ in range(8):
        for state, _, entered in known:
            moves[state] = min(moves[state], moves[entered] + 1.0)
    for state, action, entered in known:
        expected = None if moves[state] == inf else moves[entered] < moves[state]
        assert ways.verdict(state, action) is (False if entered == state else expected)


def test_trust_is_the_mean_of_a_beta() -> None:
    assert trust(0, 0) == 0.5
    assert trust(8, 2) == 9 / 12
    assert trust_there(0.75, 0, 0) == 0.75
    assert trust_there(0.75, 0, 4) == 3 / 8
    assert trust_there(0.5, 12, 0) == 14 / 16


def test_credible_bounds() -> None:
    """All good: the Beta (n + 1, 1), whose quantile p is p ** (1 / (n + 1))."""
    assert bounds(0, 0) == pytest.approx((0.025, 0.975))
    assert bounds(9, 0) == pytest.approx((0.025 ** (1 / 10), 0.975 ** (1 / 10)))
    assert bounds(0, 9) == pytest.approx(tuple(1 - one for one in reversed(bounds(9, 0))))
    assert bounds(0, 1, level=0.5) == pytest.approx((1 - 0.75**0.5, 1 - 0.25**0.5))


def test_beyond_doubt() -> None:
    assert not is_bad(0, 9)  # too few
    assert is_bad(0, 10)
    assert not is_bad(4, 6)
    assert not is_good(4, 0)  # 0.025 ** (1 / 5) = 0.478
    assert is_good(5, 0)  # 0.025 ** (1 / 6) = 0.541
    assert not is_good(50, 50)


TWO = np.array([[0.0, -1.0], [2.0, 2.0]])  # in state 0 the first action is better by 1; state 1 shows nothing


@pytest.mark.parametrize("good", [6, 8, 9])
def test_the_likeliest_tau_of_two_actions(good: int) -> None:
    """good of 10 answers: 1 / (1 + exp(-1 / tau)) = good / 10; at the ends of the interval the likelihood is as asked."""
    found = skill_of([(0, 0)] * good + [(0, 1)] * (10 - good) + [(1, 0)] * 7, TWO)
    assert found is not None
    assert found.tau == pytest.approx(1 / log(good / (10 - good)), rel=1e-4)
    assert found.answers == 10

    def likelihood(tau: float) -> float:
        return -good * log(1 + np.exp(-1 / tau)) - (10 - good) * log(1 + np.exp(1 / tau))

    assert found.low < found.tau < found.high
    if good < 9:
        assert likelihood(found.low) == pytest.approx(likelihood(found.tau) - EDGE, abs=1e-4)
    else:
        assert found.low == 0.001  # an expert's, if the one other answer was a slip
    if found.high < 100:
        assert likelihood(found.high) == pytest.approx(likelihood(found.tau) - EDGE, abs=1e-4)


def test_skills_at_the_ends() -> None:
    best, worst = skill_of([(0, 0)] * 20, TWO), skill_of([(0, 1)] * 20, TWO)
    assert best is not None
    assert worst is not None
    assert (best.tau, best.low, best.word) == (0.001, 0.001, "expert")
    assert best.high == pytest.approx(1 / log(1 / (np.exp(EDGE / 20) - 1)), rel=1e-4)  # 20 log(1 + e) = EDGE
    assert (worst.tau, worst.high, worst.word) == (100.0, 100.0, "novice")
    assert str(best) == f"tau 0.001 (0.001 to {best.high:.3g}, from 20 answers): nearest to expert"
    assert str(worst).endswith(": no better than chance")


def test_one_slip_of_26_answers_is_still_an_expert() -> None:
    """25 choices of the best by 0.1, and one that is worse by 10: likeliest as an expert's, of whose answers 1 in 26 is a slip.

    As a softmax alone they would be a novice's: at tau 0.1 the slip has the chance exp(-100), at tau 1 exp(-10).
    """
    found = skill_of([(0, 0)] * 25 + [(1, 1)], np.array([[0.0, -0.1], [0.0, -10.0]]))
    assert found is not None
    assert found.word == "expert"


def test_too_few_answers_show_no_skill() -> None:
    assert skill_of([], TWO) is None
    assert skill_of([(0, 0)] * 4 + [(1, 0)] * 50, TWO) is None
    assert skill_of([(0, 0)] * 5, TWO) is not None


@pytest.mark.parametrize(("word", "tau"), SKILL_TAUS.items())
def test_the_interval_holds_the_truth(word: str, tau: float) -> None:
    """300 answers of a simulated advisor in world I, 40 times; measured with 200 seeds: 200, 190, 192 and 188 held."""
    mdp = world("world-1").mdp()
    values = optimal_values(mdp, 0.99)
    chances, free = chances_of(values, tau), np.flatnonzero(~mdp.terminal)
    held = words = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        states = rng.choice(free, 300)
        actions = (rng.random((300, 1)) > np.cumsum(chances[states], axis=1)[:, :-1]).sum(axis=1)
        found = skill_of(list(zip(states.tolist(), actions.tolist(), strict=True)), values)
        assert found is not None
        held += found.low <= tau <= found.high
        words += found.word == word
    assert held >= 34
    assert words >= 34


def test_what_was_better() -> None:
    """A board of 1 x 3, the goal on the right: only right is best, and up and down stay where they are."""
    mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("up", "down", "left", "right"))
    values = optimal_values(mdp, 0.99)
    wrong = worse([(0, 3), (0, 0), (1, 2), (1, 2)], values)
    assert wrong == {(0, 0): 1, (1, 2): 2}
    first, second = differences(wrong, mdp, values, 8)
    assert (first.state, first.label, first.said, first.best, first.times) == (1, "(0, 1)", "left", ("right",), 2)
    assert (second.state, second.said) == (0, "up")
    assert len(differences(wrong, mdp, values, 1)) == 1
