"""The rounds of a student with a mentor, on a point that goes along a line."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from lab.cloning.rounds import (
    CALIBRATING,
    CORRECTING,
    DEMONSTRATING,
    EVALUATING,
    Asking,
    Cloning,
    CloningOptions,
    Measured,
    cloned,
    seeds_for,
)
from lab.cloning.student import Student
from lab.errors import BadInput
from lab.learning.members import Member
from lab.mentor.doubts import DOUBTS, Doubt, Step
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from tests.cloning.conftest import RollOut

FEW = CloningOptions(rounds=2, questions=3, takeover_steps=4, calibrated=9, episodes=6, evaluated=5, epochs=60)


def narrow(recording: Recording) -> Recording:
    """Demonstrations of the way's last part alone, so that the student is lost before it."""
    late = [episode.part(len(episode) - 6, len(episode), success=True) for episode in recording.episodes]
    return replace(recording, episodes=late)


def test_no_seed_serves_two_purposes() -> None:
    purposes = (DEMONSTRATING, CALIBRATING, CORRECTING, EVALUATING)
    drawn = [seed for purpose in purposes for in_round in range(4) for seed in seeds_for(FEW, purpose, 50, in_round)]
    assert len(set(drawn)) == len(drawn)
    assert seeds_for(FEW, EVALUATING, 5) == seeds_for(FEW, EVALUATING, 5)


def test_a_session_measures_each_round_on_the_same_episodes(roll_out: RollOut, shown: Recording) -> None:
    *_, last = cloned(roll_out, shown, replace(FEW, rule="always"))
    assert [measured.round for measured in last.measured] == [0, 1, 2]
    assert [measured.questions for measured in last.measured] == [0, 3, 6]
    assert [measured.corrected_steps for measured in last.measured] == [0, 12, 24]
    assert last.measured[0].success == np.mean(last.measured[0].successes)
    assert all(len(measured.successes) == FEW.evaluated for measured in last.measured)


def test_corrections_are_learned_from(roll_out: RollOut, shown: Recording) -> None:
    lost = narrow(shown)
    *_, never = cloned(roll_out, lost, replace(FEW, rule="never"))
    assert (never.questions, never.corrections) == (0, [])
    *_, asked = cloned(roll_out, lost, replace(FEW, rule="distance", questions=6))
    assert asked.questions > 0
    assert asked.measured[-1].success >= asked.measured[0].success
    assert all(episode.corrected.any() for episode in asked.corrections)


@pytest.mark.parametrize("rule", ["distance", "failure", "chunk", "random", "clock"])
def test_the_same_seed_gives_the_same_session(rule: str, roll_out: RollOut, shown: Recording) -> None:
    options = replace(FEW, rule=rule, rounds=1, every_steps=6)
    first, again = ([*cloned(roll_out, shown, options)][-1] for _ in range(2))
    assert first.measured == again.measured
    assert [e.actions.tolist() for e in first.corrections] == [e.actions.tolist() for e in again.corrections]


def test_a_session_goes_on_where_it_stopped(roll_out: RollOut, shown: Recording) -> None:
    *_, whole = cloned(roll_out, shown, replace(FEW, rule="clock", every_steps=6))
    first = next(iter(cloned(roll_out, shown, replace(FEW, rule="clock", every_steps=6))))
    *_, rest = cloned(roll_out, shown, replace(FEW, rule="clock", every_steps=6), first)
    assert rest.measured == whole.measured


def test_a_takeover_lasts_its_steps_and_the_budget_its_questions(shown: Recording) -> None:
    student = Student.learn(shown, epochs=1)
    asks = Asking(Mentor.learn(shown, "always"), student, 2, 3)
    given = [asks(np.array([0.5], np.float32), np.zeros(1, np.float32)) for _ in range(9)]
    assert given == [True] * 6 + [False] * 3
    assert asks.questions == 2


def test_a_teacher_who_misleads_is_asked_no_more(roll_out: RollOut, shown: Recording) -> None:
    """One who goes back takes the point away from its end: the judge of the mentor notices."""

    def back(observation: Any) -> np.ndarray:
        return np.full(1, -1.0, np.float32)

    misled: partial[Episode] = partial(roll_out, teacher=back)
    *_, last = cloned(misled, shown, replace(FEW, rule="clock", rounds=4, questions=20, episodes=20, every_steps=6))
    assert last.measured[-1].rejected
    assert last.measured[-1].helped < last.measured[-1].judged / 2
    assert last.questions < 4 * 20


@pytest.mark.parametrize("success", [True, False])
def test_what_cannot_be_learned_from_the_rollouts_is_replaced_and_told(
    success: bool, roll_out: RollOut, shown: Recording
) -> None:
    """Of rollouts that all end alike a predictor of failure learns nothing."""

    def alike(*args: Any, **kwargs: Any) -> Episode:
        return replace(roll_out(*args, **kwargs), success=success)

    sessions = [next(iter(cloned(alike, shown, replace(FEW, rule=rule)))) for rule in ("failure", "distance")]
    assert [session.measured[0].rule for session in sessions] == ["distance", "distance"]


class Broken(Doubt):
    """Learns nothing."""

    @classmethod
    def learned(cls, *_: Any) -> Any:
        raise BadInput("this rule is broken")

    def __call__(self, step: Step) -> float:
        return 0.0


def test_a_broken_rule_of_ones_own_is_not_replaced(
    roll_out: RollOut, shown: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(DOUBTS, "broken", Member(Broken, "is broken"))
    with pytest.raises(BadInput, match="this rule is broken"):
        next(iter(cloned(roll_out, shown, replace(FEW, rule="broken"))))


GOOD = Measured(1, (True, False), 3, 12, 1, 0, (9,), None, 1, 2, False)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"successes": ()}, "successes: none"),
        ({"questions": -4}, "questions -4: wanted 0 or more"),
        ({"warned": 2}, "warned 2: wanted 0 to 1"),
        ({"false_alarms": 2}, "false_alarms 2: wanted 0 to 1"),
        ({"helped": 3}, "helped 3: wanted 0 to 2"),
        ({"lead_steps": ()}, "lead_steps of 0 failures: wanted those of 1"),
    ],
)
def test_a_round_has_numbers_that_can_be(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        replace(GOOD, **wrong)


def test_a_session_knows_its_parts(roll_out: RollOut, shown: Recording) -> None:
    session = next(iter(cloned(roll_out, shown, FEW)))
    assert isinstance(session, Cloning)
    assert session.mentor.rule == FEW.rule
    assert session.measured[0].promise is not None
    assert session.measured[0].promise.share == FEW.false_alarms
