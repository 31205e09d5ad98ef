"""The speed study: the kernel beside rivals that took a known time. What the kernel itself takes is not judged here."""

import warnings
from typing import Any

import pytest

from lab.learning.gates import GATES
from lab.learning.gates.gate import Introspection
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP
from lab.studies.runner import Job
from lab.testing import check_gate
from lab_studies.comparisons import learning_speed as module
from lab_studies.comparisons.learning_speed import FEW, LEARNERS, REPEATS, SESSIONS, OwnGate, OwnRule, speed
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


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """No learner beside every gate, which takes minutes."""
    monkeypatch.setattr(module, "BESIDE", {})
    monkeypatch.setattr(module, "OWN", {})


def test_every_learner_beside_every_gate(asked: Asked, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not compiled is named a session and runs few of them: there several learners do not fit side by side."""
    monkeypatch.setattr(module, "RIVALS", {})
    monkeypatch.setattr(module, "REPEATS", 1)
    monkeypatch.setattr(module, "UNCOMPILED", 1)
    monkeypatch.setattr(module, "LEARNERS", ("q", "dyna-q"))
    monkeypatch.setattr(module, "BESIDE", {"uncertainty": GateSettings("uncertainty", ensemble=2)})
    monkeypatch.setattr(module, "OWN", {"own gate": OwnGate})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rows = speed(Job(sessions=10), {}).rows
    uncertainty = ["kernel q uncertainty", "session dyna-q uncertainty"]
    own = ["session q own gate", "session dyna-q own gate"]
    assert [one["name"] for one in rows][5:] == [uncertainty[0], own[0], uncertainty[1], own[1]]
    assert all(one["value"] > 0 for one in rows)


def test_the_rules_are_those_of_ia() -> None:
    assert GATES[GATES.use("own rule", OwnRule)].compiled is not None
    assert GATES[GATES.use("own gate", OwnGate)].compiled is None
    for gate in (OwnRule, OwnGate):
        check_gate(gate)
    for values, width in (((0.0, 0.5), 0.5), ((0.0, 2.0), 2.0)):
        own, ia = (kind(GateSettings(), 9, 9) for kind in (OwnRule, Introspection))
        assert own.asks(0, values) == ia.asks(0, values) == (width <= GateSettings.psi)


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
