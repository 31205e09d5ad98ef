"""The listing's sessions: its rules by hand, against the lab's own simulation, and against a readable session."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from math import cos, log, pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.learning.splitmix import uniform
from lab.sequencing.cell.cell import Cell
from lab.sequencing.simulate.follow import simulate
from lab.tasks.task_file import load_cell
from lab_studies.thesis import chapter_7_listing_kernels as kernels
from lab_studies.thesis.chapter_7_listing import (
    LISTING,
    ListingInput,
    Reading,
    banned_states,
    new_workspace,
    run_sessions,
)
from lab_studies.thesis.chapter_7_listing_kernels import LATEST_S, STATE, ListingRules, Toasts

CASES = ("toast-case-1", "toast-case-2", "toast-case-3")
OPTIMA = {3: (513, 700, 995), 4: (663, 900, 1290)}
# The "impossible positions" of the listing, one digit a toast, stations from 1.
IMPOSSIBLE = """
    112 114 121 122 124 133 134 141 142 143 144 155 211 212 214 221 222 224 233 234 241 242 243 244 255 313 314 323 324 331
    332 333 334 335 336 341 342 343 344 353 355 363 411 412 413 414 421 422 423 424 431 432 433 434 441 442 443 444 454 455
    511 515 525 533 535 545 551 552 553 554 555 556 565 633 655
