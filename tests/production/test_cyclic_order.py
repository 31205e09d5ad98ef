"""A cyclic order in a run: the one that is carried out, and its period beside the planned one."""

from dataclasses import replace

import numpy as np
import pytest

from lab.production.cyclic_order import cyclic_order, measured_period, mix_of
from lab.production.order import OrderAdvice, ordered
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Stage, Station
from lab.sequencing.simulate.follow import simulate
from lab.tasks.sequencing import Sequencing
from lab.tasks.task_file import load_cell

SIX = load_cell("toast-case-1").cell(6)  # a toast every 150 s


@pytest.mark.parametrize(
    ("order", "mix"),
    [
        ("aaaa", "a"),
        ("aabb", "ab"),
        ("aaaabb", "aab"),
        ("abcab", "aabbc"),
    ],
)
def test_the_smallest_mix_repeats(order: str, mix: str) -> None:
    assert mix_of(order) == tuple(mix)


def test_a_cyclic_order_is_used_though_others_are_better() -> None:
    found = ordered(SIX, Sequencing(method="fifo"), OrderAdvice(cyclic=True, parts_per_cycle=1), 0)
    assert found.used == "cyclic"
    assert found.rhythm is not None
    assert found.rhythm.per_part_s == 150.0
    assert found.costs["cyclic"] == simulate(SIX, found.found.sequence).makespan_s == 967.0
    assert found.costs["exact"] == 963.0


def test_the_measured_period_stands_beside_the_planned_one() -> None:
    """All takes a tenth longer than planned."""
    rhythm, made = cyclic_order(SIX, 0, 1)
    slow = replace(SIX, empty_s=1.1 * SIX.empty_s, loaded_s=1.1 * SIX.loaded_s)
    slow = replace(slow, stations=tuple(replace(one, processing_s=1.1 * one.processing_s) for one in slow.stations))
    told = measured_period(rhythm, made.schedule, simulate(slow, made.sequence))
    assert (told["period_s"], told["planned_period_s"]) == (150.0, 150.0)
    assert told["measured_period_s"] == pytest.approx(165.0)
    assert told["period_deviation"] == pytest.approx(0.1)


def test_one_part_has_no_period() -> None:
    rhythm, made = cyclic_order(SIX, 0, 1)
    told = measured_period(rhythm, made.schedule, simulate(load_cell("toast-case-1").cell(1), (1, 1, 1)))
    assert (told["measured_period_s"], told["period_deviation"]) == (None, None)


def test_a_cycle_may_wait_on_purpose() -> None:
    """Nothing may stay in the first machine, the second one takes twice as long: the robot brings a part late, every 25 s.

    From the second machine, 20 s, a part is taken out, 2 s; from there to the first one, 1 s, and with the next part back, 2 s.
    """
    stations = (
        Station("in", "storage", 9),
        Station("first", "machine", 1, 10.0, 0.0),
        Station("second", "machine", 1, 20.0),
        Station("out", "storage", 9),
    )
    table = np.ones((4, 4)) - np.eye(4)
    route = tuple(Stage(station.name) for station in stations)
    cell = Cell.alike(stations, route, table, 2 * table, "in", 4)
    rhythm, made = cyclic_order(cell, 0)
    assert (made.waits, rhythm.cycle.period_s) == (True, 25.0)
    told = measured_period(rhythm, made.schedule, simulate(cell, made.sequence))
    assert told["planned_period_s"] == told["measured_period_s"] == 25.0
