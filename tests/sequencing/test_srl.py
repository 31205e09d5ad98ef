"""SRL: the updates by hand, and what it does over a session."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from lab.errors import BadInput
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced
from lab.sequencing.srl import srl

CellMaker = Callable[..., Cell]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_two_episodes_by_hand(oven_cell: CellMaker) -> None:
    """One toast, two moves, 14 s, no choice: both updates of fig. 5.1, type B."""
    after_one = srl(oven_cell(1), 1, rng()).q
    first, second = (1 + 0.05 * (0.9 - 1)) / 14, (1 - 0.05) / 14
    assert after_one == {(0,): {1: pytest.approx(first)}, (1,): {1: pytest.approx(second)}}
    after_two = srl(oven_cell(1), 2, rng()).q
    expected = {
        (0,): {1: pytest.approx((first + 0.05 * (0.9 * second - first)) / 14)},
        (1,): {1: pytest.approx((second - 0.05 * second) / 14)},
    }
    assert after_two == expected


def test_factor_a_by_hand(toast_cell: CellMaker) -> None:
    """No step update (alpha 0): a pair's Q is the product of the factors of its episodes, eq. 5.3."""
    result = srl(toast_cell("I", 2), 8, rng(3), alpha=0.0, factor="A")
    best_s, product = math.inf, 1.0
    for makespan_s in result.episode_makespans_s:
        if makespan_s > best_s:
            product *= 1 / (makespan_s - best_s + 5) + 0.8
        best_s = min(best_s, makespan_s)
    start_row = result.q[(0, 0)]
    assert math.prod(start_row.values()) == pytest.approx(product)


def test_the_result_is_the_best_found(toast_cell: CellMaker) -> None:
    seen: list[EpisodeSequenced] = []
    result = srl(toast_cell("II", 3), 30, rng(), on_episode=seen.append)
    assert result.makespan_s == min(result.episode_makespans_s) == seen[-1].best_makespan_s
    assert [event.episode for event in seen] == list(range(1, 31))
    assert tuple(event.makespan_s for event in seen) == result.episode_makespans_s


def test_sixty_episodes_mostly_find_the_optimum(toast_cell: CellMaker) -> None:
    """Table 7.4 prints 100 % for 60 episodes, 29 % for 15; 40 sessions of each here."""
    shares = [
        np.mean([srl(toast_cell("I", 3), episodes, rng(seed)).makespan_s == 513 for seed in range(40)])
        for episodes in (15, 60)
    ]
    assert shares[1] > 0.65 > 0.5 > shares[0]


def test_values_far_below_the_smallest_float_stay_apart(oven_cell: CellMaker) -> None:
    """Type B divides by 14 in each of 400 episodes: 1e-458, which a float would hold as 0."""
    result = srl(oven_cell(1), 400, rng())
    assert result.q[(0,)][1] == 0
    assert -math.inf < result.log_q[(0,)][1] < result.log_q[(1,)][1] + 10 < -1000


def test_equal_values_are_drawn_between(toast_cell: CellMaker) -> None:
    """With beta huge there is no exploration after episode 1; fresh states still see different first choices."""
    first_moves = {srl(toast_cell("I", 3), 1, rng(seed), beta=50.0).sequence[0] for seed in range(20)}
    assert first_moves == {1, 2, 3}


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"episodes": 0}, "episodes = 0"),
        ({"alpha": 1.5}, "alpha = 1.5"),
        ({"discount": -0.1}, "discount = -0.1"),
        ({"beta": math.nan}, "beta = nan"),
        ({"factor": "C"}, "unknown reward factor 'C'"),
    ],
)
def test_bad_settings(oven_cell: CellMaker, settings: dict[str, object], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        srl(oven_cell(), **({"episodes": 5, "rng": rng()} | settings))  # type: ignore[arg-type]


def test_a_makespan_of_zero_has_no_type_b_factor(oven_cell: CellMaker) -> None:
    nothing = np.zeros((3, 3))
    stations = oven_cell().stations
    instant = (stations[0], type(stations[1])("oven", "machine", 1, 0.0), stations[2])
    with pytest.raises(BadInput, match="makespan 0"):
        srl(oven_cell(stations=instant, empty_s=nothing, loaded_s=nothing), 3, rng())
