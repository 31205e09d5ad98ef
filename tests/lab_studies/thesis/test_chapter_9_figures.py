"""The figures of chapter 9: every cell that is asked for, and what stands in the pictures."""

import json
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.studies.findings import JUDGED, row, those
from lab.studies.runner import Job
from lab_studies.thesis import chapter_9_figures as figures
from lab_studies.thesis.chapter_9_cells import TABLES, appendix
from lab_studies.thesis.chapter_9_figures import NEVER_REJECTS, beta_picture, convergence, walk_rows
from lab_studies.thesis.chapter_9_sessions import world

JOB = Job(sessions=10)
STEPS = [201] * 20 + [40, 30, 60, 20] * 5 + [13] * 20
GUIDED = [False] * 25 + [True] * 5 + [False] * 30


def test_cells_of_the_figures() -> None:
    """Each figure varies one or two settings, and where the appendix has the cell, it is the same one."""
    rows, pictures = figures.figures(JOB, {})
    assert len(pictures) == 3 + 2 * len(figures.figure_series())
    walked, cells = rows[:16], rows[16:]
    assert [one["tau"] for one in walked if one["measure"] == "SP_percent"] == [0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1]
    assert [one["thesis"] for one in walked if one["thesis"]] == [100.0, 13.0, 178.0]
    assert {one["advisor"] for one in walked} == {"alone"}

    def settings(place: str, view: str, gate: str, **more: Any) -> list[dict[str, Any]]:
        return those(cells, world=place, view=view, gate=gate, measure="HS_steps", **more)

    for omega in (NEVER_REJECTS, 7):  # fig. 9.7
        by_lambda = settings("world-2", "limited", "ccrl", omega=omega)
        assert [one["lambda_threshold"] for one in by_lambda] == [0.01, 0.05, 0.1, 0.3, 0.5, 0.9]
        assert {one["tau"] for one in by_lambda} == {0.01}
    for omega in (NEVER_REJECTS, 1, 3, 5, 7):  # figs. 9.8 to 9.10; omega 1 is in both
        by_skill = [one["tau"] for one in settings("world-1", "limited", "ccrl", omega=omega)]
        assert sorted(by_skill) == sorted([0.01, 0.1, 0.3, 1.0] * (2 if omega == 1 else 1))
    by_psi = settings("world-2", "limited", "ia")  # figs. 9.11 and 9.12
    assert sorted((one["psi"], one["tau"]) for one in by_psi) == [
        *((0.1, 0.01), (0.3, 0.01), (0.7, 0.01), (1.0, 0.01), (1.0, 0.01)),
        *((1.0, 0.1), (1.0, 0.3), (1.0, 1.0), (1.3, 0.01)),
    ]
    both = settings("world-2", "limited", "combined")
    assert [(one["lambda_threshold"], one["omega"], one["psi"], one["tau"]) for one in both] == [
        (0.05, 5, 1.0, tau) for tau in (0.01, 0.1, 0.3, 1.0)
    ]

    printed = {_named(one): one["value"] for one in appendix(JOB, [TABLES["table-9.5"]], {}) if one["tau"] != "all"}
    again = [one for one in cells if _named(one) in printed]
    assert len(again) > 20
    assert all(one["value"] == printed[_named(one)] for one in again)


def _named(one: dict[str, Any]) -> str:
    results = ("value", "ci95", "thesis", *JUDGED, "table")
    return json.dumps({name: value for name, value in one.items() if name not in results}, sort_keys=True)


def test_an_advisor_alone() -> None:
    """Who knows the exact values and is an expert takes the shortest way, in 13 steps; a novice seldom arrives."""
    rows = walk_rows({"advisor_table": "exact"})
    shares, means = ([one["value"] for one in those(rows, measure=m)] for m in ("SP_percent", "mean_steps"))
    assert shares[0] > 99 > 1 > shares[-1]
    assert means[0] == pytest.approx(13, abs=0.1)
    assert means[-1] > 150
    assert np.all(np.diff(shares) <= 0)
    assert world("world-1").learner.max_steps == 200


def texts(picture: bytes) -> list[str]:
    """What stands in an SVG picture."""
    return [text.strip() for text in ElementTree.fromstring(picture).itertext() if text.strip()]


def test_what_is_written() -> None:
    rows = [
        row({"world": "world-1", "beta": beta}, "SP_percent", value, (value - 9, value + 9))
        for beta, value in ((0.5, 20), (1.3, 62))
    ]
    rows.append(row({"world": "world-2", "beta": 0.7}, "SP_percent", 37, (28, 47)))
    assert {"world-1", "world-2", "printed"} <= {*texts(beta_picture(rows))}
    written = {*texts(convergence(STEPS, GUIDED, 13, 0.05))}
    assert {"guided episodes", "fewest possible: 13", "asks below Λ = 0.05"} <= written


def test_the_rate_is_the_one_that_the_learner_knows() -> None:
    """K = 1: the rate before episode 3 is 1 - 5/10, before episode 4 is 1 - 20/5 = -3, below the plot's edge."""
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    figures.draw_rate(axes, [10, 5, 20, 1], 1, None)
    rate, cut = axes.get_lines()[:2]
    assert np.asarray(rate.get_xydata()).tolist() == [[3, 0.5], [4, -3]]
    assert np.asarray(cut.get_xydata()).tolist() == [[4, figures.LOWEST_RATE]]


@settings(max_examples=4)
@given(steps=st.lists(st.integers(1, 201), min_size=1, max_size=30), data=st.data())
def test_any_session(steps: list[int], data: st.DataObject) -> None:
    guided = data.draw(st.lists(st.booleans(), min_size=len(steps), max_size=len(steps)))
    assert convergence(steps, guided, 1).startswith(b"<?xml")


@pytest.mark.parametrize(
    ("steps", "guided", "says"), [([], [], "0 episodes, 0 marks"), ([5, 5], [True], "2 episodes, 1 marks")]
)
def test_a_session_that_does_not_fit(steps: list[int], guided: list[bool], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        convergence(steps, guided, 5)
