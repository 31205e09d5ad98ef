"""SRL: the updates by hand, and what it does over a session."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Station
from lab.sequencing.methods.srl import srl
from lab.sequencing.search import Search, SrlSettings
from lab_studies.many_sessions import run_sessions

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_two_episodes_by_hand(oven_cell: CellMaker) -> None:
    """One part, two moves, 14 s, no choice: both updates of fig. 5.1, type B."""
    after_one = srl(oven_cell(1), Search(1), rng()).q
    first, second = (1 + 0.05 * (0.9 - 1)) / 14, (1 - 0.05) / 14
    assert after_one == {(0,): {1: pytest.approx(first)}, (1,): {1: pytest.approx(second)}}
    after_two = srl(oven_cell(1), Search(2), rng()).q
    expected = {
        (0,): {1: pytest.approx((first + 0.05 * (0.9 * second - first)) / 14)},
        (1,): {1: pytest.approx((second - 0.05 * second) / 14)},
    }
    assert after_two == expected


def test_values_per_next_state_by_hand(oven_cell: CellMaker) -> None:
    """The listing's: oven (1) and out (2) have a value each, and the last one ends with 1.5 + discount times itself."""
    search = Search(1, settings=SrlSettings(values="states"))
    oven, out = (1 + 0.05 * (0.9 - 1)) / 14, (1.5 + 0.9) / 14
    assert srl(oven_cell(1), search, rng()).q == {(1,): {0: pytest.approx(oven)}, (2,): {0: pytest.approx(out)}}


def test_another_objective_by_hand(oven_cell: CellMaker) -> None:
    """The robot waits 10 s at the oven: type B is 1 / (1 + 10)."""
    result = srl(oven_cell(1), Search(1, "robot-idle"), rng())
    assert result.cost == result.final_cost == 10.0
    assert result.q[(1,)] == {1: pytest.approx(0.95 / 11)}


def test_factor_a_by_hand(toast_cell: CellMaker) -> None:
    """No step update (alpha 0): a pair's Q is the product of the factors of its episodes, eq. 5.3."""
    result = srl(toast_cell("I", 2), Search(8, settings=SrlSettings(alpha=0.0, factor="A")), rng(3))
    best_s, product = math.inf, 1.0
    for makespan_s in result.episode_costs:
        if makespan_s > best_s:
            product *= 1 / (makespan_s - best_s + 5) + 0.8
        best_s = min(best_s, makespan_s)
    assert product < 1
    assert math.prod(result.q[(0, 0)].values()) == pytest.approx(product)


def test_the_result_is_the_best_found(toast_cell: CellMaker) -> None:
    result = srl(toast_cell("II", 3), Search(30), rng())
    assert result.cost == min(result.episode_costs)
    assert len(result.episode_costs) == 30
    again = srl(toast_cell("II", 3), Search(30), rng())
    assert again == result


def test_longer_sessions_find_the_optimum_more_often(toast_cell: CellMaker) -> None:
    """Table 7.4 prints 29 % for 15 episodes and 100 % for 60."""
    shares = [
        float(np.mean(run_sessions(toast_cell("I", 3), "srl", Search(episodes), 400, 1).best_cost == 513))
        for episodes in (15, 60)
    ]
    assert shares[1] > 0.65 > 0.5 > shares[0]


def test_values_far_below_the_smallest_float_stay_apart(oven_cell: CellMaker) -> None:
    """Type B divides by 14 in each of 400 episodes: 1e-458, which a float would hold as 0."""
    result = srl(oven_cell(1), Search(400), rng())
    assert result.q[(0,)][1] == 0
    assert -math.inf < result.log_q[(0,)][1] < result.log_q[(1,)][1] + 10 < -1000


def test_equal_values_are_drawn_between(toast_cell: CellMaker) -> None:
    """With beta huge there is no exploration after episode 1; the second still begins in different ways."""
    search = Search(2, settings=SrlSettings(beta=50.0))
    tables = [srl(toast_cell("I", 3), search, rng(seed)).log_q[(0, 0, 0)] for seed in range(20)]
    assert {frozenset(table) for table in tables} == {frozenset(pair) for pair in ({1, 2}, {1, 3}, {2, 3})}


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"alpha": 1.5}, "alpha = 1.5"),
        ({"discount": -0.1}, "discount = -0.1"),
        ({"beta": math.nan}, "beta = nan"),
        ({"factor": "C"}, "unknown reward factor 'C'"),
        ({"values": "pears"}, "did you mean 'pairs'"),
        ({"state": "part"}, "did you mean 'parts'"),
    ],
)
def test_bad_settings(settings: dict[str, object], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        SrlSettings(**settings)  # type: ignore[arg-type]


def test_an_objective_that_needs_due_times(oven_cell: CellMaker) -> None:
    with pytest.raises(BadInput, match="no due times"):
        srl(oven_cell(), Search(5, "tardy-parts"), rng())


def test_a_makespan_of_zero_has_no_type_b_factor(oven_cell: CellMaker) -> None:
    nothing = np.zeros((3, 3))
    stations = oven_cell().stations
    instant = (stations[0], Station("oven", "machine", 1, 0.0), stations[2])
    cell = oven_cell(stations=instant, empty_s=nothing, loaded_s=nothing)
    with pytest.raises(BadInput, match="makespan 0"):
        srl(cell, Search(3), rng())
    assert srl(cell, Search(3, settings=SrlSettings(factor="A")), rng()).cost == 0.0
