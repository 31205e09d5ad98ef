"""Gates of other code by their compiled rules: sessions equal the interactive ones, with every kind of learner and advisor."""

import warnings
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lab
from lab.errors import BadInput
from lab.learning import own_rules
from lab.learning.batch import Batch, run_sessions
from lab.learning.environment import Environment, TableEnvironment
from lab.learning.gates import GATES, Gate
from lab.learning.gates.gate import ASKS_BY_RULE, OPENS_BY_RULE
from lab.learning.kernels.records import LANES, GateNumbers
from lab.learning.own_rules import Uncompiled
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import SPEAKS_TO_CORRECT, Advice, TableAdvisor
from lab.learning.splitmix import stream
from lab.learning.updates import UPDATES
from lab.testing import check_gate
from tests.learning import test_batch, test_linear_sessions
from tests.learning.test_kernels import EAGER, SHORT, Cautious, Grown, advice, assert_same, board


class Unsure(lab.RuleGate):
    """Reads all that a rule may read: steps, values, state, helped steps, uniform numbers, and settings."""

    @staticmethod
    def opens_rule(episode: int, steps: Any, now: Any, settings: Any) -> Any:
        if episode <= settings.window:
            return True
        mean = 0.0
        for i in range(len(steps) - settings.window, len(steps)):
            mean += steps[i] / settings.window
        return 2 * episode <= now.episodes and (mean > settings.enough_steps or now.u < settings.rate)

    @staticmethod
    def asks_rule(state: int, values: Any, now: Any, settings: Any) -> Any:
        if now.helped_steps > 3 * now.episode + now.max_steps:
            return False
        return max(values) - min(values) <= settings.psi and (state % 3 > 0 or now.u < 0.5)


class Seldom(lab.RuleGate):
    """Asks about a share of the steps; every episode may ask."""

    @staticmethod
    def asks_rule(state: int, values: Any, now: Any, settings: Any) -> Any:
        return now.u < settings.rate and values[0] < 1.0


@pytest.fixture(scope="module", autouse=True)
def at_any_price() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(own_rules, "WORTH_COMPILING", 0)
        yield


@pytest.fixture(autouse=True)
def untold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_rules, "_told", set())


def alone(place: Any, learner: LearnerSettings, gate: GateSettings, who: Advice, seed: int) -> Any:
    draw = stream(seed)
    return Session(place, learner, gate, TableAdvisor(who, draw), draw).run()


def compiled(place: Any, learner: LearnerSettings, gate: GateSettings, who: Advice, count: int = LANES + 2) -> Batch:
    """Compiled sessions, the first, the eighth and the last of which are compared with the interactive ones."""
    seeds = np.arange(60, 60 + count, dtype=np.uint64)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # that it runs uncompiled
        batch = run_sessions(place, learner, gate, who, seeds, keep_tables=True)
    for n in {0, min(7, count - 1), count - 1}:
        assert_same(batch, n, alone(place, learner, gate, who, int(seeds[n])))
    rules = [Unsure.opens_rule, Seldom.asks_rule]
    assert any(own_rules._compiled_rules.get(rule) is not None for rule in rules)
    return batch


def test_the_contract_is_kept() -> None:
    for gate in (Unsure, Seldom):
        check_gate(gate)
    assert GateNumbers._fields == tuple(field.name for field in fields(GateSettings) if field.name != "gate")


@given(
    psi=st.floats(0.0, 2.0),
    rate=st.floats(0.0, 1.0),
    enough_steps=st.floats(1.0, 40.0),
    window=st.integers(1, 9),
    budget=st.integers(0, 400),
    episodes=st.integers(1, 30),
    max_steps=st.integers(2, 40),
    seed=st.integers(0, 2**64 - 1),
)
@settings(max_examples=40)
def test_they_are_the_same_at_all_settings(episodes: int, max_steps: int, seed: int, **of_gate: Any) -> None:
    learner = replace(SHORT, learner="q", episodes=episodes, max_steps=max_steps)
    gate = replace(EAGER, gate=GATES.use("unsure", Unsure), **of_gate)
    batch = run_sessions(board(), learner, gate, advice(board()), np.array([seed], np.uint64), keep_tables=True)
    assert_same(batch, 0, alone(board(), learner, gate, advice(board()), seed))


def test_each_rule_decides_and_the_advisor_is_heard_by_every_learner() -> None:
    """At an advisor of 50 answers; sarsa-lambda learns from the step before, with what was asked in between."""
    gate = replace(EAGER, gate=GATES.use("unsure", Unsure), enough_steps=30.0, budget=50)
    for learner in ("q", "afterstate", "sarsa-lambda", "dyna-q"):
        batch = compiled(board(), replace(SHORT, learner=learner), gate, advice(board(), 0.4, np.arange(25) != 7))
        assert 0 < batch.helped_steps.min() <= batch.helped_steps.max() <= 50
        assert batch.guided[:, :3].any()
        assert not batch.guided[:, 20:].any()  # the second half of the session


def test_they_are_the_same_with_memory_and_starts_anywhere() -> None:
    anywhere = replace(board(), starts=tuple(np.flatnonzero(~board().terminal).tolist()))
    gate = replace(EAGER, gate=GATES.use("seldom", Seldom), memory=True, budget=90)
    batch = compiled(anywhere, SHORT, gate, advice(anywhere))
    assert batch.guided.any()


