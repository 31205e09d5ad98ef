"""One pass through a cell: service, pallets, arrivals, routes to choose, free buffers, deadlocks, all by hand."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode
from lab.sequencing.cell.routes import part_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.cell.stations import UNLIMITED, Arrivals, Product, Robot, Route, Stage, Station, one_robot
from lab.sequencing.simulate.follow import simulate
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]


def build(stations: str, *routes: Route, parts: int = 2, **change: object) -> Cell:
    """Loaded moves 2 s, empty ones 1 s; "m" and "n" are machines of 10 s, "p", "q" and "b" buffers; the robot at "in".

    stations: names between "in" and "out", a letter each. All rooms are for one part. Each product has one route.
    """
    kinds = {"m": "machine", "n": "machine"}
    inner = [Station(name, kinds.get(name, "buffer"), 1, 10.0 if name in kinds else 0.0) for name in stations]  # type: ignore[arg-type]
    all_ = (Station("in", "storage", 9), *inner, Station("out", "storage", 9))
    table = 1.0 - np.eye(len(all_))
    described: dict[str, object] = {
        "products": tuple(Product(f"type {number}", (route,)) for number, route in enumerate(routes, 1)),
        "order": tuple(f"type {1 + number % len(routes)}" for number in range(parts)),
    }
    described |= {"empty_s": table, "loaded_s": 2.0 * table, "robots": one_robot("in")}
    return Cell(all_, **(described | change))  # type: ignore[arg-type]


def way(*stages: Stage | str) -> Route:
    """A route from "in" to "out"; a name alone is a stage without more."""
    named = [Stage(stage) if isinstance(stage, str) else stage for stage in stages]
    return (Stage("in"), *named, Stage("out"))


def moved(run: Run, *decisions: int) -> list[Move]:
    return [run.move(decision) for decision in decisions]


def test_the_robot_serves_a_machine_after_it_has_finished() -> None:
    """In at 2 s, done at 12 s, vacuumed until 16 s, out at 18 s."""
    run = Run(build("m", way(Stage("m", service_s=4.0)), parts=1))
    move = moved(run, 1, 1)[1]
    assert (move.reach_s, move.pick_s, move.drop_s, move.service_s) == (2.0, 16.0, 18.0, 4.0)
    assert (run.waited_s, run.processed_s, run.finished_s) == (10.0, 10.0, [18.0])


def test_service_takes_its_time_even_when_the_robot_comes_late() -> None:
    """Part 1 is done at 12 s. Part 2 goes through n meanwhile: in at 5 s, out at 17 s; 1 s to m, 4 s there, 2 s out."""
    cell = build("mn", way(Stage("m", service_s=4.0)), way("n"))
    run = Run(cell)
    assert [move.drop_s for move in moved(run, 1, 2, 2, 1)] == [2.0, 5.0, 17.0, 24.0]
    assert run.waited_s == 10.0


def test_a_stage_may_have_a_time_of_its_own() -> None:
    """3 s instead of the machine's 10 s."""
    assert simulate(build("m", way(Stage("m", processing_s=3.0)), parts=1), (1, 1)).makespan_s == 7.0


def palletised(parts: int = 1) -> Cell:
    """By p, its machine m, and q: the pallet stays in p, and has to be brought to q."""
    return build("pmq", way("p", Stage("m", pallet=True), "q"), parts=parts)


def test_a_pallet_is_brought_round_the_machine() -> None:
    """To p 2, into m 4 (done 14), back 5 and the pallet to q 7, to m 8, wait for 14, to q 16, away 18."""
    cell, run = palletised(), Run(palletised())
    moves = moved(run, 1, 1, 1, 1, 1)
    assert [move.drop_s for move in moves] == [2.0, 4.0, 7.0, 16.0, 18.0]
    assert [(move.origin, move.target, move.carries) for move in moves][1:4] == [
        ("p", "m", "part"),
        ("p", "q", "pallet"),
        ("m", "q", "part"),
    ]
    assert run.waited_s == 14.0 - 8.0
    assert run.occupied == [0] * len(cell.stations)


def test_a_pallet_takes_room_until_it_is_brought_on() -> None:
    """p is taken by the pallet of part 1 while that is in m; then q is, until part 1 has left on it."""
    run = Run(palletised(2))
    moved(run, 1, 1)
    assert run.allowed() == (1,)
    assert run.refusal(2) == "type 1 2 at 'in' cannot move on: 'p' full"
    moved(run, 1, 2)
    assert run.refusal(2) == "type 1 2 at 'p' cannot move on: 'm' full"
    moved(run, 1, 2)
    assert run.refusal(2) == "type 1 2 at 'p' cannot move on: 'q' full"
    moved(run, 1)
    assert run.allowed() == (2,)


