"""Problems from arrays: what a reader can redo by hand, RiverSwim, returns in sessions, comparisons and documents, refusals."""

from typing import Any

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.learning import splitmix
from lab.learning.batch import run_sessions
from lab.learning.gates import GATES
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.transition_arrays import ArrayEnvironment, river_swim

# Two states, "stay" and "go"; going to state 1 succeeds with probability 0.5, and staying there gives 1.
COIN = [[[1.0, 0.0], [0.5, 0.5]], [[0.0, 1.0], [1.0, 0.0]]]
GIVES = [[0.0, 0.0], [1.0, 0.0]]


def coin(**given: Any) -> ArrayEnvironment:
    environment = lab.Problem.from_arrays(COIN, GIVES, **given).environment
    assert isinstance(environment, ArrayEnvironment)
    return environment


def swim(**given: Any) -> lab.Problem:
    named: dict[str, Any] = {"horizon": 20, "name": "riverswim", "action_labels": ("left", "right")} | given
    return lab.Problem.from_arrays(*river_swim(), **named)


def test_values_and_worth_are_those_by_hand() -> None:
    """In state 1: 1 / (1 - 0.5) = 2. In state 0: v = 0.5 (0.5 v + 0.5 * 2), so v = 2 / 3."""
    place = coin(discount=0.5, horizon=3)
    assert np.allclose(place.values(0.5).max(axis=1), [2 / 3, 2.0])
    go_then_stay = np.array([1, 0])
    assert place.worth(go_then_stay, 3)[0] == 0.5 + 0.75  # by then in state 1 after one step, and after two
    assert place.highest_reward == 1.0
    assert not place.certain


def test_with_a_goal_steps_are_scored() -> None:
    """The goal is reached after 2 steps on average."""
    place = coin(terminal=[1], goal=[1])
    assert place.highest_reward is None
    returned, reached, steps = place.worth(np.array([1, 0]), 200)
    assert (returned, round(reached, 9), round(steps, 9)) == (0.0, 1.0, 2.0)
    judged = place.judge(np.array([[0.0, 1.0], [0.0, 0.0]]), LearnerSettings())
    assert (judged.final_steps, judged.final_return) == (2, None)


def test_a_goal_that_cannot_be_reached_is_refused() -> None:
    stays = [[[1.0, 0.0]], [[0.0, 1.0]]]
    with pytest.raises(lab.BadInput, match="no goal can be reached from 0"):
        lab.teach(lab.Problem.from_arrays(stays, [[0.0], [0.0]], terminal=[1], goal=[1]))


def test_starts_are_drawn_from_their_distribution() -> None:
    place = coin(start=[0.25, 0.75])
    assert [place.reset(1, iter([u]).__next__) for u in (0.0, 0.24, 0.25, 0.99)] == [0, 0, 1, 1]
    assert place.mdp.starts == (0, 1)


def test_rewards_may_depend_on_the_state_entered() -> None:
    gives = np.zeros((2, 2, 2))
    gives[0, 1, 1] = 4.0
    environment = lab.Problem.from_arrays(COIN, gives).environment
    assert environment is not None
    assert environment.mdp.reward.tolist() == [[0.0, 2.0], [0.0, 0.0]]


def test_other_chances_make_another_problem() -> None:
    """Both have the same likeliest table, and the same mean rewards."""
    other = [[[1.0, 0.0], [0.6, 0.4]], COIN[1]]
    assert lab.Problem.from_arrays(other, GIVES).mdp.signature != coin().mdp.signature


def test_the_score_of_an_episode_is_its_return() -> None:
    """Greedy, it stays in state 1: 4 steps of reward 1, nothing short of the highest."""
    learner = LearnerSettings("q", selection="greedy", episodes=3, max_steps=4)
    q0 = np.array([[0.0, 0.0], [1.0, 0.0]])
    session = Session(coin(start=1), learner, GateSettings(), None, np.random.default_rng(0), q0)
    events: list[Any] = []
    result = session.run(events.append)
    assert result.returns is not None
    assert (result.steps.tolist(), result.returns.tolist()) == ([4, 4, 4], [4.0, 4.0, 4.0])
    assert [event.steps for event in events] == [0.0, 0.0, 0.0]
    assert (result.final_return, result.best_return, result.solved) == (4.0, 4.0, True)


