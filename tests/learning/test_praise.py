"""Praise and blame: the rules by hand and by another program, what they change in a session, and what they do not."""

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.advice.advisors import AdvisorName
from lab.advice.table_level import TableLevel
from lab.errors import BadInput
from lab.learning.gates import GATES, Gate, Steps
from lab.learning.praise import (
    BIAS,
    FADING,
    PRAISE_RULES,
    RATE,
    ActionBiasing,
    Coach,
    ControlSharing,
    Judgement,
    Judging,
)
from lab.learning.requests import AdviceRequest, AdvisorLeft, Reply
from lab.learning.selection import SELECTIONS
from lab.learning.session import Session
from lab.learning.session_events import AdviceGiven, AdviceRejected, Event, MoveJudged
from lab.learning.session_result import SessionResult
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid

LEFT, RIGHT = 0, 1
LEARNER = LearnerSettings("q", episodes=40, max_steps=40)
ALWAYS = GateSettings("always", first_episode=1)
NO_VALUES = [0.0, 0.0]


def corridor(length: int = 6) -> TabularMDP:
    return grid((length,), np.zeros(length, bool), (0,), (length - 1,), action_labels=("left", "right"))


def board() -> TabularMDP:
    return grid((5, 5), np.zeros((5, 5), bool), (0, 0), (4, 4))


def ran(name: str, gate: GateSettings, mdp: TabularMDP, seed: int = 0) -> tuple[SessionResult, list[Event]]:
    rng, told = np.random.default_rng(seed), list[Event]()
    advisor = TableLevel(mdp, LEARNER.discount, rng).advisor(AdvisorName.of(name))
    return Session(mdp, LEARNER, gate, advisor, rng).run(told.append), told


# ---- the rules ------------------------------------------------------------------------------------------------------


def test_a_judgement_of_one_move_by_hand() -> None:
    rule = ActionBiasing(2, "softmax")
    rule.hears([(3, RIGHT)], 1.0, lambda state: NO_VALUES, 1.0)
    assert rule.told(3) == [0.0, RATE]
    rule.hears([(3, RIGHT)], -1.0, lambda state: NO_VALUES, 1.0)
    assert rule.told(3) == [0.0, RATE + RATE * (-1.0 - RATE)]


def test_a_late_judgement_changes_the_mean_of_the_moves_that_it_may_be_about() -> None:
    """Of two predictions, each with half of the credit, both move by a quarter of the way from 0 to -2."""
    rule = ActionBiasing(2, "softmax")
    rule.hears([(0, LEFT), (1, LEFT)], -2.0, lambda state: NO_VALUES, 1.0)
    assert [rule.told(0), rule.told(1)] == [[-0.5, 0.0], [-0.5, 0.0]]


def test_the_weight_of_what_was_told_fades() -> None:
    rule = ActionBiasing(2, "greedy")
    rule.hears([(0, LEFT)], 1.0, lambda state: NO_VALUES, 1.0)
    values = [1.0, 3.0]  # their span is 2
    assert rule.biased(0, values, 0.5) == [1.0 + BIAS * RATE * 2.0, 3.0]
    assert rule.choice(0, values, 0.5, lambda: 0.0) == LEFT
    assert rule.biased(1, values, 0.5) == values  # nothing was told there
    for _ in range(60):
        rule.fades()
    assert rule.weight == pytest.approx(FADING**60)
    assert rule.choice(0, values, 0.5, lambda: 0.0) == RIGHT


def test_the_advantage_of_a_move_by_hand() -> None:
    """What the learner does anyway is no news: a second judgement changes less."""
    rule = Coach(2, "softmax")
    rule.hears([(0, RIGHT)], 1.0, lambda state: NO_VALUES, 1.0)
    assert rule.told(0) == [-2.0 * RATE * 0.5, 2.0 * RATE * 0.5]
    first = rule.told(0)[RIGHT]
    rule.hears([(0, RIGHT)], 1.0, lambda state: NO_VALUES, 1.0)
    assert rule.told(0)[RIGHT] - first < 0.01 * first


