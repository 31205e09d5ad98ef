"""Advisors: their skill, their names, and who may not be asked."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.advice.advisors import (
    PEOPLE,
    SKILL_TAUS,
    AdvisorName,
    RecordedAdvisor,
    make_advisor,
    named,
)
from lab.advice.entries import FILE, SessionEntry
from lab.advice.journal import Journal
from lab.advice.order_level import OrderAdvisor, OrderLevel
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest, Advisor, AdvisorLeft, Reply
from lab.learning.selection import softmax
from lab.learning.session_events import AdviceGiven
from lab.learning.simulated_advice import (
    Advice,
    TableAdvisor,
    accuracy,
    advice_chances,
    chance_accuracy,
    decisive,
    tau_of_accuracy,
)
from lab.mdp import FloatArray, TabularMDP, grid, optimal_values, shortest_steps
from lab.sequencing.search import SequenceRequest, state_of
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell


def board() -> TabularMDP:
    blocked = np.zeros((4, 4), bool)
    blocked[1, 1:3] = True
    return grid((4, 4), blocked, (0, 0), (3, 3))


def request(mdp: TabularMDP, state: int) -> AdviceRequest:
    return AdviceRequest(
        mdp=mdp,
        q=[[0.0] * mdp.n_actions] * mdp.n_states,
        state=state,
        episode=1,
        step=1,
        own=0,
        allowed=range(mdp.n_actions),
    )


def walk(mdp: TabularMDP, advisor: Advisor, limit: int = 200) -> int:
    """Moves until the goal when every advice is followed; the limit when it is not reached."""
    state = mdp.start
    for step in range(1, limit + 1):
        action = advisor.advise(request(mdp, state))
        assert isinstance(action, int)
        state = int(mdp.successor[state, action])
        if mdp.terminal[state]:
            return step if mdp.goal[state] else limit
    return limit


def made(name: str, mdp: TabularMDP, seed: int = 0) -> Advisor:
    advisor = TableLevel(mdp, 0.99, np.random.default_rng(seed)).advisor(AdvisorName.of(name))
    assert advisor is not None
    return advisor


@pytest.mark.parametrize("name", [*SKILL_TAUS, "tau=0.05"])
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
    means = [np.mean([walk(mdp, advisor) for _ in range(60)]) for advisor in (made(name, mdp) for name in SKILL_TAUS)]
    assert means == sorted(means)
    assert means[0] < means[-1]


def test_advice_follows_the_softmax_of_the_optimal_values() -> None:
    mdp = board()
    expected = softmax(optimal_values(mdp, 0.99)[mdp.start].tolist(), 0.3)
    advisor = made("limited", mdp)
    answers = [advisor.advise(request(mdp, mdp.start)) for _ in range(4000)]
    counts = np.bincount([action for action in answers if isinstance(action, int)], minlength=4)
    np.testing.assert_allclose(counts / 4000, expected, atol=0.03)


def test_a_frozen_table_never_overflows() -> None:
    advice = Advice.of(advice_chances(np.array([[1e9, -1e9, 1e9]]), 1e-12))
    advisor = TableAdvisor(advice, np.random.default_rng(0).random)
    assert {advisor.advise(request(board(), 0)) for _ in range(50)} == {0, 2}


def test_nobody_and_a_person() -> None:
    mdp = board()
    rng = np.random.default_rng(0)
    assert TableLevel(mdp, 0.99, rng).advisor(AdvisorName.of("none")) is None
    person = TableLevel(mdp, 0.99, rng, {"terminal": lambda asked: asked.state + 1}).advisor(AdvisorName.of("terminal"))
    assert person is not None
    assert person.advise(request(mdp, 2)) == 3
    for name, missing in (("terminal", "no prompt"), ("web", "no page")):
        with pytest.raises(BadInput, match=missing):
            TableLevel(mdp, 0.99, rng).advisor(AdvisorName.of(name))


def test_a_person_may_leave() -> None:
    def leave(asked: AdviceRequest) -> int:
        raise AdvisorLeft

    person = TableLevel(board(), 0.99, np.random.default_rng(0), {"terminal": leave}).advisor(
        AdvisorName.of("terminal")
    )
    assert person is not None
    with pytest.raises(AdvisorLeft):
        person.advise(request(board(), 0))


def test_names_are_checked() -> None:
    for name in (*named(), "tau=0.25", "tau=1..0.01", "accuracy=0.8", "recorded:some/file"):
        assert AdvisorName.of(name).text == name
    with pytest.raises(BadInput, match=r"unknown advisor 'exprt' \(--advisor\): did you mean 'expert'\?.*tau=X"):
        AdvisorName.of("exprt", "--advisor")
    for bad in ("tau=", "tau=x", "tau=0", "tau=-1", "tau=nan", "tau=inf", "tau=1..", "tau=1..0"):
        with pytest.raises(BadInput, match="tau must be a number above 0"):
            AdvisorName.of(bad)
    for bad in ("accuracy=", "accuracy=x", "accuracy=0", "accuracy=1", "accuracy=nan", "accuracy=0.5..0.9"):
        with pytest.raises(BadInput, match="accuracy must be a share of optimal answers between 0 and 1"):
            AdvisorName.of(bad)
    with pytest.raises(BadInput, match=r"unknown advisor 'acuracy=0.8' .*did you mean 'accuracy=X'\?"):
        AdvisorName.of("acuracy=0.8")


@pytest.mark.parametrize("answer", [1.0, True, np.float64(1.0), np.bool_(True), "up", 4, -1, [1]])
def test_an_added_advisor_answers_with_an_allowed_action(answer: object) -> None:
    class Odd:
        def advise(self, request: AdviceRequest) -> object:
            return answer

    mdp = board()
    things: list[Any] = [Odd, Odd(), lambda request: answer]
    for thing in things:
        name = AdvisorName.made(thing)
        advisor = TableLevel(mdp, 0.99, np.random.default_rng(0)).advisor(name)
        assert advisor is not None
        with pytest.raises(BadInput, match=f"advisor '{name}' named action .*: allowed 0..3"):
            advisor.advise(request(mdp, 0))


@pytest.mark.parametrize("answer", [None, 2, np.int64(2)])
def test_an_added_advisor_may_answer_with_an_integer_of_any_kind(answer: int | None) -> None:
    mdp = board()
    advisor = TableLevel(mdp, 0.99, np.random.default_rng(0)).advisor(AdvisorName.made(lambda request: answer))
    assert advisor is not None
    said = advisor.advise(request(mdp, 0))
    assert (said, type(said)) == (answer, type(None) if answer is None else int)


@pytest.mark.parametrize("thing", [7, int, type("NeedsMore", (), {"__init__": lambda self, a: None, "advise": None})])
def test_what_is_no_advisor_is_refused(thing: object) -> None:
    with pytest.raises(BadInput, match="wanted a name, a function of a request, or a class with `advise`"):
        AdvisorName.made(thing)  # type: ignore[arg-type]


def test_an_advisor_with_a_limited_view_says_nothing_outside_it() -> None:
    mdp = board()
    region = np.arange(16) >= 8
    advisor = TableLevel(mdp, 0.99, np.random.default_rng(0), region=region).advisor(AdvisorName.of("expert"))
    assert advisor is not None
    assert [advisor.advise(request(mdp, state)) is None for state in (0, 7, 8, 15)] == [True, True, False, False]


def test_an_advisor_may_learn_or_tire_over_the_episodes() -> None:
    q = np.array([[0.0, 1.0]])
    novice_to_expert = TableAdvisor(Advice.of(advice_chances(q, [100.0, 0.01])), np.random.default_rng(0).random)
    asked = [replace(request(board(), 0), episode=n) for n in (1, 2, 9)]
    shares = [np.mean([novice_to_expert.advise(one) for _ in range(500)]) for one in asked]
    assert 0.4 < shares[0] < 0.6
    assert shares[1:] == [1.0, 1.0]  # the last skill stays
    assert isinstance(made("tau=1..0.01", board()), TableAdvisor)


def test_a_wrong_advisor_takes_the_worst_for_the_best() -> None:
    mdp = board()
    worst = optimal_values(mdp, 0.99).min(axis=1)
    for state in (0, 3, 12):
        action = made("wrong", mdp).advise(request(mdp, state))
        assert isinstance(action, int)
        assert optimal_values(mdp, 0.99)[state, action] == worst[state]


@pytest.mark.parametrize(
    "chances", [np.full((2, 2), 0.4), np.array([[1.5, -0.5]]), np.array([[np.nan, 1.0]]), np.ones(2)]
)
def test_advice_is_made_of_chances(chances: FloatArray) -> None:
    with pytest.raises(BadInput, match="advice: "):
        Advice.of(chances)


@pytest.mark.parametrize("tau", [0.0, -1.0, float("nan"), float("inf"), [0.1, 0.0]])
def test_a_skill_needs_a_tau_above_zero(tau: float | list[float]) -> None:
    with pytest.raises(BadInput, match="tau above 0"):
        advice_chances(np.zeros((2, 2)), tau)


def recorded(folder: Path, mdp: TabularMDP, said: list[tuple[int, int | None]]) -> str:
    """A session in which this was advised, (state, action); its name as an advisor."""
    journal = Journal.begin(folder, SessionEntry({}, "board", mdp.signature, "test"))
    for step, (state, action) in enumerate(said, start=1):
        journal.tell(AdviceGiven(1, step, state, action, 0))
    journal.close()
    return f"recorded:{folder}"


def test_recorded_advice_is_said_again_by_state(tmp_path: Path) -> None:
    mdp = board()
    name = recorded(tmp_path, mdp, [(3, 1), (5, 2), (4, None), (3, 3)])
    with (tmp_path / FILE).open("a") as cut:
        cut.write('{"kind": "adv')  # the last line was cut off
    advisor = made(name, mdp)
    assert isinstance(advisor, RecordedAdvisor)
    assert [advisor.advise(request(mdp, state)) for state in (3, 4, 5)] == [3, None, 2]


@pytest.mark.parametrize(
    ("said", "message"),
    [([(99, 0)], "state 99, action 0 do not exist"), ([(0, 4)], "state 0, action 4"), ([], "nothing was advised")],
)
def test_a_record_that_does_not_fit(said: list[tuple[int, int | None]], message: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=message):
        made(recorded(tmp_path, board(), said), board())


def test_a_record_of_another_problem_or_of_none(tmp_path: Path) -> None:
    other = grid((2, 2), np.zeros((2, 2), bool), (0, 0), (1, 1))
    with pytest.raises(BadInput, match="it is advice about another problem, 'board'"):
        made(recorded(tmp_path, other, [(0, 1)]), board())
    with pytest.raises(BadInput, match="cannot be read"):
        made(f"recorded:{tmp_path / 'none'}", board())


@pytest.mark.parametrize(
    "name", [name for name in named() if name not in PEOPLE] + ["tau=0.05", "tau=1..0.01", "accuracy=0.9"]
)
def test_every_name_serves_both_levels(name: str) -> None:
    """One row makes who advises in a table and on the order; what is said is allowed."""
    mdp, run = board(), Run(load_cell("toast-case-1").cell(3))
    order = SequenceRequest(episode=1, step=1, state=state_of(run), own=1, allowed=run.allowed(), run=run)
    level = OrderLevel(run.cell, np.random.default_rng(0), episodes=5)
    for advisor, asked in (
        (TableLevel(mdp, 0.99, np.random.default_rng(0)).advisor(AdvisorName.of(name)), request(mdp, 5)),
        (make_advisor(AdvisorName.of(name), level), order),
    ):
        assert (advisor is None) == (name == "none")
        assert advisor is None or advisor.advise(asked) in asked.allowed


def test_an_advisor_of_the_order_may_learn_over_the_episodes() -> None:
    """With a large tau it takes any of the moves; with a small one, from the last episode on, only the best."""
    run = follow(load_cell("toast-case-2").cell(3), (1, 2))
    level = OrderLevel(run.cell, np.random.default_rng(0), episodes=2)
    advisor = make_advisor(AdvisorName.of("tau=100..0.0001"), level)
    assert advisor is not None

    def said(episode: int) -> set[Reply]:
        asked = SequenceRequest(episode=episode, step=1, state=0, own=1, allowed=run.allowed(), run=run)
        return {advisor.advise(asked) for _ in range(200)}

    assert said(1) == {*run.allowed()}
    assert said(2) == said(9) < said(1)


def test_where_the_work_stands_is_one_number() -> None:
    """Other places, other numbers; the same places by another way, the same number, whatever the time."""
    cell = load_cell("toast-case-1").cell(3)
    run, seen = Run(cell), {state_of(Run(cell))}
    for decision in (1, 2, 1):
        run.move(decision)
        assert state_of(run) not in seen
        seen.add(state_of(run))
    assert state_of(follow(cell, (1, 2, 1))) == state_of(run)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 500.0])
@pytest.mark.parametrize("share", [0.6, 0.9, 0.99])
def test_a_tau_gives_the_share_of_optimal_answers_by_hand(share: float, scale: float) -> None:
    """Two actions whose values lie 1 apart: the better one has the chance 1 / (1 + exp(-1 / tau)), so tau is 1 / logit."""
    q, states = scale * np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]), np.array([True, True, False])
    tau = tau_of_accuracy(q, states, share)
    assert tau == pytest.approx(scale / np.log(share / (1 - share)))
    assert accuracy(advice_chances(q, tau), q, states) == pytest.approx(share)


def test_actions_of_equal_values_are_equally_good() -> None:
    q, everywhere = np.array([[1.0, 1.0, 0.0]]), np.array([True])
    assert accuracy(np.array([[0.5, 0.25, 0.25]]), q, everywhere) == 0.75
    with pytest.raises(BadInput, match=r"accuracy 0\.6: .*above 0\.667"):
        tau_of_accuracy(q, everywhere, 0.6)


def test_states_in_which_every_action_is_best_say_nothing_of_skill() -> None:
    q, states = np.array([[1.0, 0.0], [2.0, 2.0], [5.0, 0.0], [3.0, -np.inf]]), np.array([True, True, False, True])
    assert decisive(q, states).tolist() == [True, False, False, False]
    assert chance_accuracy(q, states) == (0.5 + 1.0 + 1.0) / 3  # an action that is not allowed is not drawn
    with pytest.raises(BadInput, match="every answer is optimal here"):
        tau_of_accuracy(q, decisive(q, np.array([False, True, False, False])), 0.9)


@pytest.mark.parametrize("share", [0.6, 0.9])
def test_an_advisor_of_an_accuracy_is_right_as_often(share: float) -> None:
    mdp = board()
    q = optimal_values(mdp, 0.99)
    best = q > q.max(axis=1, keepdims=True) - 1e-6
    asked = np.flatnonzero(~best.all(axis=1) & ~mdp.terminal).tolist() * 300
    advisor = made(f"accuracy={share}", mdp)
    right = [best[state, advisor.advise(request(mdp, state))] for state in asked]
    assert np.mean(right) == pytest.approx(share, abs=0.03)


def test_an_advisor_of_the_order_is_right_as_often_over_drawn_orders() -> None:
    level = OrderLevel(load_cell("toast-case-1").cell(3), np.random.default_rng(0))
    advisor = make_advisor(AdvisorName.of("accuracy=0.9"), level)
    assert isinstance(advisor, OrderAdvisor)
    q = advisor.drawn_values()
    matters = decisive(q, np.ones(len(q), np.bool_))
    best = q >= q.max(axis=1, keepdims=True) - 1e-6
    weights = np.exp((q - q.max(axis=1, keepdims=True)) / advisor.taus[0])
    assert ((weights * best).sum(axis=1) / weights.sum(axis=1))[matters].mean() == pytest.approx(0.9, abs=1e-3)
    with pytest.raises(BadInput, match=r"advisor 'accuracy=0\.1': accuracy 0\.1: .* at random"):
        make_advisor(AdvisorName.of("accuracy=0.1"), level)
