"""Times drawn by chance: their laws, and what a draw depends on."""

from collections.abc import Callable
from itertools import islice, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning.splitmix import uniform
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import LAWS, NO_CHANCE, Chance, Episode, check_chance, repairs, through
from lab.tasks.task_file import load_cell

CellMaker = Callable[..., Cell]
SEEDS = st.integers(0, 2**64 - 1)
OVEN = 1  # position of a part in the oven


def draws(cell: Cell, chance: Chance, count: int = 4000) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """The first part's time in the oven, in so many episodes (count,)."""
    return np.array([Episode(cell, chance, seed).processing_s(1, OVEN) for seed in range(count)])


def test_without_chance_times_are_those_of_the_cell(fms_cell: CellMaker) -> None:
    cell = fms_cell("RS", 150.0)
    episode = Episode(cell, NO_CHANCE, 9)
    assert [episode.interval_s(part) for part in (1, 2)] == [150.0, 150.0]
    for position, place in enumerate(cell.positions):
        assert episode.processing_s(1, position) == (place.processing_s or 0.0)


def test_the_stream_is_the_published_one() -> None:
    """The first outputs of SplitMix64 with seed 1234567 (Steele, Lea and Flood 2014), as fractions."""
    published = (6457827717110365317, 3203168211198807973, 9817491932198370423)
    assert [uniform(1234567, number) for number in range(3)] == [(z >> 11) / 2**53 for z in published]


@given(seed=SEEDS, number=st.integers(0, 10**6))
def test_numbers_are_below_one(seed: int, number: int) -> None:
    assert 0.0 <= uniform(seed, number) < 1.0


def test_a_normal_time_has_its_mean_and_its_spread(oven_cell: CellMaker) -> None:
    """10 s, 10 %; the mean of 4000 is within 0.1 s (6 standard errors), about 68.3 % are within one deviation."""
    times = draws(oven_cell(1), Chance("normal", spread=0.1))
    assert times.mean() == pytest.approx(10.0, abs=0.1)
    assert times.std() == pytest.approx(1.0, abs=0.07)
    assert (abs(times - 10.0) < 1.0).mean() == pytest.approx(0.683, abs=0.04)


def test_a_normal_time_is_never_negative(oven_cell: CellMaker) -> None:
    """With a spread of 100 % 15.9 % would be."""
    times = draws(oven_cell(1), Chance("normal", spread=1.0))
    assert times.min() == 0.0
    assert (times == 0.0).mean() == pytest.approx(0.159, abs=0.03)


def test_an_exponential_time_has_its_mean(oven_cell: CellMaker) -> None:
    """Mean and deviation 10 s; 63.2 % are below the mean."""
    times = draws(oven_cell(1), Chance("exponential"))
    assert times.mean() == pytest.approx(10.0, abs=0.8)
    assert times.std() == pytest.approx(10.0, abs=1.2)
    assert (times < 10.0).mean() == pytest.approx(0.632, abs=0.04)
    assert times.min() >= 0.0


def test_neighbouring_draws_have_nothing_in_common(toast_cell: CellMaker) -> None:
    """Of parts, of positions and of episodes: |r| of 2000 pairs stays below 0.1 (4.5 standard errors)."""
    cell, chance, count = toast_cell("I", 3), Chance("exponential"), 2000
    first = [Episode(cell, chance, seed).processing_s(1, 1) for seed in range(count)]
    part = [Episode(cell, chance, seed).processing_s(2, 1) for seed in range(count)]
    position = [Episode(cell, chance, seed).processing_s(1, 3) for seed in range(count)]
    for other in (part, position, first[1:] + first[:1]):
        assert abs(np.corrcoef(first, other)[0, 1]) < 0.1


@given(seed=SEEDS, law=st.sampled_from(sorted(LAWS)))
def test_a_draw_depends_on_seed_part_and_position_only(fms_cell: CellMaker, seed: int, law: str) -> None:
    """Asked twice, or in another order, an episode gives the same."""
    cell = fms_cell("RSR")
    keys = [(part, position) for part in (1, 2, 3) for position in range(len(cell.positions))]
    one, other = Episode(cell, Chance(law, law), seed), Episode(cell, Chance(law, law), seed)
    times = {key: one.processing_s(*key) for key in keys}
    assert {key: other.processing_s(*key) for key in reversed(keys)} == times
    assert [one.interval_s(part) for part in (1, 2, 3)] == [other.interval_s(part) for part in (3, 2, 1)][::-1]


def test_processing_and_arrivals_have_laws_of_their_own(fms_cell: CellMaker) -> None:
    cell = fms_cell("S")
    mill = next(index for index, place in enumerate(cell.positions) if place.processing_s == 600.0)
    processed = Episode(cell, Chance("constant", "exponential"), 4)
    assert processed.processing_s(1, mill) == 600.0
    assert processed.interval_s(1) != 200.0
    arrived = Episode(cell, Chance("exponential", "constant"), 4)
    assert arrived.processing_s(1, mill) != 600.0
    assert arrived.interval_s(1) == 200.0