def test_control_is_shared_by_chance() -> None:
    rule, drawn = ControlSharing(2, "greedy"), deque([0.4, 0.0, 0.6, 0.0])
    rule.hears([(0, LEFT)], 1.0, lambda state: NO_VALUES, 1.0)
    rule.weight = 0.5
    assert rule.choice(0, [0.0, 1.0], 1.0, drawn.popleft) == LEFT
    assert rule.choice(0, [0.0, 1.0], 1.0, drawn.popleft) == RIGHT
    assert rule.chances(0, [0.0, 1.0], 1.0) == [0.5, 0.5]


@pytest.mark.parametrize("rule", PRAISE_RULES)
@pytest.mark.parametrize("selection", SELECTIONS)
def test_chances_are_those_of_the_choices(rule: str, selection: str) -> None:
    made, rng = PRAISE_RULES[rule].make(3, selection), np.random.default_rng(0)
    made.hears([(0, 0), (0, 2)], -1.0, lambda state: [0.0] * 3, 0.5)
    made.weight = 0.05
    counts = np.bincount([made.choice(0, [0.3, 0.2, 0.1], 0.5, rng.random) for _ in range(4000)], minlength=3)
    assert np.abs(counts / 4000 - made.chances(0, [0.3, 0.2, 0.1], 0.5)).max() < 0.04


# ---- in a session ---------------------------------------------------------------------------------------------------


class Watching:
    """An evaluator 0 to 2 moves late that judges at random; keeps the moves that it was shown and what it said of them."""

    def __init__(self, seed: int = 0):
        self.judging, self.shown = Judging(only=True, late=2), list[tuple[int, int, int]]()
        self.said = list[tuple[int, list[tuple[int, int]]]]()
        self._rng = np.random.default_rng(seed)

    def advise(self, request: AdviceRequest) -> Reply:
        self.shown.append((request.episode, request.state, request.own))
        value = int(self._rng.integers(-2, 3))
        if value == 0:
            return None
        about = int(self._rng.integers(0, 4))
        moves = [(state, own) for episode, state, own in self.shown if episode == request.episode]
        self.said.append((value, moves[-(about or 3) :]))
        return Judgement(value, about)


def test_what_is_told_by_another_program() -> None:
    """Least mean squares over all moves as one vector: H += RATE (h - c H) c."""
    mdp, person = board(), Watching()
    session = Session(mdp, LEARNER, ALWAYS, person, np.random.default_rng(1))
    result = session.run()
    predicted = np.zeros(mdp.n_states * mdp.n_actions)
    for value, moves in person.said:
        credit = np.zeros_like(predicted)
        for state, action in moves:
            credit[state * mdp.n_actions + action] += 1.0 / len(moves)
        predicted += RATE * (value - credit @ predicted) * credit
    assert session.praise is not None
    told = np.array([session.praise.told(state) for state in range(mdp.n_states)])
    np.testing.assert_allclose(told.ravel(), predicted, atol=1e-9)
    assert result.helped_steps == len(person.said) > 100


def test_no_judgement_changes_what_moves_are_worth() -> None:
    """The table is that of Q-learning from the moves that were made, whatever was said of them."""
    mdp, person, q = board(), Watching(), np.zeros((25, 4))
    session, learned = Session(mdp, LEARNER, ALWAYS, person, np.random.default_rng(2)), []
    update: Any = session.update
    learn = update.learn

    def seen(state: int, action: int, reward: float, discount: float, entered: int, following: int) -> None:
        learned.append((state, action, reward, discount, entered))
        learn(state, action, reward, discount, entered, following)

    update.learn = seen
    result = session.run()
    for state, action, reward, discount, entered in learned:
        q[state, action] += LEARNER.alpha * (reward + discount * q[entered].max() - q[state, action])
    np.testing.assert_allclose(result.q, q)


class Early(Gate):
    """Asks in the first three episodes."""

    def opens(self, episode: int, steps: Steps) -> bool:
        return episode <= 3


