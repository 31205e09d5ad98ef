"""The checker of schedules: right ones of the simulation pass, whatever the cell; each kind of wrong one is caught."""

import os
from collections.abc import Callable
from copy import deepcopy
from math import inf
from typing import Any

import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import rows_of
from lab.sequencing.methods.cp_sat import cp_sat
from lab.sequencing.methods.portfolio import best_known
from lab.sequencing.search import SAME
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run, branch
from lab.tasks.cell_file import CellFile
from lab.tasks.task_file import load_cell
from lab_studies.comparisons.schedule_checker import faults

Rows = list[dict[str, Any]]
Plain = dict[str, Any]


def decided(file: CellFile, choose: Callable[[tuple[int, ...]], int]) -> tuple[Rows, float] | None:
    """The rows and the makespan of a run whose decisions are chosen one by one; None when it ends in a deadlock."""
    cell, sequence = file.cell(), list[int]()
    run = Run(cell)
    while allowed := run.allowed():
        sequence.append(choose(allowed))
        run.move(sequence[-1])
    if not run.done:
        return None
    schedule = simulate(cell, sequence)
    return rows_of(schedule, cell, "planned"), schedule.makespan_s


@st.composite
def plain_cells(draw: st.DrawFn) -> Plain:
    """A cell as a file has it: robots (none, too), machines with room for one or a queue, setups, releases, buffers, windows."""
    seconds = st.integers(0, 9).map(float)
    machines = [f"m{n}" for n in range(draw(st.integers(1, 3)))]
    robots = [
        {"name": f"r{n}", "start": "in", "speed": draw(st.sampled_from([1.0, 2.0]))}
        for n in range(draw(st.integers(0, 3)))
    ]
    jobs = [f"job{n}" for n in range(draw(st.integers(1, 3)))]
    stations: list[Plain] = [{"name": name, "kind": "storage", "capacity": "unlimited"} for name in ("in", "out")]
    stations.append({"name": "buffer", "kind": "buffer", "capacity": 1})
    for name in machines:
        room = draw(st.sampled_from(["unlimited", 1, 2]))
        one: Plain = {"name": name, "kind": "machine", "capacity": room, "processing_s": 1.0}
        if not robots or draw(st.booleans()):
            one["servers"] = 1 if room == 1 else draw(st.integers(1, 2))
            one["setup_s"] = {a: {b: draw(seconds) for b in jobs} for a in jobs} if draw(st.booleans()) else {}
        elif room == "unlimited":
            one["capacity"] = 2
        if draw(st.integers(0, 4)) == 0:
            one["at_most_s"] = 20.0
        stations.append(one)
    served = {one["name"] for one in stations if "servers" in one}
    products, through = list[Plain](), False
    for name in jobs:
        visited = draw(st.permutations(machines))
        stages: list[Plain] = [{"station": machine, "processing_s": draw(seconds)} for machine in visited]
        if robots and visited[0] not in served and draw(st.booleans()):
            stages[0]["buffer"] = "buffer"
            through = True
        out = [{"station": "out"}] if robots and (visited[-1] not in served or draw(st.booleans())) else []
        products.append({"name": name, "routes": [[{"station": "in"}, *stages, *out]]})
    if not any(stage["station"] == "out" for product in products for stage in product["routes"][0]):
        stations.pop(1)
    if not through:
        stations = [one for one in stations if one["name"] != "buffer"]
    names = [one["name"] for one in stations]
    order = [draw(st.sampled_from(jobs)) for _ in range(draw(st.integers(1, 4)))]
    cell: Plain = {"name": "drawn", "order": order, "stations": stations, "products": products, "robots": robots}
    if draw(st.booleans()):
        cell["release_s"] = [draw(seconds) for _ in order]
    if len(robots) > 1 and draw(st.booleans()):
        ends = [(names[n], names[draw(st.integers(0, n - 1))]) for n in range(1, len(names))]
        cell["track"] = {"stretches": [[a, b, float(draw(st.integers(1, 9)))] for a, b in ends]}
        return cell
    for table in ("travel", "loaded"):
        cell[table] = {a: {b: draw(seconds) for b in names if b != a} for a in names}
    return cell


def as_file(cell: Plain) -> CellFile:
    return CellFile.model_validate(cell)


