"""The families: small cells to learn from, larger ones to be tried on, the same ones again."""

from collections.abc import Sequence

import pytest

from lab.sequencing.cell.cell import Cell
from lab_studies.comparisons.carried_over_families import (
    BILGE_ULUSOY,
    FMS,
    MORE_JOBS,
    ORDERS,
    SHOP,
    SMALL,
    THESIS_TOASTS,
    TOAST,
    larger_cell,
    larger_cells,
    small_cells,
)

LEAST_MOST = {SHOP: (3, 5), TOAST: (3, 8), FMS: (3, 8)}


def told(cells: Sequence[Cell]) -> list[tuple[object, ...]]:
    return [(cell.stations, cell.products, cell.order, cell.loaded_s.tobytes(), cell.arrivals) for cell in cells]


@pytest.mark.parametrize("family", [*SMALL])
def test_the_small_ones_are_small_and_drawn_by_the_seed(family: str) -> None:
    cells = small_cells(family, 12, 3)
    least, most = LEAST_MOST[family]
    assert all(least <= cell.parts <= most and cell.due_s is None for cell in cells)
    assert len(set(told(cells))) > 6
    assert told(cells) == told(small_cells(family, 12, 3)) != told(small_cells(family, 12, 4))


def test_of_all_families_in_turn() -> None:
    stations = [len(cell.stations) for cell in small_cells("all families", 6, 0)]
    assert stations == [5, 6, 11] * 2


def test_the_larger_ones_are_larger() -> None:
    of = {
        group: [one for one in larger_cells() if one.group == group]
        for group in dict.fromkeys(o.group for o in larger_cells())
    }
    assert [len(group) for group in of.values()] == [40, 12, 15, 20, 10]
    assert [larger_cell(one).parts for one in of[THESIS_TOASTS]] == [20, 30, 40, 50, 60] * 3
    assert [larger_cell(one).parts for one in of[ORDERS]] == [*range(12, 32, 2)]
    assert all(10 <= larger_cell(one).parts <= 20 for one in of[MORE_JOBS])
    assert [one.printed for one in of[BILGE_ULUSOY]][:3] == [96.0, 100.0, 99.0]
    assert all(len(larger_cell(one).robots) == 2 for one in of[BILGE_ULUSOY])