def test_they_are_the_same_where_moves_are_random_and_the_advisor_is_late() -> None:
    table, gate = test_batch.slippery(), replace(EAGER, gate=GATES.use("seldom", Seldom))
    who = replace(test_batch.advice(table.mdp), late=True, speaks=SPEAKS_TO_CORRECT)
    assert compiled(table, replace(SHORT, learner="q"), gate, who).guided.any()


def test_rules_of_a_learner_and_of_a_gate_work_together() -> None:
    learner = replace(SHORT, learner=UPDATES.use("cautious", Cautious))
    assert compiled(board(), learner, replace(EAGER, gate=GATES.use("seldom", Seldom)), advice(board())).guided.any()


@pytest.mark.parametrize("place", [test_linear_sessions.CAR, TableEnvironment(test_linear_sessions.board())])
def test_they_are_the_same_on_tiles(place: Environment) -> None:
    learner = replace(test_linear_sessions.SHORT, learner="sarsa-lambda", episodes=8)
    gate = replace(test_linear_sessions.EAGER, gate=GATES.use("unsure", Unsure))
    assert compiled(place, learner, gate, test_linear_sessions.advice(place), 2).guided.any()


class Sorted(lab.RuleGate):
    """A rule that makes a list, which the kernel cannot."""

    @staticmethod
    def asks_rule(state: int, values: Any, now: Any, settings: Any) -> bool:
        return bool(sorted(values)[-1] - sorted(values)[0] <= settings.psi)


class More(Seldom):
    """A gate that overrides more than its rules."""

    def begins(self, state: int) -> None:
        self.begun = state


@pytest.mark.parametrize(("gate", "why"), [(Sorted, ": numba cannot compile its rule"), (More, "")])
def test_an_uncompiled_gate_is_told_once(gate: type[Gate], why: str) -> None:
    how, seeds = replace(EAGER, gate=GATES.use("own", gate)), np.arange(2, dtype=np.uint64)
    with pytest.warns(Uncompiled, match=f"gate 'own' runs uncompiled, about [0-9]+ times slower.*{why}$") as told:
        batch = run_sessions(board(), SHORT, how, advice(board()), seeds, keep_tables=True)
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run_sessions(board(), SHORT, how, advice(board()), seeds)
    assert_same(batch, 1, alone(board(), SHORT, how, advice(board()), 1))


def test_the_rule_that_cannot_be_compiled_is_the_one_that_is_told() -> None:
    learner = replace(SHORT, learner=UPDATES.use("grown", Grown))
    how = replace(EAGER, gate=GATES.use("seldom", Seldom))
    with pytest.warns(Uncompiled, match="learner 'grown' runs uncompiled") as told:
        run_sessions(board(), learner, how, advice(board()), np.arange(2, dtype=np.uint64))
    assert len(told) == 1


class Late(lab.RuleGate):
    """A rule that fails in the ninth episode."""

    @staticmethod
    def opens_rule(episode: int, steps: Any, now: Any, settings: Any) -> bool:
        return 1 / (9 - episode) > 0.0


class Number(lab.RuleGate):
    """A rule without a comparison."""

    @staticmethod
    def asks_rule(state: int, values: Any, now: Any, settings: Any) -> Any:
        return settings.psi


class Half(lab.RuleGate):
    """A rule without an answer in some states."""

    @staticmethod
    def asks_rule(state: int, values: Any, now: Any, settings: Any) -> Any:
        if state > 2:
            return True
        return None


def test_the_session_shows_the_line_of_a_rule_that_fails() -> None:
    how = replace(EAGER, gate=GATES.use("late", Late))
    with pytest.raises(ZeroDivisionError) as failed:
        run_sessions(board(), replace(SHORT, learner="q"), how, advice(board()), np.arange(2, dtype=np.uint64))
    assert failed.traceback[-1].name == "opens_rule"
    assert own_rules._compiled_rules[Late.opens_rule] is not None


@pytest.mark.filterwarnings("ignore::lab.learning.own_rules.Uncompiled")
@pytest.mark.parametrize(("gate", "given"), [(Number, "0.4"), (Half, "None")])
def test_an_answer_that_is_no_bool_is_refused(gate: type[Gate], given: str) -> None:
    how = replace(EAGER, gate=GATES.use("own", gate))
    with pytest.raises(BadInput, match=f"gate 'own': its asks_rule returned {given}: wanted True or False"):
        run_sessions(board(), SHORT, how, advice(board()), np.arange(2, dtype=np.uint64))


def test_few_episodes_run_one_by_one_until_they_are_worth_compiling(monkeypatch: pytest.MonkeyPatch) -> None:
    class Once(Sorted):
        """A gate of its own, whose rule is looked at only when it is to be compiled."""

        @staticmethod
        def asks_rule(state: int, values: Any, now: Any, settings: Any) -> bool:
            return len([*values]) == 4

    monkeypatch.setattr(own_rules, "WORTH_COMPILING", 100)
    how, seeds = replace(EAGER, gate=GATES.use("once", Once)), np.arange(2, dtype=np.uint64)  # 80 episodes
    run_sessions(board(), SHORT, how, advice(board()), seeds)
    assert Once.asks_rule not in own_rules._compiled_rules
    with pytest.warns(Uncompiled, match="gate 'once'"):
        run_sessions(board(), SHORT, how, advice(board()), seeds)
    assert Once.asks_rule in own_rules._compiled_rules


def test_a_form_of_its_own_is_given_to_rules_only() -> None:
    forms = {gate: GATES[GATES.use("own", gate)].compiled for gate in (Unsure, Seldom, More)}
    assert forms[Unsure] == forms[Seldom] == (OPENS_BY_RULE, ASKS_BY_RULE, False, 0)
    assert forms[More] is None
