"""Moves left to chance, advisors that are late or hold back: compiled sessions equal the interactive ones."""

from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.batch import _one_by_one, run_sessions
from lab.learning.chance_table import ChanceTable, Outcome
from lab.learning.environment import Step, TableEnvironment
from lab.learning.gates import GATES
from lab.learning.greedy import greedy_steps
from lab.learning.kernels.arrays import Kept
from lab.learning.requests import AdviceRequest
from lab.learning.selection import Draw
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import (
    SPEAKS_ALWAYS,
    SPEAKS_AS_EXPECTED,
    SPEAKS_TO_CORRECT,
    Advice,
    TableAdvisor,
    advice_chances,
)
from lab.learning.splitmix import stream
from lab.mdp import NoPath, TabularMDP, grid, optimal_values

LEARNER = LearnerSettings("q", alpha=0.5, episodes=25, max_steps=30)
EAGER = GateSettings(first_episode=4, window=2, omega=1, psi=0.4, spread=0.2, rate=0.3, enough_steps=9.0, budget=50)


def slippery() -> ChanceTable:
    """A board of 4 x 4 with an obstacle; a move goes as meant with chance 0.8, else as the next action would."""
    blocked = np.zeros((4, 4), bool)
    blocked[1, 1] = True
    mdp = grid((4, 4), blocked, (0, 0), (3, 3))
    outcomes: list[list[Outcome]] = []
    for state in range(mdp.n_states):
        for action in range(mdp.n_actions):
            both = (action, 0.8), ((action + 1) % mdp.n_actions, 0.2)
            outcomes.append([(p, int(mdp.successor[state, a]), float(mdp.reward[state, a])) for a, p in both])
    return ChanceTable(mdp, outcomes, optimal_values(mdp, 0.99))


def advice(mdp: TabularMDP) -> Advice:
    return Advice.of(advice_chances(optimal_values(mdp, 0.99), 0.3), np.arange(mdp.n_states) != 2)


@pytest.mark.parametrize("gate", GATES)
@pytest.mark.parametrize("speaks", [SPEAKS_ALWAYS, SPEAKS_TO_CORRECT, SPEAKS_AS_EXPECTED])
def test_compiled_sessions_are_the_same(gate: str, speaks: int) -> None:
    table, how = slippery(), replace(EAGER, gate=gate)
    who = replace(advice(table.mdp), late=speaks == SPEAKS_TO_CORRECT, speaks=speaks)
    seeds = np.arange(40, 70, dtype=np.uint64)
    batch = run_sessions(table, LEARNER, how, who, seeds, keep_tables=True)
    for n in (0, 5, 29):
        draw = stream(int(seeds[n]))
        one = Session(table, LEARNER, how, TableAdvisor(who, draw), draw).run()
        np.testing.assert_array_equal(batch.steps[n], one.steps)
        np.testing.assert_array_equal(batch.q[n], one.q)
        assert (batch.requests[n], batch.helped_steps[n]) == (one.requests, one.helped_steps)


def test_a_goal_that_is_entered_by_unlikely_outcomes_only_can_be_reached() -> None:
    """Of the three cells in a row the last is the goal; the likeliest outcome of each move is to stay."""
    mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2))
    moves = [(state, int(mdp.successor[state, a]), float(mdp.reward[state, a])) for state in range(3) for a in range(4)]
    outcomes: list[list[Outcome]] = [[(0.6, state, -1.0), (0.4, led, paid)] for state, led, paid in moves]
    likeliest = TabularMDP(
        np.repeat(np.arange(3, dtype=np.int32)[:, None], 4, axis=1),
        np.where(mdp.terminal[:, None], 0.0, -1.0).repeat(4, axis=1),
        mdp.terminal,
        mdp.goal,
        0,
        mdp.action_labels,
    )
    table = ChanceTable(likeliest, outcomes, optimal_values(mdp, 0.99))
    draw = stream(9)
    one = Session(table, LEARNER, GateSettings("never"), None, draw).run()
    assert (one.optimal_steps, one.final_steps, one.solved) == (None, None, False)
    assert one.steps.min() >= 2
    batch = run_sessions(table, LEARNER, GateSettings("never"), None, np.array([9], np.uint64), keep_tables=True)
    np.testing.assert_array_equal(batch.steps[0], one.steps)
    np.testing.assert_array_equal(batch.q[0], one.q)
    never = [[(1.0, state, -1.0)] for state, _, _ in moves]
    with pytest.raises(NoPath, match="no goal can be reached from"):
        ChanceTable(likeliest, never, np.zeros((3, 4))).check()


def test_outcomes_come_as_often_as_they_should() -> None:
    table, draw = slippery(), stream(3)
    entered = [table.step(0, 1, draw).state for _ in range(2000)]  # down, else left, where it stays
    assert {*entered} == {0, 4}
    assert 0.77 < np.mean(np.array(entered) == 4) < 0.83


def test_chances_must_sum_to_one() -> None:
    mdp = grid((1, 2), np.zeros((1, 2), bool), (0, 0), (0, 1))
    outcomes: list[list[Outcome]] = [[(0.5, 0, 0.0)]] * (mdp.n_states * mdp.n_actions)
    with pytest.raises(BadInput, match=r"outcomes of move 0: their chances sum to 0\.5: wanted 1"):
        ChanceTable(mdp, outcomes, np.zeros((2, 4)))


def request(mdp: TabularMDP, state: int, own: int) -> AdviceRequest:
    return AdviceRequest(episode=1, step=1, state=state, own=own, allowed=range(4), mdp=mdp, q=[])