@settings(max_examples=150)
@given(cell=plain_cells(), data=st.data())
def test_what_the_simulation_does_is_right_and_its_damage_is_caught(cell: Plain, data: st.DataObject) -> None:
    found = decided(as_file(cell), lambda allowed: data.draw(st.sampled_from(allowed)))
    if found is None:
        return
    rows, makespan_s = found
    assert faults(cell, rows, makespan_s) == faults(as_file(cell).model_dump(), rows, makespan_s) == []
    assert faults(cell, rows, makespan_s + 0.5)
    works = [n for n, row in enumerate(rows) if row["operation"] in ("carry", "process")]
    number = data.draw(st.sampled_from(works))
    assert faults(cell, rows[:number] + rows[number + 1 :], makespan_s), "a row left out"
    assert faults(cell, [*rows, rows[number]], makespan_s), "a row twice"
    processes = [n for n in works if rows[n]["operation"] == "process"]
    longer = deepcopy(rows)
    longer[data.draw(st.sampled_from(processes))]["end_s"] += 0.5
    assert faults(cell, longer, makespan_s), "work that takes longer than it does"


NODES = 20_000  # of a search through all lists of decisions; a larger cell is passed over


def least_of_all(cell: Cell) -> float | None:
    """The least makespan of all lists of decisions: each state that was reached is gone on from once. None: too many."""
    best, seen, open_runs = inf, set[Any](), [Run(cell)]
    while open_runs:
        run = open_runs.pop()
        best = min(best, run.end_s) if run.done else best
        for decision in run.allowed():
            ahead = branch(run)
            ahead.move(decision)
            key = (
                *ahead.locations,
                *ahead.ready_s,
                *ahead.robots_at,
                *ahead.robots_s,
                ahead.end_s,
                repr(vars(ahead.rooms)),
                repr(ahead.servers),
                *(*ahead.held, *ahead._fetched_s, *ahead.put_s, *ahead._kept_s),
                *ahead.track_s,
            )
            if ahead.end_s < best and key not in seen:
                seen.add(key)
                open_runs.append(ahead)
        if len(seen) > NODES:
            return None
    return best


# A track keeps a part of this one waiting for longer than it may, if the decisions are taken in the order of their ends.
BURNS: Plain = {
    "name": "drawn",
    "order": ["job0", "job0"],
    "stations": [
        {"name": "in", "kind": "storage", "capacity": "unlimited"},
        {"name": "out", "kind": "storage", "capacity": "unlimited"},
        {"name": "buffer", "kind": "buffer", "capacity": 1},
        {
            "name": "m0",
            "kind": "machine",
            "capacity": "unlimited",
            "processing_s": 1.0,
            "servers": 1,
            "at_most_s": 20.0,
        },
        {"name": "m1", "kind": "machine", "capacity": 2, "processing_s": 1.0, "at_most_s": 20.0},
        {"name": "m2", "kind": "machine", "capacity": 2, "processing_s": 1.0, "at_most_s": 20.0},
    ],
    "products": [
        {
            "name": "job0",
            "routes": [
                [
                    {"station": "in"},
                    {"station": "m1", "processing_s": 7.0, "buffer": "buffer"},
                    {"station": "m0", "processing_s": 0.0},
                    {"station": "m2", "processing_s": 9.0},
                    {"station": "out"},
                ]
            ],
        }
    ],
    "robots": [{"name": f"r{number}", "start": "in", "speed": speed} for number, speed in enumerate((1.0, 2.0, 1.0))],
    "release_s": [0.0, 0.0],
    "track": {
        "stretches": [
            ["out", "in", 9.0],
            ["buffer", "in", 1.0],
            ["m0", "in", 3.0],
            ["m1", "out", 1.0],
            ["m2", "m1", 7.0],
        ]
    },
}


@settings(max_examples=int(os.environ.get("LAB_RANDOM_CELLS", "8")), deadline=None)
@example(cell=BURNS)
@given(cell=plain_cells())
def test_three_solvers_and_the_checker_agree(cell: Plain) -> None:
    """All lists of decisions, CP-SAT, and the search that fits the cell: by states, by tours, or the portfolio.

    None of them proves more than the least, finds less, or has an order that the checker refuses.
    With LAB_RANDOM_CELLS=500 in the environment it is tried on so many cells.
    """
    built = as_file(cell).cell()
    if not built.unfinished:
        return
    least = least_of_all(built)
    event("too many lists of decisions" if least is None else "no order" if least == inf else "compared")
    if least is None:
        return
    if least == inf:
        with pytest.raises(WorkFailed):
            best_known(built, time_limit_s=10.0)
        return
    own, other = cp_sat(built, time_limit_s=3.0), best_known(built, time_limit_s=3.0)
    event("all prove" if other.proven and own.status == "optimal" else "not all prove in their time")
    for sequence, value, bound in ((own.sequence, own.cost, own.bound), (other.sequence, other.cost, other.bound)):
        assert bound <= least + SAME <= value + 2 * SAME
        schedule = simulate(built, sequence)
        assert schedule.makespan_s == pytest.approx(value)
        assert faults(cell, rows_of(schedule, built, "planned"), schedule.makespan_s) == []


