"""Sessions run by the batch equal the interactive one, number by number, compiled or not, whatever their company."""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning import own_rules
from lab.learning.batch import Batch, run_sessions
from lab.learning.gates import GATES, Gate, Steps
from lab.learning.kernels.records import LANES
from lab.learning.members import Member
from lab.learning.own_rules import Uncompiled
from lab.learning.selection import SELECTIONS
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.learning.splitmix import stream
from lab.learning.updates import UPDATES, RuleUpdate
from lab.mdp import TabularMDP, grid, optimal_values
from lab.testing import check_learner

LEARNERS = tuple(name for name, one in UPDATES.items() if one.compiled is not None)
SHORT = LearnerSettings("afterstate", episodes=40, max_steps=40, count_start=True)
EAGER = GateSettings(first_episode=6, window=3, omega=1, psi=0.4, spread=0.2, rate=0.3, enough_steps=12.0, budget=60)


def board() -> TabularMDP:
    blocked = np.zeros((5, 5), bool)
    blocked[1, 1:4] = blocked[3, 2] = True
    return grid((5, 5), blocked, (0, 0), (4, 4))


def advice(mdp: TabularMDP, tau: Any = 0.2, region: Any = None) -> Advice:
    return Advice.of(advice_chances(optimal_values(mdp, 0.99), tau), region)


def alone(
    mdp: TabularMDP, learner: LearnerSettings, gate: GateSettings, who: Advice | None, seed: int
) -> SessionResult:
    """The interactive session with the numbers that the kernel draws for this seed."""
    draw = stream(seed)
    advisor = None if who is None else TableAdvisor(who, draw)
    return Session(mdp, learner, gate, advisor, draw).run()


def assert_same(batch: Batch, n: int, one: SessionResult) -> None:
    """A compiled session is the interactive one: tables, steps, and all that is counted."""
    np.testing.assert_array_equal(batch.steps[n], one.steps)
    np.testing.assert_array_equal(batch.guided[n], one.guided)
    np.testing.assert_array_equal(batch.q[n], one.q)
    counted = (
        batch.requests[n],
        batch.helped_steps[n],
        batch.misleads[n],
        batch.rejected_at_episode[n],
        batch.moves[n],
    )
    assert counted == (one.requests, one.helped_steps, one.misleads, one.rejected_at_episode or 0, one.visits.sum())


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("learner", UPDATES)
def test_batch_and_interactive_sessions_are_the_same(learner: str, gate: str) -> None:
    mdp, settings, how = board(), replace(SHORT, learner=learner), replace(EAGER, gate=gate)
    who = advice(mdp, [1.0, 0.1], np.arange(25) > 4)
    seeds = np.arange(100, 100 + (LANES + 6 if learner in LEARNERS else 2), dtype=np.uint64)
    batch = run_sessions(mdp, settings, how, who, seeds, keep_tables=True)
    for n in {0, min(7, len(seeds) - 1), len(seeds) - 1}:
        assert_same(batch, n, alone(mdp, settings, how, who, int(seeds[n])))
    if learner in LEARNERS:
        assert (batch.helped_steps.sum() > 0) == (gate != "never")


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("learner", UPDATES)
def test_they_are_the_same_with_nobody_to_ask(learner: str, gate: str) -> None:
    mdp, settings, how = board(), replace(SHORT, learner=learner, episodes=20), replace(EAGER, gate=gate)
    batch = run_sessions(mdp, settings, how, None, np.array([7], np.uint64), keep_tables=True)
    assert_same(batch, 0, alone(mdp, settings, how, None, 7))


@pytest.mark.parametrize("gate", ["ccrl", "combined"])
@pytest.mark.parametrize("spare_best", [False, True])
def test_they_are_the_same_where_gates_judge_and_episodes_begin_anywhere(gate: str, spare_best: bool) -> None:
    anywhere = replace(board(), starts=tuple(np.flatnonzero(~board().terminal).tolist()))
    how, seeds = replace(EAGER, gate=gate, spare_best=spare_best), np.arange(3, dtype=np.uint64)
    batch = run_sessions(anywhere, SHORT, how, advice(anywhere, 1.0), seeds, keep_tables=True)
    for n in range(3):
        assert_same(batch, n, alone(anywhere, SHORT, how, advice(anywhere, 1.0), n))
    assert batch.misleads.sum() > 0


