"""Carrying out under chance: what can be known, waiting, replications, and planning anew."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance, Episode
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station, one_robot
from lab.sequencing.methods.rollout import by_rule, rollout
from lab.sequencing.methods.rules import RULES
from lab.sequencing.simulate.execution import WAIT, Execution, Observed
from lab.sequencing.simulate.follow import follow, simulate
from lab.sequencing.simulate.run import Run, branch
from lab.sequencing.simulate.several import carry_out, replicate

CellMaker = Callable[..., Cell]
NORMAL, EXPONENTIAL = Chance("normal", "normal"), Chance("exponential", "exponential")


@dataclass(frozen=True)
class Told(Episode):
    """An episode whose times are given: {part: process [s]}, {part: interval [s]}."""

    process: dict[int, float] = field(default_factory=dict)
    interval: dict[int, float] = field(default_factory=dict)

    def processing_s(self, part: int, position: int) -> float:
        mean_s = super().processing_s(part, position)
        return self.process.get(part, mean_s) if mean_s else 0.0

    def interval_s(self, part: int) -> float:
        return self.interval.get(part, super().interval_s(part))


def two_ovens(arrivals: Arrivals | None = None, parts: int = 2) -> Cell:
    """Two parts, each with an oven of its own, 10 s on average; loaded moves 2 s, empty ones 1 s."""
    stations = (
        Station("in", "storage", 9),
        Station("one", "machine", 1, 10.0),
        Station("two", "machine", 1, 10.0),
        Station("out", "storage", 9),
    )
    products = tuple(Product(name, ((Stage("in"), Stage(name), Stage("out")),)) for name in ("one", "two"))
    table = 1.0 - np.eye(4)
    order = ("one", "two", "one")[:parts]
    return Cell(stations, products, order, table, 2.0 * table, one_robot("in"), arrivals)


def after(cell: Cell, times: Episode, *decisions: int) -> Execution:
    execution = Execution(cell, times)
    for decision in decisions:
        execution.step(decision)
    return execution


def test_the_mean_is_expected_whatever_was_drawn() -> None:
    """Part 1 is in its oven from 2 s on, part 2 from 2 + 1 + 2 = 5 s on: expected at 12 and 15 s, really at 30 and 7 s."""
    cell = two_ovens()
    seen = after(cell, Told(cell, process={1: 28.0, 2: 2.0}), 1, 2).observe()
    assert (seen.now_s, seen.ready_s, seen.ready) == (5.0, [12.0, 15.0], (False, False))
    assert seen.processed_s == 20.0


def test_what_is_late_is_expected_now_and_what_is_ready_is_known() -> None:
    """As before, at 7 s and at 30 s; part 2 was fetched in between, and part 1 is still not ready at 12 s."""
    cell = two_ovens()
    execution = after(cell, Told(cell, process={1: 28.0, 2: 2.0}), 1, 2, WAIT)
    seen = execution.observe()
    assert (seen.now_s, seen.ready_s, seen.ready) == (7.0, [12.0, 7.0], (False, True))
    assert seen.processed_s == 12.0
    execution.step(2)
    execution.run.wait(20.0)
    late = execution.observe()
    assert (late.ready_s[0], late.ready[0]) == (20.0, False)


@given(data=st.data(), longer_s=st.floats(0.5, 1e6))
def test_the_future_does_not_show(
    cells: Callable[..., st.SearchStrategy[Cell]], data: st.DataObject, longer_s: float
) -> None:
    """Whatever is under way may last longer by any time: what is observed stays the same."""
    cell = data.draw(cells(max_machines=2, max_parts=4, many=True))
    execution = Execution(cell, Episode(cell, EXPONENTIAL, data.draw(st.integers(0, 2**64 - 1))))
    for _ in range(data.draw(st.integers(0, 12))):
        if allowed := execution.run.allowed():
            execution.step(data.draw(st.sampled_from(allowed)))
    before, run = vars(execution.observe()), execution.run
    for index, ready_s in enumerate(run.ready_s):
        if ready_s > run.now_s:
            run.ready_s[index] += longer_s
            if run.locations[index] != cell.starts[index]:
                run.processed_s += longer_s
    assert {
        name: value for name, value in vars(execution.observe()).items() if name not in ("times", "processed_s")
    } == {name: value for name, value in before.items() if name not in ("times", "processed_s")}
    assert execution.observe().processed_s == pytest.approx(before["processed_s"], abs=1e-6)


def test_what_is_observed_does_not_move_with_the_run() -> None:
    cell = two_ovens()
    execution = Execution(cell)
    seen = execution.observe()
    execution.step(1)
    seen.move(2)
    assert (seen.locations, execution.run.locations) == ([0, 4], [1, 3])
    assert isinstance(seen, Run)


@pytest.mark.parametrize(
    ("after_what", "expected_s"),
    [
        # By the clock: part 1 came at 7; part 2 is due 20 s later on average, part 3 another 20 s later.
        ("clock", [7.0, 27.0, 47.0]),
        # After a pick: part 1 was picked at 7; part 3 sets out when part 2 is picked, at 27 at the soonest.
        ("pick", [19.0, 27.0, 47.0]),
    ],
)
def test_arrivals_are_expected_by_the_mean(after_what: str, expected_s: list[float]) -> None:
    """Part 1 comes after 7 s instead of 20; it is then carried to its oven, 9 s, where it is for 10 s."""
    cell = two_ovens(Arrivals((20.0, 20.0, 20.0), after_what), parts=3)  # type: ignore[arg-type]
    times = Told(cell, interval={1: 7.0, 2: 90.0, 3: 90.0})
    assert after(cell, times).observe().ready_s == [20.0, 40.0, 60.0]
    execution = after(cell, times, 1)
    assert execution.run.now_s == 9.0
    assert execution.observe().ready_s == [19.0, *expected_s[1:]]
    assert execution.observe().ready == (False, False, False)


def test_an_arrival_that_is_late_is_expected_now() -> None:
    """Part 2 should have come at 40 s; at 50 s it is expected now, and part 3 20 s later."""
    cell = two_ovens(Arrivals((20.0, 20.0, 20.0)), parts=3)
    execution = after(cell, Told(cell, interval={2: 90.0}), 1, 1)
    execution.run.wait(50.0)
    assert execution.observe().ready_s[1:] == [50.0, 70.0]


def test_waiting_goes_to_the_next_event_and_counts_as_idle() -> None:
    """Part 2 is done at 5 + 2 s, part 1 at 2 + 28 s."""
    cell = two_ovens()
    execution = after(cell, Told(cell, process={1: 28.0, 2: 2.0}), 1, 2)
    execution.step(WAIT)
    assert (execution.run.now_s, execution.run.waited_s) == (7.0, 2.0)
    execution.step(WAIT)
    assert (execution.run.now_s, execution.run.waited_s) == (30.0, 25.0)
    with pytest.raises(WorkFailed, match="waits at 30 s, but nothing is going to happen"):
        execution.step(WAIT)
    assert execution.sequence == [1, 2]


def test_a_decision_that_may_not_be_taken(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="'oven' full"):
        after(oven_cell(2), Episode(oven_cell(2)), 1, 2)


def test_following_is_simulating(fms_cell: CellMaker) -> None:
    cell = fms_cell("RS")
    times = Episode(cell, EXPONENTIAL, 5)
    sequence = (1, 1, 1, 2, 2, 2, 1, 1, 2, 2)
    run, schedule = follow(cell, sequence, times), simulate(cell, sequence, times)
    assert run.now_s == schedule.makespan_s
    assert run.waited_s == pytest.approx(sum(a.end_s - a.start_s for a in schedule.robot if a.kind == "wait"))


def test_a_policy_that_reacts_beats_its_list_when_the_order_turns() -> None:
    """Part 2 is done first. The list 1, 2, 1, 2 waits for part 1 until 30 s: 32 s, back 1 s, 35 s.

    So does who goes where the pick is expected soonest: at 5 s that is part 1 (12 s), for the rule knows the means only.
    Who stays until something happens takes part 2 at 7 s, has it out at 9 s, stays until 30 s, 31 s, 33 s.
    """
    cell = two_ovens()
    times = Told(cell, process={1: 28.0, 2: 2.0})

    def patient(seen: Observed, allowed: tuple[int, ...]) -> int:
        raw = [decision for decision in allowed if seen.locations[decision - 1] == cell.starts[decision - 1]]
        ready = [decision for decision in allowed if seen.ready[decision - 1]]
        return (*raw, *ready, WAIT)[0]

    assert follow(cell, (1, 2, 1, 2), times).now_s == 35.0
    assert carry_out(cell, by_rule(RULES["nearest-ready"]), times).run.now_s == 35.0
    assert carry_out(cell, lambda cell: patient, times).run.now_s == 33.0


def test_replications_share_their_times(oven_cell: CellMaker) -> None:
    """One oven has one sequence: a list and a policy cost the same in each episode, though each has its own times."""
    cell = oven_cell(2)
    listed = replicate(cell, (1, 1, 2, 2), NORMAL, 20, 3)
    np.testing.assert_array_equal(listed, replicate(cell, by_rule(RULES["shortest-move"]), NORMAL, 20, 3))
    assert len(set(listed)) == 20
    np.testing.assert_array_equal(listed[:5], replicate(cell, (1, 1, 2, 2), NORMAL, 5, 3))
    assert not np.isin(listed, replicate(cell, (1, 1, 2, 2), NORMAL, 20, 4)).any()


def test_replications_have_the_mean_of_the_times(oven_cell: CellMaker) -> None:
    """One part costs 2 + X + 2 s, X normal (10 s, 1 s): the mean of 400 is within 0.2 s of 14 s (4 standard errors)."""
    costs = replicate(oven_cell(1), (1, 1), NORMAL, 400, 0)
    assert costs.mean() == pytest.approx(14.0, abs=0.2)
    assert costs.std() == pytest.approx(1.0, abs=0.15)


def test_without_chance_every_replication_is_the_same(oven_cell: CellMaker) -> None:
    np.testing.assert_array_equal(replicate(oven_cell(2), (1, 1, 2, 2), NO_CHANCE, 3, 0), [29.0, 29.0, 29.0])
    np.testing.assert_array_equal(replicate(oven_cell(2), (1, 1, 2, 2), NO_CHANCE, 2, 0, "robot-idle"), [20.0, 20.0])


@pytest.mark.parametrize(
    ("sequence", "episodes", "seed", "objective", "says"),
    [
        ((1, 1), 0, 0, "makespan", "episodes = 0: allowed are whole numbers from 1"),
        ((1, 1), 1, -1, "makespan", "seed = -1: allowed are whole numbers from 0"),
        ((1, 1), 1, 0, "tardy-parts", "due times"),
        ((1,), 1, 0, "makespan", "the sequence ends after 1 move"),
        ((1, 1, 1), 1, 0, "makespan", "already at 'out'"),
    ],
)
def test_what_cannot_be_replicated(
    oven_cell: CellMaker, sequence: Sequence[int], episodes: int, seed: int, objective: str, says: str
) -> None:
    with pytest.raises(BadInput, match=says):
        replicate(oven_cell(1), sequence, NORMAL, episodes, seed, objective)


def test_a_branch_goes_its_own_way(oven_cell: CellMaker) -> None:
    run = Run(oven_cell(2))
    run.move(1)
    other = branch(run)
    other.move(1)
    assert (run.locations, other.locations) == ([1, 0], [2, 0])
    assert (run.now_s, other.now_s) == (2.0, 14.0)
    assert (run.occupied, other.occupied) == ([0, 1, 0], [0, 0, 0])
    assert (run.finished_s, other.finished_s) == ([None, None], [14.0, None])


def test_planning_anew_reacts_to_what_has_happened() -> None:
    """Nothing is known of part 1 but that it is late: at 20 s it is expected at once, and still part 2 may be ready."""
    cell = two_ovens()
    times = Told(cell, process={1: 28.0, 2: 2.0})
    execution = after(cell, times, 1, 2)
    assert rollout(execution.observe())[0] == 1
    execution.step(WAIT)
    assert rollout(execution.observe())[0] == 2
