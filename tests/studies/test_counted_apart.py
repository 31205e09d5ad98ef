"""Agreement counted apart: tiny tables by hand."""

from itertools import permutations, product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.studies.findings import counts, in_short, marked, middle, ordered, ranked, share_within


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
