"""Sessions on tiles: the compiled ones equal the readable ones, number by number, in grids and in worlds of physics."""

from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.batch import Batch, is_compiled, run_sessions
from lab.learning.environment import Environment, TableEnvironment
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import PhysicsEnvironment, fitting
from lab.learning.session import Session
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.learning.splitmix import stream
from lab.learning.updates import LINEAR
from lab.mdp import TabularMDP, grid, optimal_values

CAR = PhysicsEnvironment(PHYSICS["MountainCar-v0"])
SHORT = replace(fitting(CAR.physics), episodes=14, max_steps=150, alpha=0.8)
EAGER = GateSettings(first_episode=4, window=2, omega=2, psi=0.5, rate=0.3, enough_steps=140.0, budget=900)
COMPILED_GATES = ("never", "always", "ccrl", "combined", "ia", "importance", "random", "cq")


def board() -> TabularMDP:
    blocked = np.zeros((6, 6), bool)
    blocked[1, 1:5] = True
    return grid((6, 6), blocked, (0, 0), (5, 5))


def advice(of: Environment, chances: float = 0.2) -> Advice:
    known = optimal_values(of.mdp, 0.99) if isinstance(of, TableEnvironment) else of.values(1.0)
    return Advice.of(advice_chances(known, chances))


def assert_same(batch: Batch, n: int, one: SessionResult) -> None:
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
    wanted = (one.requests, one.helped_steps, one.misleads, one.rejected_at_episode or 0, one.visits.sum())
    assert counted == wanted


def both(place: Environment, learner: LearnerSettings, gate: GateSettings, who: Advice | None) -> Batch:
    """Two sessions each way, compared; the compiled ones."""
    seeds = np.array([5, 2**63], np.uint64)
    assert is_compiled(place.mdp, learner, gate)
    batch = run_sessions(place, learner, gate, who, seeds, keep_tables=True)
    for n, seed in enumerate(seeds.tolist()):
        draw = stream(seed)
        assert_same(
            batch, n, Session(place, learner, gate, None if who is None else TableAdvisor(who, draw), draw).run()
        )
    return batch


@pytest.mark.parametrize("gate", COMPILED_GATES)
def test_every_gate_in_the_car(gate: str) -> None:
    batch = both(CAR, SHORT, replace(EAGER, gate=gate), advice(CAR))
    assert (batch.helped_steps > 0).all() == (gate != "never")


@pytest.mark.parametrize("selection", ["softmax", "epsilon-greedy", "greedy"])
@pytest.mark.parametrize("learner", LINEAR)
def test_every_learner_and_selection_on_a_grid(learner: str, selection: str) -> None:
    settings = LearnerSettings(
        learner, alpha=0.5, trace=0.8, selection=selection, tilings=2, episodes=30, max_steps=60, count_start=True
    )
    place = TableEnvironment(board())
    for replacing in (True, False):
        both(place, replace(settings, replacing=replacing), EAGER, advice(place))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_advisors_are_judged_by_evidence_alike(sign: float) -> None:
    settings = LearnerSettings("sarsa-lambda", alpha=0.5, tilings=2, episodes=30, max_steps=60)
    place, how = TableEnvironment(board()), replace(EAGER, by_evidence=True, lambda_threshold=1.0)
    who = Advice.of(advice_chances(sign * optimal_values(board(), 0.99), 0.01))
    assert both(place, settings, how, who).rejected_at_episode.any() == (sign < 0)


def test_several_starts_are_drawn_alike() -> None:
    place = TableEnvironment(replace(board(), starts=(0, 3, 30)))
    both(place, LearnerSettings("sarsa", tilings=2, episodes=20, max_steps=40), replace(EAGER, gate="ia"), None)


@pytest.mark.parametrize("name", ["Acrobot-v1", "CartPole-v1"])
def test_the_other_worlds(name: str) -> None:
    place = PhysicsEnvironment(PHYSICS[name])
    both(place, replace(fitting(place.physics), episodes=3, max_steps=60), GateSettings("never"), None)


def test_what_has_no_compiled_form_runs_one_by_one() -> None:
    gate = replace(EAGER, gate="always", memory=True)
    assert not is_compiled(CAR.mdp, SHORT, gate)
    short, who = replace(SHORT, episodes=3), advice(CAR)
    draw = stream(7)
    one = Session(CAR, short, gate, TableAdvisor(who, draw), draw).run()
    assert_same(run_sessions(CAR, short, gate, who, np.array([7], np.uint64), keep_tables=True), 0, one)


def test_the_car_is_learned_alone_and_its_master_is_a_good_one() -> None:
    seeds = np.arange(20, dtype=np.uint64)
    batch = run_sessions(CAR, fitting(CAR.physics), GateSettings("never"), None, seeds)
    assert batch.steps[:, 0].min() == 201
    assert batch.steps[:, -50:].mean() < 130
    assert CAR.judge(CAR.values(1.0), replace(SHORT, max_steps=200)).solved


def test_learners_that_keep_a_value_per_state_have_no_tiles() -> None:
    with pytest.raises(BadInput, match=r"'dyna-q'.*tilings = 8: allowed are q, sarsa, q-lambda, sarsa-lambda"):
        Session(CAR, replace(SHORT, learner="dyna-q"), EAGER, None, stream(0)).run()


def test_start_values_hold_wherever_nothing_was_learned() -> None:
    settings = LearnerSettings("q", alpha=0.5, start_value=-3.0, episodes=1, max_steps=1)
    mdp = board()
    for tilings in (1, 2):
        q = Session(mdp, replace(settings, tilings=tilings), EAGER, None, stream(0)).run().q
        assert q[-2].tolist() == [-3.0] * 4
        assert q[0].min() < -3.0  # a step costs
    both(CAR, replace(SHORT, start_value=-50.0, episodes=4), GateSettings("never"), None)
    assert not is_compiled(mdp, settings, EAGER)


def test_what_comes_after_a_broken_off_episode_is_thought_to_be_worth_the_start_value() -> None:
    """Two steps of -0.1 in a corridor that is longer: -0.1 - 0.1 - 5, by hand, without discount."""
    mdp = grid((1, 9), np.zeros((1, 9), bool), (0, 4), (0, 8))
    for start, worth in ((0.0, -0.2), (-5.0, -5.2)):
        learner = LearnerSettings("monte-carlo", alpha=1.0, discount=1.0, start_value=start, episodes=1, max_steps=2)
        q = Session(mdp, learner, GateSettings("never"), None, stream(1)).run().q
        assert worth in np.round(q[4], 9)