"""
METHODS = (("srl", "A"), ("srl", "B"), ("mc", None), ("random", None))
READINGS = (
    LISTING,
    replace(LISTING, averages=True),
    replace(LISTING, phantoms=False),
    replace(LISTING, null_moves=False),
    replace(LISTING, last_of_ties=False),
    replace(LISTING, frees_by_place=False, bans_too=False),
)


def cell_of(toasts: int, case: int = 1) -> Cell:
    return load_cell(CASES[case]).cell(toasts)


def toasts_of(cell: Cell, spread: float = 0.0, reading: Reading = LISTING) -> Toasts:
    return ListingInput.of(cell, "random", None, reading, spread).toasts


def rules_of(method: str, factor: str | None, reading: Reading = LISTING) -> ListingRules:
    return ListingInput.of(cell_of(3), method, factor, reading).rules


def epsilons(episodes: int, beta: float = 1.0) -> Any:
    return np.arange(1.0, episodes + 1) ** -beta


def seeds(number: int, first: int = 1) -> Any:
    return np.random.default_rng(first).integers(2**64, size=number, dtype=np.uint64)


def number_of(*stations: int) -> int:
    """The state of toasts at these stations, from 1 as the thesis numbers them, toast 1 first."""
    return sum((station - 1) * 6**toast for toast, station in enumerate(stations))


# ---- rules --------------------------------------------------------------------------------------------------------


def test_the_impossible_states_are_those_of_the_listing() -> None:
    named = sorted(number_of(*map(int, word)) for word in IMPOSSIBLE.split())
    assert len(named) == 75
    assert np.flatnonzero(banned_states(3)).tolist() == named
    fewer = banned_states(3, replace(LISTING, bans_too=False))
    assert {*named} - {*np.flatnonzero(fewer).tolist()} == {number_of(5, 1, 1), number_of(4, 5, 4)}


@pytest.mark.parametrize(
    ("stations", "banned"),
    [
        ((3, 3, 1, 1), True),  # two in the toaster
        ((5, 2, 5, 3), True),  # two at the butter applier
        ((4, 1, 3, 1), True),  # one waits for the applier, and nothing is or was there
        ((4, 1, 3, 6), False),
        ((2, 1, 1, 1), True),  # one waits for the toaster, and nothing is or was there
        ((2, 1, 1, 5), False),
        ((5, 1, 1, 1), False),  # banned with three toasts only
        ((6, 6, 6, 6), False),
    ],
)
def test_the_rules_hold_for_four_toasts(stations: tuple[int, ...], banned: bool) -> None:
    assert banned_states(4)[number_of(*stations)] == banned


def carried(work: Any, toasts: Toasts, toast: int, rules: Any) -> tuple[float, int, int]:
    """Clock, state and moves after one more move of a toast, numbered from 1."""
    kernels.carry(toasts, rules, work, toast - 1)
    return work.clock[0], work.whole[STATE], int(np.count_nonzero(work.moved))


def test_moves_of_case_two_by_hand() -> None:
    """Stations 1 to 6, the robot begins at 2. Travel: 2-1 30, 1-3 30, 3-1 30, 1-2 20, 2-3 30, 3-5 50 s; 90 s of toasting."""
    toasts, rules, work = toasts_of(cell_of(3)), rules_of("random", None), new_workspace(3)
    kernels.reset(work)
    assert carried(work, toasts, 1, rules) == (60, number_of(3, 1, 1), 1)  # 30 empty, 30 with the toast; done at 150
    assert carried(work, toasts, 2, rules) == (110, number_of(3, 2, 1), 2)  # the toaster is busy: into its buffer
    assert carried(work, toasts, 2, rules) == (
        110,
        number_of(3, 2, 1),
        2,
    )  # a null move, and the robot is there already
    assert carried(work, toasts, 1, rules) == (200, number_of(5, 2, 1), 3)  # there at 140, waits until 150
    assert carried(work, toasts, 2, rules) == (250, number_of(5, 3, 1), 4)  # 20 empty from 5 to 2, 30 with the toast
    assert work.moved[:5].tolist() == [1, 2, 1, 2, 0]


def test_a_null_move_takes_the_way_to_the_toast() -> None:
    """From the toaster to its buffer no toast is ever taken, and table 7.2 has no time: it counts as 0 s."""
    toasts, rules, work = toasts_of(cell_of(3)), rules_of("random", None), new_workspace(3)
    kernels.reset(work)
    for toast, clock in ((1, 60), (2, 110), (3, 160), (2, 160)):  # 2-1 30, 1-2 20 for the third; 2-2 nothing
        assert carried(work, toasts, toast, rules)[0] == clock
    assert carried(work, toasts, 1, rules)[0] == 240  # 2-3 30, 3-5 50
    assert carried(work, toasts, 3, rules)[0] == 290  # 5-2 20, 2-3 30: into the toaster
    assert carried(work, toasts, 2, rules) == (290, number_of(5, 2, 3), 5)


def options_after(reading: Reading, *moved: int) -> list[tuple[int, tuple[int, ...]]]:
    """The options after these toasts were moved: toast, and stations of the next state; from 1."""
    toasts, rules, work = toasts_of(cell_of(3)), rules_of("random", None, reading), new_workspace(3)
    kernels.reset(work)
    for toast in moved:
        kernels.carry(toasts, rules, work, toast - 1)
    found = kernels.list_options(toasts, rules, work)
    states = work.following[:found].tolist()
    stations = [tuple(state // 6**toast % 6 + 1 for toast in range(3)) for state in states]
    return [*zip((work.toast[:found] + 1).tolist(), stations, strict=True)]


def test_the_options_are_next_states() -> None:
    """At (3, 2, 1) toast 1 may aim at 5, but not at 4, where nothing is ahead; toast 2 at nothing; toast 3 at 2 only."""
    assert options_after(LISTING, 1, 2) == [(1, (5, 2, 1)), (3, (3, 2, 2))]


def test_phantoms_and_null_moves_are_options_of_the_listing_only() -> None:
    """At (5, 3, 2) the machines are busy: toast 2 would go to 4, and toast 3 has to stay, but may aim at 4."""
    known = [(1, (6, 3, 2)), (2, (5, 4, 2))]
    assert options_after(LISTING, 1, 2, 1, 2, 3) == [*known, (3, (5, 3, 4))]
    assert options_after(replace(LISTING, null_moves=False), 1, 2, 1, 2, 3) == known
    assert options_after(replace(LISTING, phantoms=False), 1, 2, 1, 2, 3) == known


def test_a_phantom_is_another_way_to_choose_the_same_move() -> None:
    """At (5, 2, 1) the toaster is free: toast 2 goes there, and may aim at 4 as well; toast 3, too, and may aim at 2."""
    assert options_after(LISTING, 1, 2, 1) == [
        (1, (6, 2, 1)),
        (2, (5, 3, 1)),
        (2, (5, 4, 1)),
        (3, (5, 2, 2)),
        (3, (5, 2, 3)),
    ]
    own_way = [(1, (6, 2, 1)), (2, (5, 3, 1)), (3, (5, 2, 3))]
    assert options_after(replace(LISTING, phantoms=False), 1, 2, 1) == own_way


def test_what_an_episode_teaches_by_hand() -> None:
    """Two states visited, the first twice, T = 500 s, the best 490 s: R of type A is 1 / 15 + .8, of type B 1 / 500."""
    expected = {
        ("srl", "A"): [(1 / 15 + 0.8) ** 2 * 0.5, (1 / 15 + 0.8) * 0.25],
        ("srl", "B"): [0.5 / 500 / 500, 0.25 / 500],
        ("mc", None): [1 / 500, 1 / 500],
        ("random", None): [0.5, 0.25],
    }
    for (method, factor), values in expected.items():
        work = new_workspace(3)
        work.values[[7, 9]], work.visits[[7, 9]], work.seen[:2] = (0.5, 0.25), (2, 1), (7, 9)
        work.whole[kernels.SEEN] = 2
        kernels.learn(rules_of(method, factor), work, 500.0, 490.0)
        assert work.values[[7, 9]].tolist() == pytest.approx(values, rel=1e-12)
        assert work.values[8] == 1.0


def test_averages_over_a_session_by_hand() -> None:
    """State 7 had 2 visits of mean .004; two more with 1 / 500 make .003. State 9 had none."""
    work = new_workspace(3)
    work.values[7], work.counts[7], work.visits[[7, 9]], work.seen[:2] = 0.004, 2, (2, 1), (7, 9)
    work.whole[kernels.SEEN] = 2
    kernels.learn(rules_of("mc", None, replace(LISTING, averages=True)), work, 500.0, 490.0)
    assert work.values[[7, 9]].tolist() == pytest.approx([0.003, 0.002])
    assert work.counts[[7, 9]].tolist() == [4, 1]


# ---- whole sessions -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("toasts", [3, 4])
@pytest.mark.parametrize("case", [0, 1, 2])
def test_no_session_is_better_than_the_printed_optimum(toasts: int, case: int) -> None:
    for method, factor in METHODS:
        found = run_sessions(ListingInput.of(cell_of(toasts, case), method, factor), epsilons(60), seeds(50))
        assert found.best_s.min() >= OPTIMA[toasts][case]
    assert toasts == 4 or found.best_s.min() == OPTIMA[toasts][case]


@settings(max_examples=30, deadline=None)
@given(
    toasts=st.integers(2, 5),
    case=st.integers(0, 2),
    method=st.sampled_from(METHODS),
    null_moves=st.booleans(),
    seed=st.integers(0, 2**64 - 1),
)
def test_the_best_sequence_in_the_simulation(
    toasts: int, case: int, method: tuple[str, str | None], null_moves: bool, seed: int
) -> None:
    """It may be carried out, and without null moves takes the same time; these have ways, also such that take no time."""
    reading = replace(LISTING, null_moves=null_moves, frees_by_place=False)
    cell = cell_of(toasts, case)
    found = run_sessions(ListingInput.of(cell, *method, reading), epsilons(12), np.array([seed], np.uint64))
    moved = [toast for toast in found.sequences[0].tolist() if toast]
    makespan_s = simulate(cell, moved).makespan_s
    assert sorted({*moved}) == [*range(1, toasts + 1)]
    assert null_moves or makespan_s == pytest.approx(found.best_s[0])


class Plain:
    """A session as its rules say it, a list of visits and a dictionary of values; stations from 1."""

    def __init__(self, toasts: Toasts, method: str, factor: str | None, reading: Reading, seed: int) -> None:
        self.toasts, self.method, self.factor, self.reading = toasts, method, factor, reading
        self.stream = (uniform(seed, number) for number in count())
        self.values: dict[tuple[int, ...], float] = {}
        self.visits: dict[tuple[int, ...], int] = {}
        self.best_s = np.inf
        self.k = round(log(len(toasts.banned), 6))

    def travel_s(self, origin: int, target: int) -> float:
        return float(self.toasts.travel_s[origin - 1, target - 1])

    def value(self, state: tuple[int, ...]) -> float:
        return self.values.get(state, 1.0)

    def processed_s(self, station: int) -> float:
        mean_s = float(self.toasts.processing_s[station - 1])
        if self.toasts.spread == 0:
            return mean_s
        u, v = next(self.stream), next(self.stream)
        return mean_s * (1.0 + self.toasts.spread * sqrt(-2.0 * log(1.0 - u)) * cos(2.0 * pi * v))

    def goes_to(self, station: int, busy: dict[int, bool]) -> int:
        if station in (1, 2):
            return 2 if busy[3] else 3
        if station in (3, 4):
            return 4 if busy[5] else 5
        return 6

    def options(self, state: tuple[int, ...], busy: dict[int, bool]) -> Iterator[tuple[int, tuple[int, ...]]]:
        for toast, station in enumerate(state):
            stays = station in (2, 4) and self.goes_to(station, busy) == station
            if stays and not (self.reading.phantoms and self.reading.null_moves):
                continue
            aims = (station + 1, station + 2) if self.reading.phantoms else (self.goes_to(station, busy),)
            for aim in aims if station < 6 else ():
                following = (*state[:toast], aim, *state[toast + 1 :])
                if aim <= 6 and not self.toasts.banned[number_of(*following)]:
                    yield toast, following

    def choose(self, options: list[tuple[int, tuple[int, ...]]], epsilon: float) -> int:
        if next(self.stream) <= epsilon:
            return options[int(next(self.stream) * len(options))][0]
        top = max(self.value(state) for _, state in options)
        ties = [toast for toast, state in options if self.value(state) == top]
        if self.reading.last_of_ties or len(ties) == 1:
            return ties[-1]
        return ties[int(next(self.stream) * len(ties))]

    def episode(self, epsilon: float) -> float:
        state, robot, clock_s, toast = (1,) * self.k, 2, 0.0, 0
        ready_s, busy, visited = [0.0] * self.k, {3: False, 5: False}, [state]
        while True:
            origin = state[toast]
            target = self.goes_to(origin, busy)
            clock_s = max(clock_s + self.travel_s(robot, origin), ready_s[toast]) + self.travel_s(origin, target)
            robot = target
            if target in (3, 5):
                busy[target], ready_s[toast] = True, clock_s + self.processed_s(target)
            if origin == 3 or (self.reading.frees_by_place and target in (4, 5)):
                busy[3] = False
            if target == 6:
                busy[5] = False
            before, state = state, (*state[:toast], target, *state[toast + 1 :])
            visited.append(state)
            if self.method == "srl":
                own = self.value(before)
                self.values[before] = own + 0.05 * (0.9 * self.value(state) - own)
            if state == (6,) * self.k:
                break
            toast = self.choose(list(self.options(state, busy)), epsilon)
        if self.method == "srl":
            self.values[state] = 1.5 + 0.9 * self.value(state)
        self.learn(visited[1:], clock_s)
        return clock_s

    def learn(self, visited: list[tuple[int, ...]], time_s: float) -> None:
        self.best_s = min(self.best_s, time_s)
        a, b = (5.0, 0.8) if self.k == 3 else (10.0, 0.95)
        factor = 1 / time_s if self.factor == "B" else 1 / (time_s - self.best_s + a) + b
        for state in visited:
            if self.method == "srl":
                self.values[state] = self.value(state) * factor
            elif self.method == "mc" and self.reading.averages:
                n = self.visits.get(state, 0)
                self.values[state] = (n * self.value(state) + 1 / time_s) / (n + 1)
                self.visits[state] = n + 1
            elif self.method == "mc":
                self.values[state] = 1 / time_s


@pytest.mark.parametrize("method", METHODS, ids=lambda method: "-".join(filter(None, method)))
@pytest.mark.parametrize("reading", READINGS, ids=range(len(READINGS)))
@pytest.mark.parametrize(("toasts", "spread"), [(3, 0.0), (3, 0.1), (4, 0.0)])
def test_the_compiled_session_is_the_plain_one(
    method: tuple[str, str | None], reading: Reading, toasts: int, spread: float
) -> None:
    listed = ListingInput.of(cell_of(toasts, 0), *method, reading, spread)
    found = run_sessions(listed, epsilons(40), seeds(2), keep_times=True)
    for seed, times_s, best_s, last_s, converged in zip(
        seeds(2).tolist(), found.times_s.tolist(), found.best_s, found.last_s, found.converged, strict=True
    ):
        plain = Plain(listed.toasts, *method, reading, seed)
        tried = [1.0] * 40 if method[0] == "random" else epsilons(40).tolist()
        expected = [plain.episode(epsilon) for epsilon in tried]
        assert times_s == pytest.approx(expected, rel=1e-12)
        assert (best_s, last_s) == (min(times_s), times_s[-1])
        changes = [n for n in range(1, 40) if times_s[n] != times_s[n - 1]]
        assert converged == (changes[-1] + 1 if changes else 1)


def test_a_session_depends_on_its_seed_only() -> None:
    listed, all_seeds = ListingInput.of(cell_of(3), "srl", "B", spread=0.1), seeds(6)
    whole = run_sessions(listed, epsilons(20), all_seeds, keep_times=True)
    part = run_sessions(listed, epsilons(20), all_seeds[2:4], keep_times=True)
    for one, other in zip(whole, part, strict=True):
        np.testing.assert_array_equal(one[2:4], other)
    without = run_sessions(listed, epsilons(20), all_seeds)
    assert without.times_s.shape == (0, 20)
    np.testing.assert_array_equal(without.best_s, whole.best_s)
    assert len({*whole.best_s.tolist()}) == 6


def test_drawn_times_have_the_spread_that_is_asked_for() -> None:
    """Of 4000 drawn times of 90 s: mean 90, standard deviation 9, each within four standard errors."""
    problem, work = toasts_of(cell_of(3), 0.1), new_workspace(3)
    work.stream[0] = 12
    drawn = np.array([kernels.processing_s(problem, work, kernels.TOASTER) for _ in range(4000)])
    assert drawn.mean() == pytest.approx(90, abs=4 * 9 / 4000**0.5)
    assert drawn.std() == pytest.approx(9, abs=4 * 9 / 8000**0.5)
    still = problem._replace(spread=0.0)
    assert kernels.processing_s(still, work, kernels.TOASTER) == 90


def test_an_episode_without_options_is_given_up() -> None:
    listed = ListingInput.of(cell_of(3), "random")
    stuck = replace(listed, toasts=listed.toasts._replace(banned=np.ones_like(listed.toasts.banned)))
    found = run_sessions(stuck, epsilons(3), seeds(2), keep_times=True)
    assert found.times_s.tolist() == [[LATEST_S] * 3] * 2


# ---- refusals -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "factor", "episodes", "says"),
    [
        ("monte carlo", None, 5, r"^unknown method 'monte carlo' \(listing\):.* known: mc, random, srl$"),
        ("srl", None, 5, r"^unknown reward factor 'None' \(listing\):.* known: A, B$"),
        ("mc", None, 0, r"^episodes = 0: allowed are whole numbers from 1$"),
    ],
)
def test_what_is_refused(method: str, factor: str | None, episodes: int, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        run_sessions(ListingInput.of(cell_of(3), method, factor), epsilons(episodes), seeds(1))


def test_other_cells_are_refused() -> None:
    with pytest.raises(BadInput, match=r"^7 toasts as listed: allowed are 2 to 6$"):
        toasts_of(cell_of(7))
    with pytest.raises(BadInput, match=r"^cell with the stations .*toast cell$"):
        toasts_of(load_cell("fms").cell())