def test_advisors_that_are_late_or_hold_back() -> None:
    mdp = grid((1, 4), np.zeros((1, 4), bool), (0, 0), (0, 3))
    right = 3
    sure = Advice.of(np.tile(np.eye(4)[right], (4, 1)), np.array([True, True, False, True]))
    late = TableAdvisor(replace(sure, late=True), stream(0))
    assert [late.advise(request(mdp, state, 0)) for state in (0, 1, 2, 1)] == [None, right, right, None]
    correcting = TableAdvisor(replace(sure, speaks=SPEAKS_TO_CORRECT), stream(0))
    assert [correcting.advise(request(mdp, 0, own)) for own in (0, right)] == [right, None]
    expecting = TableAdvisor(replace(sure, speaks=SPEAKS_AS_EXPECTED), stream(0))
    assert [expecting.advise(request(mdp, 0, own)) for own in (right, 0, 0)] == [right, None, right]


@pytest.mark.parametrize("gate", ["never", "ccrl", "earned-trust"])
@pytest.mark.parametrize("learner", ["q", "afterstate"])
@pytest.mark.parametrize("starts", [(), (0, 3, 12)])
def test_the_greedy_policy_is_measured_along_the_way_as_in_the_session(
    gate: str, learner: str, starts: tuple[int, ...]
) -> None:
    """It costs no draw: the sessions are the same as without."""
    mdp = replace(slippery().mdp, starts=starts)
    place: TabularMDP | ChanceTable = mdp if learner == "afterstate" else slippery()
    how, who, seeds = replace(EAGER, gate=gate), advice(mdp), np.arange(3, 9, dtype=np.uint64)
    settings = replace(LEARNER, learner=learner, episodes=24)
    batch = run_sessions(place, settings, how, who, seeds, greedy_every=5, keep_returns=True)
    plain = run_sessions(place, settings, how, who, seeds)
    np.testing.assert_array_equal(batch.steps, plain.steps)
    assert (batch.greedy.shape, plain.greedy.shape) == ((6, 4), (6, 0))
    table = TableEnvironment(place) if isinstance(place, TabularMDP) else place
    one_by_one = _one_by_one(table, settings, how, who, seeds, Kept(returns=True, greedy_every=5))
    np.testing.assert_array_equal(batch.greedy, one_by_one.greedy)
    np.testing.assert_array_equal(batch.returns, one_by_one.returns)
    assert (batch.returns.shape, plain.returns.shape) == ((6, 24), (0, 24))


def test_a_greedy_policy_by_hand() -> None:
    """Three cells in a row, right is 1: two moves to the goal; a table of nothing goes left for ever."""
    place = TableEnvironment(grid((3,), np.zeros(3, bool), (0,), (2,)))
    learner, right = LearnerSettings(max_steps=9), np.tile([0.0, 1.0], (3, 1))
    assert greedy_steps(place, right, learner, stream(0), 1) == 2.0
    assert greedy_steps(place, right, replace(learner, count_start=True), stream(0), 1) == 3.0
    assert greedy_steps(place, np.zeros((3, 2)), learner, stream(0), 1) == 10.0


@pytest.mark.parametrize("tilings", [1, 4])
def test_a_return_is_the_sum_of_an_episodes_rewards(tilings: int) -> None:
    """Each move of the board costs as much, but the one that reaches the goal has its own reward."""
    mdp, settings = slippery().mdp, replace(LEARNER, tilings=tilings, episodes=8)
    seeds = np.arange(4, dtype=np.uint64)
    batch = run_sessions(mdp, settings, GateSettings("never"), None, seeds, keep_returns=True)
    one = Session(mdp, settings, GateSettings("never"), None, stream(3)).run()
    np.testing.assert_array_equal(batch.returns[3], one.returns)
    reached = batch.steps <= settings.max_steps
    assert reached.any()
    step, last = mdp.reward[mdp.start].max(), mdp.reward.max()
    np.testing.assert_allclose(batch.returns[reached], (batch.steps[reached] - 1) * step + last)


def test_a_learner_on_tiles_is_not_measured_along_the_way() -> None:
    with pytest.raises(BadInput, match=r"greedy_every 5: .*on tables only"):
        run_sessions(
            slippery().mdp, replace(LEARNER, tilings=4), EAGER, None, np.arange(2, dtype=np.uint64), greedy_every=5
        )


class HeldBack(TableEnvironment):
    """A corridor in which three of ten draws do not move the learner."""

    def step(self, state: int, action: int, draw: Draw) -> Step:
        return Step(-0.1, state, False) if draw() < 0.3 else super().step(state, action, draw)


class SecondStart(TableEnvironment):
    """A corridor that begins in its second cell, whatever its table says."""

    def reset(self, episode: int, draw: Draw) -> int:
        return 1


@pytest.mark.parametrize("kind", [HeldBack, SecondStart])
def test_an_environment_with_steps_or_starts_of_its_own_is_not_run_as_its_table(kind: type[TableEnvironment]) -> None:
    mdp = grid((1, 5), [[0] * 5], (0, 0), (0, 4))
    place, learner, seeds = (
        kind(mdp),
        LearnerSettings(learner="q", episodes=12, max_steps=30),
        np.arange(4, dtype=np.uint64),
    )
    given = (place, learner, GateSettings("never"), None, seeds)
    batch, one_by_one = run_sessions(*given, greedy_every=4), _one_by_one(*given, Kept(greedy_every=4))
    assert batch.steps.tolist() == one_by_one.steps.tolist()
    assert batch.steps.tolist() != run_sessions(mdp, *given[1:]).steps.tolist()
    assert batch.greedy.tolist() == one_by_one.greedy.tolist()
    if kind is SecondStart:
        assert batch.greedy.min() >= 3.0  # its shortest path
