"""The oracle itself: cells small enough to redo by hand, every rule of the check of plans, and no import of the lab."""

import ast
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from oracle.cell import Carried, Cell, Plan, Robot, Stage, Station, Worked
from oracle.cycle import best_cycle, repeated
from oracle.model import best
from oracle.rules import value_of, violations

MOVE_S = 5.0
WAITED_S, LARGER_S = 140, 155


def every_way(names: list[str], seconds: float = MOVE_S) -> dict[tuple[str, str], float]:
    return {(a, b): seconds for a in names for b in names if a != b}


def in_a_row(*machines: Station, work_s: float, parts: int, robots: int = 1, at_most_s: float | None = None) -> Cell:
    """Parts that go through all of these machines, each for as long; every way takes 5 s."""
    stations = (Station("in"), *machines, Station("out"))
    way = tuple(
        Stage(one.name, work_s if one.machine else 0.0, at_most_s=at_most_s if one.machine else None)
        for one in stations
    )
    travel = every_way([one.name for one in stations])
    carriers = tuple(Robot(f"r{n + 1}", "in") for n in range(robots))
    return Cell(stations, {"p": (way,)}, ("p",) * parts, travel, travel, carriers)


def machine(name: str, capacity: int = 1, servers: int | None = None) -> Station:
    return Station(name, capacity, True, servers)


def test_the_oracle_imports_nothing_of_the_lab() -> None:
    for file in (Path(__file__).parent / "oracle").glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not [name for name in names if name.split(".")[0] in ("lab", "against_oracle")], file


def test_one_part_takes_its_moves_and_its_work() -> None:
    found = best(in_a_row(machine("m1"), machine("m2"), work_s=20, parts=1))
    assert (found.status, found.value) == ("optimal", 5 + 20 + 5 + 20 + 5)


def test_transfers_of_two_robots_make_room_for_each_other() -> None:
    """Issue 33: three parts, two machines of 20 s, all moves 5 s. At 45 s one robot takes part 2 out of m1, the other one puts
    part 3 there, and takes part 1 out of m2 at 50 s, where the first one puts part 2: no order of whole transfers, one after
    the other, has that. It is the least: m1 works for 3 * 20 s from 5 s on, and part 3 then still needs 5, 20 and 5 s."""
    cell = in_a_row(machine("m1"), machine("m2"), work_s=20, parts=3, robots=2)
    found = best(cell)
    assert (found.status, found.value) == ("optimal", 5 + 3 * 20 + 5 + 20 + 5)
    assert found.plan is not None
    assert violations(cell, found.plan) == []


def test_two_robots_with_blocking_at_a_larger_size() -> None:
    """Issue 33's third row at a size that is solved at once: three parts, machines of 20, 30 and 25 s in a line."""
    names = ["in", "m1", "m2", "m3", "out"]
    travel = {(a, b): 2.0 + 3 * abs(i - j) for i, a in enumerate(names) for j, b in enumerate(names) if i != j}
    way = (Stage("in"), Stage("m1", 20), Stage("m2", 30), Stage("m3", 25), Stage("out"))
    stations = (Station("in"), machine("m1"), machine("m2"), machine("m3"), Station("out"))
    cell = Cell(stations, {"p": (way,)}, ("p",) * 3, travel, travel, (Robot("r1", "in"), Robot("r2", "in")))
    found = best(cell)
    assert found.plan is not None
    assert (found.status, found.value, violations(cell, found.plan)) == ("optimal", LARGER_S, [])


def test_a_robot_waits_on_purpose_before_it_brings_a_part() -> None:
    """Two tanks, 10 and 50 s, to be left within 10 s. Part 1 is in the second one from 20 to 70 s. Part 2, brought to the first
    one at once, would be spoilt there; brought late enough, it is done when the second one is free."""
    way = (Stage("in"), Stage("t1", 10, at_most_s=10), Stage("t2", 50, at_most_s=10), Stage("out"))
    cell = replace(in_a_row(machine("t1"), machine("t2"), work_s=10, parts=2), routes={"p": (way,)})
    found = best(cell)
    assert found.plan is not None
    assert (found.status, violations(cell, found.plan)) == ("optimal", [])
    assert found.value == WAITED_S < 2 * (5 + 10 + 5 + 50 + 5) + 5
    second = next(one for one in found.plan.carried if one.part == 2 and one.origin == "in")
    assert second.drop_s >= 70 - 10 - 10  # it could have been there at 30


