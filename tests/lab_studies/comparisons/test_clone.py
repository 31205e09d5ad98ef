"""The study of when a clone should ask: its numbers from measurements written by hand, and a session of every rule on a line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.cloning.rounds import CloningOptions, Measured
from lab.mentor.conformal import Promise
from lab.recordings.episode import Recording
from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import clone
from lab_studies.comparisons.clone import DOUBTING, MOST, RIVALS, Results, rows_of, rules_tried
from tests.cloning.conftest import rolled_out, straight_on

pytestmark = pytest.mark.studies
PROMISE = Promise("false alarms", 0.2, 9, 1.0, 0.2, 0.4)


def measured(number: int, succeeded: int, questions: int, warned: int = 0, false_alarms: int = 0) -> Measured:
    successes = tuple(place < succeeded for place in range(10))
    leads = (20,) * warned
    return Measured(number, successes, questions, 0, warned, false_alarms, leads, PROMISE, 0, 0, False)


def session(random_end: int, distance_end: int) -> Results:
    still = [measured(0, 4, 0), measured(1, 4, 0)]
    results = dict.fromkeys((*DOUBTING, *RIVALS), still)
    results["random"] = [measured(0, 4, 0), measured(1, random_end, 10)]
    results["distance"] = [measured(0, 4, 0, warned=3), measured(1, distance_end, 5, warned=1, false_alarms=2)]
    return results


def test_the_gain_is_over_a_rival_with_as_many_questions() -> None:
    rows = rows_of("grasp", [session(8, 9), session(6, 7)])
    (gain,) = those(rows, rule="distance", round=1, measure="gain_percent", against="random")
    assert gain["value"] == pytest.approx(100 * np.mean([0.9 - 0.6, 0.7 - 0.5]))
    (gain,) = those(rows, rule="distance", round=1, measure="gain_percent", against="never")
    assert gain["value"] == pytest.approx(100 * np.mean([0.9 - 0.4, 0.7 - 0.4]))
    assert not those(rows, rule="never", measure="gain_percent", against="never")
    (success,) = those(rows, rule="distance", round=1, measure="success_percent")
    assert success["value"] == pytest.approx(80.0)


@pytest.mark.parametrize(
    ("succeeded", "questions", "reached"),
    [((4, 9), 5, 100.0), ((9, 9), 0, 100.0), ((9, 4), MOST + 1, 0.0), ((4, 4), MOST + 1, 0.0)],
)
def test_90_percent_are_reached_for_good_or_not_at_all(
    succeeded: tuple[int, int], questions: int, reached: float
) -> None:
    results = session(8, 9) | {"distance": [measured(0, succeeded[0], 0), measured(1, succeeded[1], 5)]}
    rows = rows_of("grasp", [results, results])
    assert those(rows, rule="distance", measure="questions_to_90")[0]["value"] == questions
    assert those(rows, rule="distance", measure="reached_90_percent")[0]["value"] == reached


def test_warnings_are_counted_over_failures_and_alarms_over_successes() -> None:
    rows = rows_of("grasp", [session(8, 9), session(6, 7)])
    (warned,) = those(rows, rule="distance", round=1, measure="warned_percent")
    assert warned["value"] == pytest.approx(100 * 2 / 4)
    (alarms,) = those(rows, rule="distance", round=1, measure="false_alarms_percent")
    assert alarms["value"] == pytest.approx(100 * 4 / 16)
    (lead,) = those(rows, rule="distance", round=0, measure="lead_s")
    assert lead["value"] == pytest.approx(2.0)


def test_sessions_are_kept_and_pooled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def measured_by_hand(of: clone.Session) -> Results:
        rounds = {"distance": 9 if of.skill == "grasp" else 6, "random": 5}
        return {
            rule: [measured(number, rounds.get(rule, 4) if number else 4, 5 * number) for number in range(3)]
            for rule in (*DOUBTING, *RIVALS)
        }

    def nothing_is_left(of: clone.Session) -> Results:
        raise AssertionError(of)

    job = Job(sessions=2, folder=tmp_path)
    monkeypatch.setattr(clone, "results_of", measured_by_hand)
    found = clone.clone(job, {})
    last = {"rule": "distance", "round": 2, "measure": "gain_percent", "against": "random"}
    gains = [those(found.rows, skill=skill, **last)[0]["value"] for skill in (*clone.SKILLS, clone.ALL)]
    assert gains == pytest.approx([40.0, 10.0, 10.0, 20.0])
    monkeypatch.setattr(clone, "results_of", nothing_is_left)
    assert clone.clone(job, {}).rows == found.rows


def test_every_rule_begins_with_the_same_student() -> None:
    options = CloningOptions(rounds=1, questions=2, calibrated=5, episodes=2, evaluated=4, epochs=20, every_steps=6)
    shown = Recording(10, "point", ("x",), ("speed",), [rolled_out(straight_on, seed) for seed in (1, 2)])
    results = rules_tried(rolled_out, shown, options)
    assert {*results} == {*DOUBTING, *RIVALS}
    assert len({found[0].successes for found in results.values()}) == 1
    assert results["never"][1].questions == 0
    assert results["always"][1].questions == 2
    again = rules_tried(rolled_out, shown, replace(options))
    assert again == results
