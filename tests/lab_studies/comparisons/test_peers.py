"""The study of peers: what is watched, what a gain is, and that every company has the same seeds."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lab.mdp import grid
from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import peers as study
from lab_studies.comparisons.peers import (
    ALONE,
    NEVER,
    PEERS,
    TOGETHER,
    UNJUDGED,
    WRONG,
    Outcome,
    Setting,
    Watch,
    in_short,
    outcome,
    rows_of,
)


def peer(moves: int, steps: int, q: list[list[float]]) -> Any:
    settings = SimpleNamespace(count_start=False)
    return SimpleNamespace(moves=moves, session=SimpleNamespace(steps=[steps], q=q, settings=settings, max_moves=8))


def test_a_watch_sees_the_greedy_path_and_the_walked_one() -> None:
    watch = Watch(grid((3,), np.zeros(3, bool), (0,), (2,)), fewest=2, most=8, most_moves=20)
    lost, found = [[1.0, 0.0]] * 3, [[0.0, 1.0]] * 3
    watch.look(peer(8, 9, lost))  # it failed
    watch.look(peer(12, 4, found))
    watch.look(peer(24, 2, found))
    assert (watch.moves, watch.greedy, watch.walked) == ([8, 12, 24], [0.0, 100.0, 100.0], [0.0, 50.0, 100.0])
    assert watch.first(100.0) == (2, 12)
    assert watch.first(101.0) == (3, 20)  # never: all that count
    assert watch.mean_points(watch.walked) == (4 * 50.0 + 8 * 100.0) / 20


def values(moves: float, points: float) -> np.ndarray:
    """Two sessions, of which peer 4 would change the mean."""
    one = Outcome(*[np.array([moves, moves + 2.0])] * 4, *[np.array([points, points])] * 2, *[np.array([0.0, 1.0])] * 2)
    table = np.repeat(np.array(one).T[:, None, :], PEERS, axis=1)
    table[:, PEERS - 1] *= 2.0
    return table


def test_a_gain_is_paired_and_positive_if_the_company_is_better() -> None:
    alone, wrong = Setting("insert", NEVER, ALONE), Setting("insert", "ccrl", WRONG)
    both = {alone: values(10.0, 50.0), wrong: values(7.0, 60.0)}
    rows = {row["measure"]: row for row in rows_of(wrong, both)}
    assert (rows["solved_moves"]["value"], rows["solved_moves"]["learners"]) == (8.0, 3)
    assert (rows["gain_solved_moves"]["value"], rows["gain_solved_moves"]["ci95"]) == (3.0, [3.0, 3.0])
    assert rows["gain_greedy_points"]["value"] == 10.0
    assert "gain_solved_moves" not in {row["measure"] for row in rows_of(alone, both)}
    assert rows_of(alone, both)[3]["value"] == 11.0 * 5 / 4  # of all four


def test_it_runs_and_the_wrong_peer_harms_if_nobody_judges(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "PROBLEMS", {"insert": 2_000})
    monkeypatch.setattr(study, "FIRST_EPISODES", {"early": 10})
    findings = study.peers(Job(sessions=2), {})
    assert {row["company"] for row in findings.rows} == {ALONE, TOGETHER, WRONG, UNJUDGED}
    assert in_short(findings.rows) == findings.summary
    helped = [
        row["value"]
        for company in (WRONG, UNJUDGED)
        for row in those(findings.rows, company=company, measure="helped_steps")
    ]
    assert helped[1] > 2 * helped[0]
    assert all(picture.lstrip().startswith(b"<?xml") for picture in findings.figures.values())


def test_all_companies_have_the_same_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "PROBLEMS", {"insert": 300})
    alone = outcome(Setting("insert", NEVER, ALONE), sessions=1, seed=0)
    with_others = outcome(Setting("insert", "ccrl", TOGETHER), sessions=1, seed=0)  # before its first question
    assert np.array_equal(alone, with_others)
    assert alone.shape == (1, PEERS, len(Outcome._fields))
