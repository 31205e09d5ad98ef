"""The study of several advisors: who is asked how, what rows say of sessions, and that chance depends on the setting only."""

import json
from xml.etree import ElementTree

import numpy as np
import pytest

from lab.advice.panel import DECISIONS
from lab.studies.findings import Findings
from lab.studies.runner import Job
from lab_studies.comparisons import several_advisors as study
from lab_studies.comparisons.several_advisors import (
    BEST,
    IN_TURN,
    WAYS,
    WORST,
    PanelOutcome,
    PanelSetting,
    advisors,
    in_short,
    member_names,
    panel_outcome,
    rows_of,
)
from lab_studies.thesis.chapter_9_sessions import AdviceSetting

EXACT = AdviceSetting("world-1", gate="ccrl", advisor_table="exact")
PAIR = ("expert", "wrong")


def counts(*values: int) -> np.ndarray:
    return np.array(values, np.int64)


def test_nobody_and_an_expert_alone() -> None:
    alone = panel_outcome(PanelSetting((), None, EXACT), sessions=3, seed=0)
    assert alone.helped_steps.tolist() == [0, 0, 0]
    expert = panel_outcome(PanelSetting(("expert",), None, EXACT), sessions=3, seed=0)
    assert (expert.helped_steps > 0).all()
    assert (expert.dropped, expert.disagreed.tolist()) == ({}, [0, 0, 0])


def test_two_advisors_disagree_and_one_is_dropped() -> None:
    found = panel_outcome(PanelSetting(PAIR, IN_TURN, EXACT), sessions=2, seed=0)
    assert found.disagreed.tolist() == [0, 0]  # one is asked at a time
    assert found.dropped["wrong"].tolist() == [1, 1]
    together = panel_outcome(PanelSetting(PAIR, "majority", EXACT), sessions=2, seed=0)
    assert (together.disagreed > 0).all()
    for way in DECISIONS:  # between two there is no majority: the more trusted one decides
        again = panel_outcome(PanelSetting(PAIR, way, EXACT), sessions=2, seed=0)
        assert again.helped_steps.tolist() == together.helped_steps.tolist()


def test_chance_depends_on_the_seed_and_the_members() -> None:
    one = [
        panel_outcome(PanelSetting(("novice",), None, EXACT), sessions=2, seed=seed).helped_steps.tolist()
        for seed in (0, 0, 1)
    ]
    assert one[0] == one[1] != one[2]


def test_rows_by_hand() -> None:
    """Two sessions: one succeeds; 10 and 30 helped steps; the second wrong one is dropped in one session, twice."""
    found = PanelOutcome(
        np.array([True, False]),
        counts(10, 30),
        counts(5, 5),
        counts(0, 1),
        {"wrong 2": counts(0, 2), "wrong": counts(0, 0)},
    )
    rows = rows_of(("expert", "wrong", "wrong"), "majority", "", found)
    assert {(one["measure"], one.get("advisor")): one["value"] for one in rows} == {
        ("SP_percent", None): 50.0,
        ("HS_steps", None): 20.0,
        ("dropped", None): 1.0,
        ("readmitted", None): 0.5,
        ("disagreed_steps", None): 5.0,
        ("ever_dropped_percent", "expert"): 0.0,
        ("ever_dropped_percent", "wrong"): 0.0,
        ("ever_dropped_percent", "wrong 2"): 50.0,
    }
    assert (
        rows[0].items() >= {"panel": "expert, wrong, wrong", "way": "majority", "sessions": 2, "thesis": None}.items()
    )
    assert [one["ci95"] for one in rows if one["measure"] == "disagreed_steps"] == [None]
    alone = rows_of(("expert", "wrong", "wrong"), BEST, "expert", found)
    assert [(one["measure"], one["asked"]) for one in alone] == [("SP_percent", "expert"), ("HS_steps", "expert")]


def test_names_in_a_panel() -> None:
    assert member_names(("wrong", "expert", "wrong", "wrong")) == ["wrong", "expert", "wrong 2", "wrong 3"]


@pytest.fixture(scope="module")
def found() -> Findings:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "PANELS", (PAIR, ("expert", "novice")))
        return advisors(Job(sessions=2, seed=0), {"advisor_table": "exact"})


def test_the_study_has_every_row(found: Findings) -> None:
    keys = [tuple(one.get(name) for name in ("panel", "way", "advisor", "measure")) for one in found.rows]
    assert len({*keys}) == len(keys)
    assert {key[:2] for key in keys} == {
        *((panel, way) for panel in ("expert, wrong", "expert, novice") for way in WAYS),
        (None, "nobody"),
    }
    for one in found.rows:
        if one["ci95"] is not None:
            assert one["ci95"][0] <= one["value"] <= one["ci95"][1]
    asked = {(one["panel"], one["way"]): one["asked"] for one in found.rows if "asked" in one}
    assert asked.keys() == {(panel, way) for panel in ("expert, wrong", "expert, novice") for way in (BEST, WORST)}
    for panel, other in (("expert, wrong", "wrong"), ("expert, novice", "novice")):
        assert {asked[panel, BEST], asked[panel, WORST]} == {"expert", other}
    json.dumps(found.rows, allow_nan=False)


def test_the_summary_is_of_the_rows(found: Findings) -> None:
    helped = [one["value"] for one in found.rows if (one["way"], one["measure"]) == ("majority", "HS_steps")]
    assert found.summary["majority: mean HS [steps] of 2 panels"] == pytest.approx(np.mean(helped), abs=0.06)
    assert 0 <= found.summary["in turn: panels within 2 points of their best member"] <= 2


def test_a_panel_behind_its_best_member_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """90 % by majority and 97 % by best-trusted where the best alone has 98 %."""
    monkeypatch.setattr(study, "PANELS", (PAIR,))
    success = {"majority": 90, "best-trusted": 97, "trust-weighted": 96, IN_TURN: 10, BEST: 98, WORST: 0}
    rows, none = [], np.zeros(100, np.int64)
    for way, times in success.items():
        rows += rows_of(PAIR, way, "", PanelOutcome(np.arange(100) < times, none, none, none, {"wrong": none + 1}))
    nothing = PanelOutcome(none > 0, none, none, none, {})
    says = in_short([*rows, *rows_of((), "nobody", "", nothing)])
    behind = {way: says[f"{way}: panels within 2 points of their best member"] for way in (*DECISIONS, IN_TURN)}
    assert behind == {"majority": 0, "best-trusted": 1, "trust-weighted": 1, IN_TURN: 0}
    assert says["nobody: SP [%]"] == 0.0
    assert (says["wrong: sessions that drop it [%]"], says["expert: sessions that drop it [%]"]) == (100.0, 0.0)


def test_pictures(found: Findings) -> None:
    assert len(found.figures) == 2
    for caption, picture in found.figures.items():
        assert ElementTree.fromstring(picture).tag.endswith("svg")
        assert {*WAYS} <= {*ElementTree.fromstring(picture).itertext()}, caption