@pytest.mark.parametrize("name", ["fms", "toast-case-1", "toast-case-2", "toast-case-1-window", "hoist-pu"])
@settings(max_examples=10)
@given(data=st.data())
def test_the_cells_that_ship_pass(name: str, data: st.DataObject) -> None:
    """Pallets, services, arrivals, buffers and windows among them."""
    file = load_cell(name)
    found = decided(file, lambda allowed: data.draw(st.sampled_from(allowed)))
    if found is not None:
        assert faults(file.model_dump(), *found) == []


# ---- each kind of fault, by hand: two jobs, two robots, a machine with a queue and one that holds one part ----------

SHOP: Plain = {
    "name": "shop",
    "order": ["a", "b"],
    "stations": [
        {"name": "in", "kind": "storage", "capacity": "unlimited"},
        {"name": "saw", "kind": "machine", "capacity": 2, "servers": 1},
        {"name": "oven", "kind": "machine", "capacity": 1},
        {"name": "out", "kind": "storage", "capacity": "unlimited"},
    ],
    "products": [
        {"name": name, "routes": [["in", *({"station": m, "processing_s": 4.0} for m in ("saw", "oven")), "out"]]}
        for name in "ab"
    ],
    "robots": [{"name": "r1", "start": "in"}, {"name": "r2", "start": "in"}],
    "travel": {a: {b: 2.0 for b in ("in", "saw", "oven", "out") if b != a} for a in ("in", "saw", "oven", "out")},
}


def row(part: str, what: str, way: str, start_s: float, end_s: float, robot: str | None = None) -> Plain:
    origin, _, target = way.partition(" > ")
    return {
        "part": part,
        "product": part[0],
        "operation": what,
        "station": origin,
        "target": target or origin,
        "robot": robot,
        "start_s": start_s,
        "end_s": end_s,
    }


RIGHT = [  # in > saw 2 s, saw 4 s, saw > oven 2 s, oven 4 s, oven > out 2 s; b waits for the saw, then for the oven
    row("a 1", "carry", "in > saw", 0, 2, "r1"),
    row("a 1", "process", "saw", 2, 6),
    row("a 1", "carry", "saw > oven", 6, 8, "r1"),
    row("a 1", "process", "oven", 8, 12),
    row("a 1", "carry", "oven > out", 12, 14, "r1"),
    row("b 2", "carry", "in > saw", 0, 2, "r2"),
    row("b 2", "process", "saw", 6, 10),
    row("b 2", "carry", "saw > oven", 10, 12, "r2"),
    row("b 2", "process", "oven", 12, 16),
    row("b 2", "carry", "oven > out", 16, 18, "r2"),
]
B_OUT = 9


def changed(*changes: tuple[int, Plain]) -> Rows:
    rows = deepcopy(RIGHT)
    for number, change in changes:
        rows[number] |= change
    return rows


def shop(**change: Any) -> Plain:
    return deepcopy(SHOP) | change


def saw(**change: Any) -> Plain:
    stations = deepcopy(SHOP["stations"])
    stations[1] |= change
    return shop(stations=stations)


def oven(**change: Any) -> Plain:
    stations = deepcopy(SHOP["stations"])
    stations[2] |= change
    return shop(stations=stations)


def test_the_right_one_by_hand_passes() -> None:
    as_file(SHOP).cell()
    assert faults(SHOP, RIGHT, 18.0) == []