def test_a_hoist_line_of_three_tanks_and_four_carriers() -> None:
    """Issue 33's first row at a size that is solved at once."""
    names, soak = ["load", "t1", "t2", "t3", "unload"], {"t1": (85, 20), "t2": (60, 10), "t3": (40, 5)}
    empty = {(a, b): 2.0 * abs(i - j) for i, a in enumerate(names) for j, b in enumerate(names) if i != j}
    loaded = dict.fromkeys(pairwise(names), 12.0)
    way = tuple(Stage(one, soak[one][0], at_most_s=soak[one][1]) if one in soak else Stage(one) for one in names)
    stations = tuple(machine(one) if one in soak else Station(one) for one in names)
    cell = Cell(stations, {"c": (way,)}, ("c",) * 4, empty, loaded, (Robot("hoist", "unload"),))
    found = best(cell)
    assert found.plan is not None
    assert (found.status, found.value, violations(cell, found.plan)) == ("optimal", 580, [])


def test_a_cycle_of_two_parts_uses_both_mills() -> None:
    """Issue 33: two mills of 90 s, a washer of two places. With one part a cycle one mill works every period: 90 s, and 15 s in
    which its part is taken to the washer and the next one fetched; with two parts each mill does so once."""
    stations = (Station("in"), machine("mill 1"), machine("mill 2"), machine("washer", 2), Station("out"))
    ways = tuple((Stage("in"), Stage(mill, 90), Stage("washer", 60), Stage("out")) for mill in ("mill 1", "mill 2"))
    travel = every_way([one.name for one in stations])
    cell = Cell(stations, {"p": ways}, ("p",), travel, travel, (Robot("r", "in"),))
    one, two = (best_cycle(cell, ("p",) * parts) for parts in (1, 2))
    assert (one.status, one.period_s) == ("optimal", 105)
    assert (two.status, two.period_s) == ("optimal", 105)
    eight = replace(cell, order=("p",) * 8)
    assert violations(eight, repeated(two, 2, 4)) == []


@pytest.mark.parametrize(
    ("objective", "value"),
    [("makespan", 65), ("mean-tardiness", 5), ("tardy-parts", 1), ("machine-idle", 65 - 40), ("robot-idle", 40)],
)
def test_objectives_by_hand(objective: str, value: float) -> None:
    """Two parts through a machine of 20 s: from 5 to 25 and from 40 to 60 s, out at 30 and 65 s; meanwhile the robot waits."""
    cell = replace(in_a_row(machine("m"), work_s=20, parts=2), due_s=(30.0, 55.0))
    found = best(cell, objective)  # type: ignore[arg-type]
    assert found.plan is not None
    assert (found.status, found.value) == ("optimal", value)
    assert value_of(cell, found.plan, objective) == value  # type: ignore[arg-type]


# ---- the rules

CELL = in_a_row(machine("m"), work_s=20, parts=2, at_most_s=10)
ONE = Carried(1, "r1", "in", "m", 0, 0, 0, 5)
OUT = Carried(1, "r1", "m", "out", 5, 25, 25, 30)
TWO = Carried(2, "r1", "in", "m", 30, 35, 35, 40)
LAST = Carried(2, "r1", "m", "out", 40, 60, 60, 65)
PLAN = (ONE, OUT, TWO, LAST)


def later(one: Carried, by_s: float) -> Carried:
    return replace(
        one, leave_s=one.leave_s + by_s, pick_s=one.pick_s + by_s, out_s=one.out_s + by_s, drop_s=one.drop_s + by_s
    )


