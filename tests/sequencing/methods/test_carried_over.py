"""A policy that carries over, used: as a method, as a rule, and what cannot be one."""

from collections.abc import Callable

import pytest

from lab.errors import WorkFailed
from lab.sequencing import SEQUENCERS, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over import rule_of
from lab.sequencing.methods.carried_over_policy import DEFAULT, CarriedPolicy
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.rules import dispatch, nearest_ready
from lab.sequencing.search import Search
from lab.sequencing.simulate.execution import Observed
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def test_one_weight_is_a_rule_that_everybody_knows(toast_cell: CellMaker) -> None:
    """What begins soonest first, which is `nearest_ready`."""
    cell = toast_cell("I", 4)
    search = Search(1, policy=CarriedPolicy({"delay": -1.0}))
    assert find_sequence(cell, "carried", search, 0).sequence == dispatch(Run(cell), nearest_ready)


def test_the_one_that_ships_is_near_the_optimum(toast_cell: CellMaker, fms_cell: CellMaker) -> None:
    """Without search, in cells that it has not seen; nearest-ready is 19 % above it for 40 toasts in case I."""
    for cell, near in ((toast_cell("I", 40), 0.05), (fms_cell("RSRSRRSR"), 0.1)):
        assert find_sequence(cell, "carried", Search(1), 0).cost <= (1 + near) * optimum(cell).cost


def test_it_reacts_as_it_plans(toast_cell: CellMaker) -> None:
    cell = toast_cell("II", 4)
    reaction = SEQUENCERS["carried"].react(cell, "makespan", 0, ())
    run = Run(cell)
    choose = reaction.policy(cell)
    while allowed := run.allowed():
        run.move(choose(Observed(run), allowed))
    assert run.end_s == find_sequence(cell, "carried", Search(1), 0).cost
    assert (reaction.words, reaction.replans) == ("the carried-over policy, asked at every decision", None)


def test_a_rule_that_meets_another_cell(toast_cell: CellMaker, oven_cell: CellMaker) -> None:
    choose = rule_of(DEFAULT)
    for cell in (toast_cell("I", 3), oven_cell(2), toast_cell("I", 3)):
        run = Run(cell)
        dispatch(run, choose)
        assert run.end_s == find_sequence(cell, "carried", Search(1), 0).cost


def test_a_deadlock_is_told(crossing_cell: CellMaker) -> None:
    """Both parts into the cell at once, and nothing moves any more."""
    search = Search(1, policy=CarriedPolicy({"enters": 1.0}))
    with pytest.raises(WorkFailed, match="no sequence for 2 parts came to its end in 1 episode: deadlocks"):
        find_sequence(crossing_cell(), "carried", search, 0)
