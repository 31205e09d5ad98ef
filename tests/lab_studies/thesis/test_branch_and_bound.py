"""The search tree of thesis App. IV: all of it, and its optimum."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import optimum
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run
from lab_studies.thesis.branch_and_bound import branch_and_bound

CellMaker = Callable[..., Cell]


def test_one_toast_is_a_chain(oven_cell: CellMaker) -> None:
    tree = branch_and_bound(oven_cell(1))
    assert [(node.decisions, node.time_s, node.end) for node in tree.nodes] == [
        ((), 0.0, ""),
        ((1,), 2.0, ""),
        ((1, 1), 14.0, "finished"),
    ]
    assert tree.optimal == (1, 1)


@pytest.mark.parametrize(("case", "optimal_s"), [("I", 513), ("II", 700), ("III", 995)])
def test_the_optima_of_the_thesis(toast_cell: CellMaker, case: str, optimal_s: float) -> None:
    """Fig. IV.2: three toasts."""
    cell = toast_cell(case, 3)
    tree = branch_and_bound(cell)
    assert simulate(cell, tree.optimal).makespan_s == optimal_s
    assert {node.end for node in tree.nodes} == {"", "finished", "dominated"}
    assert len(tree.nodes) < 100  # thousands, were alike toasts told apart


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_every_node_is_a_run(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=3))
    tree = branch_and_bound(cell)
    assert simulate(cell, tree.optimal).makespan_s == pytest.approx(optimum(cell).cost, abs=1e-6)
    numbers = {node.decisions: number for number, node in enumerate(tree.nodes)}
    assert len(numbers) == len(tree.nodes)
    for node in tree.nodes[:: max(1, len(tree.nodes) // 20)]:
        run = Run(cell)
        for decision in node.decisions:
            run.move(decision)
        assert run.now_s == pytest.approx(node.time_s, abs=1e-6)
        assert run.done == (node.end == "finished")
        if node.decisions:
            parent = numbers[node.decisions[:-1]]
            assert parent < numbers[node.decisions]
            assert tree.nodes[parent].end == ""


def test_too_large(toast_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="more than 50 nodes; take fewer parts"):
        branch_and_bound(toast_cell("I", 4), 50)
