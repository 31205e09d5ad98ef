"""Monte Carlo: averages by hand, and what it does over a session."""

from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Station
from lab.sequencing.methods.monte_carlo import monte_carlo
from lab.sequencing.search import Search, SrlSettings
from lab_studies.many_sessions import run_sessions

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_one_way_by_hand(oven_cell: CellMaker) -> None:
    """14 s each time: both pairs are worth 1 / 14, whatever the number of episodes."""
    result = monte_carlo(oven_cell(1), Search(3), rng())
    assert result.q == {(0,): {1: pytest.approx(1 / 14)}, (1,): {1: pytest.approx(1 / 14)}}
    assert (result.cost, result.final_cost, result.episode_costs) == (14.0, 14.0, (14.0,) * 3)


def test_another_objective_by_hand(oven_cell: CellMaker) -> None:
    """The robot waits 10 s at the oven: the return is 1 / (1 + 10)."""
    assert monte_carlo(oven_cell(1), Search(2, "robot-idle"), rng()).q[(1,)] == {1: pytest.approx(1 / 11)}


@pytest.mark.parametrize("seed", range(5))
def test_averages_by_hand(toast_cell: CellMaker, seed: int) -> None:
    """Greedy from episode 2 on: the part not yet tried, as 1 is above any 1 / T; then the one of the higher average."""
    result = monte_carlo(toast_cell("I", 2), Search(3, settings=SrlSettings(beta=60.0)), rng(seed))
    one, other, third = (1 / makespan_s for makespan_s in result.episode_costs)
    again = [(max(one, other) + third) / 2, min(one, other)]
    assert sorted(result.q[(0, 0)].values()) == pytest.approx(sorted(again))


def test_longer_sessions_find_the_optimum_more_often(toast_cell: CellMaker) -> None:
    """Table 7.4 prints 34 % for 15 episodes and 65 % for 60."""
    shares = [
        float(np.mean(run_sessions(toast_cell("I", 3), "mc", Search(episodes), 400, 1).best_cost == 513))
        for episodes in (15, 60)
    ]
    assert shares[1] > shares[0] + 0.1


def test_a_makespan_of_zero_has_no_return(oven_cell: CellMaker) -> None:
    nothing = np.zeros((3, 3))
    stations = oven_cell().stations
    instant = (stations[0], Station("oven", "machine", 1, 0.0), stations[2])
    with pytest.raises(BadInput, match="makespan 0"):
        monte_carlo(oven_cell(stations=instant, empty_s=nothing, loaded_s=nothing), Search(3), rng())
