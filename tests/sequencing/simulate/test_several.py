"""Several robots and servers, decided event by event: by hand, and against a plain simulation that shares no code with it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from against_oracle.translated import plain_cell
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracle.stops import Stops
from oracle.stops import Told as Command

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.cell.objectives import cost
from lab.sequencing.cell.stations import Product, Robot, Stage, Station
from lab.sequencing.methods.fifo import first_in_first_out
from lab.sequencing.methods.rollout import by_rule, replan
from lab.sequencing.methods.rules import RULES, any_order
from lab.sequencing.simulate.execution import WAIT, Observed, Policy
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.several import Dispatch, Known, dispatched

Shops = Callable[..., st.SearchStrategy[Cell]]
POLICIES: dict[str, Policy] = {
    "nearest-ready": by_rule(RULES["nearest-ready"]),
    "longest-remaining-work": by_rule(RULES["longest-remaining-work"]),
    "fifo": first_in_first_out,
    "replan": replan(),
}


@dataclass(frozen=True)
class Told(Episode):
    """An episode whose times are given: works, by part and station; stops, by robot, from when until when."""

    works: dict[tuple[int, str], float] = field(default_factory=dict)
    stops: dict[int, tuple[tuple[float, float], ...]] = field(default_factory=dict)

    def processing_s(self, part: int, position: int) -> float:
        drawn_s = super().processing_s(part, position)
        return (
            self.works.get((part, self.cell.names[self.cell.positions[position].station]), drawn_s) if drawn_s else 0.0
        )

    def outages(self, robot: int) -> Iterator[tuple[float, float]]:
        yield from self.stops.get(robot, ())


@dataclass(frozen=True)
class Later(Told):
    """One in which all that goes on at a time lasts longer, and no robot stops after it."""

    now_s: float = 0.0
    more_s: float = 0.0

    def lasts_s(self, part: int, position: int, begin_s: float) -> float:
        lasts_s = super().lasts_s(part, position, begin_s)
        return lasts_s + self.more_s if begin_s + lasts_s > self.now_s else lasts_s

    def outages(self, robot: int) -> Iterator[tuple[float, float]]:
        for from_s, until_s in super().outages(robot):
            if from_s <= self.now_s:
                yield from_s, until_s + self.more_s if until_s > self.now_s else until_s


def line(parts: int, starts: tuple[str, ...] = ("in", "in"), machines: int = 1, work_s: float = 30.0) -> Cell:
    """Parts from `in`, through one of the machines, to `out`; every way takes 10 s, with a part or without."""
    names = [f"m{n + 1}" for n in range(machines)]
    stations = (
        Station("in", "storage", 9), *(Station(name, "machine", 1, work_s) for name in names), Station("out", "storage", 9)
    )  # fmt: skip
    routes = tuple((Stage("in"), Stage(name), Stage("out")) for name in names)
    table = 10.0 * (1.0 - np.eye(len(stations)))
    robots = tuple(Robot(f"robot {n + 1}", start) for n, start in enumerate(starts))
    return Cell(stations, (Product("box", routes),), ("box",) * parts, table, table, robots)


def broken(cell: Cell, repair_s: float = 0.0, **stops: tuple[tuple[float, float], ...]) -> Told:
    """An episode in which robots stop: r1, r2 and so on."""
    chance = Chance("constant", robot_repair_s=repair_s)
    return Told(cell, chance, stops={int(name[1:]) - 1: own for name, own in stops.items()})


def moves(found: Dispatch) -> list[tuple[str, int, str, float, float]]:
    """Who carried which part where, from when until when."""
    return [(one.by, one.part, one.target, one.pick_s, one.drop_s) for one in found.moves]


# ---- by hand ----------------------------------------------------------------------------------------------------------


def test_what_a_broken_robot_holds_waits_with_it() -> None:
    """It takes the box at 0, stops at 4 for 20 s, and has 6 s of its way left: it is there at 30. The other one, which is free,
    can do nothing for the box. Worked on until 60; robot 2 is there by then and brings it out at 70."""
    cell = line(1, starts=("in", "out"))
    found = dispatched(cell, replan(), broken(cell, 20.0, r1=((4.0, 24.0),)))
    assert [one[1:] for one in moves(found)] == [(1, "m1", 0.0, 30.0), (1, "out", 60.0, 70.0)]
    assert found.run.end_s == 70.0


def test_the_work_of_a_broken_robot_is_given_to_another() -> None:
    """Both robots stand at `in`, the box is in m1 from 10 on, done at 40. At 10 robot 1, which brought it, breaks down at m1 for
    500 s. Robot 2 stands at `in`: it drives to m1 and takes the box out as it is done: 50. By the list robot 1 does it: 520."""
    cell = line(1)
    times = broken(cell, 500.0, r1=((10.0, 510.0),))
    found = dispatched(cell, replan(), times)
    assert moves(found) == [("robot 1", 1, "m1", 0.0, 10.0), ("robot 2", 1, "out", 40.0, 50.0)]
    assert [(one.robot, cell.names[one.target], one.leave_s, one.reach_s) for one in found.drives] == [
        (1, "m1", 10.0, 20.0)
    ]
    assert follow(cell, (1, 1), times).end_s == 520.0


def test_a_short_stop_is_waited_for() -> None:
    """As before, but robot 1 is repaired after 20 s, at 30, and stands there: so says the mean, too. Robot 2 is asked at 10, has
    nothing better to do and comes, too; who picks at 40 is one of them, and nobody has to be sent for: 50."""
    cell = line(1)
    found = dispatched(cell, replan(), broken(cell, 20.0, r1=((10.0, 30.0),)))
    assert found.run.end_s == 50.0


def test_a_robot_that_breaks_down_on_its_way_to_a_part_leaves_it_to_another() -> None:
    """Box 1 is in m1 from 10 on. Robot 2, at `out`, is on its way there when it breaks down at 4 for 200 s. Robot 1 has it."""
    cell = line(1, starts=("in", "out"))
    found = dispatched(cell, by_rule(RULES["nearest-ready"]), broken(cell, 200.0, r2=((4.0, 204.0),)))
    assert moves(found) == [("robot 1", 1, "m1", 0.0, 10.0), ("robot 1", 1, "out", 40.0, 50.0)]
    assert follow(cell, (1, 2), broken(cell, r2=((4.0, 204.0),))).end_s == 220.0  # 6 s of its way, then 10 with the box


def test_a_robot_with_a_part_over_a_full_station_waits_for_its_repair() -> None:
    """Robot 2 brings box 2 while box 1 is in m1, where it is done at 10 + 30. Robot 1 takes it out then; robot 2 could put its
    box down, but stands still from 35 to 60. Box 2 is done at 90, and out at 100."""
    cell = line(2)
    found = dispatched(cell, replan(), broken(cell, 20.0, r2=((35.0, 60.0),)))
    assert [one[:3] + one[4:] for one in moves(found)][:3] == [
        *(("robot 1", 1, "m1", 10.0), ("robot 2", 2, "m1", 60.0), ("robot 1", 1, "out", 50.0)),
    ]
    assert found.run.end_s == 100.0


def test_nobody_moves_and_nothing_is_lost_while_all_are_broken() -> None:
    cell = line(1)
    stops = ((5.0, 105.0),)
    found = dispatched(cell, replan(), broken(cell, 100.0, r1=stops, r2=stops))
    assert moves(found)[0][3:] == (0.0, 110.0)
    assert found.run.end_s == 150.0


def test_servers_are_decided_when_they_are_free() -> None:
    """Two parts that need no robot, one server, 10 s on average: part 1 takes 25, so that part 2 begins at 25."""
    stations = (Station("in", "storage", 9), Station("m", "machine", 9, 10.0, servers=1))
    cell = Cell(
        stations, (Product("p", ((Stage("in"), Stage("m")),)),), ("p", "p"), np.zeros((2, 2)), np.zeros((2, 2)), ()
    )
    found = dispatched(cell, replan(), Told(cell, works={(1, "m"): 25.0}))
    assert [(one.part, one.pick_s, one.end_s) for one in found.moves] == [(1, 0.0, 25.0), (2, 25.0, 35.0)]


def test_a_decision_that_nobody_was_asked_for() -> None:
    def seventh(seen: Observed, allowed: tuple[int, ...]) -> int:
        return 7

    with pytest.raises(BadInput, match=r"^decision 7 at 0 s: allowed are 1, 2$"):
        dispatched(line(1), lambda cell: seventh)


def test_who_only_waits_comes_to_no_end() -> None:
    found = dispatched(line(1), lambda cell: lambda seen, allowed: WAIT, broken(line(1), r1=((5.0, 9.0),)))
    assert (found.run.done, found.moves) == (False, [])


# ---- what is known ----------------------------------------------------------------------------------------------------


def test_what_is_not_over_is_expected_by_its_mean() -> None:
    """At 12 s: box 1 is in m1 since 10, for 99 s in truth: expected at 40, and at 50 expected now. Robot 1 is out of order from
    11 to 500: expected to be repaired 20 s from now on, whenever that is."""
    cell = line(2, machines=1)
    times = replace(broken(cell, 20.0, r1=((11.0, 500.0),)), works={(1, "m1"): 99.0})
    for now_s, ready_s, robot_s in ((12.0, 40.0, 32.0), (50.0, 50.0, 70.0)):
        dispatch = Dispatch(cell, times)
        dispatch.decide(lambda seen, allowed: 1 if 1 in allowed and seen.locations[0] == 0 else WAIT)
        dispatch.now_s = now_s
        seen = dispatch.observe()
        assert (seen.now_s, seen.ready_s[0], seen.robots_s[0]) == (now_s, ready_s, robot_s)


@settings(max_examples=40, deadline=None)
@given(data=st.data(), longer_s=st.floats(0.5, 1e5), seed=st.integers(0, 99))
def test_the_future_does_not_show(shops: Shops, data: st.DataObject, longer_s: float, seed: int) -> None:
    """Whatever goes on at a time may last longer, and any robot may stop after it: what is known is the same."""
    cell = data.draw(shops())
    assume(not cell.track)
    chance, now_s = Chance("exponential", robot_repair_s=9.0), float(data.draw(st.integers(0, 60)))
    stops = dict[int, tuple[tuple[float, float], ...]]()
    stops |= {n: ((5.0 * n + 3.0, 5.0 * n + 30.0),) for n in range(len(cell.robots))}
    found = []
    for more_s in (0.0, longer_s):
        dispatch = Dispatch(cell, Later(cell, chance, seed, stops=stops, now_s=now_s, more_s=more_s))
        choose = POLICIES["nearest-ready"](cell)
        dispatch.decide(choose)
        while dispatch.goes_on() and dispatch.now_s < now_s:
            dispatch.decide(choose)
        dispatch.now_s = now_s
        found.append({name: value for name, value in vars(dispatch.observe()).items() if name != "times"})
    assert found[0] == found[1]


def test_what_is_known_is_the_mean_and_what_is_over() -> None:
    cell = line(2)
    known = Known(cell, real=Told(cell, works={(1, "m1"): 7.0}), now_s=10.0)
    assert (known.lasts_s(1, 1, 3.0), known.lasts_s(1, 1, 4.0), known.lasts_s(1, 1, 99.0)) == (7.0, 30.0, 30.0)


# ---- against the plain simulation -------------------------------------------------------------------------------------


def commands(found: Dispatch) -> list[Command]:
    """What was told to whom, and when, in the order in which it was."""
    cell, told, moves = found.run.cell, list[Command](), iter(found.moves)
    for at_s, what, station in found.done:
        if station is None:
            move = next(moves)
            told.append(Command(at_s, "" if move.served else move.by, move.part, move.target))
        else:
            told.append(Command(at_s, cell.robots[what].name, 0, cell.names[station]))
    return told


def held_against_it(cell: Cell, times: Told, policy: Policy) -> Dispatch:
    """A policy's episode, which the plain simulation finds as it is."""
    found = dispatched(cell, policy, times)
    stops = {cell.robots[n].name: own for n, own in times.stops.items()}
    plain = Stops(plain_cell(cell), times.works, stops)
    plain.play(commands(found), until_s=found.run.end_s + 1.0)
    assert [part.ended_s for part in plain.parts.values()] == found.run.finished_s
    dropped = [(one.part, one.target, one.drop_s) for one in found.moves if not one.served]
    assert sorted(plain.dropped) == sorted(dropped)
    assert found.run.done
    assert max(part.ended_s or 0.0 for part in plain.parts.values()) == cost(found.run, "makespan")
    return found