def arriving(after: str, *interval_s: float) -> Cell:
    arrivals = Arrivals(interval_s, after)  # type: ignore[arg-type]
    return build("m", way("m"), parts=len(interval_s), arrivals=arrivals)


def test_parts_arrive_by_the_clock() -> None:
    """At 5 and at 9 s; the second has waited for 5 + 2 + 10 + 2 + 1 = 20 s."""
    run = Run(arriving("clock", 5.0, 4.0))
    assert run.ready_s == [5.0, 9.0]
    assert [move.pick_s for move in moved(run, 1, 1, 2, 2)] == [5.0, 17.0, 20.0, 32.0]
    assert run.waited_s == 5.0 + 10.0 + 10.0


def test_parts_arrive_after_the_pick_of_the_one_before() -> None:
    """At 5 s, and 30 s after it was taken: at 35 s; the robot is back at 20 s and waits."""
    run = Run(arriving("pick", 5.0, 30.0))
    assert [move.pick_s for move in moved(run, 1, 1, 2, 2)] == [5.0, 17.0, 35.0, 47.0]
    assert run.waited_s == 5.0 + 10.0 + 15.0 + 10.0


def test_the_next_part_sets_out_when_the_robot_picks_not_when_the_part_came() -> None:
    """The robot starts at "out": it picks at 1 s what has waited since 0.5 s; the next one comes at 1 + 8 s."""
    run = Run(build("m", way("m"), arrivals=Arrivals((0.5, 8.0), "pick"), robots=one_robot("out")))
    run.move(1)
    assert run.ready_s[1] == 9.0


@pytest.mark.parametrize("after", ["clock", "pick"])
def test_parts_that_arrive_are_taken_in_their_order(after: str) -> None:
    run = Run(arriving(after, 5.0, 4.0, 4.0))
    assert run.allowed() == (1,)
    assert run.refusal(3) == "type 1 3 has not come yet: type 1 1 is before it"
    moved(run, 1, 1)
    assert run.allowed() == (2,)


def test_a_schedule_stores_a_part_from_when_it_came() -> None:
    parts = simulate(arriving("clock", 5.0, 4.0), (1, 1, 2, 2)).parts
    assert [(a.kind, a.start_s, a.end_s) for a in parts if a.part == 2][:2] == [
        ("store", 9.0, 20.0),
        ("carry", 20.0, 22.0),
    ]


def test_a_part_chooses_its_route_once() -> None:
    """Two parts, m or n: entries 1 and 2 mean m, 3 and 4 mean n. After the choice there is one way on."""
    product = Product("type 1", (way("m"), way("n")))
    run = Run(build("mn", way("m"), products=(product,), order=("type 1",) * 2))
    assert run.allowed() == (1, 2, 3, 4)
    assert run.move(4).target == "n"
    assert run.allowed() == (1, 2), "n is taken; 2 now means out of it"
    assert run.refusal(4) == "type 1 2 at 'n' has no choice 2"
    assert [move.drop_s for move in moved(run, 1, 2, 1)] == [5.0, 14.0, 17.0]
    assert run.done


def test_a_decision_that_no_part_has(oven_cell: CellMaker) -> None:
    run = Run(oven_cell(2))
    assert [run.refusal(decision) for decision in (0, 3, -2)] == [
        "there is no part 0, only 1 to 2",
        "there is no part 3, only 1 to 2",
        "there is no part -2, only 1 to 2",
    ]


def test_a_busy_buffer_is_used_only_when_the_machine_is_full() -> None:
    run = Run(build("bm", way(Stage("m", "b"))))
    assert run.allowed() == (1, 2)
    assert run.move(1).target == "m"
    assert run.move(2).target == "b"
    assert run.allowed() == (1,)


def test_a_free_buffer_is_a_choice() -> None:
    """Entry 1 means m, 1 + 2 = 3 the buffer, also while m is free; from the buffer there is only m."""
    run = Run(build("bm", way(Stage("m", "b")), buffers="free"))
    assert run.allowed() == (1, 2, 3, 4)
    assert run.move(3).target == "b"
    assert run.allowed() == (1, 2), "the buffer is taken; 2 means m"
    assert run.move(2).target == "m"
    assert run.allowed() == (2,), "part 1 waits for m"
    assert [move.target for move in moved(run, 2, 1, 1)] == ["out", "m", "out"]


