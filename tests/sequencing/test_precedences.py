"""Parts that have to wait for others: decisions, kernels, searches and the rest of a run, against an enumeration by hand."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf

import numpy as np
import pytest

from lab.errors import BadInput, WorkFailed
from lab.sequencing import SEQUENCERS, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.precedence import Precedence, RouteStep
from lab.sequencing.cell.stations import Product, Robot, Stage, Station, one_robot
from lab.sequencing.cyclic.cycle import check_cyclic
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import Search
from lab.sequencing.simulate.cell_arrays import cell_arrays, run_arrays
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.rest import Mishaps, rest_of
from lab.sequencing.simulate.run import Run

IN, MILL, TRAY = Station("in", "storage", 9), Station("mill", "machine", 1, 5.0), Station("tray", "storage", 9)
ROUTE = (Stage("in"), Stage("mill"), Stage("tray"))
LID, BOX = Product("lid", ((Stage("in"), Stage("tray")),)), Product("box", (ROUTE,))


def kit(order: tuple[str, ...] = ("lid", "box"), *precedences: Precedence) -> Cell:
    """Lids go straight to the tray, boxes through a mill of 5 s; every way takes a second."""
    second = np.ones((3, 3)) - np.eye(3)
    return Cell((IN, MILL, TRAY), (LID, BOX), order, second, second, one_robot("in"), precedences=precedences)


ON_TOP = Precedence((1,), RouteStep("tray"), (2,), RouteStep("tray"))  # the lid, part 1, onto the box, part 2


def test_a_lid_waits_for_its_box() -> None:
    free, held = Run(kit()), Run(kit(("lid", "box"), ON_TOP))
    assert free.allowed() == (1, 2)
    assert held.allowed() == (2,)
    assert held.refusal(1) == "lid 1 at 'in' may not come to 'tray' before 1 more of box come to 'tray'"
    held.move(2), held.move(2)
    assert held.allowed() == (1,)
    # box: 1 s there, 5 s of milling, 1 s; back for the lid 1 s, and 1 s with it
    assert simulate(held.cell, (2, 2, 1)).makespan_s == 9.0
    assert optimum(held.cell).cost == 9.0
    assert optimum(free.cell).cost == 8.0 - 1.0  # the lid while the mill runs


def test_the_lower_part_leaves_last() -> None:
    below = Precedence((1,), RouteStep("in", leaves=True), (2,), RouteStep("in", leaves=True))
    run = Run(kit(("box", "box"), below))
    assert run.allowed() == (2,)
    run.move(2)
    assert run.allowed() == (2,)  # box 1 lies free, but the mill is full
    run.move(2)
    assert run.allowed() == (1,)


def test_counts_say_how_many_the_next_one_needs() -> None:
    cell = kit(
        ("lid", "lid", "box", "box"), Precedence((1, 2), RouteStep("tray"), (3, 4), RouteStep("tray"), needs=(1, 2))
    )
    run = Run(cell)
    run.move(3), run.move(3)
    assert run.allowed() == (1, 2, 4)  # whichever lid comes first
    run.move(2)
    assert run.allowed() == (4,)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (replace(ON_TOP, parts=(3,)), "there is no part 3"),
        (replace(ON_TOP, parts=()), "wanted one or more"),
        (replace(ON_TOP, step=RouteStep("mill")), "lid 1 does not come to 'mill' on every route"),
        (replace(ON_TOP, needs=(2,)), "there are 1 parts to wait for"),
        (replace(ON_TOP, needs=(1, 1)), "wanted 1 counts that do not fall"),
    ],
)
def test_a_precedence_that_cannot_be_is_refused(wrong: Precedence, said: str) -> None:
    with pytest.raises(BadInput) as refused:
        kit(("lid", "box"), wrong)
    assert said in str(refused.value)


def test_what_does_not_know_precedences_says_so() -> None:
    cell = kit(("lid", "box"), ON_TOP)
    with pytest.raises(BadInput, match=r"--cyclic: .*precedences"):
        check_cyclic(cell, ("box",))
    with pytest.raises(BadInput, match="precedences: they are for cells of one robot"):
        replace(cell, robots=(Robot("a", "in"), Robot("b", "in")))


def test_the_rest_of_a_run_waits_on() -> None:
    run = Run(kit(("lid", "box"), ON_TOP))
    run.move(2)
    rest = rest_of(run).cell
    assert rest is not None
    assert Run(rest).allowed() == (2,)
    lost = rest_of(run, Mishaps(lost=frozenset({2})))
    assert lost.cell is None
    assert lost.stuck == {1: "lid 1 may not come to 'tray': box 2 cannot come to 'tray' before"}


def test_a_part_that_is_lost_lies_on_nothing_any_more() -> None:
    below = Precedence((1,), RouteStep("in", leaves=True), (2,), RouteStep("in", leaves=True))
    rest = rest_of(Run(kit(("box", "box"), below)), Mishaps(lost=frozenset({2}))).cell
    assert rest is not None
    assert Run(rest).allowed() == (1,)


# ---- drawn cells, enumerated by a model that shares nothing with the sequencing ------------------------------------


@dataclass(frozen=True)
class Drawn:
    """Routes (station indices) by part, seconds, capacities and who waits for whom: (part, its nth move, part, its nth move)."""

    routes: tuple[tuple[int, ...], ...]
    process: tuple[float, ...]
    room: tuple[int, ...]
    empty: tuple[tuple[float, ...], ...]
    loaded: tuple[tuple[float, ...], ...]
    waits: tuple[tuple[int, int, int, int], ...]


def drawn(seed: int) -> Drawn:
    """A cell of two to four parts, up to two machines and one to three precedences between moves of different parts."""
    rng = np.random.default_rng(seed)
    routes = [(0, *rng.permutation([1, 2])[: rng.integers(1, 3)].tolist(), 3) for _ in range(2)]
    own = [routes[int(rng.integers(2))] for _ in range(int(rng.integers(2, 5)))]
    table = rng.integers(1, 9, (2, 4, 4)).astype(float).tolist()
    waits = []
    for _ in range(int(rng.integers(1, 4))):
        a, b = (int(n) for n in rng.permutation(len(own))[:2])
        waits.append((a, int(rng.integers(1, len(own[a]))), b, int(rng.integers(1, len(own[b])))))
    room = (9, int(rng.integers(1, 3)), int(rng.integers(1, 3)), 9)
    process = (0.0, *rng.integers(0, 25, 2).astype(float).tolist(), 0.0)
    empty, loaded = (tuple(map(tuple, one)) for one in table)
    return Drawn(tuple(own), process, room, empty, loaded, tuple(waits))


def shortest(cell: Drawn) -> float:
    """The least makespan of all orders, by trying each; infinite where all end in a deadlock."""
    best = inf

    def go(made: list[int], ready: list[float], robot: int, now: float) -> None:
        nonlocal best
        if all(n == len(route) - 1 for n, route in zip(made, cell.routes, strict=True)):
            best = min(best, now)
        for part, move in possible(cell, made):
            here, there = cell.routes[part][move - 1], cell.routes[part][move]
            at = max(now + (0.0 if robot == here else cell.empty[robot][here]), ready[part]) + cell.loaded[here][there]
            if at < best:
                after = [*made[:part], move, *made[part + 1 :]]
                go(after, [*ready[:part], at + cell.process[there], *ready[part + 1 :]], there, at)

    go([0] * len(cell.routes), [0.0] * len(cell.routes), 0, 0.0)
    return best


def possible(cell: Drawn, made: list[int]) -> Iterator[tuple[int, int]]:
    """The parts that may be moved, and the number of that move."""
    at = [route[n] for n, route in zip(made, cell.routes, strict=True)]
    for part, route in enumerate(cell.routes):
        move = made[part] + 1
        held = any(a == part and k == move and made[b] < j for a, k, b, j in cell.waits)
        if move < len(route) and not held and (route[move] == 3 or at.count(route[move]) < cell.room[route[move]]):
            yield part, move


def as_cell(cell: Drawn) -> Cell:
    """The drawn cell as the sequencing has it; parts of one route are alike but for the precedences."""
    names, kinds = ("in", "a", "b", "out"), ("storage", "machine", "machine", "storage")
    stations = [
        Station(name, kind, room, s)  # type: ignore[arg-type]
        for name, kind, room, s in zip(names, kinds, cell.room, cell.process, strict=True)
    ]
    routes = dict.fromkeys(cell.routes)
    products = {r: Product(f"p{n}", (tuple(Stage(names[s]) for s in r),)) for n, r in enumerate(routes)}
    empty, loaded = (np.array(table) * (1 - np.eye(4)) for table in (cell.empty, cell.loaded))
    waits = [
        Precedence((a + 1,), RouteStep(names[cell.routes[a][k]]), (b + 1,), RouteStep(names[cell.routes[b][j]]))
        for a, k, b, j in cell.waits
    ]
    return Cell(
        tuple(stations),
        tuple(products.values()),
        tuple(products[route].name for route in cell.routes),
        empty,
        loaded,
        one_robot("in"),
        precedences=tuple(waits),
    )


SEEDS = [seed for seed in range(100) if shortest(drawn(seed)) < inf][:60]


@pytest.mark.parametrize("seed", SEEDS)
def test_the_shortest_order_is_the_one_that_enumeration_finds(seed: int) -> None:
    cell, best = as_cell(drawn(seed)), shortest(drawn(seed))
    found = optimum(cell)
    assert found.proven
    assert found.cost == pytest.approx(best)
    assert simulate(cell, found.sequence).makespan_s == pytest.approx(best)


@pytest.mark.parametrize("seed", SEEDS[:12])
def test_the_constraint_model_finds_it_too(seed: int) -> None:
    found = cp_sat(as_cell(drawn(seed)), time_limit_s=60.0, hint=optimum(as_cell(drawn(seed))).sequence)
    assert found.status == "optimal"
    assert found.cost == pytest.approx(shortest(drawn(seed)))


@pytest.mark.parametrize("method", [name for name in SEQUENCERS if name != "earliest-due"])
def test_every_method_keeps_to_it_or_says_that_it_found_nothing(method: str) -> None:
    """A rule that looks at one step only may come to a deadlock, as in any cell that has one."""
    found = 0
    for seed in SEEDS[:6]:
        cell = as_cell(drawn(seed))
        try:
            sequence = find_sequence(cell, method, Search(episodes=60), 0).sequence
        except WorkFailed as failed:
            if "came to its end" not in str(failed):
                raise
            continue
        assert simulate(cell, sequence).makespan_s >= shortest(drawn(seed)) - 1e-6
        found += 1
    assert found


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rest_of_a_run_allows_the_same_wherever_it_is_cut(seed: int) -> None:
    run, rng = Run(as_cell(drawn(seed))), np.random.default_rng(seed)
    while allowed := run.allowed():
        rest = rest_of(run)
        assert rest.cell is not None
        assert (Run(rest.cell).allowed(), rest.stuck) == (allowed, {})
        run.move(int(rng.choice(allowed)))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_compiled_run_allows_the_same(seed: int) -> None:
    from lab.sequencing.simulate import kernels

    cell, rng = as_cell(drawn(seed)), np.random.default_rng(seed)
    arrays, compiled, run = cell_arrays(cell), run_arrays(cell), Run(cell)
    kernels.reset(arrays, compiled, np.uint64(0))
    while not run.done:
        count = kernels.list_allowed(arrays, compiled)
        assert tuple(compiled.allowed[:count].tolist()) == run.allowed()
        if not count:
            break
        taken = int(rng.integers(count))
        run.move(int(compiled.allowed[taken]))
        kernels.move(arrays, compiled, taken, np.uint64(0))