@pytest.mark.parametrize("gate", ["ccrl", "combined"])
def test_they_are_the_same_where_the_best_episodes_are_spared(gate: str) -> None:
    how, seeds = replace(EAGER, gate=gate, spare_best=True), np.arange(12, dtype=np.uint64)
    batch = run_sessions(board(), SHORT, how, advice(board(), 1.0), seeds, keep_tables=True)
    for n in range(12):
        assert_same(batch, n, alone(board(), SHORT, how, advice(board(), 1.0), n))
    plain = run_sessions(board(), SHORT, replace(how, spare_best=False), advice(board(), 1.0), seeds)
    assert 0 < batch.misleads.sum() < plain.misleads.sum()


@pytest.mark.parametrize("gate", ["ccrl", "combined"])
@pytest.mark.parametrize("several", [False, True])
def test_they_are_the_same_where_gates_judge_by_evidence(gate: str, several: bool) -> None:
    starts = tuple(np.flatnonzero(~board().terminal).tolist()) if several else ()
    place, seeds = replace(board(), starts=starts), np.arange(6, dtype=np.uint64)
    how = replace(EAGER, gate=gate, by_evidence=True, budget=2000, lambda_threshold=1.0)
    for values in (optimal_values(board(), SHORT.discount), -optimal_values(board(), SHORT.discount)):
        said = Advice.of(advice_chances(values, 0.3))
        batch = run_sessions(place, SHORT, how, said, seeds, keep_tables=True)
        for n in range(6):
            assert_same(batch, n, alone(place, SHORT, how, said, n))
    assert batch.rejected_at_episode.any()


class EveryOther(Gate):
    """A gate of somebody else's, which has no compiled form."""

    def opens(self, episode: int, steps: Steps) -> bool:
        return episode % 2 == 0


def test_a_gate_without_a_compiled_form_is_run_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(GATES, "every-other", Member(EveryOther, "asks about every other episode"))
    mdp, how = board(), replace(EAGER, gate="every-other")
    batch = run_sessions(mdp, SHORT, how, advice(mdp), np.array([1, 2], np.uint64), keep_tables=True)
    for n in range(2):
        assert_same(batch, n, alone(mdp, SHORT, how, advice(mdp), n + 1))
    assert not batch.guided[:, ::2].any()  # episodes 1, 3, ...


def test_a_learner_without_a_compiled_form_is_run_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(UPDATES, "another", replace(UPDATES["sarsa"], compiled=None))
    mdp, settings = board(), replace(SHORT, learner="another")
    batch = run_sessions(mdp, settings, EAGER, advice(mdp), np.array([1], np.uint64), keep_tables=True)
    assert_same(batch, 0, alone(mdp, replace(SHORT, learner="sarsa"), EAGER, advice(mdp), 1))


