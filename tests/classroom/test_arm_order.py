"""The order of arms: what the design promises of every block of participants."""

from collections import Counter
from itertools import pairwise, permutations

import pytest

from lab.classroom.arm_order import arms_at, rows_of, williams_rows

ARMS = ("a", "b", "c", "d")


def test_the_rows_of_two_and_three_arms_by_hand() -> None:
    assert williams_rows(1) == [(0,)]
    assert williams_rows(2) == [(0, 1), (1, 0)]
    assert sorted(williams_rows(3)) == sorted(permutations(range(3)))


@pytest.mark.parametrize("n", range(2, 13))
def test_every_arm_stands_equally_often_in_each_place_and_after_each_other(n: int) -> None:
    rows = williams_rows(n)
    squares = len(rows) // n
    assert squares == (1 if n % 2 == 0 else 2)
    places = Counter((place, arm) for row in rows for place, arm in enumerate(row))
    after = Counter(pair for row in rows for pair in pairwise(row))
    assert {*places.values()} == {squares}
    assert len(places) == n * n
    assert {*after.values()} == {squares}
    assert len(after) == n * (n - 1)


@pytest.mark.parametrize("design", ["latin-square", "between"])
def test_each_block_of_participants_has_every_row_once(design: str) -> None:
    rows = sorted(tuple(ARMS[arm] for arm in row) for row in rows_of(design, 4))  # type: ignore[arg-type]
    for block in range(3):
        met = [arms_at(design, ARMS, 4 * block + k, 7) for k in range(4)]  # type: ignore[arg-type]
        assert sorted(met) == rows


def test_a_drawn_order_depends_on_seed_and_position_alone() -> None:
    drawn = [arms_at("draw", ARMS, position, 7) for position in range(20)]
    assert drawn == [arms_at("draw", ARMS, position, 7) for position in range(20)]
    assert drawn != [arms_at("draw", ARMS, position, 8) for position in range(20)]
    assert {tuple(sorted(order)) for order in drawn} == {ARMS}
    assert len({*drawn}) > 10
