"""The mentor: learned, calibrated, asked, kept in a file."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.mentor.doubts import DOUBTS, UNCALIBRATED
from lab.mentor.mentor import Mentor, parted
from lab.mentor.mentor_file import Kept, decode, encode
from lab.recordings.episode import Episode, Recording
from tests.mentor.conftest import Run


def strayed(run: Run, far: float) -> Episode:
    return run([0.0, 0.1, 0.2, 0.2 + far], success=False)


def test_it_never_asks_before_it_is_calibrated(recording: Recording) -> None:
    assert not Mentor.learn(recording)([100.0], [0.1])


def test_it_asks_above_the_peak_that_calibration_allows(recording: Recording, run: Run) -> None:
    successes = [run([0.0, 0.1 + 0.01 * number]) for number in range(9)]
    mentor = Mentor.learn(recording, "distance").calibrate(successes, false_alarms=0.1)
    assert mentor.threshold == max(mentor.peak(episode) for episode in successes)
    assert not any(
        mentor(state, action) for state, action in zip(successes[8].states, successes[8].actions, strict=True)
    )
    question = mentor([3.0], [0.1])
    assert question
    assert question.doubt > question.threshold == mentor.threshold
    assert "distance" in question.why
    assert "above" in question.why


def test_it_catches_failures_while_there_is_time(recording: Recording, run: Run) -> None:
    failures = [strayed(run, far) for far in (1, 2, 3, 4, 5, 6, 7, 8, 9)]
    mentor = Mentor.learn(recording, "distance").calibrate(failures, caught=0.9)
    assert mentor.peak(failures[0]) > mentor.threshold >= mentor.peak(failures[0]) - 1e-9
    mentor.calibrate(failures, caught=0.9, lead=1)
    assert mentor.threshold < mentor.peak(failures[0], lead=1) < 1.0  # it has to ask before they stray


def test_only_uncorrected_episodes_of_the_kind_calibrate(recording: Recording, run: Run) -> None:
    helped = run([0.0, 5.0], corrected=[1])
    unknown = run([0.0, 5.0], success=None)
    mentor = Mentor.learn(recording, "distance")
    with pytest.raises(BadInput, match="0 successful episodes"):
        mentor.calibrate([helped, unknown, strayed(run, 1.0)] * 9, false_alarms=0.1)


@pytest.mark.parametrize("given", [{}, {"false_alarms": 0.1, "caught": 0.9}])
def test_one_share_is_promised(recording: Recording, given: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match="one of the two"):
        Mentor.learn(recording).calibrate([], **given)


@pytest.mark.parametrize("rule", UNCALIBRATED)
def test_there_is_nothing_to_calibrate_in_always_and_never(recording: Recording, straight: Episode, rule: str) -> None:
    mentor = Mentor.learn(recording, rule)
    assert bool(mentor([0.0], [0.1])) == (rule == "always")
    with pytest.raises(BadInput, match=rule):
        mentor.calibrate([straight] * 9, false_alarms=0.1)


def test_rollouts_from_which_a_rule_learned_do_not_calibrate_it(
    recording: Recording, run: Run, straight: Episode
) -> None:
    """In them it doubts less than in others, so that its promise would not hold."""
    stuck = run([0.1 * min(step, 3) for step in range(11)], success=False)
    others = [run([0.001 * number, *(0.1 * step for step in range(1, 11))]) for number in range(1, 10)]
    learned, rest = parted("failure", [straight, others[0], stuck, *others[1:]])
    assert [*learned] == [straight, stuck, *others[2::2]]
    mentor = Mentor.learn(recording, "failure", rollouts=learned)
    with pytest.raises(BadInput, match=r"rollout 0 \(calibrate\): the mentor has learned from it"):
        mentor.calibrate([straight] * 9, false_alarms=0.2)
    assert mentor.calibrate(rest, false_alarms=0.2).promise is not None
    with pytest.raises(BadInput, match="rollout 1"):
        Mentor.learn(recording).calibrate([others[0], straight], false_alarms=0.5)  # which is demonstrated
    assert parted("distance", others) == ((), others)
    Mentor.learn(recording, "distance", rollouts=others).calibrate(others, false_alarms=0.2)  # which learns from none


def test_rollouts_of_another_robot_are_refused(recording: Recording) -> None:
    wide = Episode("go", np.zeros((3, 2), np.float32), np.zeros((3, 1), np.float32), np.zeros(3, bool), True)
    with pytest.raises(BadInput, match=r"rollout 0.*2 states and 1 actions: wanted 1 and 1"):
        Mentor.learn(recording).calibrate([wide] * 9, false_alarms=0.2)
    with pytest.raises(BadInput, match="rollout 0"):
        Mentor.learn(recording, "failure", rollouts=[wide])


def test_rollouts_without_a_known_success_are_refused(recording: Recording, run: Run) -> None:
    with pytest.raises(BadInput, match="of none is it known"):
        Mentor.learn(recording).calibrate([run([0.0, 0.1], success=None)] * 9, false_alarms=0.2)


def test_it_takes_observations_by_name_and_tensors(recording: Recording) -> None:
    mentor = Mentor.learn(recording)
    alone = mentor([0.5], [0.1]).doubt
    assert mentor({"x": 0.5, "camera": None}, {"dx": 0.1}).doubt == alone
    assert mentor({"observation.state": np.array([[0.5]])}, np.array([[0.1]])).doubt == alone


@pytest.mark.parametrize(
    ("observation", "action", "told"),
    [
        ([0.1, 0.2], [0.1], "2 numbers"),
        ([float("nan")], [0.1], "finite"),
        ({"y": 1.0}, [0.1], "lacks 'x'"),
        ([0.1], [], "0 numbers"),
    ],
)
def test_other_widths_are_refused(recording: Recording, observation: object, action: object, told: str) -> None:
    with pytest.raises(BadInput, match=told):
        Mentor.learn(recording)(observation, action)


def test_an_unknown_rule_is_refused_with_the_nearest(recording: Recording) -> None:
    with pytest.raises(BadInput, match="did you mean 'distance'"):
        Mentor.learn(recording, "distence")


def test_a_takeover_begins_the_measure_anew(recording: Recording, run: Run) -> None:
    waits = run([0.3] * 6, corrected=[2])
    assert Mentor.learn(recording, "progress").doubts(waits).tolist() == [0, 1, 2, 0, 1, 2]


@pytest.mark.parametrize("rule", DOUBTS)
def test_a_file_gives_the_mentor_back(
    rule: str, recording: Recording, run: Run, straight: Episode, tmp_path: Path
) -> None:
    stuck = run([0.1 * min(step, 3) for step in range(11)], success=False)
    mentor = Mentor.learn(recording, rule, rollouts=[straight, stuck])
    if rule not in (*UNCALIBRATED, "chunk"):
        others = [run([0.01 * number, *(0.1 * step for step in range(1, 11))]) for number in range(1, 10)]
        mentor.calibrate(others, false_alarms=0.2)
    mentor.save(tmp_path / "mentor.safetensors")
    back = Mentor.load(tmp_path / "mentor.safetensors")
    assert (back.rule, back.threshold, back.promise) == (mentor.rule, mentor.threshold, mentor.promise)
    plan = [[0.1], [0.1]]
    if rule != "random":
        assert [back([x], [0.1], chunk=plan) for x in (0.0, 0.5, 2.0)] == [
            mentor([x], [0.1], chunk=plan) for x in (0.0, 0.5, 2.0)
        ]
    back.save(tmp_path / "again.safetensors")
    assert (tmp_path / "again.safetensors").read_bytes() == (tmp_path / "mentor.safetensors").read_bytes()


def test_a_file_that_is_missing_or_another_is_refused(recording: Recording, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No such file"):
        Mentor.load(tmp_path / "none")
    (tmp_path / "text").write_text("hello")
    with pytest.raises(BadInput, match="text"):
        Mentor.load(tmp_path / "text")


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_damaged_file_is_refused_or_harmless(data: st.DataObject) -> None:
    """Any byte of a file may be wrong: it is refused in one line, or it is a mentor all the same."""
    line = np.linspace(0, 1, 11, dtype=np.float32)[:, None]
    episode = Episode("go", line, np.ones_like(line), np.zeros(11, bool), True)
    mentor = Mentor.learn(Recording(10, "cart", ("x",), ("dx",), [episode]), "distance")
    content = bytearray(encode(Kept("distance", ("x",), ("dx",), 1.0, None), mentor.demonstrated, mentor.arrays))
    content[data.draw(st.integers(0, min(len(content), 1500) - 1))] = data.draw(st.integers(0, 255))
    with suppress(BadInput):
        decode(bytes(content), "it")
