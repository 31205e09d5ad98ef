"""The measures of doubt, on a cart on a line: each number here can be redone by hand."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.mentor.demonstrated import Demonstrated
from lab.mentor.doubts import DOUBTS, Doubt, Step, steps_of
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.testing import check_doubt
from tests.mentor.conftest import Run

TIMES = 3  # each place of the cart was demonstrated as often


def measure(rule: str, recording: Recording, rollouts: tuple[Episode, ...] = ()) -> tuple[Doubt, Demonstrated]:
    demonstrated = Demonstrated.of(recording.episodes, np.random.default_rng(0))
    make = DOUBTS[rule].make
    return make(demonstrated, make.learned(demonstrated, rollouts, np.random.default_rng(0))), demonstrated


def at(demonstrated: Demonstrated, place: float, action: float = 0.1, **more: np.ndarray) -> Step:
    return Step(demonstrated, demonstrated.standardized([place]), np.array([action]), 0, **more)


def test_the_distance_is_that_to_the_fifth_nearest_step_in_standard_deviations(recording: Recording) -> None:
    doubt, demonstrated = measure("distance", recording)
    deviation = np.std(np.arange(11) * 0.1)
    # three steps at 0.5, so the fourth and fifth nearest are at 0.4 and 0.6
    assert doubt(at(demonstrated, 0.5)) == pytest.approx(0.1 / deviation, rel=1e-5)
    # at 2 the three at 1.0 are nearest, then those at 0.9
    assert doubt(at(demonstrated, 2.0)) == pytest.approx(1.1 / deviation, rel=1e-5)


def test_the_discrepancy_is_that_to_the_actions_nearby(run: Run) -> None:
    slow_then_fast = [0.0, 0.1, 0.2, 0.4, 0.6, 0.8]
    recording = Recording(10, "cart", ("x",), ("dx",), [run(slow_then_fast)] * 5)
    doubt, demonstrated = measure("discrepancy", recording)
    deviation = np.std([0.1, 0.1, 0.2, 0.2, 0.2, 0.1])  # of the actions
    assert doubt(at(demonstrated, 0.0, 0.1)) == pytest.approx(0.0, abs=1e-5)
    assert doubt(at(demonstrated, 0.0, 0.3)) == pytest.approx(0.2 / deviation, rel=1e-4)


def test_an_ensemble_disagrees_more_where_nothing_was_demonstrated(recording: Recording) -> None:
    doubt, demonstrated = measure("ensemble", recording)
    inside = max(doubt(at(demonstrated, 0.1 * place)) for place in range(11))
    assert doubt(at(demonstrated, 8.0)) > 10 * inside


def test_the_members_of_the_policy_go_before_the_mentors_own(recording: Recording) -> None:
    doubt, demonstrated = measure("ensemble", recording)
    members = np.array([[0.1], [0.3]])
    assert doubt(at(demonstrated, 0.5, members=members)) == pytest.approx(0.1 / demonstrated.action_scale[0])
    assert doubt(at(demonstrated, 0.5, members=members[:1])) == 0.0


def test_a_chunk_is_held_against_the_one_before_where_they_overlap(recording: Recording) -> None:
    doubt, demonstrated = measure("chunk", recording)
    scale = demonstrated.action_scale[0]
    first, second = np.array([[0.1], [0.1], [0.1]]), np.array([[0.1], [0.3], [9.0]])
    assert doubt(at(demonstrated, 0.0, chunk=first)) == 0.0
    assert doubt(at(demonstrated, 0.1, chunk=second)) == pytest.approx((0.0 + 0.2) / 2 / scale)
    doubt.begin()
    assert doubt(at(demonstrated, 0.0, chunk=first)) == 0.0


@pytest.mark.parametrize("chunk", [None, np.array([[0.1]])])
def test_a_chunk_has_two_actions_or_more(recording: Recording, chunk: np.ndarray | None) -> None:
    doubt, demonstrated = measure("chunk", recording)
    with pytest.raises(BadInput, match="chunk"):
        doubt(Step(demonstrated, np.zeros(1), np.zeros(1), 0, chunk))


def test_no_progress_counts_the_steps_since_the_end_came_nearer(recording: Recording) -> None:
    doubt, demonstrated = measure("progress", recording)
    places = [0.0, 0.2, 0.4, 0.4, 0.4, 0.2, 0.4, 0.6]
    assert [doubt(at(demonstrated, place)) for place in places] == [0, 0, 0, 1, 2, 3, 4, 0]


def test_the_failure_predictor_tells_failed_from_done(recording: Recording, run: Run, straight: Episode) -> None:
    stuck = run([0.1 * min(step, 3) for step in range(11)], success=False)
    doubt, demonstrated = measure("failure", recording, (straight, stuck, straight, stuck))
    done = [doubt(step) for step in steps_of(demonstrated, straight)]
    doubt.begin()
    failing = [doubt(step) for step in steps_of(demonstrated, stuck)]
    assert min(done) >= 0.0
    assert max(failing) <= 1.0
    assert failing[-1] > 0.8 > 0.2 > done[-1]
    assert failing[0] == done[0]  # the same step so far


def test_the_failure_predictor_needs_both(recording: Recording, straight: Episode, run: Run) -> None:
    with pytest.raises(BadInput, match="failure"):
        measure("failure", recording, (straight,))
    helped = run([0.1, 0.1], success=False, corrected=[1])
    with pytest.raises(BadInput, match="failure"):
        measure("failure", recording, (straight, helped))


def test_the_clock_starts_again_after_a_takeover(recording: Recording) -> None:
    doubt, demonstrated = measure("clock", recording)
    assert [doubt(at(demonstrated, 0.0)) for _ in range(3)] == [0, 1, 2]
    doubt.begin()
    assert doubt(at(demonstrated, 0.0)) == 0


def test_only_what_was_done_right_is_demonstrated(run: Run, straight: Episode) -> None:
    failed = run([5.0, 6.0, 7.0], success=False, corrected=[1])
    demonstrated = Demonstrated.of([straight, failed], np.random.default_rng(0))
    assert len(demonstrated.left) == 11 + 1
    assert demonstrated.states[-1] * demonstrated.scale + demonstrated.middle == pytest.approx(6.0)
    assert demonstrated.left[-1] == 1
    with pytest.raises(BadInput, match="demonstrations"):
        Demonstrated.of([run([5.0], success=False)], np.random.default_rng(0))


def test_a_number_that_never_moved_counts_but_does_not_outweigh_all(run: Run) -> None:
    still = np.zeros((11, 1), np.float32)
    moving = run([0.1 * step for step in range(11)])
    states = np.hstack([moving.states, still])
    episode = Episode("go", states, moving.actions, moving.corrected, True)
    demonstrated = Demonstrated.of([episode], np.random.default_rng(0))
    assert demonstrated.scale[1] == pytest.approx(0.01 * demonstrated.scale[0])


@pytest.mark.parametrize("rule", DOUBTS)
def test_every_rule_keeps_its_contract(rule: str) -> None:
    check_doubt(rule)
    assert DOUBTS[rule].help.startswith("asks ")


class Slow(Doubt):
    """Asks where the action is small."""

    returned: Any = None

    def __call__(self, step: Step) -> float:
        return -float(abs(step.action).max()) if self.returned is None else self.returned


def test_a_rule_of_ones_own_is_calibrated_kept_and_given_back(recording: Recording, run: Run, tmp_path: Path) -> None:
    check_doubt(Slow)
    mentor = Mentor.learn(recording, Slow)
    mentor.calibrate([run([0.1 * step for step in range(5)])] * 9, false_alarms=0.2)
    assert bool(mentor([0.5], [0.05]))
    assert not mentor([0.5], [0.2])
    mentor.save(tmp_path / "slow")
    assert Mentor.load(tmp_path / "slow").threshold == mentor.threshold
    content = (tmp_path / "slow").read_bytes()
    (tmp_path / "other").write_bytes(content.replace(b"Slow", b"Slew"))
    with pytest.raises(BadInput, match="its rule 'Slew' is not known here: give its class"):
        Mentor.load(tmp_path / "other")
    assert Mentor.load(tmp_path / "other", Slow).rule == "Slew"


@pytest.mark.parametrize("returned", [float("nan"), "much", True, [1.0]])
def test_what_is_no_number_is_refused(returned: Any, recording: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Slow, "returned", returned)
    with pytest.raises(BadInput, match="the rule Slow returned"):
        Mentor.learn(recording, Slow)([0.5], [0.1])


@pytest.mark.parametrize("thing", [Doubt, int, type("Silent", (Doubt,), {})])
def test_what_is_no_rule_is_refused(thing: Any, recording: Recording) -> None:
    with pytest.raises(BadInput, match=r"wanted a subclass of lab\.Doubt with __call__"):
        Mentor.learn(recording, thing)


def test_a_rule_that_remembers_another_episode_breaks_the_contract() -> None:
    class Grows(Doubt):
        count = 0

        def __call__(self, step: Step) -> float:
            self.count += 1
            return float(self.count)

    with pytest.raises(AssertionError, match=r"see `begin`"):
        check_doubt(Grows)
