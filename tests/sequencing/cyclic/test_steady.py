"""A few periods of a cycle: the same in each."""

from collections.abc import Callable

import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cyclic.cycle import best_cycle
from lab.sequencing.cyclic.unrolled import steady

CellMaker = Callable[..., Cell]


def test_each_period_is_like_the_one_before(hoist_cell: CellMaker) -> None:
    cycle = best_cycle(hoist_cell(), ("carrier",))
    schedule = steady(cycle, 3).schedule

    def within(period: int) -> set[tuple[str, str, float, float]]:
        start_s, end_s = period * 521.0, (period + 1) * 521.0
        return {
            (one.resource, one.kind, one.start_s - start_s, one.end_s - start_s)
            for one in (*schedule.robot, *schedule.machines)
            if start_s < one.start_s and one.end_s < end_s
        }

    assert within(0) == within(1) == within(2)
    assert sum(one.kind == "carry" for one in schedule.robot) == 3 * 13


def test_the_robot_is_never_in_two_places(toast_cell: CellMaker) -> None:
    """Its row leaves no gap: it carries, drives, or waits where it is to pick."""
    row = steady(best_cycle(toast_cell("I", 2), ("toast",)), 2).schedule.robot
    assert [one.start_s for one in row[1:]] == pytest.approx([one.end_s for one in row[:-1]])
    assert (row[0].start_s, row[-1].end_s) == (0.0, 300.0)
    assert [one.origin for one in row[1:]] == [one.target for one in row[:-1]]


def test_parts_are_named_by_their_products(crossing_cell: Callable[[], Cell]) -> None:
    shown = steady(best_cycle(crossing_cell(), ("there", "back")), 2)
    assert {name.split()[0] for name in shown.names.values()} == {"there", "back"}
    assert sorted(shown.names) == [*range(1, len(shown.names) + 1)]


@pytest.mark.parametrize("periods", [0, 21])
def test_too_many_periods(oven_cell: CellMaker, periods: int) -> None:
    with pytest.raises(BadInput, match=f"periods = {periods}: allowed are 1 to 20"):
        steady(best_cycle(oven_cell(), ("toast",)), periods)
