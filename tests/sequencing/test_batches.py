"""Machines that work on several parts together: what an order says, every simulation alike, the optimum by brute force."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot
from lab.sequencing.cyclic.cycle import check_cyclic
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.one_robot import why_not
from lab.sequencing.search import Search
from lab.sequencing.simulate import kernels
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.follow import follow, simulate, steps
from lab.sequencing.simulate.rest import Mishaps, rest_of
from lab.sequencing.simulate.run import Run, branch
from lab_studies.comparisons.rolling import rolling

DRAWN = 60


def oven(parts: int = 2, room: int = 2, seconds: float = 10.0) -> Cell:
    """In, an oven with batches, out: 1 s empty, 2 s with a part from anywhere to anywhere."""
    stations = (
        Station("in", "storage", 9),
        Station("oven", "machine", room, seconds, batch=True),
        Station("out", "storage", 9),
    )
    table = 1.0 - np.eye(3)
    route = (Stage("in"), Stage("oven"), Stage("out"))
    return Cell(stations, (Product("bun", (route,)),), ("bun",) * parts, table, 2.0 * table, one_robot("in"))


def test_all_that_is_brought_before_one_is_taken_out_begins_together() -> None:
    """1 comes at 2 s, 2 at 5 s: both are done at 15 s, and out at 17 and 20 s. One by one it takes 29 s."""
    schedule = simulate(oven(), [1, 2, 1, 2])
    assert schedule.makespan_s == 20.0
    works = [(one.part, one.start_s, one.end_s) for one in schedule.machines if one.kind == "process"]
    assert works == [(1, 5.0, 15.0), (2, 5.0, 15.0)]
    waits = [one for one in schedule.parts if one.kind == "store" and one.origin == "oven"]
    assert [(one.part, one.start_s, one.end_s) for one in waits] == [(1, 2.0, 5.0)]
    alone = simulate(oven(), [1, 1, 2, 2])
    assert [(one.start_s, one.end_s) for one in alone.machines if one.kind == "process"] == [(2.0, 12.0), (17.0, 27.0)]
    assert alone.makespan_s == 29.0


def test_the_longest_time_holds_for_all() -> None:
    cell = oven()
    route = cell.products[0].routes[0]
    quick = Product("quick", ((route[0], replace(route[1], processing_s=0.0), route[2]),))
    cell = replace(cell, products=(*cell.products, quick), order=("bun", "quick"))
    assert simulate(cell, [1, 2, 2, 1]).makespan_s == 20.0
    assert simulate(cell, [2, 2, 1, 1]).makespan_s == 19.0  # 2 is out at 4 s, 1 comes at 7 s and is done at 17 s
    assert optimum(cell).cost == 19.0


def test_nothing_comes_in_until_it_is_empty() -> None:
    cell = oven(3, 3)
    run = follow(cell, [1, 2, 1])
    assert run.allowed() == (2,)
    assert run.refusal(3) == "bun 3 at 'in' cannot move on: the batch in 'oven' has begun"
    run.move(2)
    assert run.allowed() == (3,)


def test_a_batch_that_stands_there_at_first_has_begun() -> None:
    rest = rest_of(follow(oven(3, 3), [1, 2])).cell
    assert rest is not None
    assert Run(rest).allowed() == (1, 2)
    assert rest.begin_s == (10.0, 10.0, 0.0)
    lost = rest_of(follow(oven(3, 3), [1, 2]), Mishaps(closed=("oven",)))
    assert sorted(lost.stuck) == [1, 2, 3]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"kind": "buffer"}, r"station 'oven': .*only a machine"),
        ({"capacity": 1}, r"station 'oven': batch = true with capacity = 1; .* 2 parts or more"),
        ({"capacity": 10**6}, r"capacity = unlimited"),
        ({"servers": 1}, r"batch = true and servers = 1; .*servers"),
        ({"at_most_s": 3.0}, r"batch = true and at_most_s = 3; .*at_most_s"),
    ],
)
def test_what_cannot_be(changes: dict[str, object], says: str) -> None:
    cell = oven()
    wrong = replace(cell.stations[1], **{"processing_s": 0.0, **changes})  # type: ignore[arg-type]
    with pytest.raises(BadInput, match=says):
        replace(cell, stations=(cell.stations[0], wrong, cell.stations[2]))


def test_who_does_not_know_batches_says_so() -> None:
    cell = oven()
    with pytest.raises(BadInput, match=r"batch = true is for cells of one robot"):
        replace(cell, robots=(*cell.robots, replace(cell.robots[0], name="other")))
    with pytest.raises(BadInput, match=r"CP-SAT: station 'oven' has batch = true"):
        cp_sat(cell)
    with pytest.raises(BadInput, match=r"--cyclic: station 'oven' has batch = true"):
        check_cyclic(cell, ("bun",))
    with pytest.raises(BadInput, match=r"rolling decisions are for cells without batches"):
        rolling((), Chance("constant"), 0)(cell)
    for make in (lambda: Episode(cell, Chance()), lambda: cell_arrays(cell, chance=Chance())):
        with pytest.raises(BadInput, match=r"station 'oven': batch = true"):
            make()
    assert "batches" in why_not(cell)


@pytest.mark.parametrize("seed", range(DRAWN))
def test_the_optimum_is_that_of_brute_force(seed: int) -> None:
    """Drawn cells of one to three machines, one or two with batches: every order, when each batch begins tried out, too."""
    cell, plain = _drawn(np.random.default_rng(seed))
    found = optimum(cell)
    assert found.proven
    assert found.cost == pytest.approx(_brute_force(*plain))


@pytest.mark.parametrize("seed", range(DRAWN))
def test_every_simulation_is_alike(seed: int) -> None:
    """Random orders: the compiled run allows what the readable one does, and comes to the same end."""
    rng = np.random.default_rng(seed)
    cell, _ = _drawn(rng)
    run, arrays = Run(cell), cell_arrays(cell)
    compiled, decisions = run_arrays(cell), list[int]()
    kernels.reset(arrays, compiled, np.uint64(0))
    while allowed := run.allowed():
        count = kernels.list_allowed(arrays, compiled)
        assert tuple(compiled.allowed[:count].tolist()) == allowed
        choice = int(rng.integers(count))
        kernels.move(arrays, compiled, choice, np.uint64(0))
        run.move(allowed[choice])
        decisions.append(allowed[choice])
        assert compiled.ready_s.tolist() == pytest.approx(run.ready_s)
        again = branch(run)
        assert again.allowed() == run.allowed()
    if run.done:
        assert simulate(cell, decisions).makespan_s == pytest.approx(run.end_s)
        assert kernels.cost(arrays, compiled) == pytest.approx(run.end_s)


@pytest.mark.parametrize("method", [name for name in SEQUENCERS if name not in ("cp-sat", "earliest-due")])
def test_methods_give_orders_that_can_be(method: str) -> None:
    cell = oven(4, 3)
    assert optimum(cell).cost == 41.0  # two batches of two, 20 s each, and 1 s back between them
    result = SEQUENCERS[method](cell, Search(30), np.random.default_rng(0))
    assert simulate(cell, result.sequence).makespan_s == pytest.approx(result.cost)
    assert result.cost >= optimum(cell).cost


# ---- brute force: nothing of the lab ---------------------------------------------------------------------------------

Plain = tuple[list[tuple[int, bool]], list[list[tuple[int, int]]], list[list[int]], list[list[int]]]


def _drawn(rng: np.random.Generator) -> tuple[Cell, Plain]:
    """A cell of in (0), machines (1 ...), out (last), and the same as numbers."""
    machines, parts = int(rng.integers(1, 3)), int(rng.integers(2, 4))
    kinds = [(int(rng.integers(2, 4)), True)] + [
        (int(rng.integers(1, 3)), bool(rng.integers(2))) for _ in range(machines - 1)
    ]
    kinds = [(max(room, 2) if batch else room, batch) for room, batch in kinds]
    size = machines + 2
    products = []
    for _ in range(2):
        visits = [n for n in rng.permutation(machines) + 1 if n == 1 or rng.integers(2)]
        products.append([(int(n), int(rng.integers(0, 30))) for n in visits])
    order = [int(rng.integers(2)) for _ in range(parts)]
    empty, loaded = (rng.integers(1, 6, (size, size)) * (1 - np.eye(size, dtype=int)) for _ in range(2))
    names = ["in", *(f"m{n}" for n in range(1, machines + 1)), "out"]
    stations = (
        Station("in", "storage", 9),
        *(
            Station(name, "machine", room, 0.0, batch=batch)
            for name, (room, batch) in zip(names[1:], kinds, strict=False)
        ),
        Station("out", "storage", 9),
    )
    built = tuple(
        Product(f"p{n}", ((Stage("in"), *(Stage(names[at], processing_s=s) for at, s in visits), Stage("out")),))
        for n, visits in enumerate(products)
    )
    cell = Cell(stations, built, tuple(f"p{n}" for n in order), empty * 1.0, loaded * 1.0, one_robot("in"))
    routes = [[(0, 0), *products[n], (size - 1, 0)] for n in order]
    return cell, ([(9, False), *kinds, (9, False)], routes, empty.tolist(), loaded.tolist())


def _brute_force(
    stations: list[tuple[int, bool]],
    routes: list[list[tuple[int, int]]],
    empty: list[list[int]],
    loaded: list[list[int]],
) -> float:
    """The least makespan: by every order of picks, and every choice, after each drop, of whether the batch begins now.

    A batch begins by a decision of its own, with all that stands there; once begun nothing comes in or goes out until it is over,
    and what comes then is another batch, once what was finished is out.
    """
    best = [float("inf")]

    def moves(at: list[int], begun: list[float | None], robot: int, now: float) -> Iterator[tuple[int, float]]:
        for part, route in enumerate(routes):
            if at[part] + 1 < len(route):
                here, there = route[at[part]][0], route[at[part] + 1][0]
                ready = begun[part]
                if ready is None or not _enters(there, at, begun):
                    continue
                pick = max(now + empty[robot][here], ready)
                yield part, pick + loaded[here][there]

    def _enters(there: int, at: list[int], begun: list[float | None]) -> bool:
        inside = [n for n in range(len(routes)) if routes[n][at[n]][0] == there]
        room, batch = stations[there]
        if there in (0, len(stations) - 1):
            return True
        return len(inside) < room and not (batch and any(begun[n] is not None for n in inside))

    def go(at: list[int], ends: list[float | None], robot: int, now: float) -> None:
        if now >= best[0]:
            return
        if all(at[n] + 1 == len(routes[n]) for n in range(len(routes))):
            best[0] = now
            return
        for part, drop in list(moves(at, ends, robot, now)):
            there = routes[part][at[part] + 1][0]
            then, done = at.copy(), ends.copy()
            then[part] += 1
            if stations[there][1]:
                done[part] = None  # it waits for its batch to begin
                go(then, done, there, drop)
                inside = [n for n in range(len(routes)) if routes[n][then[n]][0] == there]
                end = drop + max(routes[n][then[n]][1] for n in inside)
                begun = done.copy()
                for n in inside:
                    begun[n] = end
                go(then, begun, there, drop)
            else:
                done[part] = drop + routes[part][then[part]][1]
                go(then, done, there, drop)

    go([0] * len(routes), [0.0] * len(routes), 0, 0.0)
    return best[0]


def test_a_list_waits_for_a_batch_so_that_nothing_is_spoilt() -> None:
    """A mixer of 5 s, to be left within 2 s, before the oven. Buns 1 and 2 begin at 19 s and are ready at 29 s; with both out at
    34 s, bun 3 is picked at 35 s. It would be mixed at 27 s: the robot picks it 6 s later."""
    mixer, stations = Station("mixer", "machine", 1, 5.0, 2.0), oven().stations
    route = tuple(Stage(name) for name in ("in", "mixer", "oven", "out"))
    table = 1.0 - np.eye(4)
    stations = (stations[0], mixer, *stations[1:])
    cell = Cell(stations, (Product("bun", (route,)),), ("bun",) * 3, table, 2.0 * table, one_robot("in"))
    waits = [tuple(wait) for *_, wait in steps(cell, [1, 1, 2, 2, 3, 1, 2, 3, 3])]
    assert waits == [*[(0.0, 0.0)] * 4, (6.0, 0.0), *[(0.0, 0.0)] * 4]
    assert simulate(cell, [1, 1, 2, 2, 3, 1, 2, 3, 3]).makespan_s == 49.0
    assert optimum(cell).cost == 49.0
