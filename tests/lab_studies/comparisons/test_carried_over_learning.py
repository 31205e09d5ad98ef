"""A policy is learned: the same from the same seed, better than the best rule, and of what has an effect alone."""

from collections.abc import Callable

import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over import Decider
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rules import dispatch, usable
from lab.sequencing.simulate.run import Run
from lab_studies.comparisons.carried_over_learning import CarriedLearning, learn_policy

CellMaker = Callable[..., Cell]
SHORT = CarriedLearning(generations=24, population=10, batch=6)


def small(toast_cell: CellMaker) -> list[Cell]:
    return [toast_cell(case, parts) for case in ("I", "II", "III") for parts in (3, 4)]


@pytest.mark.parametrize("seed", range(3))
def test_learned_on_three_and_four_toasts_it_orders_thirty(toast_cell: CellMaker, seed: int) -> None:
    """The best rule, nearest-ready, is 11 % above the optimum on average; the policy at most a third of that."""
    policy = learn_policy(small(toast_cell), settings=SHORT, seed=seed)
    own, rule = 0.0, 0.0
    for case in ("I", "II", "III"):
        cell = toast_cell(case, 30)
        least, run = optimum(cell).bound_s, Run(cell)
        dispatch(run, usable(cell)["nearest-ready"])
        own += float(Decider(cell).costs(policy.vector[None])[0]) / least - 1.0
        rule += run.end_s / least - 1.0
    assert rule / 3 == pytest.approx(0.0934, abs=0.02)
    assert own < rule / 3


def test_the_seed_decides_and_every_generation_is_heard(toast_cell: CellMaker) -> None:
    cells, heard = small(toast_cell), list[int]()
    one = learn_policy(cells, settings=SHORT, seed=1, learned_on="toast", heard=lambda number, _: heard.append(number))
    assert heard == [*range(1, 25)]
    assert one == learn_policy(cells, settings=SHORT, seed=1, learned_on="toast")
    assert one != learn_policy(cells, settings=SHORT, seed=2, learned_on="toast")
    assert one.learned_on == "toast"


def test_what_makes_no_difference_is_worth_nothing(oven_cell: CellMaker) -> None:
    """One toast after the other, whatever the weights; with due times that count for nothing, no slack either."""
    assert learn_policy([oven_cell(2)], settings=SHORT).weights == {}


def test_what_is_refused(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match=r"^nothing to learn from: no cell$"):
        learn_policy([])
    with pytest.raises(BadInput, match="the cell has no due times"):
        learn_policy([oven_cell(2)], "mean-tardiness")
    with pytest.raises(BadInput, match=r"^generations = 3: allowed are whole numbers from 4$"):
        CarriedLearning(generations=3)
