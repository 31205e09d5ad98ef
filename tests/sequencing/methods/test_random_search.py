"""Random search: the best of what it meets, and a word when all were deadlocks."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance
from lab.sequencing.cell.stations import Arrivals, Product, Stage, Station, one_robot
from lab.sequencing.methods.random_search import random_search
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.follow import simulate

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def far_oven(interval_s: float) -> Cell:
    """Two parts by the clock, oven 10 s; the robot starts at the oven. Loaded moves 2 s, empty ones 3 s."""
    stations = (Station("in", "storage", 1), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9))
    table = 1.0 - np.eye(3)
    route = (Stage("in"), Stage("oven"), Stage("out"))
    arrivals = Arrivals((interval_s, interval_s))
    return Cell(stations, (Product("a", (route,)),), ("a", "a"), 3 * table, 2 * table, one_robot("oven"), arrivals)


def test_it_keeps_the_best(toast_cell: CellMaker) -> None:
    seen: list[EpisodeSequenced] = []
    result = random_search(toast_cell("I", 3), Search(50, on_episode=seen.append), rng())
    assert len(result.episode_costs) == 50
    assert result.cost == min(result.episode_costs) < max(result.episode_costs)
    assert tuple(episode.cost for episode in seen) == result.episode_costs
    assert result.cost == simulate(toast_cell("I", 3), result.sequence).makespan_s


def test_it_by_another_objective() -> None:
    """The robot waits at least for the first part; how long it waits is what counts, not the makespan."""
    cell = far_oven(5.0)
    result = random_search(cell, Search(5, "robot-idle"), rng())
    assert result.cost == 2.0 + 10.0 + 10.0


def test_it_by_chance_meets_other_times_in_every_episode(oven_cell: CellMaker) -> None:
    """One oven has one sequence: only the times can differ."""
    result = random_search(oven_cell(1), Search(20, chance=Chance("exponential")), rng())
    assert len(set(result.episode_costs)) == 20
    assert result == random_search(oven_cell(1), Search(20, chance=Chance("exponential")), rng())


def test_it_says_when_all_it_met_were_deadlocks() -> None:
    """Two parts that want each other's machine: half of the first two moves lead into a deadlock, some do not."""
    stations = (Station("in", "storage", 9), Station("m", "machine", 1), Station("n", "machine", 1))
    names = ("in", "m", "n", "out")
    ways = [tuple(Stage(name) for name in way) for way in (names, ("in", "n", "m", "out"))]
    products = tuple(Product(name, (way,)) for name, way in zip("ab", ways, strict=True))
    table = 1.0 - np.eye(4)
    cell = Cell((*stations, Station("out", "storage", 9)), products, ("a", "b"), table, table, one_robot("in"))
    ends: set[object] = set()
    for seed in range(20):
        try:
            ends.add(random_search(cell, Search(1), rng(seed)).sequence)
        except WorkFailed as error:
            ends.add(str(error))
    assert "no sequence for 2 parts came to its end in 1 episode: deadlocks" in ends
    assert (1, 1, 1, 2, 2, 2) in ends


def test_an_objective_that_the_cell_has_no_data_for(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="due times"):
        random_search(oven_cell(), Search(objective="mean-tardiness"), rng())