def drawn(cell: Cell, rng: np.random.Generator) -> Told:
    """Whole times, and robots that stop for whole seconds."""
    works = {
        (part, cell.names[place.station]): float(rng.integers(1, 30))
        for part in range(1, cell.parts + 1)
        for place in cell.positions
        if place.product == cell.positions[cell.starts[part - 1]].product and place.processing_s
    }
    stops = {}
    for robot in range(len(cell.robots)):
        at_s = np.cumsum(rng.integers(3, 30, 12)).astype(float)
        stops[robot] = tuple(zip(at_s[::2].tolist(), at_s[1::2].tolist(), strict=True))
    return Told(cell, Chance("constant", robot_repair_s=15.0), works=works, stops=stops)


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("seed", range(6))
def test_a_line_is_as_the_plain_simulation_has_it(name: str, seed: int) -> None:
    cell = line(3, starts=("in", "out"), machines=1 + seed % 2)
    if seed % 2:  # the plain simulation knows one route a product
        products = tuple(Product(f"box {n}", (cell.products[0].routes[n],)) for n in range(2))
        cell = replace(cell, products=products, order=("box 0", "box 1", "box 0"))
    held_against_it(cell, drawn(cell, np.random.default_rng(seed)), POLICIES[name])


@settings(max_examples=60, deadline=None)
@given(data=st.data(), seed=st.integers(0, 10**6), name=st.sampled_from(sorted(POLICIES)))
def test_shops_are_as_the_plain_simulation_has_them(shops: Shops, data: st.DataObject, seed: int, name: str) -> None:
    """One robot beside servers, several, queues, changeovers, limited rooms."""
    cell = data.draw(shops())
    assume(cell.robots and not cell.track and not cell.serial)
    times = drawn(cell, np.random.default_rng(seed))
    assume(dispatched(cell, POLICIES[name], times).run.done)  # a rule may end in a deadlock
    held_against_it(cell, times, POLICIES[name])


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_where_nothing_is_drawn_the_planned_list_is_the_worst(shops: Shops, data: st.DataObject) -> None:
    """Planned anew from a list, it costs no more than the list; but where a server changes over before its part is there."""
    cell = data.draw(shops())
    assume(not cell.serial and not any(station.setups for station in cell.stations))
    listed = any_order(cell)
    assume(listed)
    assert dispatched(cell, replan(planned=listed)).run.end_s <= follow(cell, listed).end_s + 1e-6
