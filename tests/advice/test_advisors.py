"""Advisors: their skill, their names, and who may not be asked."""

import numpy as np
import pytest

from lab.advice.advisors import (
    ADVISORS,
    SKILLS,
    AdviceRequest,
    Advisor,
    AdvisorLeft,
    SkilledAdvisor,
    check_advisor,
    make_advisor,
)
from lab.errors import BadInput
from lab.learning.selection import softmax
from lab.mdp import TabularMDP, grid, optimal_values, shortest_steps


def board() -> TabularMDP:
    blocked = np.zeros((4, 4), bool)
    blocked[1, 1:3] = True
    return grid((4, 4), blocked, (0, 0), (3, 3))


def request(mdp: TabularMDP, state: int) -> AdviceRequest:
    return AdviceRequest(mdp, [[0.0] * mdp.n_actions] * mdp.n_states, state, 1, 1, 0, None, None, None)


def walk(mdp: TabularMDP, advisor: Advisor, limit: int = 200) -> int:
    """Moves until the goal when every advice is followed; the limit when it is not reached."""
    state = mdp.start
    for step in range(1, limit + 1):
        action = advisor.advise(request(mdp, state))
        assert action is not None
        state = int(mdp.successor[state, action])
        if mdp.terminal[state]:
            return step if mdp.goal[state] else limit
    return limit


def made(name: str, mdp: TabularMDP, seed: int = 0) -> Advisor:
    advisor = make_advisor(name, mdp, 0.99, np.random.default_rng(seed))
    assert advisor is not None
    return advisor


@pytest.mark.parametrize("name", [*SKILLS, "tau=0.05"])
def test_simulated_advisors_name_actions_and_repeat(name: str) -> None:
    mdp = board()
    asked = [request(mdp, state) for state in range(mdp.n_states)] * 5
    answers, again = ([advisor.advise(one) for one in asked] for advisor in (made(name, mdp, 7), made(name, mdp, 7)))
    assert answers == again
    assert set(answers) <= {0, 1, 2, 3}


def test_an_expert_walks_the_shortest_way() -> None:
    mdp = board()
    expert = made("expert", mdp)
    assert {walk(mdp, expert) for _ in range(20)} == {shortest_steps(mdp)}


def test_less_skill_means_longer_ways() -> None:
    mdp = board()
    means = [np.mean([walk(mdp, advisor) for _ in range(60)]) for advisor in (made(name, mdp) for name in SKILLS)]
    assert means == sorted(means)
    assert means[0] < means[-1]


def test_advice_follows_the_softmax_of_the_optimal_values() -> None:
    mdp = board()
    expected = softmax(optimal_values(mdp, 0.99)[mdp.start].tolist(), 0.3)
    advisor = made("limited", mdp)
    counts = np.bincount([advisor.advise(request(mdp, mdp.start)) or 0 for _ in range(4000)], minlength=4)
    np.testing.assert_allclose(counts / 4000, expected, atol=0.03)


def test_a_frozen_table_never_overflows() -> None:
    advisor = SkilledAdvisor(np.array([[1e9, -1e9, 1e9]]), 1e-12, np.random.default_rng(0))
    assert {advisor.advise(request(board(), 0)) for _ in range(50)} == {0, 2}


def test_nobody_and_a_person() -> None:
    mdp = board()
    rng = np.random.default_rng(0)
    assert make_advisor("none", mdp, 0.99, rng) is None
    person = make_advisor("terminal", mdp, 0.99, rng, ask=lambda asked: asked.state + 1)
    assert person is not None
    assert person.advise(request(mdp, 2)) == 3
    with pytest.raises(BadInput, match="no prompt"):
        make_advisor("terminal", mdp, 0.99, rng)


def test_a_person_may_leave() -> None:
    def leave(asked: AdviceRequest) -> int:
        raise AdvisorLeft

    person = make_advisor("terminal", board(), 0.99, np.random.default_rng(0), ask=leave)
    assert person is not None
    with pytest.raises(AdvisorLeft):
        person.advise(request(board(), 0))


def test_names_are_checked() -> None:
    assert [check_advisor(name) for name in ADVISORS] == [None] * len(ADVISORS)
    assert check_advisor("tau=0.25") == 0.25
    with pytest.raises(BadInput, match=r"unknown advisor 'exprt' \(--advisor\): did you mean 'expert'\?.*tau=X"):
        check_advisor("exprt", "--advisor")
    for bad in ("tau=", "tau=x", "tau=0", "tau=-1", "tau=nan", "tau=inf"):
        with pytest.raises(BadInput, match="tau must be a number above 0"):
            check_advisor(bad)
