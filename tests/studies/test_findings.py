"""What a study comes to: rows by hand, and how many of them agree with print."""

from itertools import permutations, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.statistics import interval, proportion_interval, within
from lab.studies.findings import (
    agreement,
    counts,
    in_short,
    marked,
    mean_row,
    median_row,
    middle,
    ordered,
    ranked,
    row,
    share_row,
    share_within,
    those,
    varying_row,
)


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


# ---- counted apart ----------------------------------------------------------------------------------------------------


def printed(thesis: float | None, measure: str = "score", **more: Any) -> dict[str, Any]:
    return {"measure": measure, "value": 1.0, "thesis": thesis, "within": None if thesis is None else True, **more}


def test_what_nearly_anything_would_hit() -> None:
    """15 % of 1 is .15: two of the other three lie there; of .9 they are .765 to 1.035; of .5 and .2 none does."""
    rows = [printed(1.0), printed(0.9), printed(0.95), printed(0.2), printed(None)]
    assert [one.get("easy") for one in marked(rows)] == [True, True, True, False, None]
    assert marked([printed(5.0)])[0]["easy"] is False  # nothing beside it
    assert [one["easy"] for one in marked([printed(1.0), printed(1.0), printed(9.0)])] == [
        False
    ] * 3  # half is not more


def test_tables_and_measures_are_apart() -> None:
    """600 s and 610 s are near, but not of one cell; 97 % and 99 % are within 5 points."""
    times = [printed(600, "BR_s", toasts=3), printed(610, "BR_s", toasts=4)]
    assert [one["easy"] for one in marked(times)] == [False, False]
    same = [{**one, "toasts": 3} for one in times]
    assert [one["easy"] for one in marked([*same, printed(97, "SP_percent", toasts=3)])] == [True, True, False]
    assert [one["easy"] for one in marked([printed(97, "SP_percent"), printed(99, "SP_percent")])] == [True, True]


def test_a_headline_by_hand() -> None:
    told = [
        {"used": True, "easy": False, "within": True, "within_errors": True},
        {"used": True, "easy": False, "within": True, "within_errors": False},
        {"used": False, "easy": False, "within": False, "within_errors": False},
        {"used": False, "easy": False, "within": True},  # the thesis does not say how many sessions
        {"used": False, "easy": True, "within": True, "within_errors": True},
        {"within": True},  # not told: of another study
    ]
    assert in_short(told) == {
        "headline": "not used: 1 of 2 agree; used to choose: 2 of 2 agree",
        "within both sampling errors": "not used: 0 of 1 agree; used to choose: 1 of 2 agree",
        "easy, left out of both": "1 of 1 agree",
    }
    assert {name: len(of) for name, of in counts(told).items()} == {"not used": 2, "used to choose": 2, "easy": 1}
    assert in_short(told[-1:]) == counts(told[-1:]) == {}
    assert in_short(told[4:5])["headline"] == "all cells are easy"
    assert share_within([]) == "0 of 0 agree"


def test_ranks_as_numbers() -> None:
    assert [middle(rank) for rank in ("2", "1-2", "1,3", "1-3")] == [2, 1.5, 2, 2]


def test_pairs_by_hand() -> None:
    """Three in the printed order: one of six orders has all three pairs. Of two groups one of 36. Ties are no pairs."""
    right = [(0.9, "1"), (0.8, "2"), (0.7, "3")]
    assert ordered([right]) == pytest.approx((3, 3, 1 / 6))
    assert ordered([right, right]) == pytest.approx((6, 6, 1 / 36))
    assert ordered([[(0.7, "1"), (0.8, "2"), (0.9, "3")]]) == pytest.approx((0, 3, 1))
    assert ordered([[(0.7, "1"), (0.8, "1"), (0.9, "1")]]) == (0, 0, 1)
    tied = [(0.9, "1"), (0.8, "2-3"), (0.7, "2-3")]  # the best is best in one of three orders
    assert ordered([tied]) == pytest.approx((2, 2, 1 / 3))


@given(st.lists(st.lists(st.sampled_from(["1", "1-2", "2", "3"]), min_size=2, max_size=3), min_size=1, max_size=3))
def test_chance_is_what_all_orders_give(ranks: list[list[str]]) -> None:
    """Every order of every group counted one by one."""
    ours = [[(float(-n), rank) for n, rank in enumerate(group)] for group in ranks]
    right, pairs, p = ordered(ours)
    every = [
        ordered([list(zip(values, group, strict=True)) for values, group in zip(chosen, ranks, strict=True)])[0]
        for chosen in product(*(permutations([value for value, _ in group]) for group in ours))
    ]
    assert p == pytest.approx(sum(one >= right for one in every) / len(every))
    assert sum(every) / len(every) == pytest.approx(pairs / 2)  # half of the pairs by chance


def test_ranks_beside_chance() -> None:
    """Shuffled, "1", "2", "3" meet the same three once on average; two advisors are two groups: 13 of 36 ways."""
    rows = [
        printed(0.5, value=value, rank=rank, thesis_rank=theirs, tau=tau)
        for tau in (0.01, 1.0)
        for value, rank, theirs in ((0.9, "1", "1"), (0.8, "2", "3"), (0.7, "3", "2"))
    ]
    assert ranked(rows) == {
        "ranks": 6,
        "ranks as printed": 2,
        "ranks as printed by chance": 2.0,
        "pairs in the printed order": "4 of 6 (3 by chance, p = 0.36)",
    }