def test_river_swim_is_learned_with_advice_and_not_without() -> None:
    lesson = lab.teach(swim(), seed=1)
    assert lesson.solved
    assert round(lesson.session.final_return or 0.0, 4) == round(lesson.session.best_return or 0.0, 4) == 3.3966
    assert [lesson.act(state) for state in range(6)] == [1] * 6
    document = lesson.document
    assert (document["score"], document["final_steps"], document["optimal_steps"]) == ("return", None, None)
    assert document["returns_per_episode"] == [row["return"] for row in lesson.rows()]
    assert "mean return 3.397" in str(lesson)
    alone = lab.teach(swim(), seed=1, advisor=None)
    assert not alone.solved
    assert round(alone.session.final_return or 0.0, 9) == 0.1  # 20 steps of 0.005 at the left bank


@pytest.mark.parametrize("gate", [name for name in GATES if name != "never"])
def test_every_gate_teaches_it(gate: str) -> None:
    enough: dict[str, dict[str, Any]] = {"cq": {"enough_steps": 10}, "importance": {"psi": 0.0}}
    session = lab.teach(swim(), gate=gate, episodes=100, **enough.get(gate, {})).session
    assert session.returns is not None
    assert session.steps.tolist() == [20] * 100
    assert session.helped_steps > 0


def test_a_comparison_has_returns() -> None:
    compared = lab.compare(swim(), advisor=["expert", "none"], sessions=3, episodes=200)
    means = {row["advisor"]: row["value"] for row in compared.rows if row["measure"] == "mean_return"}
    assert means["expert"] > 5 * means["none"]
    assert "Mean return of each episode" in compared.figures


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"P": np.transpose(river_swim()[0], (1, 0, 2))},
            r"P has shape \(2, 6, 6\): wanted \(states, actions, states\)",
        ),
        ({"P": river_swim()[0] / 2}, r"P\[0, 0\] sums to 0.5: wanted 1"),
        ({"P": -river_swim()[0]}, r"P\[0, 0\] has a negative probability"),
        ({"P": np.full((6, 2, 6), np.nan)}, r"P\[0, 0\] is not finite"),
        ({"P": "some"}, "P 'some': wanted an array of numbers"),
        ({"R": [0.0] * 6}, r"R has shape \(6,\): wanted \(6, 2\) or \(6, 2, 6\)"),
        ({"R": np.full((6, 2), np.inf)}, r"R\[0, 0\] is inf: wanted finite rewards"),
        ({"start": 6}, "start 6: wanted a state 0..5, or 6 probabilities"),
        ({"start": [0.5] * 6}, "probabilities that sum to 1"),
        ({"terminal": [0]}, "start 0 is a terminal state"),
        ({"terminal": [6]}, r"terminal \[6\]: wanted states 0..5"),
        ({"goal": [5]}, "goal 5 is not among the terminal states"),
        ({"discount": 0.0}, "discount 0.0"),
        ({"horizon": 0}, "horizon 0"),
        ({"action_labels": ("left",)}, "1 action labels for 2 actions"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(given: dict[str, Any], said: str) -> None:
    P, R = river_swim()
    with pytest.raises(BadInput, match=said) as refused:
        lab.Problem.from_arrays(**({"P": P, "R": R} | given))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("setting", [{"memory": True}, {"learner": "afterstate"}])
def test_settings_that_need_a_goal_or_certain_steps_are_refused(setting: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match=r"memory|afterstate"):
        lab.teach(swim(), **setting)


@pytest.mark.parametrize("start", [0, [0.0, 1.0, 0.0], [0.9, 0.1, 0.0]])
@pytest.mark.parametrize("goal", [[2], []])
def test_many_sessions_are_those_of_one(start: Any, goal: list[int]) -> None:
    """Three states in a row; in the last of the cases nine of ten episodes begin in the first."""
    P = np.zeros((3, 2, 3))
    P[0, 0, 0] = P[1, 0, 0] = P[2, :, 2] = 1.0
    P[[0, 1], 1, [1, 2]], P[[0, 1], 1, [0, 1]] = 0.75, 0.25
    place = lab.Problem.from_arrays(P, -np.ones((3, 2)), start=start, terminal=[2], goal=goal).environment
    assert place is not None
    learner, seeds = LearnerSettings(learner="q", episodes=10, max_steps=20), np.arange(5, dtype=np.uint64)
    batch = run_sessions(place, learner, GateSettings("never"), None, seeds, keep_returns=True)
    for seed, steps in enumerate(batch.steps.tolist()):
        session = Session(place, learner, GateSettings("never"), None, splitmix.stream(seed))
        result = session.run()
        assert (result.steps.tolist(), result.returns.tolist()) == (steps, batch.returns[seed].tolist())
