"""What a study comes to: rows by hand, and how many of them agree with print."""

from typing import Any

import numpy as np

from lab.statistics import interval, proportion_interval, within
from lab.studies.findings import agreement, mean_row, median_row, row, share_row, those, varying_row


def test_a_row_says_whether_it_agrees() -> None:
    """68 is 5 points from 63, 69 is 6; the interval may hold it all the same."""
    assert row({"tau": 1}, "SP_percent", 68, (66, 70), 63) == {
        "tau": 1,
        "measure": "SP_percent",
        "value": 68.0,
        "ci95": [66.0, 70.0],
        "thesis": 63,
        "within": True,
    }
    assert [row({}, "SP_percent", 69, ci, 63)["within"] for ci in ((66, 72), (62, 76), None)] == [False, True, False]
    nothing = row({}, "ANOVA_p", np.float64(0.5), None, None)
    assert (nothing["value"], type(nothing["value"]), nothing["ci95"], nothing["within"]) == (0.5, float, None, None)
    assert within(69, (62, 76), 63, "SP_percent")


def made_up(measure: str, inside: bool | None, **more: Any) -> dict[str, Any]:
    return {"measure": measure, "value": 1.0, "within": inside, **more}


def test_agreement_counts() -> None:
    rows = [
        made_up("SP_percent", True),
        made_up("SP_percent", False),
        made_up("SP_percent", None),
        made_up("HS_steps", True, rank="1", thesis_rank="1"),  # a rank counts once, with the score
        made_up("score", True, rank="1", thesis_rank="1"),
        made_up("score", False, rank="2", thesis_rank="1-2", value=0.5),
        made_up("score", True, rank="1", thesis_rank=None),
        made_up("score", False, rank="1-2", thesis_rank="1-2"),
        made_up("AR_requests", None),
    ]
    assert agreement(rows) == {
        "cells": 7,
        "within": 4,
        "SP_percent cells": 2,
        "SP_percent within": 1,
        "HS_steps cells": 1,
        "HS_steps within": 1,
        "score cells": 4,
        "score within": 2,
        "ranks": 3,
        "ranks as printed": 2,
        "ranks as printed by chance": 1.0,
        "pairs in the printed order": "1 of 2 (1 by chance, p = 0.67)",
    }
    assert agreement([]) == {"cells": 0, "within": 0}


def test_rows_of_sessions_by_hand() -> None:
    """Three of four succeed; 1, 2 and 3 have the mean and the median 2, whose interval is the lowest and the highest."""
    share, mean = share_row({}, "SP_percent", [True, True, False, True]), mean_row({}, "HS_steps", [1, 2, 3], 2.0)
    assert (share["value"], *share["ci95"]) == proportion_interval(3, 4)
    assert (mean["value"], *mean["ci95"], mean["within"]) == (*interval([1, 2, 3]), True)
    assert median_row({}, "wall_s", [1.0, 3.0, 2.0])["ci95"] == [1.0, 3.0]
    assert varying_row({}, "HS_steps", [1, 2, 3])["ci95"] == mean["ci95"]
    assert [varying_row({}, "HS_steps", [7, 7])[name] for name in ("value", "ci95")] == [7.0, None]


def test_both_sampling_errors() -> None:
    """Of 100 sessions half: 5 points, with the added ones 4.90; with as many of the thesis 1.96 * 6.93 is 13.6 points."""
    half = [True, False] * 50
    for thesis, agrees in ((63, True), (64, False)):
        one = share_row({}, "SP_percent", half, thesis, 100)
        assert one["within_errors"] is agrees
    """1 and 3 in turn spread by 1.01, of 100 that is .1005; of the thesis's 25 .201: 1.96 * .2247 is .440."""
    steps = [1, 3] * 50
    assert [mean_row({}, "HS_steps", steps, thesis, 25)["within_errors"] for thesis in (2.43, 2.45)] == [True, False]
    assert "within_errors" not in mean_row({}, "HS_steps", steps, None, 25)
    assert "within_errors" not in share_row({}, "SP_percent", half, 50)


def test_those_rows() -> None:
    rows: list[dict[str, Any]] = [{"a": 1, "b": 2}, {"a": 1}, {"b": 2}]
    assert those(rows, a=1) == rows[:2]
    assert those(rows, a=None) == rows[2:]
    assert those(rows, a=1, b=None) == [rows[1]]
