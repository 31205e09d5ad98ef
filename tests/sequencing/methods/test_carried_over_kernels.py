"""The features compiled: in every state of a run the same as the readable ones; and so are the runs."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DataObject, SearchStrategy

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.methods import carried_over_kernels
from lab.sequencing.methods.carried_over import Decider, rule_of
from lab.sequencing.methods.carried_over_features import feature_arrays, features
from lab.sequencing.methods.carried_over_policy import FEATURES, CarriedPolicy
from lab.sequencing.methods.rules import dispatch
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.run import Run

Cells = Callable[..., SearchStrategy[Cell]]
WEIGHTS = st.dictionaries(st.sampled_from([*FEATURES]), st.integers(-9, 9).map(float), min_size=1)


def walk(cell: Cell, objective: str, pick: Callable[[int], int]) -> None:
    """Compares the features of all allowed decisions, state by state."""
    run, arrays, there = Run(cell), cell_arrays(cell), run_arrays(cell)
    known, work = feature_arrays(cell, objective), carried_over_kernels.work_arrays(cell)
    found = np.zeros((cell.parts * cell.most_choices, len(FEATURES)))
    kernels.reset(arrays, there, np.uint64(0))
    while True:
        allowed = run.allowed()
        assert carried_over_kernels.describe_all(arrays, there, known, work, found) == len(allowed)
        if not allowed:
            return
        assert found[: len(allowed)] == pytest.approx(features(run, allowed, known), abs=1e-7)
        i = pick(len(allowed))
        run.move(allowed[i])
        kernels.move(arrays, there, i, np.uint64(0))


@settings(max_examples=60)
@given(data=st.data())
def test_they_are_the_readable_ones(cells: Cells, data: DataObject) -> None:
    """One robot: several products and routes, buffers, pallets, arrivals, due times."""
    walk(data.draw(cells(many=True)), "mean-tardiness", data.draw(st.randoms(use_true_random=False)).randrange)


@settings(max_examples=60)
@given(data=st.data())
def test_robots_and_servers_too(shops: Cells, data: DataObject) -> None:
    walk(data.draw(shops()), "makespan", data.draw(st.randoms(use_true_random=False)).randrange)


@settings(max_examples=60)
@given(data=st.data(), weights=WEIGHTS)
def test_the_run_is_that_of_the_readable_rule(
    shops: Cells, cells: Cells, data: DataObject, weights: dict[str, float]
) -> None:
    cell = data.draw(st.one_of(shops(), cells(many=True)))
    policy, decider, run = CarriedPolicy(weights), Decider(cell), Run(cell)
    assert decider.sequence(policy.vector) == dispatch(run, rule_of(policy))
    expected = cost(run, "makespan") if run.done else decider.stuck_cost
    assert decider.costs(policy.vector[None]) == pytest.approx([expected])
