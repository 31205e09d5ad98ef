"""The lab against the oracle: drawn cells of which it proves something of every plan (`python lab-dev proofs` draws of all)."""

from itertools import count, islice

import pytest
from against_oracle.beaten import BEATEN, classes
from against_oracle.compared import cell_of, compared
from against_oracle.cycles import fits, judged, periods
from against_oracle.drawn import FEATURES, as_toml, drawn, features, smaller

from lab.sequencing.cell.cell import EVERY_PLAN

SEED = 1
CELLS = 30
QUICK = (
    number
    for number in count()
    if cell_of(raw := drawn(SEED, number)).proven_of == EVERY_PLAN and len(raw["order"]) < 4
)
NUMBERS = [*islice(QUICK, CELLS)]
SMALL = (number for number in count() if fits(raw := drawn(SEED, number)) and len(raw["stations"]) < 6)
CYCLIC = [*islice(SMALL, 10)]


@pytest.mark.parametrize("number", NUMBERS)
def test_proofs_bounds_and_plans_hold(number: int) -> None:
    found = compared(drawn(SEED, number), ("fifo", "nearest-ready"))
    assert found.wrong == ()


def test_where_the_lab_proves_less_a_class_says_why() -> None:
    for number in range(200):
        raw = drawn(SEED, number)
        assert cell_of(raw).proven_of == EVERY_PLAN or classes(raw)


@pytest.mark.parametrize("number", CYCLIC)
def test_periods_of_one_to_three_parts_a_cycle_hold(number: int) -> None:
    """The shortest period of as many parts, and the least time a part of all of them."""
    assert judged(periods(drawn(SEED, number))) == []


def test_every_kind_of_cell_is_drawn() -> None:
    seen = {name for number in range(400) for name in features(drawn(SEED, number))}
    assert seen == set(FEATURES)


def test_a_cell_is_drawn_alike_again() -> None:
    assert as_toml(drawn(7, 3)) == as_toml(drawn(7, 3)) != as_toml(drawn(7, 4))


@pytest.mark.parametrize("name", BEATEN)
def test_each_class_that_is_left_is_drawn(name: str) -> None:
    assert any(name in classes(drawn(SEED, number)) for number in range(100))


def test_smaller_cells_have_less() -> None:
    raw = next(one for one in (drawn(SEED, number) for number in count()) if len(features(one)) > 3)
    for other in smaller(raw):
        assert len(other["order"]) < len(raw["order"]) or len(features(other)) < len(features(raw))
