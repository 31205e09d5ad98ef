"""Routes laid flat: positions, ways on, and how decisions are written."""

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import choice_of, entry, from_the_ends, open_ways, part_of, reached_from
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


@given(parts=st.integers(1, 200), data=st.data())
def test_a_decision_is_its_part_and_its_choice(parts: int, data: st.DataObject) -> None:
    part, choice = data.draw(st.integers(1, parts)), data.draw(st.integers(0, 9))
    decision = entry(part, choice, parts)
    assert (part_of(decision, parts), choice_of(decision, parts)) == (part, choice)


def test_a_toast_has_a_buffer_before_each_machine(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 3)
    assert [cell.names[place.station] for place in cell.positions] == [
        "plate",
        "toaster",
        "toaster buffer",
        "butter",
        "butter buffer",
        "done",
    ]
    direct, through = cell.positions[0].options
    assert (cell.names[direct.target], direct.if_full) == ("toaster", None)
    assert (cell.names[through.target], through.if_full) == ("toaster buffer", cell.index("toaster"))
    assert direct.choice == through.choice == 0


def test_a_sign_takes_five_moves_and_its_pallet_follows(fms_cell: CellMaker) -> None:
    """Thesis App. III: to the mill's in-buffer, into the mill, the pallet to the out-buffer, the part onto it, away."""
    cell, run = fms_cell("S"), Run(fms_cell("S"))
    moves = [run.move(1) for _ in range(5)]
    assert [(m.origin, m.target, m.carries) for m in moves] == [
        ("incoming", "mill in", "part"),
        ("mill in", "mill", "part"),
        ("mill in", "mill out", "pallet"),
        ("mill", "mill out", "part"),
        ("mill out", "outgoing", "part"),
    ]
    # In at 200 + 30; 50 s into the mill (7 -> 8): 280; empty 8 -> 7 25, pallet 7 -> 9 15: 320; to the mill 25: 345;
    # done at 280 + 600 = 880; vacuumed until 1120; 25 to the out-buffer and 30 away.
    assert [m.drop_s for m in moves] == [230, 280, 320, 1145, 1175]
    assert cell.names[run.robot] == "outgoing"


def test_a_rook_chooses_its_lathe(fms_cell: CellMaker) -> None:
    run = Run(fms_cell("RR"))
    assert run.allowed() == (1, 3)
    assert run.move(3).target == "lathe 2 in"
    assert run.allowed() == (1, 2), "part 1 goes on, part 2 to the first lathe: the second's in-buffer is taken"
    run.move(1)
    assert run.allowed() == (1, 2), "the pallet still stands there"
    run.move(1)
    assert run.allowed() == (1, 2, 4)


@given(data=st.data())
def test_whatever_is_picked_no_station_holds_more_than_it_can(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    cell = data.draw(cells(max_machines=3, max_parts=5, many=True))
    run = Run(cell)
    while allowed := run.allowed():
        run.move(data.draw(st.sampled_from(allowed)))
        assert all(0 <= n <= room for n, room in zip(run.occupied, cell.capacities, strict=True))
    assert run.done, "routes with stations of their own cannot block one another"
    assert run.occupied == [0] * len(cell.stations)


@given(data=st.data())
def test_the_needed_moves_are_enough(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    """The tables hold nothing but the needed moves, and no run meets a missing time."""
    run = Run(data.draw(cells(max_machines=2, max_parts=4, many=True)))
    while allowed := run.allowed():
        run.move(data.draw(st.sampled_from(allowed)))
    assert np.isfinite(run.now_s)


def test_values_are_found_from_the_ends_back(toast_cell: Callable[..., Cell]) -> None:
    """How many moves are left at the most: plate, toaster, its buffer, applier, its buffer, done."""
    cell = toast_cell("I", 2)
    names = [cell.names[place.station] for place in cell.positions]
    left = from_the_ends(cell.positions, lambda _, ahead: max((1 + moves for moves in ahead), default=0))
    by_name = dict(zip(names, left, strict=True))
    wanted = {"plate": 5, "toaster buffer": 4, "toaster": 3, "butter buffer": 2, "butter": 1, "done": 0}
    assert by_name == wanted
    whole = from_the_ends(cell.positions, lambda place, ahead: {names[place]}.union(*ahead))
    assert whole[0] == set(names)


def test_what_is_shut_is_not_gone_to_nor_what_only_leads_there(toast_cell: Callable[..., Cell]) -> None:
    """plate 0, toaster 1, its buffer 2, applier 3, its buffer 4, done 5: without an applier nothing leads to the end."""
    cell = toast_cell("I", 2)
    assert [len(place.options) for place in cell.positions] == [2, 2, 1, 1, 1, 0]
    assert [len(place.options) for place in open_ways(cell.positions, {cell.index("butter")})] == [0, 0, 0, 1, 0, 0]
    assert [len(place.options) for place in open_ways(cell.positions, {cell.index("butter buffer")})] == [
        2,
        1,
        1,
        1,
        1,
        0,
    ]
    assert open_ways(cell.positions, ()) == list(cell.positions)


def test_what_is_reached_from_where(toast_cell: Callable[..., Cell]) -> None:
    cell = toast_cell("I", 2)
    found = {cell.names[cell.positions[place].station] for place in reached_from(cell.positions, {4})}
    assert found == {"butter buffer", "butter", "done"}
    assert reached_from(cell.positions, ()) == set()
