"""The speed study: the kernel beside rivals that took a known time. What the kernel itself takes is not judged here."""

from typing import Any

import pytest

from lab.learning.settings import LearnerSettings
from lab.mdp import TabularMDP
from lab.studies.runner import Job
from lab_studies.comparisons import learning_speed as module
from lab_studies.comparisons.learning_speed import FEW, LEARNERS, REPEATS, SESSIONS, speed
from lab_studies.comparisons.learning_speed_rivals import C_LANES, RIVALS
from lab_studies.comparisons.learning_speed_session import Measured, Missing
from lab_studies.thesis.chapter_9_sessions import world

Asked = list[tuple[Any, ...]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    """What a quick rival is asked for; it makes 6 million moves in 1, 2, 3 ... seconds. Another one is missing."""
    calls: Asked = []

    def quick(mdp: TabularMDP, settings: LearnerSettings, sessions: int, seed: int) -> Measured:
        calls.append((mdp.signature, settings, sessions, seed))
        return Measured(6_000_000, float(len(calls)), 50.0)

    def missing(*_: object) -> Measured:
        raise Missing("no such processor")

    monkeypatch.setattr(module, "RIVALS", {"quick": quick, "gone": missing})
    return calls


def test_the_kernel_beside_rivals(asked: Asked) -> None:
    """The first run compiles and does not count; the other five took 2 to 6 seconds: 3 to 1 million a second, median 1.5."""
    told: list[tuple[int, int]] = []
    found = speed(Job(sessions=10, seed=7, progress=lambda *both: told.append(both)), {})
    by_learner = [f"kernel {name}" for name in (*LEARNERS, "q epsilon-greedy")]
    assert [one["name"] for one in found.rows] == ["kernel", "kernel gated", *by_learner, "quick"]
    kernel, gated, *_, quick = found.rows
    assert (quick["value"], quick["ci95"]) == (1.5, [1.0, 3.0])
    for one in (kernel, gated):
        assert 0 < one["ci95"][0] <= one["value"] <= one["ci95"][1]
    for one in found.rows:
        assert (one["world"], one["thesis"], one["within"]) == ("world-1", None, None)
    assert len({one["measure"] for one in found.rows}) == 1
    ratio = {"kernel to the fastest rival": pytest.approx(kernel["value"] / 1.5, abs=0.01), "kernel to C lanes": None}
    assert found.summary == {"cells": 0, "within": 0} | ratio  # nothing of this is printed
    assert found.notes[-1] == "gone: not measured: no such processor"
    place = world("world-1")
    assert asked == [(place.mdp().signature, place.learner, 10, 7)] * (1 + REPEATS)
    assert told == [(0, 2), (1, 2), (2, 2)]


def test_slow_rivals_learn_few_sessions(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FEW", {"quick": 3})
    monkeypatch.setattr(module, "REPEATS", 1)
    speed(Job(sessions=10), {})
    assert {call[2] for call in asked} == {3}
    assert {*FEW} <= {*RIVALS}
    assert max(FEW.values()) < SESSIONS


def test_the_kernel_beside_c_lanes(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both rivals are the same one: it slows down, so that the second is slower."""
    quick = vars(module)["RIVALS"]["quick"]
    monkeypatch.setattr(module, "RIVALS", {"first": quick, C_LANES: quick})
    found = speed(Job(sessions=10), {})
    kernel, *_, first, lanes = (one["value"] for one in found.rows)
    assert first > lanes
    assert found.summary["kernel to the fastest rival"] == pytest.approx(kernel / first, abs=0.01)
    assert found.summary["kernel to C lanes"] == pytest.approx(kernel / lanes, abs=0.01)


def test_without_any_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "RIVALS", {})
    monkeypatch.setattr(module, "REPEATS", 1)
    found = speed(Job(sessions=10), {})
    assert [one["name"] for one in found.rows][:2] == ["kernel", "kernel gated"]
    assert found.summary == {"cells": 0, "within": 0, "kernel to the fastest rival": None, "kernel to C lanes": None}
    assert "not measured" not in "".join(found.notes)