class Cautious(RuleUpdate):
    """As q, but a tenth of what comes next is the value of the worst move."""

    @staticmethod
    def rule(q: Any, settings: Any, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        best = worst = q[s_t][0]
        for value in q[s_t]:
            best, worst = max(best, value), min(worst, value)
        target = r_t + discount_t * (0.9 * best + 0.1 * worst)
        q[s_tm1][a_tm1] += settings.alpha * (target - q[s_tm1][a_tm1])


class Grown(RuleUpdate):
    """A rule that numba cannot compile, because it reads an attribute that settings lack there."""

    @staticmethod
    def rule(q: Any, settings: Any, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        q[s_tm1][a_tm1] += settings.alpha * len(settings.learner)


class Often(RuleUpdate):
    """A learner that overrides more than its rule."""

    rule = Cautious.rule

    def end(self) -> None:
        self.q[0][0] += 0.0


@pytest.fixture
def at_any_price(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_rules, "WORTH_COMPILING", 0)
    monkeypatch.setattr(own_rules, "_told", set())


@pytest.mark.usefixtures("at_any_price")
def test_a_rule_of_ones_own_is_compiled_with_the_same_results() -> None:
    check_learner(Cautious)
    settings = replace(SHORT, learner=UPDATES.use("cautious", Cautious))
    for gate in ("ccrl", "uncertainty"):
        how, seeds = replace(EAGER, gate=gate), np.arange(LANES + 1, dtype=np.uint64)
        batch = run_sessions(board(), settings, how, advice(board()), seeds, keep_tables=True)
        for n in (0, LANES):
            assert_same(batch, n, alone(board(), settings, how, advice(board()), n))
    assert UPDATES["cautious"].compiled is not None
    assert Cautious.rule in own_rules._compiled_rules


@pytest.mark.usefixtures("at_any_price")
@pytest.mark.parametrize(("learner", "why"), [(Grown, ": numba cannot compile its rule"), (Often, "")])
def test_an_uncompiled_learner_is_told_once(learner: type[RuleUpdate], why: str) -> None:
    settings, seeds = replace(SHORT, learner=UPDATES.use("own", learner)), np.arange(2, dtype=np.uint64)
    with pytest.warns(Uncompiled, match=f"learner 'own' runs uncompiled, about [0-9]+ times slower.*{why}$") as told:
        batch = run_sessions(board(), settings, EAGER, None, seeds, keep_tables=True)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run_sessions(board(), settings, EAGER, None, seeds)
    assert_same(batch, 1, alone(board(), settings, EAGER, None, 1))


def test_a_selection_without_a_compiled_form_is_run_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SELECTIONS, "another", replace(SELECTIONS["epsilon-greedy"], compiled=None))
    settings = replace(SHORT, selection="another")
    batch = run_sessions(board(), settings, EAGER, None, np.array([1], np.uint64), keep_tables=True)
    assert_same(batch, 0, alone(board(), settings, EAGER, None, 1))


@pytest.mark.parametrize("selection", ["epsilon-greedy", "greedy"])
@pytest.mark.parametrize("learner", LEARNERS)
@pytest.mark.parametrize("exploration", [0.3, 2.0])
def test_they_are_the_same_with_other_selections(learner: str, selection: str, exploration: float) -> None:
    settings = replace(SHORT, learner=learner, selection=selection, exploration=exploration, beta=0.4)
    how, seeds = replace(EAGER, gate="random"), np.arange(LANES + 1, dtype=np.uint64)
    batch = run_sessions(board(), settings, how, advice(board()), seeds, keep_tables=True)
    for n in (0, LANES):
        assert_same(batch, n, alone(board(), settings, how, advice(board()), n))


@given(
    learner=st.sampled_from(["q-lambda", "sarsa-lambda"]),
    trace=st.sampled_from([0.0, 0.01, 0.5, 0.97, 1.0]),
    discount=st.sampled_from([0.9, 1.0]),
    replacing=st.booleans(),
    max_steps=st.integers(2, 90),
    seed=st.integers(0, 1000),
)
@settings(max_examples=40, deadline=None)
def test_traces_are_the_same(
    learner: str, trace: float, discount: float, replacing: bool, max_steps: int, seed: int
) -> None:
    """The lists of traces are long or short, kept for whole episodes or cut, and moved when they are full."""
    how = LearnerSettings(
        learner,
        alpha=0.3,
        discount=discount,
        trace=trace,
        replacing=replacing,
        beta=0.3,
        episodes=8,
        max_steps=max_steps,
    )
    batch = run_sessions(board(), how, GateSettings("never"), None, np.array([seed], np.uint64), keep_tables=True)
    assert_same(batch, 0, alone(board(), how, GateSettings("never"), None, seed))


@pytest.mark.parametrize("planning", [0, 1, 200])
def test_planning_is_the_same(planning: int) -> None:
    how, seeds = replace(SHORT, learner="dyna-q", planning=planning, episodes=12), np.arange(2, dtype=np.uint64)
    batch = run_sessions(board(), how, GateSettings("never"), None, seeds, keep_tables=True)
    for n in range(2):
        assert_same(batch, n, alone(board(), how, GateSettings("never"), None, n))


CHANGED = ("q", "afterstate")  # learners so slow here that memory shows in each view
VIEWS = [
    (learner, gate, view)
    for learner in LEARNERS
    for gate in GATES
    for view in ("full", "limited", "nobody")
    if learner in CHANGED or view == "limited"
]


@pytest.mark.parametrize(("learner", "gate", "view"), VIEWS)
def test_they_are_the_same_with_memory(learner: str, gate: str, view: str) -> None:
    mdp, settings = board(), replace(SHORT, learner=learner, beta=0.7)  # so warm that its own last result is often long
    # gates that open again and again, a budget that some sessions use up, advice that leads round and into obstacles
    how = replace(EAGER, gate=gate, memory=True, lambda_threshold=0.5, rate=0.6, window=2, budget=25)
    region = np.arange(25) > 4 if view == "limited" else None
    who = None if view == "nobody" else advice(mdp, 0.4, region)
    seeds = np.arange(200, 200 + LANES + 6, dtype=np.uint64)
    batch = run_sessions(mdp, settings, how, who, seeds, keep_tables=True)
    for n in (0, 3, 7, 11, LANES + 5):
        assert_same(batch, n, alone(mdp, settings, how, who, int(seeds[n])))
    assert (batch.helped_steps.sum() > 0) == (gate != "never" and view != "nobody")
    plain = run_sessions(mdp, settings, replace(how, memory=False), who, seeds)
    if learner in CHANGED:
        assert (plain.steps != batch.steps).any()  # at the latest when the way is practised


def test_memory_is_the_same_where_episodes_begin_anywhere() -> None:
    anywhere = replace(board(), starts=tuple(np.flatnonzero(~board().terminal).tolist()))
    how = replace(EAGER, gate="always", memory=True)
    seeds = np.arange(LANES + 1, dtype=np.uint64)
    batch = run_sessions(anywhere, SHORT, how, advice(anywhere), seeds, keep_tables=True)
    for n in (1, LANES):
        assert_same(batch, n, alone(anywhere, SHORT, how, advice(anywhere), n))


def test_unhelped_episodes_may_be_left_unjudged() -> None:
    mdp, blind = board(), advice(board(), 0.2, np.zeros(25, bool))
    for judged in (True, False):
        how = replace(EAGER, judge_unhelped=judged, lambda_threshold=1.0)
        batch = run_sessions(mdp, SHORT, how, blind, np.array([3], np.uint64))
        one = alone(mdp, SHORT, how, blind, 3)
        assert batch.misleads[0] == one.misleads
        assert (one.misleads > 0) == judged


def test_episodes_may_begin_anywhere() -> None:
    mdp = board()
    anywhere = replace(mdp, starts=tuple(np.flatnonzero(~mdp.terminal).tolist()))
    settings = replace(SHORT, count_start=False)
    batch = run_sessions(anywhere, settings, GateSettings("never"), None, np.array([5], np.uint64), keep_tables=True)
    one = alone(anywhere, settings, GateSettings("never"), None, 5)
    np.testing.assert_array_equal(batch.steps[0], one.steps)
    np.testing.assert_array_equal(batch.q[0], one.q)


@pytest.mark.parametrize("memory", [False, True])
def test_a_session_does_not_depend_on_its_company(memory: bool) -> None:
    mdp, how = board(), replace(EAGER, gate="combined", memory=memory)
    seeds = np.arange(3 * LANES + 1, dtype=np.uint64)
    together = run_sessions(mdp, SHORT, how, advice(mdp), seeds)
    apart = [run_sessions(mdp, SHORT, how, advice(mdp), part) for part in np.array_split(seeds, 4)]
    for name in ("steps", "guided", "requests", "helped_steps", "misleads", "rejected_at_episode", "moves"):
        np.testing.assert_array_equal(getattr(together, name), np.concatenate([getattr(one, name) for one in apart]))


def test_without_an_advisor_nobody_is_asked() -> None:
    batch = run_sessions(board(), SHORT, GateSettings("always"), None, np.arange(3, dtype=np.uint64))
    assert (batch.requests.sum(), batch.helped_steps.sum(), batch.q.shape) == (0, 0, (0, 25, 4))
    none = run_sessions(board(), SHORT, GateSettings("always"), None, np.zeros(0, np.uint64))
    assert none.steps.shape == (0, 40)


def test_what_nobody_knows_is_refused() -> None:
    mdp, seeds = board(), np.arange(1, dtype=np.uint64)
    with pytest.raises(BadInput, match="unknown learner 'sarsi'"):
        run_sessions(mdp, replace(SHORT, learner="sarsi"), EAGER, None, seeds)
    with pytest.raises(BadInput, match="unknown selection 'greed'"):
        run_sessions(mdp, replace(SHORT, selection="greed"), EAGER, None, seeds)
    with pytest.raises(BadInput, match="unknown gate 'maybe'"):
        run_sessions(mdp, SHORT, replace(EAGER, gate="maybe"), None, seeds)
    with pytest.raises(BadInput, match=r"advice of shape \(1, 9, 4\): the problem has \(25, 4\)"):
        run_sessions(mdp, SHORT, EAGER, Advice.of(np.full((9, 4), 0.25)), seeds)