@pytest.mark.parametrize(
    ("cell", "rows", "said"),
    [
        (SHOP, changed((9, {"end_s": 17.0})), "carry oven > out: 1, not 2 to inf"),
        (SHOP, changed((2, {"start_s": 5.0, "end_s": 7.0})), "picked in 'saw': 5, not 6 to inf"),
        (SHOP, changed((1, {"end_s": 5.0})), "worked on in 'saw': 3, not 4 to 4"),
        (SHOP, changed((3, {"start_s": 9.0, "end_s": 13.0})), "begun in 'oven': 9, not 8 to 8"),
        (SHOP, changed((6, {"start_s": 4.0, "end_s": 8.0})), "'saw' needs 2 servers"),
        (SHOP, RIGHT[:3] + RIGHT[4:], "process oven: -1, not 0 to inf"),
        (SHOP, [*RIGHT, row("a 1", "carry", "out > in", 14, 16, "r1")], "not on its route"),
        (SHOP, [*RIGHT, row("c 3", "carry", "in > saw", 0, 2, "r1")], "an impossible row"),
        (SHOP, changed((0, {"start_s": float("nan")})), "an impossible row"),
        (SHOP, changed((0, {"robot": "r3"})), "an impossible row"),
        (SHOP, changed((5, {"robot": "r1"})), "robot late"),
        (SHOP, [*RIGHT, row("a 1", "empty", "out > in", 14, 15, "r1") | {"part": None}], "robot short"),
        (shop(robots=[{"name": "r1", "start": "oven"}, {"name": "r2", "start": "in"}]), RIGHT, "robot late"),
        (
            shop(robots=[{"name": "r1", "start": "in", "speed": 0.5}, {"name": "r2", "start": "in"}]),
            RIGHT,
            "not 4 to inf",
        ),
        (
            shop(robots=[{"name": "r1", "start": "in", "serves": ["in", "saw"]}, {"name": "r2", "start": "in"}]),
            RIGHT,
            "barred",
        ),
        (saw(capacity=1), RIGHT, "'saw' holds 2"),
        (oven(), changed((4, {"start_s": 13.0, "end_s": 15.0})), "'oven' holds 2"),
        (saw(setup_s={"a": {"b": 1.0}}), RIGHT, "'saw' needs 2 servers"),
        (oven(at_most_s=0.5), changed((9, {"start_s": 17.0, "end_s": 19.0})), "picked in 'oven': 17, not 16 to 16.5"),
        (shop(release_s=[0.0, 1.0]), RIGHT, "picked in 'in': 0, not 1 to inf"),
        (shop(arrivals={"interval_s": 1.0}), RIGHT, "picked in 'in': 0, not 1 to inf"),
        (SHOP, changed((B_OUT, {"start_s": 16.5, "end_s": 18.5})), "the makespan is 18.5, not 18"),
    ],
)
def test_each_kind_of_fault_is_caught(cell: Plain, rows: Rows, said: str) -> None:
    assert any(said in fault for fault in faults(cell, rows, 18.0)), faults(cell, rows, 18.0)


def test_two_on_a_stretch_are_seen() -> None:
    """r1 brings a 1 to the saw in 2 s, and r2 comes from the oven: on the stretch between they meet, one second too early."""
    cell = shop(track={"stretches": [["in", "saw", 2.0], ["saw", "oven", 3.0], ["oven", "out", 2.0]]})
    del cell["travel"]
    late = [row("a 1", "carry", "in > saw", 0, 2, "r1"), row("b 2", "carry", "in > saw", 2, 4, "r2")]
    assert not [one for one in faults(cell, late, 4.0) if "two robots on stretch" in one]
    early = [late[0], late[1] | {"start_s": 1.0, "end_s": 3.0}]
    assert "two robots on stretch 0 of the track at 2" in faults(cell, early, 4.0)
    back = [row("a 1", "carry", "in > oven", 0, 5, "r1"), row("b 2", "carry", "oven > in", 2, 7, "r2")]
    assert "two robots on stretch 1 of the track at 5" in faults(cell, back, 7.0)


def test_service_is_by_who_picks_and_as_long_as_it_takes() -> None:
    served = deepcopy(SHOP)
    for product in served["products"]:
        product["routes"][0][2]["service_s"] = 1.0
    rows = changed((4, {"start_s": 13.0, "end_s": 15.0}), (7, {"end_s": 13.0}), (8, {"start_s": 13.0, "end_s": 17.0}))
    rows[9] |= {"start_s": 18.0, "end_s": 20.0}
    services = [row("a 1", "service", "oven", 12, 13, "r1"), row("b 2", "service", "oven", 17, 18, "r2")]
    assert faults(served, [*rows, *services], 20.0) == []
    assert any("service in 'oven'" in one for one in faults(served, rows, 20.0))
    services[1] |= {"start_s": 17.5}
    assert any("service in 'oven': 0.5, not 1" in one for one in faults(served, [*rows, *services], 20.0))


def test_a_pallet_goes_ahead_of_its_part() -> None:
    file = load_cell("fms")
    found = decided(file, lambda allowed: allowed[0])
    assert found is not None
    rows, makespan_s = found
    late = deepcopy(rows)
    pallet = next(one for one in late if one["operation"] == "pallet")
    pallet["start_s"], pallet["end_s"] = pallet["start_s"] + 500.0, pallet["end_s"] + 500.0
    assert any("pallet" in one for one in faults(file.model_dump(), late, makespan_s))
    without = [one for one in rows if one["operation"] != "pallet"]
    assert any("pallet" in one for one in faults(file.model_dump(), without, makespan_s))