def test_praise_acts_in_open_episodes_only() -> None:
    """A learner that knows its way and is told that right is bad turns round, until the gate is shut."""
    mdp, q0 = corridor(3), np.array([[0.0, 9.0], [0.0, 9.0], [0.0, 0.0]])
    person = Contrary()
    learner = replace(LEARNER, episodes=8, selection="greedy", alpha=0.01)
    session = Session(mdp, learner, ALWAYS, person, np.random.default_rng(0), q0)
    session.gate = Early(ALWAYS, 8, 40)
    steps = session.run().steps
    assert (steps[1:3] > 2).all()
    assert (steps[3:] == 2).all()


class Contrary:
    """Blames each move to the right, and praises each to the left."""

    judging = Judging(only=True)

    def advise(self, request: AdviceRequest) -> Reply:
        return Judgement(-1 if request.own == RIGHT else 1)


@pytest.mark.parametrize("rule", PRAISE_RULES)
def test_an_expert_who_judges_is_as_good_as_one_who_shows(rule: str) -> None:
    gate = GateSettings(first_episode=4, window=2, by_evidence=True, lambda_threshold=1.0)
    name = f"praise:rule={rule}:expert"
    alone, judged = ran("none", gate, board())[0], ran(name, gate, board())[0]
    assert judged.helped_steps > 0
    assert judged.solved
    assert judged.steps.sum() <= alone.steps.sum()


def test_who_praises_what_is_wrong_is_rejected_and_not_heeded_after_that() -> None:
    gate = GateSettings(first_episode=4, window=2, by_evidence=True, lambda_threshold=1.0)
    result, told = ran("praise:wrong", gate, board())
    (rejected,) = (event for event in told if isinstance(event, AdviceRejected))
    judged = [event for event in told if isinstance(event, MoveJudged)]
    assert judged[-1].episode == rejected.episode == result.rejected_at_episode
    assert result.solved


@pytest.mark.parametrize("gate", GATES)
def test_every_gate_asks_for_judgements(gate: str) -> None:
    result, told = ran(
        "praise:moderate",
        GateSettings(gate, first_episode=10, psi=1e-3 if gate == "importance" else 5.0, enough_steps=5.0),
        board(),
    )
    judged = [event for event in told if isinstance(event, MoveJudged)]
    assert len(judged) == result.helped_steps
    assert (result.helped_steps > 0) == (gate != "never")


def test_a_budget_of_judgements() -> None:
    result, _ = ran("praise:expert", replace(ALWAYS, budget=7), board())
    assert result.helped_steps == 7


class Both:
    """Answers with actions, and after its second answer of an episode says that the last two moves were bad."""

    judging = Judging()

    def __init__(self) -> None:
        self.asked = list[str]()

    def advise(self, request: AdviceRequest) -> Reply:
        self.asked.append(request.judgement)
        if request.episode > 1:
            raise AdvisorLeft
        return Judgement(-1, 2) if len(self.asked) == 3 else RIGHT


def test_a_judgement_beside_actions_is_about_what_was_done_and_the_question_is_asked_again() -> None:
    told, mdp, person = list[Event](), corridor(5), Both()
    session = Session(mdp, replace(LEARNER, episodes=3), ALWAYS, person, np.random.default_rng(0))
    session.run(told.append)
    assert person.asked[:5] == ["no", "also", "also", "also", "also"]
    (judged,) = (event for event in told if isinstance(event, MoveJudged))
    assert judged == MoveJudged(1, 3, 1, RIGHT, -1, 2)
    given = [event for event in told if isinstance(event, AdviceGiven)]
    assert [event.step for event in given] == [1, 2, 3, 4]
    assert session.praise is not None
    assert [session.praise.told(state)[RIGHT] for state in range(3)] == [-0.25, -0.25, 0.0]


def test_an_unknown_rule() -> None:
    with pytest.raises(
        BadInput, match=r"^advisor 'praise:...' \(advisor\): unknown rule 'coahc' .*: did you mean 'coach'\?"
    ):
        AdvisorName.of("praise:rule=coahc:expert")


def test_what_was_judged_is_no_demonstration() -> None:
    """With a memory a learner that was shown a path asks no more; one that was judged goes on asking."""
    gate = GateSettings(first_episode=4, window=2, lambda_threshold=1.0, memory=True)
    shown, judged = ran("expert", gate, board())[0], ran("praise:expert", gate, board())[0]
    assert shown.guided.sum() == 1
    assert judged.guided.sum() > 1