def test_a_full_machine_leaves_only_the_free_buffer() -> None:
    run = Run(build("bm", way(Stage("m", "b")), buffers="free"))
    run.move(1)
    assert run.allowed() == (1, 4)
    assert run.refusal(2) == "type 1 2 at 'in' cannot move on: 'm' full"


def test_opposite_routes_can_block_one_another() -> None:
    """Part 1 by m to n, part 2 by n to m: once each is in its first machine, neither can leave it."""
    cell = build("mn", way("m", "n"), way("n", "m"))
    run = Run(cell)
    moved(run, 1, 2)
    assert run.allowed() == ()
    assert not run.done
    assert run.refusal(1) == "type 1 1 at 'm' cannot move on: 'n' full"
    assert run.refusal(2) == "type 2 2 at 'n' cannot move on: 'm' full"
    with pytest.raises(BadInput, match=r"position 3 of the sequence: .*'n' full; allowed here: none, it is a deadlock"):
        simulate(cell, (1, 2, 1))
    assert simulate(cell, (1, 1, 1, 2, 2, 2)).makespan_s == 2 * (2 + 10 + 2 + 10 + 2) + 1


@given(data=st.data())
def test_one_part_after_the_other_always_gets_through(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject
) -> None:
    """So every cell can be finished, whatever deadlocks there are on the way."""
    run = Run(data.draw(cells(max_parts=5, max_machines=3, many=True)))
    for part in range(1, run.cell.parts + 1):
        while run.finished_s[part - 1] is None:
            run.move(next(decision for decision in run.allowed() if part_of(decision, run.cell.parts) == part))
    assert run.done


def test_drawn_times_are_the_episodes() -> None:
    """Arrivals and processing come from the episode; travel does not change."""
    cell = arriving("clock", 5.0, 4.0)
    times = Episode(cell, Chance("exponential", "exponential"), 11)
    run = Run(cell, times)
    first_s, second_s = times.interval_s(1), times.interval_s(2)
    assert run.ready_s == [first_s, first_s + second_s]
    move = run.move(1)
    assert move.drop_s == first_s + 2.0
    assert (move.process_s, run.ready_s[0]) == (times.processing_s(1, 1), move.drop_s + times.processing_s(1, 1))
    assert run.processed_s == times.processing_s(1, 1)


