"""First in, first out, as a list and as a policy."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station, one_robot
from lab.sequencing.methods.fifo import fifo, first_in_first_out
from lab.sequencing.search import Search
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.several import carry_out

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def far_oven(interval_s: float) -> Cell:
    """Two parts by the clock, oven 10 s; the robot starts at the oven. Loaded moves 2 s, empty ones 3 s."""
    stations = (Station("in", "storage", 1), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9))
    table = 1.0 - np.eye(3)
    route = (Stage("in"), Stage("oven"), Stage("out"))
    arrivals = Arrivals((interval_s, interval_s))
    return Cell(stations, (Product("a", (route,)),), ("a", "a"), 3 * table, 2 * table, one_robot("oven"), arrivals)


def test_fifo_takes_what_has_been_ready_longest(oven_cell: CellMaker, toast_cell: CellMaker) -> None:
    """Without a buffer, toast by toast; with one, all raw slices (ready at 0 s) leave the plate first."""
    assert fifo(oven_cell(2), Search(), rng()).sequence == (1, 1, 2, 2)
    assert fifo(toast_cell("I", 3), Search(), rng()).sequence[:3] == (1, 2, 3)


@pytest.mark.parametrize(
    ("case", "parts", "makespan_s"),
    [("I", 3, 544), ("I", 4, 725), ("II", 3, 730), ("II", 4, 970), ("III", 3, 1050), ("III", 12, 4200)],
)
def test_fifo_of_the_toasts(toast_cell: CellMaker, case: str, parts: int, makespan_s: float) -> None:
    """As the first version of the lab had it: of the allowed toasts the one that has been ready the longest."""
    result = fifo(toast_cell(case, parts), Search(), rng())
    assert result.cost == makespan_s == simulate(toast_cell(case, parts), result.sequence).makespan_s


def test_the_queue_lets_the_robot_stay_where_it_is() -> None:
    """Part 1 comes at 5 s: only then the robot sets out, 8 s, oven 10 s, done at 20 s, out at 22 s.

    Part 2 has come at 10 s: 25 s, 27 s, done at 37 s, out at 39 s. Sent ahead, it would be 3 s sooner.
    """
    execution = carry_out(far_oven(5.0), first_in_first_out)
    assert [move.pick_s for move in execution.moves] == [8.0, 20.0, 25.0, 37.0]
    assert execution.run.now_s == 39.0
    assert execution.run.waited_s == 5.0 + 10.0 + 10.0
    assert fifo(far_oven(5.0), Search(), rng()).cost == 36.0


def test_tasks_join_the_queue_when_an_event_makes_them_possible(toast_cell: CellMaker) -> None:
    """Case I, 3 slices. At 0 all may go: 1 to the toaster (21 + 36 s: 57, done 117), 2 and 3 to its buffer (103, 148).

    1 has been done since 117: at 148 the robot goes there (24 s) and to the butter (28 s: 200). The toaster is free for 2
    and 3 from then on, both since 200; 2 was in the buffer first: 24 s to it, 24 s to the toaster.
    """
    execution = carry_out(toast_cell("I", 3), first_in_first_out)
    assert execution.sequence[:5] == [1, 2, 3, 1, 2]
    assert [move.drop_s for move in execution.moves[:5]] == [57.0, 103.0, 148.0, 200.0, 248.0]


def test_parts_take_their_routes_in_turn(fms_cell: CellMaker) -> None:
    """Rooks to lathe 1 and 2 alternately; signs between them do not count."""
    execution = carry_out(fms_cell("RSRRR"), first_in_first_out)
    fetched = [move.target for move in execution.moves if move.origin == "incoming"]
    assert fetched == ["lathe 1 in", "mill in", "lathe 2 in", "lathe 1 in", "lathe 2 in"]


def test_a_part_waits_for_its_turn_even_when_another_lathe_has_room(fms_cell: CellMaker) -> None:
    """Arrivals at once: rook 3 is for lathe 1, and is fetched only after the pallet of rook 1 has left its in-buffer."""
    moves = carry_out(fms_cell("RRR", 0.0), first_in_first_out).moves
    third = next(index for index, move in enumerate(moves) if move.part == 3)
    assert moves[third].target == "lathe 1 in"
    assert any(move.carries == "pallet" and move.part == 1 for move in moves[:third])


def test_nothing_is_fetched_before_it_has_come(fms_cell: CellMaker) -> None:
    """The first rook comes at 200 s; each other one 200 s after the pick before it, and the robot is not sent ahead."""
    execution = carry_out(fms_cell("RR"), first_in_first_out)
    picks_s = [move.pick_s for move in execution.moves if move.origin == "incoming"]
    assert picks_s[0] == 200.0
    assert picks_s[1] > 400.0
    assert all(move.reach_s == move.pick_s for move in execution.moves), "it never waits before a machine"


def test_objectives_that_the_cell_has_no_data_for(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        fifo(oven_cell(), Search(objective="mean-tardiness"), rng())
