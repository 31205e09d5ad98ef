"""What every registered sequencer must do."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from against_oracle.translated import plain_cell, plain_plan
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle.rules import violations

from lab.errors import BadInput
from lab.sequencing import SEQUENCERS, Sequencer, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import OBJECTIVES, cost
from lab.sequencing.cell.stations import Product, Robot, Stage, Station
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import Search, SequenceResult
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run
from lab.testing.contracts import check_order

CellMaker = Callable[..., Cell]
NAMES = sorted(SEQUENCERS)
TIMED = [name for name in NAMES if name != "earliest-due"]
EXACT = ("exact", "cp-sat")


def found(name: str, cell: Cell, seed: int, objective: str = "makespan") -> SequenceResult:
    return SEQUENCERS[name](cell, Search(20, objective), np.random.default_rng(seed))


def test_the_table() -> None:
    rules = ("shortest-move", "nearest-ready", "longest-remaining-work", "most-urgent-machine", "earliest-due")
    assert set(NAMES) == {
        "srl",
        "srl-time",
        "srl-improved",
        "srl-linear",
        "mc",
        "random",
        "fifo",
        "ga",
        "anneal",
        "exact",
        "cp-sat",
        "portfolio",
        "carried",
        *rules,
    }


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=15, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_contract(cells: Callable[..., st.SearchStrategy[Cell]], name: str, data: st.DataObject, seed: int) -> None:
    """The sequence is allowed, its cost is the simulated one, none is below the optimum, and every episode is told."""
    small = {"max_machines": 1, "max_parts": 2} if name == "cp-sat" else {"max_machines": 2, "max_parts": 3}
    cell = data.draw(cells(**small, many=True))  # CP-SAT takes up to a minute for three parts
    result = check_order(name, cell, seed)
    assert name not in EXACT or result.cost == pytest.approx(optimum(cell).cost, abs=1e-5)


def two_robots_meet() -> Cell:
    """Three parts through two machines of 20 s with room for one, by two robots; every way takes 5 s."""
    machines = (Station(name, "machine", 1, 20.0) for name in ("m", "n"))
    stations = (Station("in", "storage", 3), *machines, Station("out", "storage", 3))
    table = 5.0 * (1.0 - np.eye(4))
    product = Product("part", (tuple(Stage(station.name) for station in stations),))
    return Cell(stations, (product,), ("part",) * 3, table, table, (Robot("r1", "in"), Robot("r2", "in")))


@pytest.mark.parametrize("name", NAMES)
def test_two_robots_that_meet(name: str) -> None:
    """5 + 3 * 20 + 5 + 20 + 5 = 95 s: m never waits, since the next part is held there when one is taken out.

    Whatever a method finds keeps to the rules, as the oracle has them.
    """
    cell = two_robots_meet()
    try:
        result = find_sequence(cell, name, Search(20), 1)
    except BadInput:
        assert name in ("srl-time", "earliest-due")
        return
    moves = follow(cell, result.sequence).moves
    assert violations(plain_cell(cell), plain_plan(cell, moves)) == []
    assert result.cost == max(move.drop_s for move in moves) >= 95.0
    assert name not in (*EXACT, "portfolio") or result.cost == 95.0


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("objective", sorted(OBJECTIVES))
def test_every_objective(fms_cell: CellMaker, name: str, objective: str) -> None:
    """The cost is the objective's value of the sequence."""
    cell = replace(fms_cell("RS"), due_s=(700.0, 1300.0))
    result = found(name, cell, 1, objective=objective)
    run = Run(cell)
    for decision in result.sequence:
        run.move(decision)
    assert cost(run, objective) == pytest.approx(result.cost, abs=1e-5)


@pytest.mark.parametrize("name", TIMED)
def test_same_seed_same_result(toast_cell: CellMaker, name: str) -> None:
    assert found(name, toast_cell("I", 4), seed=7) == found(name, toast_cell("I", 4), seed=7)


@pytest.mark.parametrize("name", [name for name in TIMED if name != "cp-sat"])
@pytest.mark.parametrize("parts", [1, 60])
def test_smallest_and_large_job(oven_cell: CellMaker, name: str, parts: int) -> None:
    """One machine, no buffer: the only way is toast by toast, 14 s and 15 s more for each after the first."""
    stations = tuple(
        replace(station, capacity=1 if station.kind == "machine" else 60) for station in oven_cell().stations
    )
    result = found(name, oven_cell(parts, stations=stations), seed=0)
    assert result.cost == pytest.approx(14 + 15 * (parts - 1))


@pytest.mark.parametrize("name", NAMES)
def test_without_due_times(toast_cell: CellMaker, name: str) -> None:
    with pytest.raises(BadInput, match="due times"):
        found(name, toast_cell("I", 2), 0, objective="mean-tardiness")


def test_what_is_found_is_told_and_depends_on_seed_and_session(fms_cell: CellMaker) -> None:
    cell, told = fms_cell("RSR"), list[object]()
    search = Search(5, on_episode=told.append)
    one, again = (find_sequence(cell, "random", search, 1) for _ in range(2))
    assert one == again
    assert len(told) == 10
    quiet = replace(search, on_episode=None)
    assert one != find_sequence(cell, "random", quiet, 2)
    assert one != find_sequence(cell, "random", quiet, 1, session=1)


def test_an_unknown_method_lists_the_known_ones(oven_cell: CellMaker) -> None:
    with pytest.raises(
        BadInput, match=rf"^unknown method 'srrl' .--method.: did you mean 'srl'. known: {', '.join(NAMES)}$"
    ):
        find_sequence(oven_cell(), "srrl", Search(5), 0)


def test_a_method_is_one_row(oven_cell: CellMaker, monkeypatch: pytest.MonkeyPatch) -> None:
    """A method of somebody else's, with its row: it is found, and named among the known ones."""

    def one_by_one(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
        sequence = tuple(part for part in range(1, cell.parts + 1) for _ in range(2))
        return SequenceResult(sequence, simulate(cell, sequence).makespan_s, ())

    monkeypatch.setattr(
        "lab.sequencing.SEQUENCERS", {**SEQUENCERS, "one-by-one": Sequencer(lambda: one_by_one, "all of a part")}
    )
    assert find_sequence(oven_cell(2), "one-by-one", Search(1), 0).cost == 29.0
    with pytest.raises(BadInput, match="did you mean 'one-by-one'"):
        find_sequence(oven_cell(2), "one-by-on", Search(1), 0)


@pytest.mark.parametrize("method", ["srl", "mc", "random", "srl-time", "cp-sat"])
def test_an_objective_without_a_rule_is_refused_in_words(
    oven_cell: Callable[..., Cell], monkeypatch: pytest.MonkeyPatch, method: str
) -> None:
    """It is not taken for another one; who looks at finished runs only can be judged by it."""
    monkeypatch.setitem(OBJECTIVES, "lateness-squared", lambda run: run.now_s**2)
    search = Search(10, "lateness-squared")
    with pytest.raises(BadInput, match=r"^objective 'lateness-squared': .* has no rule for it, only for makespan, "):
        find_sequence(oven_cell(2), method, search, 0)
    assert find_sequence(oven_cell(2), "fifo", search, 0).cost == 29.0**2