def test_what_takes_no_time_is_not_drawn(oven_cell: CellMaker) -> None:
    """At the end of the route, and where no arrivals are."""
    episode = Episode(oven_cell(1), Chance("exponential", "exponential"), 1)
    assert (episode.processing_s(1, 2), episode.interval_s(1)) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("given_", "says"),
    [
        ({"processing": "gauss"}, "unknown law 'gauss' .*processing.*known: constant, exponential, normal"),
        ({"arrivals": "norml"}, "unknown law 'norml' .*did you mean 'normal'"),
        ({"spread": 1.5}, "spread = 1.5: allowed are 0 to 1"),
        ({"spread": -0.1}, "spread = -0.1"),
        ({"spread": float("nan")}, "spread = nan"),
    ],
)
def test_chances_that_cannot_be(given_: dict[str, object], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        Chance(**given_)  # type: ignore[arg-type]


# ---- breakdowns and late parts -------------------------------------------------------------------------------------


def test_repairs_by_hand() -> None:
    """It breaks down after 4 s and 4 s more, is repaired for 2 s each time, and would break down again after 12 s of work."""
    four, two = 1.0 - np.exp(-0.4), 1.0 - np.exp(-0.5)
    numbers = [four, two] * 4
    assert repairs(10.0, 10.0, 4.0, lambda n: numbers[n]) == pytest.approx(4.0)
    assert repairs(3.9, 10.0, 4.0, lambda n: numbers[n]) == 0.0


def test_breakdowns_prolong_work_by_their_share(oven_cell: CellMaker) -> None:
    """10 s of work, a breakdown in 20 s of it, 4 s of repair: 2 s more on average."""
    times = draws(oven_cell(1), Chance("constant", breaks_every_s=20.0, repair_s=4.0))
    assert times.min() == 10.0
    assert times.mean() == pytest.approx(12.0, abs=0.3)


def test_late_parts_come_so_much_later_on_average(oven_cell: CellMaker) -> None:
    cell = oven_cell(2)
    late_s = np.array([Episode(cell, Chance("constant", late_s=5.0), seed).late_s(2) for seed in range(4000)])
    assert late_s.mean() == pytest.approx(5.0, abs=0.5)
    assert Episode(cell, NO_CHANCE, 3).late_s(2) == 0.0


@pytest.mark.parametrize("name", ["breaks_every_s", "repair_s", "late_s", "robot_breaks_every_s", "robot_repair_s"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_times_of_mishaps_that_cannot_be(name: str, value: float) -> None:
    with pytest.raises(BadInput, match=rf"^chance, {name} = {value}: allowed are finite times from 0$"):
        Chance(**{name: value})  # type: ignore[arg-type]


# ---- robots that break down ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start_s", "work_s", "until_s"),
    [
        (0.0, 10.0, 10.0),  # done as it breaks down
        (0.0, 11.0, 31.0),  # 10 s before, 1 s after the repair
        (12.0, 5.0, 35.0),  # begun when it is repaired
        (10.0, 0.0, 30.0),  # nothing is begun then
        (0.0, 45.0, 115.0),  # twice: 10 s, 10 s from 30 on, the rest from 90 on
        (95.0, 1.0, 96.0),
    ],
)
def test_through_outages_by_hand(start_s: float, work_s: float, until_s: float) -> None:
    """Out of order from 10 to 30 s, and from 40 to 90 s."""
    assert through([(10.0, 30.0), (40.0, 90.0)], start_s, work_s) == until_s


def test_robots_are_out_of_order_by_their_share() -> None:
    """In order for 80 s, repaired for 20 s, on average: 20 % of the time, each at times of its own, whatever is done."""
    cell, chance = load_cell("two-carriers").cell(2), Chance("constant", robot_breaks_every_s=80.0, robot_repair_s=20.0)
    episode = Episode(cell, chance, 3)
    own = [[*islice(episode.outages(robot), 2000)] for robot in (0, 1)]
    assert own[0] == [*islice(Episode(cell, chance, 3).outages(0), 2000)]
    assert own[0][0] != own[1][0]
    for stops in own:
        assert sum(until_s - from_s for from_s, until_s in stops) / stops[-1][1] == pytest.approx(0.2, abs=0.02)
        assert all(a[1] <= b[0] for a, b in pairwise(stops))


def test_without_breakdowns_robots_are_always_in_order() -> None:
    episode = Episode(load_cell("two-carriers").cell(2), Chance("constant", robot_repair_s=20.0), 3)
    assert [*episode.outages(0)] == []
    assert episode.until_s(1, 3.0, 4.0) == 7.0


def test_robots_that_cannot_break_down() -> None:
    with pytest.raises(BadInput, match=r"^chance, robot_breaks_every_s = 0.5: allowed are 0 and times from 1$"):
        Chance(robot_breaks_every_s=0.5)
    with pytest.raises(BadInput, match="robot_breaks_every_s = 50 and a track"):
        check_chance(load_cell("two-on-a-track").cell(), Chance(robot_breaks_every_s=50.0))
