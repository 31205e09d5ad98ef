"""The rules of a cell, and what it refuses."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell, needed_moves
from lab.sequencing.cell.stations import Arrivals, Begins, Product, Stage, Station, one_robot
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
PLATE, TOASTER, TOASTER_BUFFER, BUTTER, BUTTER_BUFFER, DONE = range(6)  # positions, in the order of the route


def at(cell: Cell, *locations: int) -> Run:
    """A run with parts at these positions, nothing being processed."""
    run = Run(cell)
    for part, place in enumerate(locations, 1):
        run.locations[part - 1] = place
        run.finished_s[part - 1] = 0.0 if place == DONE else None
        for station in cell.positions[place].holds:
            run.occupied[station] += 1
    return run


@pytest.mark.parametrize(
    ("locations", "toast", "expected"),
    [
        ((PLATE, PLATE), 1, "toaster"),
        ((TOASTER, PLATE), 2, "toaster buffer"),
        ((TOASTER, PLATE), 1, "butter"),
        ((BUTTER, TOASTER), 2, "butter buffer"),
        ((TOASTER, TOASTER_BUFFER), 2, None),
        ((BUTTER, TOASTER_BUFFER), 2, "toaster"),
        ((BUTTER, BUTTER_BUFFER), 2, None),
        ((DONE, BUTTER_BUFFER), 2, "butter"),
        ((BUTTER, DONE), 1, "done"),
        ((BUTTER, DONE), 2, None),
    ],
)
def test_where_a_toast_goes(
    toast_cell: CellMaker, locations: tuple[int, ...], toast: int, expected: str | None
) -> None:
    cell = toast_cell("I", 2)
    option = at(cell, *locations).option(toast)
    assert (cell.names[option.target] if option else None) == expected


def test_the_example_of_the_thesis(toast_cell: CellMaker) -> None:
    """Ch. 7.5: at (3, 2, 1) toasts 1 and 3 can move, toast 2 cannot: the toaster is loaded."""
    run = at(toast_cell("I", 3), TOASTER, TOASTER_BUFFER, PLATE)
    assert run.allowed() == (1, 3)
    assert run.refusal(2) == "toast 2 at 'toaster buffer' cannot move on: 'toaster' full"
    assert [run.move(1).target, run.move(3).target] == ["butter", "toaster"]


def test_full_buffer_stops_the_move(toast_cell: CellMaker) -> None:
    run = at(toast_cell("I", 3, buffer_room=1), TOASTER, TOASTER_BUFFER, PLATE)
    assert run.allowed() == (1,)
    assert "'toaster' and 'toaster buffer' full" in run.refusal(3)


def test_without_a_buffer_a_full_machine_stops_the_move(oven_cell: CellMaker) -> None:
    run = Run(oven_cell())
    run.move(1)
    assert run.allowed() == (1,)


def test_needed_moves_of_the_toast_cell(toast_cell: CellMaker) -> None:
    """They are moves that table 7.2 has, all but 4 -> 3 (just emptied) and those that are only made loaded."""
    cell = toast_cell("I", 3)
    moves = needed_moves(cell.stations, cell.products, cell.robots, cell.parts)
    number = {name: index + 1 for index, name in enumerate(cell.names)}
    loaded = {(number[a], number[b]) for a, b in moves.loaded}
    empty = {(number[a], number[b]) for a, b in moves.empty}
    assert loaded == {(1, 2), (1, 3), (2, 3), (3, 4), (3, 5), (4, 5), (5, 6)}
    printed = {(row + 1, column + 1) for row, column in np.argwhere(~np.isnan(cell.empty_s))}
    assert printed - empty == {(1, 2), (1, 3), (4, 3), (5, 6)}
    assert empty <= printed


def test_one_toast_needs_no_empty_way_back(oven_cell: CellMaker) -> None:
    nowhere = np.full((3, 3), np.nan)
    assert oven_cell(1, empty_s=nowhere).parts == 1
    with pytest.raises(BadInput, match="empty_s 'out' -> 'in' is missing"):
        oven_cell(2, empty_s=nowhere)


def test_a_route_may_lead_back_to_where_it_began(oven_cell: CellMaker) -> None:
    """A can is emptied and brought back: there at 2 s, empty at 12, back at 14; the other one is begun from there at once."""
    cell = oven_cell(2, **route(Stage("in"), Stage("oven"), Stage("in")))
    assert (cell.needed.empty, cell.needed.loaded) == ((), (("in", "oven"), ("oven", "in")))
    run = Run(cell)
    assert [run.move(decision).drop_s for decision in (1, 1, 2, 2)] == [2.0, 14.0, 16.0, 28.0]
    assert run.done


def test_tables_are_copies_that_cannot_be_written(oven_cell: CellMaker) -> None:
    given_table = np.ones((3, 3)) - np.eye(3)
    cell = oven_cell(empty_s=given_table)
    given_table[0, 1] = 99
    assert cell.empty_s[0, 1] == 1
    with pytest.raises(ValueError, match="read-only"):
        cell.empty_s[0, 1] = 5


TOAST = Product("toast", ((Stage("in"), Stage("oven"), Stage("out")),))
FOUR = {"empty_s": np.zeros((4, 4)), "loaded_s": np.zeros((4, 4))}
IN, OVEN, OUT = Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9)


def route(*stages: Stage) -> dict[str, object]:
    """The change that gives the oven cell one product with this route."""
    return {"products": (Product("toast", (stages,)),)}


def order(parts: int) -> dict[str, object]:
    return {"order": ("toast",) * parts}


def table(value: float) -> np.ndarray:
    """Times of 1 s, and `value` from in to oven."""
    times = np.ones((3, 3)) - np.eye(3)
    times[0, 1] = value
    return times


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (order(0), "an order of 0 parts: allowed are 1 to 200"),
        (order(201), "an order of 201 parts"),
        (order(10), "'in': capacity 9 cannot hold all 10"),
        ({"robots": one_robot("ovn")}, "unknown station 'ovn'.*did you mean 'oven'"),
        ({"stations": (IN, OVEN, OVEN, OUT)}, "'oven': the name is used twice"),
        ({"stations": (IN, Station("robot", "machine", 1), OUT)}, "names another row"),
        ({"stations": (IN, Station("oven", "grill", 1), OUT)}, "unknown kind 'grill'"),  # type: ignore[arg-type]
        ({"stations": (IN, Station("oven", "machine", 0), OUT)}, "capacity = 0"),
        ({"stations": (IN, Station("oven", "machine", 1, -1.0), OUT)}, "processing_s = -1.0"),
        ({"stations": (IN, Station("oven", "machine", 1, np.nan), OUT)}, "processing_s = nan"),
        ({"stations": (Station("in", "storage", 9, 3.0), OVEN, OUT)}, "only a machine processes"),
        (route(Stage("in")), "at least 2"),
        (route(Stage("in"), Stage("ovens"), Stage("out")), "unknown station 'ovens'.*stage 2.*'oven'"),
        (route(Stage("in"), Stage("oven"), Stage("oven"), Stage("out")), "'oven' is on the route twice, a cycle"),
        (route(Stage("in"), Stage("in")), "stage 2 of the route: station 'in' is on the route twice, a cycle"),
        (route(Stage("in"), Stage("in"), Stage("oven"), Stage("in")), "stage 2 of the route: station 'in' is on the"),
        (route(Stage("in", "oven"), Stage("out")), "buffer 'oven' before the start"),
        (route(Stage("in"), Stage("out", "oven")), "'oven' is a machine; a buffer fits"),
        (route(Stage("in"), Stage("oven")), "'oven' is a machine; a route starts and ends in storage"),
        (route(Stage("in"), Stage("oven", pallet=True), Stage("out")), "stage 2 of the route: pallet = true needs"),
        (route(Stage("in"), Stage("oven", processing_s=np.inf), Stage("out")), "stage 2 .*processing_s = inf"),
        (route(Stage("in"), Stage("oven", service_s=-1.0), Stage("out")), "stage 2 .*service_s = -1.0"),
        (route(Stage("in", service_s=2.0), Stage("oven"), Stage("out")), "service_s = 2.0, but 'in' is a storage"),
        (route(Stage("in"), Stage("out"), Stage("oven"), Stage("out")), "'out' is on the route twice"),
        ({"products": ()}, "at least one product"),
        ({"products": (Product("toast", ()),)}, "'toast': it has no route"),
        ({"products": (TOAST, TOAST)}, "'toast': the name is used twice"),
        ({"products": (TOAST, Product("bun", (TOAST.routes[0][1:],)))}, "'oven' is a machine; a route starts"),
        ({"order": ("toast", "bun")}, "unknown product 'bun' .part 2 of the order."),
        ({"stations": (IN, OVEN, OUT, Station("toast 1", "storage", 1)), **FOUR}, "'toast 1': a part has that name"),
        ({"buffers": "never"}, "unknown use of buffers 'never'"),
        ({"arrivals": Arrivals((1.0,))}, "arrivals has 1 times; 2 parts need 2"),
        ({"arrivals": Arrivals((1.0, -2.0))}, "arrivals of part 2 = -2.0"),
        ({"arrivals": Arrivals((1.0, 2.0), "bell")}, "unknown arrivals after 'bell'"),  # type: ignore[arg-type]
        ({"due_s": (1.0, np.inf)}, "due_s of part 2 = inf"),
        ({"due_s": (5.0, 5.0), "arrivals": Arrivals((3.0, 3.0))}, "due_s of part 2 = 5 s, but it only arrives at 6 s"),
        ({"loaded_s": table(np.nan)}, "loaded_s 'in' -> 'oven' is missing"),
        ({"loaded_s": table(-1)}, "loaded_s 'in' -> 'oven' = -1"),
        ({"empty_s": table(np.inf)}, "empty_s 'in' -> 'oven' = inf"),
        ({"empty_s": np.ones((3, 3))}, "'in' -> 'in' = 1.0; staying takes 0 s"),
        ({"empty_s": np.ones((2, 3))}, r"shape \(2, 3\); 3 stations need \(3, 3\)"),
        ({"closed": ("ovn",)}, "unknown station 'ovn'.*did you mean 'oven'"),
        ({"closed": ("oven",)}, "begin of toast 1 at 'in': no open path"),
        ({"begins": (Begins(0),)}, "begins has 1 parts; the order has 2"),
        ({"begins": (Begins(3), Begins(0))}, "begin of toast 1: position 3: its routes have 0 to 2"),
        ({"begins": (Begins(0, np.inf), Begins(0))}, "begin of toast 1: ready_s = inf"),
        ({"begins": (Begins(1), Begins(1))}, "begins: station 'oven' holds 2 parts; its capacity is 1"),
        ({"begins": (Begins(1, stays=True), Begins(0))}, "begin of toast 2 at 'in': no open path"),
        ({"begins": (Begins(None), Begins(2))}, "begins: no part has anything left to do"),
        (
            {"begins": (Begins(0, 1.0), Begins(0)), "arrivals": Arrivals((1.0, 1.0))},
            "begin of toast 1: ready_s = 1, but when it comes, the arrivals say",
        ),
    ],
)
def test_bad_cells(oven_cell: CellMaker, change: dict[str, object], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        oven_cell(**change)


def test_where_parts_begin(oven_cell: CellMaker) -> None:
    """1 is in the oven, 2 is lost, 3 waits, 4 is there already; only 1 and 3 have moves to make, three of them."""
    cell = oven_cell(4, begins=(Begins(1, 6.0), Begins(None), Begins(0), Begins(2)))
    assert (cell.begin_at, cell.unfinished, cell.coming) == ((1, 2, 0, 2), (1, 3), (3,))
    assert cell.possible_moves == 3
    assert cell.begin_s == (6.0, 0.0, 0.0, 0.0)
    # 3 cannot go first, the oven is full: the robot, at "in", first goes to the oven, and back for 3
    assert set(cell.needed.empty) == {("in", "oven"), ("out", "in")}


def test_the_window_of_a_stage_goes_before_its_stations(oven_cell: CellMaker) -> None:
    stations = (IN, Station("oven", "machine", 1, 10.0, 7.0), OUT)
    assert oven_cell(stations=stations).at_most_s(1, "oven") == 7.0
    own = route(Stage("in"), Stage("oven", at_most_s=3.0), Stage("out"))
    limited = oven_cell(stations=stations, **own)
    assert (limited.at_most_s(2, "oven"), limited.at_most_s(2, "out"), limited.has_windows) == (3.0, None, True)
    assert not oven_cell().has_windows


def test_a_station_that_nothing_leads_to_is_said_to_be_out_of_reach(toast_cell: CellMaker) -> None:
    cell = toast_cell("I", 2)
    times = np.array(cell.empty_s)
    times[:, 0] = np.nan
    with pytest.raises(BadInput, match=r"'toaster buffer' -> 'plate' is missing.*cannot be reached"):
        Cell(cell.stations, cell.products, cell.order, times, cell.loaded_s, cell.robots)


def test_a_station_is_an_end_or_inside_but_not_both(oven_cell: CellMaker) -> None:
    shelf = Station("shelf", "storage", 9)
    bun = Product("bun", ((Stage("shelf"), Stage("in"), Stage("out")),))
    with pytest.raises(BadInput, match="'in' is an end of one route and inside another"):
        oven_cell(stations=(IN, OVEN, OUT, shelf), products=(TOAST, bun), **FOUR)
