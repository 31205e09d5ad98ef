"""The lab against the oracle: drawn cells of every kind (`python -m devtools proofs` draws more, and larger ones)."""

from itertools import count, islice

import numpy as np
import pytest
from against_oracle.compared import cell_of, compared
from against_oracle.cycles import fits, judged, periods
from against_oracle.drawn import FEATURES, as_toml, drawn, features, smaller
from against_oracle.translated import plain_cell, plain_plan
from oracle.rules import violations

from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.run import Run

SEED = 1
CELLS = 30
QUICK = (number for number in count() if len(drawn(SEED, number)["order"]) < 4)
NUMBERS = [*islice(QUICK, CELLS)]
SEVERAL = [*islice((number for number in count() if "two robots" in features(drawn(SEED, number))), 40)]
SMALL = (number for number in count() if fits(raw := drawn(SEED, number)) and len(raw["stations"]) < 6)
CYCLIC = [*islice(SMALL, 10)]


@pytest.mark.parametrize("number", NUMBERS)
def test_proofs_bounds_and_plans_hold(number: int) -> None:
    found = compared(drawn(SEED, number), ("fifo", "nearest-ready"))
    assert found.wrong == ()


@pytest.mark.parametrize("number", SEVERAL)
def test_any_order_of_several_robots_keeps_to_all_rules(number: int) -> None:
    """Decisions drawn one after the other: both simulations are alike, and what they say can be carried out as it stands."""
    cell, rng = cell_of(drawn(SEED, number)), np.random.default_rng(number)
    for _ in range(5):
        run, arrays, there = Run(cell), cell_arrays(cell), run_arrays(cell)
        kernels.reset(arrays, there, np.uint64(0))
        while allowed := run.allowed():
            assert there.allowed[: kernels.list_allowed(arrays, there)].tolist() == [*allowed]
            place = int(rng.integers(len(allowed)))
            run.move(allowed[place])
            kernels.move(arrays, there, place, np.uint64(0))
            assert there.ready_s.tolist() == pytest.approx(run.ready_s)
        assert there.clock.tolist() == pytest.approx([run.now_s, run.waited_s, run.processed_s, run.end_s])
        assert not run.done or violations(plain_cell(cell), plain_plan(cell, run.moves)) == []


@pytest.mark.parametrize("number", CYCLIC)
def test_periods_of_one_to_three_parts_a_cycle_hold(number: int) -> None:
    """The shortest period of as many parts, and the least time a part of all of them."""
    assert judged(periods(drawn(SEED, number))) == []


def test_every_kind_of_cell_is_drawn() -> None:
    seen = {name for number in range(400) for name in features(drawn(SEED, number))}
    assert seen == set(FEATURES)


def test_a_cell_is_drawn_alike_again() -> None:
    assert as_toml(drawn(7, 3)) == as_toml(drawn(7, 3)) != as_toml(drawn(7, 4))


def test_smaller_cells_have_less() -> None:
    raw = next(one for one in (drawn(SEED, number) for number in count()) if len(features(one)) > 3)
    for other in smaller(raw):
        assert len(other["order"]) < len(raw["order"]) or len(features(other)) < len(features(raw))
