"""What a carried-over policy looks at: each number redone by hand, and that it means the same in a cell of any size."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over_features import feature_arrays, features
from lab.sequencing.methods.carried_over_policy import FEATURES
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run

CellMaker = Callable[..., Cell]
NEAR = ((0, 1, 1), (1, 0, 1), (1, 1, 0))  # one second between any two of LU, M1 and M2


def described(run: Run, objective: str = "makespan") -> dict[int, dict[str, float]]:
    """By decision, the features that are not 0."""
    allowed = run.allowed()
    rows = features(run, allowed, feature_arrays(run.cell, objective))
    named = [dict(zip(FEATURES, row.tolist(), strict=True)) for row in rows]
    return {one: {name: value for name, value in row.items() if value} for one, row in zip(allowed, named, strict=True)}


def test_both_parts_at_the_start_by_hand(oven_cell: CellMaker) -> None:
    """In, oven, out: 2 s, 10 s of work, 2 s; 28 s of work in four moves is 7 s a move.

    The oven would stand 2 s until the first part comes, which then ends at 14 s: 2 + 10 + 2. After the drop the robot is 1 s
    from the other part.
    """
    own = {"duration": 2 / 7, "starves": 2 / 7, "room": 1.0, "moves-left": 2.0, "way-on": 1 / 7, "enters": 1.0}
    found = described(Run(oven_cell(2)))
    assert found == {1: pytest.approx(own), 2: pytest.approx(own)}


def test_a_part_in_a_full_oven_by_hand(oven_cell: CellMaker) -> None:
    """At 2 s part 1 is in the oven until 12 s; it takes 2 s more, part 2 ends at 2 + 14 s if nothing stops it: 2 s later.

    Work left: 2 s and 14 s, 8 s on average. The oven is the only machine: 10 s to be through, 10 s to come. Room at the end of
    a route is not counted.
    """
    run = follow(oven_cell(2), [1])
    own = {"idle": 10 / 7, "duration": 2 / 7, "tail": -2 / 7, "work-left": -6 / 7}
    own |= {"load-behind": 1.0, "moves-left": 1.0, "queued-tail": -2 / 7}
    assert described(run) == {1: pytest.approx(own)}


def test_what_has_been_ready_for_long_counts_no_more(oven_cell: CellMaker) -> None:
    """Two in an oven for three that takes 0.1 s: part 1 is ready at 2.1 s, and at 5 s part 2 is put down beside it."""
    first, oven, end = oven_cell().stations
    roomy = (first, replace(oven, capacity=3, processing_s=0.1), end)
    run = follow(oven_cell(3, stations=roomy), [1, 2])
    found = described(run)
    scale_s = (2 + 0.1 + 2) / 2
    assert found[1]["part-waited"] == pytest.approx((5.0 - 2.1) / scale_s)
    assert "part-waited" not in found[2]  # it is just being put down: the robot waits for it
    run.robots_s[0] = 1000.0
    assert described(run)[1]["part-waited"] == 10.0
    assert "part-waited" not in described(run)[3]  # at the start of its route nothing waits


def test_queues_and_vehicles_by_hand(job_shop: CellMaker) -> None:
    """Two jobs for M1, 8 s and 4 s, by two vehicles: each takes a job there in 1 s; 14 s in four moves is 3.5 s a move.

    Once vehicle 1 has brought job 1, the queue of M1 is through at 8 s. Vehicle 1 would bring job 2 at 3 s, vehicle 2 at 1 s.
    """
    cell = job_shop([[(1, 8.0)], [(1, 4.0)]], NEAR, 2)
    found = described(follow(cell, [1]))
    served = {"delay": 1.0, "idle": 1.0, "duration": 8.0, "work-left": 8 - 6.5}
    late = {"delay": 2.0, "empty-way": 1.0, "duration": 1.0, "tail": 2 + 5 - 9, "work-left": 5 - 6.5, "queue": 8 - 3}
    soon = {"duration": 1.0, "tail": 0 + 5 - 9, "work-left": 5 - 6.5, "queue": 8 - 1, "queued-tail": 8 + 4 - 9}
    late |= {"other-way": 3 - 1, "queued-tail": 8 + 4 - 9}
    in_moves = [{name: seconds / 3.5 for name, seconds in one.items()} for one in (served, late, soon)]
    plain = [{"server": 1.0, "moves-left": 1.0}, *({"moves-left": 2.0, "enters": 1.0},) * 2]
    assert [*found] == [1, 2, 4]  # job 1 is served; job 2 comes by vehicle 1, or by vehicle 2
    for one, in_a_move, own in zip(found.values(), in_moves, plain, strict=True):
        assert one.pop("room", 0.0) < 1e-5  # of what is unlimited
        assert one == pytest.approx(in_a_move | own)


def test_loads_are_shares_of_the_highest(job_shop: CellMaker) -> None:
    """M1 has 8 s to come, M2 2 s: a quarter."""
    cell = job_shop([[(1, 8.0), (2, 1.0)], [(2, 1.0)]], NEAR)
    both, one = described(Run(cell)).values()
    assert "load-ahead" not in both
    assert one["load-ahead"] == 2 / 8 - 1
    found = described(follow(cell, [1]))  # it is to be served by M1, and then by M2
    assert found[1]["load-after"] == 2 / 8 - 1


def test_slack_counts_for_due_times_alone(oven_cell: CellMaker) -> None:
    """Due at 30 s, at its end 14 s from now: 16 s, in moves of 7 s."""
    cell = replace(oven_cell(2), due_s=(30.0, 40.0))
    assert [one["slack"] for one in described(Run(cell), "mean-tardiness").values()] == pytest.approx([16 / 7, 26 / 7])
    assert all("slack" not in one for one in described(Run(cell)).values())


@pytest.mark.parametrize("factor", [0.01, 60.0])
def test_it_does_not_matter_in_which_unit_the_times_are(job_shop: CellMaker, factor: float) -> None:
    jobs, ways = [[(1, 8.0), (2, 3.0)], [(2, 4.0), (1, 2.0)], [(2, 1.0)]], np.array(NEAR, np.float64)
    slow = [[(machine, factor * seconds) for machine, seconds in job] for job in jobs]
    one, other = Run(job_shop(jobs, ways, 2)), Run(job_shop(slow, factor * ways, 2))
    while allowed := one.allowed():
        found = [features(run, allowed, feature_arrays(run.cell)) for run in (one, other)]
        assert found[1] == pytest.approx(found[0])
        one.move(allowed[-1])
        other.move(allowed[-1])


def test_nothing_grows_with_the_number_of_parts(toast_cell: CellMaker) -> None:
    """At the start of 50 toasts every number is what it is at the start of 5."""
    few, many = (described(Run(toast_cell("I", parts)))[1] for parts in (5, 50))
    assert many == pytest.approx(few)
