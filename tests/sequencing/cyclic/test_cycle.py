"""The shortest period beside all orders tried one by one, and beside what the field has published."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from scipy.optimize import linprog

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option
from lab.sequencing.cell.stations import Arrivals, Begins, Product, Robot, Stage, Station
from lab.sequencing.cyclic.cycle import best_cycle, shortest_period
from lab.sequencing.cyclic.line import Line, lines
from lab.sequencing.simulate.follow import Arc, earliest
from lab.sequencing.simulate.run import SLACK_S

CellMaker = Callable[..., Cell]
RandomCells = Callable[..., SearchStrategy[Cell]]
SEARCH = (Phase.explicit, Phase.reuse, Phase.generate)  # what fails is small enough: to shrink it takes minutes
Move = tuple[int, int, Option]  # the part of the cycle, the position that it leaves, and how


def test_the_hoist_of_phillips_and_unger_takes_521(hoist_cell: CellMaker) -> None:
    found = best_cycle(hoist_cell(), ("carrier",))
    assert (found.period_s, found.bound_s, found.proven) == (521.0, 521.0, True)
    assert found.most_in_work == 4


@pytest.mark.parametrize(("case", "period_s"), [("I", 150.0), ("II", 200.0), ("III", 295.0)])
def test_the_thesis_s_toast_cell(toast_cell: CellMaker, case: str, period_s: float) -> None:
    """Case I by hand: the robot carries 36 + 28 + 12 s, and drives 19 + 20 + 26 s, but the toaster is the one that is waited
    for: 60 s in it, 28 s out, 26 s for the plate after 12 s and 20 s: 28 + ... = 150 s a toast."""
    assert best_cycle(toast_cell(case, 3), ("toast",)).period_s == pytest.approx(period_s)


def test_one_oven_by_hand(oven_cell: CellMaker) -> None:
    """10 s in the oven, 2 s out of it, 1 s back, 2 s into it: a toast in 15 s, whatever a cycle takes."""
    for parts in (1, 2, 3):
        found = best_cycle(oven_cell(), ("toast",) * parts)
        assert (found.period_s, found.proven) == (15.0 * parts, True)


def test_two_places_alike(oven_cell: CellMaker) -> None:
    """Each place needs 15 s a toast as before, but the robot only 2 + 0 + 2 + 1 s: 7.5 s, which is no whole number."""
    stations = (Station("in", "storage", 9), Station("oven", "machine", 2, 10.0), Station("out", "storage", 9))
    found = best_cycle(oven_cell(stations=stations), ("toast",))
    assert (found.period_s, found.proven, found.most_in_work) == (7.5, True, 2)


def tours(moves: Sequence[Move]) -> Iterator[tuple[int, ...]]:
    for rest in permutations(range(1, len(moves))):
        yield (0, *rest)


def ways(cell: Cell, mix: Sequence[str]) -> Iterator[list[Move]]:
    """The moves of a cycle, for each choice of ways of its parts."""

    def onward(place: int) -> Iterator[tuple[tuple[int, Option], ...]]:
        options = cell.positions[place].options
        if not options:
            yield ()
        for option in options:
            for rest in onward(option.to):
                yield ((place, option), *rest)

    starts = [cell.starts[cell.order.index(name)] for name in mix]
    for chosen in product(*(list(onward(start)) for start in starts)):
        yield [(slot, place, option) for slot, path in enumerate(chosen) for place, option in path]


def is_legal(cell: Cell, moves: Sequence[Move], tour: Sequence[int], over: Sequence[int]) -> bool:
    """Whether all moves have the room they need, once the line is full: parts are put down and taken up one by one."""
    cycles = 2 * (max(over) + 2)
    happens = sorted((cycle + over[n], tour.index(n), cycle, n) for cycle in range(cycles) for n in range(len(moves)))
    taken = [0] * len(cell.stations)
    for when, _, _, n in happens:
        _, place, option = moves[n]
        if max(over) + 1 <= when < cycles:  # before, the line is filled; after, it is emptied
            if any(taken[station] >= cell.capacities[station] for station in option.needs):
                return False
            if option.if_full is not None and taken[option.if_full] < cell.capacities[option.if_full]:
                return False
        for station in cell.positions[place].holds:
            taken[station] -= 1
        for station in cell.positions[option.to].holds:
            taken[station] += 1
    return True


def least_period(cell: Cell, moves: Sequence[Move], tour: Sequence[int], over: Sequence[int]) -> float:
    """The shortest period of one order as a linear program in the begins and the period; inf: there is none."""
    work = [option.service_s + cell.loaded_s[option.origin, option.target] for _, _, option in moves]
    rows, most = list[list[float]](), list[float]()

    def at_least(one: int, then: int, seconds: float, periods: int) -> None:
        """begin[then] + periods * period >= begin[one] + seconds"""
        row = [0.0] * (len(moves) + 1)
        row[one] += 1
        row[then] -= 1
        row[-1] -= periods
        rows.append(row)
        most.append(-seconds)

    for number, one in enumerate(tour):
        then = tour[(number + 1) % len(tour)]
        left, origin = moves[one][2].target, moves[then][2].origin
        empty = 0.0 if left == origin else cell.empty_s[left, origin]
        if math.isnan(empty):
            return math.inf
        at_least(one, then, work[one] + empty, int(number == len(tour) - 1))
    brought = 0  # by which move a part came to where it was last worked on
    for n, (slot, place, option) in enumerate(moves):
        if n == 0 or moves[n - 1][0] != slot:
            continue
        if cell.positions[place].processing_s is not None:
            brought = n - 1
        at_least(n - 1, n, work[n - 1], over[n] - over[n - 1])
        if option.waits:
            done = work[brought] + (cell.positions[moves[brought][2].to].processing_s or 0.0)
            at_least(brought, n, done, over[n] - over[brought])
            at_most_s = cell.positions[place].at_most_s
            if at_most_s is not None:
                latest = done + at_most_s - option.service_s + SLACK_S
                at_least(n, brought, -latest, over[brought] - over[n])
    found = linprog([0.0] * len(moves) + [1.0], A_ub=rows, b_ub=most, bounds=[(0, None)] * (len(moves) + 1))
    return float(found.fun) if found.status == 0 else math.inf


def by_trying_all(cell: Cell, mix: Sequence[str]) -> float:
    """The shortest period of all orders, ways, and numbers of cycles that parts stay."""
    best = math.inf
    for moves in ways(cell, mix):
        stays = [n for n in range(1, len(moves)) if moves[n - 1][0] == moves[n][0]]
        rooms = [min(cell.capacities[s] for s in cell.positions[moves[n][1]].holds) for n in stays]
        for chosen in product(*(range(room + 1) for room in rooms)):
            over = [0] * len(moves)
            for n, periods in zip(stays, chosen, strict=True):
                over[n] = over[n - 1] + periods
            for tour in tours(moves):
                if is_legal(cell, moves, tour, over):
                    best = min(best, least_period(cell, moves, tour, over))
    return best


@pytest.mark.parametrize("kind", ["buffers", "windows", "many"])
@settings(max_examples=20, deadline=None, suppress_health_check=list(HealthCheck), phases=SEARCH)
@given(data=st.data())
def test_no_order_has_a_shorter_period(kind: str, cells: RandomCells, data: st.DataObject) -> None:
    cell = data.draw(cells(max_machines=2, max_parts=2, many=kind == "many", windows=kind == "windows"))
    assume(cell.parts > 1)
    cell = replace(cell, arrivals=None, due_s=None)
    mix = cell.order[: data.draw(st.integers(1, 2))]
    assume(max(len(moves) for moves in ways(cell, mix)) <= 6)
    least_s = by_trying_all(cell, mix)
    if least_s == math.inf:
        with pytest.raises(WorkFailed, match="it is proven that there is none"):
            best_cycle(cell, mix)
        return
    found = best_cycle(cell, mix)
    assert found.proven
    assert found.period_s == pytest.approx(least_s, abs=1e-5)


def test_a_single_move(oven_cell: CellMaker) -> None:
    """2 s there with a toast, 1 s back."""
    straight = Product("toast", ((Stage("in"), Stage("out")),))
    found = best_cycle(oven_cell(products=(straight,)), ("toast",))
    assert (found.period_s, found.proven) == (3.0, True)


def test_a_window_makes_the_robot_wait(oven_cell: CellMaker) -> None:
    """Two ovens: the second takes 20 s, so a toast would wait in the first one for 9 s or longer; when it must be fetched at
    once, the robot brings the next one later, and the period is the same."""
    stations = [Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9)]
    stations += [Station("second", "machine", 1, 20.0)]
    route = Product("toast", (tuple(Stage(name) for name in ("in", "oven", "second", "out")),))
    table = np.ones((4, 4)) - np.eye(4)
    own = {"products": (route,), "empty_s": table, "loaded_s": 2 * table}
    free = best_cycle(oven_cell(stations=tuple(stations), **own), ("toast",))
    stations[1] = replace(stations[1], at_most_s=0.0)
    bound = best_cycle(oven_cell(stations=tuple(stations), **own), ("toast",))
    # the second oven: 20 s, 2 s out, 1 s to the first, 2 s into it
    assert free.period_s == bound.period_s == 25.0
    row = {(move["origin"], move["target"]): move for move in bound.to_json()}
    in_oven_s = row["oven", "second"]["pick_s"] - row["in", "oven"]["drop_s"]
    assert in_oven_s % 25.0 == pytest.approx(10.0)


def test_half_the_speed_takes_twice_as_long(oven_cell: CellMaker) -> None:
    found = best_cycle(oven_cell(robots=(Robot("slow", "in", 0.5),)), ("toast",))
    assert found.period_s == 20.0  # 10 s, and twice 5 s


def test_a_mix_of_two_products(crossing_cell: Callable[[], Cell]) -> None:
    """Two machines passed the one way and the other way: the parts never meet. By hand: a round of the one part is six moves
    of 1 s and 10 s of work at the least, but each part waits while the other one is worked on."""
    found = best_cycle(crossing_cell(), ("there", "back"))
    assert found.proven
    assert [move["product"] for move in found.to_json()].count("there") == 3
    assert found.period_s == pytest.approx(by_trying_all(crossing_cell(), ("there", "back")))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"arrivals": Arrivals((1.0, 1.0))}, "parts arrive one by one"),
        ({"robots": (Robot("a", "in"), Robot("b", "in"))}, "2 robots"),
        ({"begins": (Begins(None), Begins(0))}, "work is in its middle"),
        (
            {
                "stations": (
                    Station("in", "storage", 9),
                    Station("oven", "machine", 2, 1.0, None, 1),
                    Station("out", "storage", 9),
                )
            },
            "'oven' has servers",
        ),
    ],
)
def test_what_has_no_cycle_is_refused(oven_cell: CellMaker, change: dict[str, object], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        best_cycle(oven_cell(**change), ("toast",))


def test_an_unknown_product_is_refused(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="has no 'bun'; it has toast"):
        best_cycle(oven_cell(), ("bun",))
    with pytest.raises(BadInput, match="no part enters"):
        best_cycle(oven_cell(), ())


# ---- times ------------------------------------------------------------------------------------------------------------


def line_of(cell: Cell, parts: int = 1) -> Line:
    (line,) = lines(cell, ("toast",) * parts)
    return line


def test_an_oven(oven_cell: CellMaker) -> None:
    """2 s into the oven, 10 s in it, 2 s out, 1 s back."""
    line = line_of(oven_cell())
    timed = shortest_period(line, (0, 1), (0,))
    assert timed is not None
    assert (timed.period_s, timed.begin_s, timed.recurs) == (15.0, (0.0, 12.0), 1)


@pytest.mark.parametrize(("at_most_s", "period_s"), [(None, 5.0), (100.0, 5.0), (0.0, None)])
def test_two_parts_in_the_oven_at_once(oven_cell: CellMaker, at_most_s: float | None, period_s: float | None) -> None:
    """A toast of the cycle before is fetched in each: the robot's 2 + 0 + 2 + 1 s, or the oven's, 10 s in two cycles and 1 s."""
    cell = oven_cell()
    cell = replace(cell, stations=tuple(replace(one, capacity=3) for one in cell.stations))
    if at_most_s is not None:
        window = replace(cell.stations[1], at_most_s=at_most_s)
        cell = replace(cell, stations=(cell.stations[0], window, cell.stations[2]))
    timed = shortest_period(line_of(cell), (0, 1), (3,))
    if period_s is None:  # three cycles and what is left of the fourth take 10 s, in cycles of 5 s and more: never
        assert timed is None
    else:
        assert timed is not None
        assert timed.period_s == period_s


def test_a_circle_that_cannot_be_kept_is_found() -> None:
    """Each of two moves is to begin a second after the other one."""
    arcs = [Arc(0, 1, 1.0, 0), Arc(1, 0, 1.0, 0), Arc(1, 2, 5.0, 0)]
    _, broken = earliest(arcs, 3, 0, 0.0)
    assert sorted(broken) == arcs[:2]
    begin_s, broken = earliest(arcs[::2], 3, 0, 0.0)
    assert (begin_s, broken) == ([0.0, 1.0, 6.0], [])


def test_a_way_that_is_never_made_has_no_period(oven_cell: CellMaker) -> None:
    """The empty ways of a cell for one toast alone do not lead back to the beginning."""
    cell = oven_cell(1)
    empty_s = cell.empty_s.copy()
    empty_s[2, 0] = float("nan")
    assert shortest_period(line_of(replace(cell, empty_s=empty_s)), (0, 1), (0,)) is None