def test_a_plan_that_keeps_to_all() -> None:
    assert violations(CELL, Plan(PLAN)) == []
    assert value_of(CELL, Plan(PLAN), "makespan") == 65
    assert best(CELL).value == 65


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ((ONE, replace(OUT, pick_s=20, out_s=20, drop_s=25), TWO, LAST), "but ready at 25"),
        ((ONE, later(OUT, 11), later(TWO, 11), later(LAST, 11)), "later than 35"),
        ((replace(ONE, drop_s=4), OUT, TWO, LAST), "too fast"),
        ((ONE, OUT, replace(TWO, pick_s=33), LAST), "needs 5"),
        ((ONE, OUT, TWO), "not on a route"),
        ((ONE, replace(OUT, origin="in"), TWO, LAST), "not on a route"),
        ((ONE, OUT, replace(TWO, leave_s=20, pick_s=25, out_s=25, drop_s=30), LAST), "is free at 30"),
    ],
)
def test_what_breaks_a_rule_is_named(plan: tuple[Carried, ...], words: str) -> None:
    found = violations(CELL, Plan(plan))
    assert [one for one in found if words in one], found


def test_a_full_station_takes_no_part() -> None:
    """Of one robot not even in the instant in which it takes the other one; a second robot makes room in time."""
    cell = in_a_row(machine("m"), work_s=20, parts=2, robots=2)
    early = replace(TWO, leave_s=5, pick_s=10, out_s=10, drop_s=25)
    assert violations(
        cell, Plan((ONE, early, replace(OUT, robot="r1", leave_s=25), replace(LAST, pick_s=45, out_s=45, drop_s=50)))
    )
    other = replace(early, robot="r2", leave_s=0)
    out = [OUT, replace(LAST, leave_s=30, pick_s=45, out_s=45, drop_s=50)]
    assert violations(cell, Plan((ONE, other, *out))) == []


def test_a_part_that_only_passes_a_shelf_needs_room_on_it() -> None:
    """A shelf with one place between two machines: a part that stands on it keeps the others off it."""
    stations = (Station("in"), machine("m1"), Station("shelf", 1), machine("m2"), Station("out"))
    way = (Stage("in"), Stage("m1", 1), Stage("shelf"), Stage("m2", 100), Stage("out"))
    travel = every_way([one.name for one in stations])
    cell = Cell(stations, {"p": (way,)}, ("p",) * 3, travel, travel, (Robot("r1", "in"), Robot("r2", "in")))
    found = best(cell)
    assert found.plan is not None
    assert violations(cell, found.plan) == []


def test_servers_and_setups() -> None:
    """One server: 10 s a part, and 7 s from a to b; none from b to a."""
    stations = (Station("in"), Station("m", None, True, 1, {("a", "b"): 7.0}))
    routes = {name: ((Stage("in"), Stage("m", 10)),) for name in "ab"}
    cell = Cell(stations, routes, ("a", "b"), {}, {}, ())
    assert best(cell).value == 20
    assert violations(cell, Plan((), (Worked(2, "m", 0, 10), Worked(1, "m", 10, 20)))) == []
    assert violations(cell, Plan((), (Worked(1, "m", 0, 10), Worked(2, "m", 10, 20))))
    assert violations(cell, Plan((), (Worked(1, "m", 0, 10), Worked(2, "m", 17, 27)))) == []


def test_parts_that_come_are_taken_in_their_order() -> None:
    cell = replace(in_a_row(machine("m"), work_s=20, parts=2), interval_s=(10.0, 10.0))
    assert best(cell).value == 65 + 10
    assert [one for one in violations(cell, Plan(PLAN)) if "it comes at 10" in one]


def test_two_on_one_stretch_are_named() -> None:
    """The track in - m - out, 5 s each: robots that meet in the middle."""
    stations = (Station("in"), machine("m", 2), Station("out"))
    times = {
        ("in", "m"): 5.0,
        ("m", "in"): 5.0,
        ("m", "out"): 5.0,
        ("out", "m"): 5.0,
        ("in", "out"): 10.0,
        ("out", "in"): 10.0,
    }
    routes = {"p": ((Stage("in"), Stage("m", 1), Stage("out")),)}
    robots = (Robot("r1", "in"), Robot("r2", "out"))
    cell = Cell(stations, routes, ("p", "p"), times, times, robots, track=(("in", "m", 5.0), ("m", "out", 5.0)))
    found = best(cell)
    assert found.plan is not None
    assert (found.status, violations(cell, found.plan)) == ("optimal", [])
    meets = replace(TWO, robot="r2", leave_s=0, pick_s=10, out_s=10, drop_s=15)
    assert [one for one in violations(cell, Plan((later(ONE, 5), OUT, meets, LAST))) if "of the track" in one]
