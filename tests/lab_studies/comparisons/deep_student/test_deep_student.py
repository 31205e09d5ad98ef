"""The study of the deep student: its rows, what is kept, and equal results for equal seeds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.splitmix import stream
from lab.learning.updates import UPDATES
from lab.studies import carried_out, checked
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench.problems import Benched
from lab_studies.comparisons.deep_student import deep_student as study
from lab_studies.comparisons.deep_student.deep_student import NOBODY, Outcome, Setting, rows_of
from lab_studies.comparisons.deep_student.dqn import Sight, seeing
from lab_studies.comparisons.deep_student.places import LEARNER, POLE_STEPS, Place, PoleEnvironment, place


def test_the_rows_of_a_rule_by_hand() -> None:
    alone = Outcome(np.array([[0.0, 50.0], [50.0, 100.0]]), np.array([[0.0, 100.0], [0.0, 50.0]]), np.zeros(2))
    advised = Outcome(np.full((2, 2), 90.0), np.full((2, 2), 80.0), np.array([4.0, 6.0]))
    outcomes = {Setting("empty"): alone, Setting("empty", "expert", "early"): advised}
    values = {row["measure"]: row["value"] for row in rows_of(Setting("empty", "expert", "early"), outcomes)}
    assert values == {
        "points": 90.0,
        "greedy_points": 80.0,
        "greedy_last": 80.0,
        "answers": 5.0,
        "gain_points": 40.0,  # nobody: 25 and 75
        "greedy_gain": 42.5,  # nobody: 50 and 25
    }


def test_a_rule_that_is_measured_is_a_gate_of_the_bench() -> None:
    assert {gate.gate for gate in study.RULES.values()} == {
        *("always", "ccrl", "ia", "importance", "fading", "advice-reuse", "earned-trust")
    }


# ---- with PyTorch ---------------------------------------------------------------------------------------------------


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Place:
    """The empty room with sessions of ten episodes."""
    pytest.importorskip("torch")
    here = place("empty")
    learner = replace(here.benched.learner, episodes=10, max_steps=40)
    short = replace(here, benched=replace(here.benched, learner=learner))
    monkeypatch.setattr(study, "place", lambda name: short)
    return short


def test_the_same_seed_gives_the_same_session(short: Place) -> None:
    setting = Setting("empty", "expert", "fading")
    first, again, other = (study.session_outcome(setting, seed) for seed in (5, 5, 6))
    assert first[0].tolist() == again[0].tolist() != other[0].tolist()
    assert first[1:] == again[1:]


def test_an_expert_who_is_always_asked_leads_it_to_the_goal(short: Place) -> None:
    points, greedy, answers = study.session_outcome(Setting("empty", "expert", "always"), 0)
    assert (points[0], len(greedy)) == (100.0, 1)
    assert 70 <= answers <= 100  # ten paths of seven moves, with a slip in a hundred


def test_each_gate_of_the_study_runs(short: Place) -> None:
    for rule in study.RULES:
        assert study.session_outcome(Setting("empty", "limited", rule), 1)[0].shape == (10,)


def test_a_pole_is_learned_from_in_the_same_session() -> None:
    pytest.importorskip("torch")
    world = PoleEnvironment()
    learner = LearnerSettings(LEARNER, episodes=2, max_steps=POLE_STEPS, selection="epsilon-greedy")
    sight = Sight(4, world.now, world.left)
    here = Place(Benched("cart-pole", world.mdp, learner, np.zeros((0, 2))), world, sight, 1.0, 1.0)
    UPDATES.use(LEARNER, seeing(sight))
    session = Session(world, learner, GateSettings("never"), None, stream(0))
    result = session.run()
    moves = POLE_STEPS + 2 - result.steps
    assert result.visits.sum() == moves.sum()
    assert here.points(result.steps) == pytest.approx(100.0 * (moves - 1) / POLE_STEPS)
    assert 0.0 < study.greedy_points(here, session, 0) < 100.0


def test_the_study_has_every_rule_and_takes_up_what_is_kept(
    short: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "PLACES", ("empty",))
    monkeypatch.setattr(study, "BY_ADVISOR", ("expert", "contrary"))
    monkeypatch.setattr(study, "RULES", {rule: study.RULES[rule] for rule in ("early", "ccrl")})
    monkeypatch.setattr(study, "SHOWN", (NOBODY, "ccrl"))
    job = Job(sessions=2, folder=tmp_path)
    document = carried_out(checked("deep-student", job, {}), "deep-student", job, tmp_path)
    assert {(row["advisor"], row["rule"]) for row in document["rows"]} == {
        (NOBODY, NOBODY),
        *((advisor, rule) for advisor in ("expert", "contrary") for rule in ("early", "ccrl")),
    }
    monkeypatch.setattr(study, "session_outcome", None)  # nothing is measured again
    assert carried_out(checked("deep-student", job, {}), "deep-student", job, tmp_path)["rows"] == document["rows"]
