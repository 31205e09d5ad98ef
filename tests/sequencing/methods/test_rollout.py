"""Policies that look ahead: a rule asked anew, and the rest of the work planned anew."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance
from lab.sequencing.cell.objectives import cost
from lab.sequencing.methods.rollout import by_rule, replan, rollout
from lab.sequencing.methods.rules import RULES, dispatch, usable
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run
from lab.sequencing.simulate.several import carry_out, replicate

CellMaker = Callable[..., Cell]
NORMAL, EXPONENTIAL = Chance("normal", "normal"), Chance("exponential", "exponential")


@given(data=st.data())
def test_by_mean_times_a_policy_is_its_rule(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    rule = RULES[data.draw(st.sampled_from(sorted(RULES)))]
    execution = carry_out(cell, by_rule(rule))
    run = Run(cell)
    sequence = dispatch(run, rule)
    assert tuple(execution.sequence) == sequence
    assert execution.run.now_s == run.now_s
    again = Run(cell)
    assert execution.moves == [again.move(decision) for decision in sequence]


@given(data=st.data(), depth=st.integers(0, 2))
def test_a_rollout_is_allowed_and_no_worse_than_any_rule(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, depth: int
) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3, many=True))
    run = follow(cell, rollout(Run(cell), depth=depth))
    assert run.done
    for rule in usable(cell).values():
        other = Run(cell)
        dispatch(other, rule)
        assert cost(run, "makespan") <= cost(other, "makespan")


def test_of_alike_parts_the_first_to_be_ready_is_planned_with(oven_cell: CellMaker) -> None:
    """Two parts in storage, part 2 wanted first: parts with other due times are not alike."""
    assert rollout(Run(oven_cell(2)))[0] == 1
    assert rollout(Run(oven_cell(2, due_s=(90.0, 14.0))), "tardy-parts")[0] == 2


def test_planning_anew_is_no_worse_than_the_rules_on_the_toasts(toast_cell: CellMaker) -> None:
    """On average over 10 episodes with the same times, for each rule that it plans with."""
    cell = toast_cell("I", 3)
    planned = replicate(cell, replan(), NORMAL, 10, 0).mean()
    assert planned <= min(replicate(cell, by_rule(rule), NORMAL, 10, 0).mean() for rule in usable(cell).values())


def test_an_objective_that_the_cell_has_no_data_for(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        carry_out(oven_cell(), replan("mean-tardiness"))