@given(data=st.data())
def test_the_run_and_its_schedule_agree(cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject) -> None:
    """Waiting, processing and the ends, with pallets, arrivals and choices, by whatever times."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    times = Episode(cell, Chance("exponential", "exponential"), data.draw(st.integers(0, 2**64 - 1)))
    run, sequence = Run(cell, times), []
    while allowed := run.allowed():
        sequence.append(data.draw(st.sampled_from(allowed)))
        run.move(sequence[-1])
    schedule = simulate(cell, sequence, times)

    def total(rows: str, kind: str) -> float:
        return float(sum(a.end_s - a.start_s for a in getattr(schedule, rows) if a.kind == kind))

    assert schedule.makespan_s == run.now_s == max(end or 0.0 for end in run.finished_s)
    assert total("robot", "wait") == pytest.approx(run.waited_s, abs=1e-6)
    assert total("machines", "process") == pytest.approx(run.processed_s, abs=1e-6)
    assert total("robot", "carry") == pytest.approx(total("parts", "carry"), abs=1e-6)


def shop(parts: int = 2, vehicles: int = 1, **change: object) -> Cell:
    """Jobs a and b, 10 s on machine m and then 5 s on n, one at a time each, with room to wait; all ways take 2 s."""
    stations = [Station("in", "storage", UNLIMITED)]
    stations += [Station(name, "machine", UNLIMITED, seconds, servers=1) for name, seconds in (("m", 10.0), ("n", 5.0))]
    route = (Stage("in"), Stage("m"), Stage("n"))
    table = 2.0 * (1.0 - np.eye(3))
    described: dict[str, object] = {
        "stations": tuple(stations),
        "products": tuple(Product(name, (route,)) for name in "ab"),
        "order": ("a", "b")[:parts],
        "empty_s": table,
        "loaded_s": table,
        "robots": tuple(Robot(f"robot {number}", "in") for number in range(1, vehicles + 1)),
    }
    return Cell(**(described | change))  # type: ignore[arg-type]


def test_a_part_waits_in_its_machines_room_until_a_server_takes_it() -> None:
    """a there at 2 s; the robot is back for b at 4 s, b there at 6 s, and b may go first: from 6 to 16 s, a until 26 s."""
    run = Run(shop())
    moves = moved(run, 1, 2, 2, 1)
    assert [(move.by, move.pick_s, move.drop_s, move.end_s) for move in moves] == [
        ("robot 1", 0.0, 2.0, 2.0),
        ("robot 1", 4.0, 6.0, 6.0),
        ("m", 6.0, 6.0, 16.0),
        ("m", 16.0, 16.0, 26.0),
    ]
    assert (run.ready_s, run.now_s, run.end_s) == ([26.0, 16.0], 6.0, 26.0)


def test_a_route_may_end_with_the_work_of_a_machine() -> None:
    """Out of m at 12 s, in n at 14 s, done at 19 s; nobody fetches it."""
    schedule = simulate(shop(1), (1, 1, 1, 1))
    assert schedule.makespan_s == 19.0
    assert [(a.resource, a.kind, a.start_s, a.end_s) for a in schedule.machines] == [
        ("m", "process", 2.0, 12.0),
        ("n", "process", 14.0, 19.0),
    ]
    assert [(a.kind, a.start_s, a.end_s) for a in schedule.robot] == [
        ("carry", 0.0, 2.0),
        ("wait", 2.0, 12.0),
        ("carry", 12.0, 14.0),
    ]


def test_two_robots_carry_at_the_same_time() -> None:
    """Decision 4 is b by robot 2: both are there at 2 s, and what was decided second begins when m is free."""
    run = Run(shop(vehicles=2))
    moves = moved(run, 1, 4, 1, 2)
    assert [(move.by, move.pick_s, move.end_s) for move in moves] == [
        ("robot 1", 0.0, 2.0),
        ("robot 2", 0.0, 2.0),
        ("m", 2.0, 12.0),
        ("m", 12.0, 22.0),
    ]


def test_robots_may_be_faster_and_serve_some_stations_only() -> None:
    """The second one takes half the time, and never goes to n: only the first can bring a part there."""
    robots = (Robot("slow", "in"), Robot("fast", "in", 2.0, ("in", "m")))
    run = Run(shop(robots=robots))
    assert run.move(4).drop_s == 1.0
    run.move(2)
    assert run.allowed() == (1, 2, 3)  # a by either, b by the slow one only
    with pytest.raises(BadInput, match="no robot can carry from 'm' to 'n': none serves both"):
        Run(shop(robots=robots[1:]))


def test_without_robots_parts_go_on_by_themselves() -> None:
    """m: a until 10 s, b until 20 s; n: a until 15 s, b until 25 s. Two decisions a part."""
    schedule = simulate(shop(vehicles=0), (1, 2, 1, 2))
    assert (schedule.makespan_s, schedule.robot) == (25.0, ())


def test_a_robot_waits_with_its_part_until_there_is_room() -> None:
    """m holds one: b is there at 2 s, but a is only taken out by robot 1 at 12 s."""
    stations = list(shop().stations)
    stations[1] = replace(stations[1], capacity=1)
    run = Run(shop(vehicles=2, stations=tuple(stations)))
    moves = moved(run, 1, 1, 1, 4)
    assert [(move.by, move.pick_s, move.drop_s) for move in moves] == [
        ("robot 1", 0.0, 2.0),
        ("m", 2.0, 2.0),
        ("robot 1", 12.0, 14.0),
        ("robot 2", 0.0, 12.0),
    ]
    assert run.waited_s == 20.0


TWO = tuple(Robot(name, "in") for name in ("r1", "r2"))


def test_two_robots_exchange_what_stands_in_each_others_way() -> None:
    """Both are done at 12 s and picked; each robot is at the other machine at 14 s. Done there at 24 s, out at 26 s.

    Decision 1 is part 1 by r1, 4 is part 2 by r2. Until part 2 is decided on, r1 holds part 1.
    """
    run = Run(build("mn", way("m", "n"), way("n", "m"), robots=TWO))
    moved(run, 1, 4)
    assert run.allowed() == (1, 2, 3, 4)
    assert run.move(1).pick_s == 12.0
    assert (run.held, run.allowed()) == ([1, 0], (4,))
    assert [run.refusal(decision) for decision in (2, 3)] == ["'r1' holds type 1 1 until there is room in 'n'"] * 2
    run.move(4)
    assert (run.held, run.ready_s, run.waited_s) == ([0, 0], [24.0, 24.0], 20.0)
    assert [(move.pick_s, move.drop_s) for move in run.moves[2:]] == [(12.0, 14.0), (12.0, 14.0)]
    assert simulate(run.cell, (1, 4, 1, 4, 3, 2)).makespan_s == 26.0


def test_a_robot_holds_a_part_only_for_what_another_one_can_free() -> None:
    """r2 never comes to m: r1 alone takes part 1 out, so it may not hold part 2; r2 may hold part 3, for p, which r1 empties."""
    robots = Robot("r1", "in"), Robot("r2", "in", 1.0, ("in", "p"))
    run = Run(build("pm", way("p", "m"), parts=3, robots=robots))
    moved(run, 1, 1, 5)
    assert run.allowed() == (1, 6), "part 2 into m by r1 would wait for ever, part 3 into p by r2 waits for part 2"
    moved(run, 6)
    assert (run.held, run.allowed()) == ([0, 3], (1,))
    assert "'m' full" in run.refusal(2)


def test_the_order_of_those_who_wait_is_that_of_their_decisions() -> None:
    """Part 1 leaves m at 12 s: r3, decided on first, drops part 3 then; r1 takes that out at 22 s, and r2 drops part 2."""
    run = Run(build("m", way("m"), parts=3, robots=(*TWO, Robot("r3", "in"))))
    moved(run, 1, 9, 5)
    assert run.held == [0, 2, 3]
    moved(run, 1, 3)
    assert [move.drop_s for move in run.moves] == [2.0, 12.0, 22.0, 14.0, 24.0]


def test_a_pallet_stays_until_its_part_has_been_put_down() -> None:
    """r2 is at p at 1 s already; part 1 goes from p, where it came at 2 s, into m at 4 s: only then its pallet is taken to q."""
    run = Run(replace(palletised(), robots=TWO))
    moved(run, 1, 1)
    assert [(run.option(d).robot, run.option(d).carries) for d in (1, 2)] == [(0, "pallet"), (1, "pallet")]  # type: ignore[union-attr]
    pallet = run.move(2)
    assert (pallet.reach_s, pallet.pick_s, pallet.drop_s) == (1.0, 4.0, 6.0)
    assert run.move(1).pick_s == 14.0


def test_a_part_that_does_not_wait_for_its_machine_waits_for_its_pallet() -> None:
    """Done at 5 s, but its pallet is in q only at 6 s."""
    run = Run(replace(build("pmq", way("p", Stage("m", processing_s=1.0, pallet=True), "q"), parts=1), robots=TWO))
    moved(run, 1, 1, 2)
    assert run.move(1).pick_s == 6.0


def test_several_robots_use_a_busy_buffer_while_the_machine_is_full_in_time() -> None:
    """Of several robots the buffer is a choice of its own: 1 + 2 * 2 = 5 by r1, 7 by r2.

    Part 1 goes to m by r1, which is at "out" and picks at 1 s: part 2, by r2 at once, may be put into b only from then on.
    """
    robots = Robot("r1", "out"), Robot("r2", "in")
    run = Run(build("bm", way(Stage("m", "b")), robots=robots))
    assert run.allowed() == (1, 2, 3, 4)
    run.move(1)
    assert run.allowed() == (1, 2, 3, 4, 6, 8)
    assert (run.move(8).pick_s, run.move(1).pick_s) == (1.0, 13.0)


def test_parts_that_arrive_are_taken_in_their_order_in_time() -> None:
    """Both come at 0 s; r1 takes part 1 at 1 s, so r2, which stands there, takes part 2 no sooner."""
    robots = Robot("r1", "out"), Robot("r2", "in")
    run = Run(build("mn", way("m"), way("n"), arrivals=Arrivals((0.0, 0.0), "clock"), robots=robots))
    assert [move.pick_s for move in moved(run, 1, 4)] == [1.0, 1.0]


def test_a_server_changes_over_between_products() -> None:
    """From a to b takes 3 s more, after what it did before; the first product takes none."""
    stations = list(shop().stations)
    stations[1] = replace(stations[1], setups=(("a", "b", 3.0), ("b", "a", 4.0)))
    cell = shop(stations=tuple(stations), vehicles=0)
    assert [move.pick_s for move in moved(Run(cell), 1, 2)] == [0.0, 13.0]
    assert [move.pick_s for move in moved(Run(cell), 2, 1)] == [0.0, 14.0]
