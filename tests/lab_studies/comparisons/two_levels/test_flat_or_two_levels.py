"""One flat problem or two levels: both worlds are the same, both learners find the optimum of small ones, rows are complete."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.mdp import shortest_steps
from lab.sequencing.methods.exact import optimum
from lab.sequencing.methods.srl_time import srl_time
from lab.sequencing.simulate.run import Run
from lab.studies.findings import Findings
from lab.studies.report import write_rows
from lab.studies.runner import Job
from lab_studies.comparisons.two_levels import flat_or_two_levels as module
from lab_studies.comparisons.two_levels.flat_learner import FlatSettings, learn_flat
from lab_studies.comparisons.two_levels.flat_or_two_levels import (
    BUDGETS,
    CAP,
    FLAT,
    KITCHEN,
    LARGEST,
    METHODS,
    TOASTS,
    flat,
)
from lab_studies.comparisons.two_levels.kitchen import (
    ACTIONS,
    DROP,
    LETTERS,
    PICK,
    WAIT,
    FlatWorld,
    Kitchen,
    Way,
    flat_world,
)
from lab_studies.comparisons.two_levels.two_level_learner import (
    EPISODES,
    LearnedTransfer,
    TwoLevels,
    learned_stages,
    serial_makespan,
    steps_in_flat_world,
)

UP, DOWN, LEFT, RIGHT = range(4)
# All stations in a row, two steps each machine; the robot begins at the second cell.
LINE = Kitchen(("PtTbBF",), 2, 2)
ONE_TOAST = [LEFT, PICK, RIGHT, RIGHT, DROP, WAIT, WAIT, PICK, RIGHT, RIGHT, DROP, WAIT, WAIT, PICK, RIGHT, DROP]


@pytest.fixture(scope="module")
def line() -> FlatWorld:
    return flat_world(LINE, 1)


@pytest.fixture(scope="module")
def pair() -> FlatWorld:
    return flat_world(LINE, 2)


def walk(world: FlatWorld, actions: list[int], state: int | None = None) -> int:
    state = world.mdp.start if state is None else state
    for action in actions:
        state = int(world.mdp.successor[state, action])
    return state


def shortest(kitchen: Kitchen, parts: int) -> dict[Way, int]:
    empty, loaded = kitchen.needed(parts)
    return {way: shortest_steps(kitchen.way(way)) for way in (*empty, *loaded)}


def test_a_toast_on_its_way(line: FlatWorld) -> None:
    """16 steps, and none fewer: 1 + pick + 2 + drop, wait 2, pick + 2 + drop, wait 2, pick + 1 + drop."""
    assert [int(line.carried[walk(line, ONE_TOAST[:n])]) for n in (1, 2, 4, 5, 8, 11, 14)] == [0, 1, 1, 0, 2, 0, 3]
    assert line.mdp.goal[walk(line, ONE_TOAST)]
    assert not line.mdp.goal[walk(line, ONE_TOAST[:-1])]
    assert shortest_steps(line.mdp) == len(ONE_TOAST)
    assert (line.mdp.reward[~line.mdp.terminal] == -1).all()
    assert line.mdp.action_labels == ACTIONS


def test_what_cannot_be_done_is_a_wait(line: FlatWorld) -> None:
    start = line.mdp.start
    for nothing in (UP, DOWN, PICK, DROP, WAIT):  # one row only, an empty buffer, empty hands
        assert walk(line, [nothing]) == start
    loaded = walk(line, ONE_TOAST[:2])
    assert walk(line, [PICK], loaded) == loaded  # one at a time
    assert walk(line, [RIGHT, DROP], loaded) == walk(
        line, [RIGHT], loaded
    )  # not in the buffer while the toaster is free
    busy = walk(line, ONE_TOAST[:5])
    assert walk(line, [PICK], busy) == walk(line, [WAIT], busy)  # not done yet
    assert walk(line, [WAIT, PICK], busy) == walk(line, [WAIT, WAIT], busy)
    assert line.carried[walk(line, [WAIT, WAIT, PICK], busy)] == 2


def test_the_buffer_is_for_when_the_machine_is_busy(pair: FlatWorld) -> None:
    """While the first toast is in the toaster the second one goes to the buffer, and back there when it is picked early."""
    second = walk(pair, [*ONE_TOAST[:5], LEFT, LEFT, PICK, RIGHT])
    stored = walk(pair, [DROP], second)
    assert (pair.carried[second], pair.carried[stored]) == (1, 0)
    assert walk(pair, [PICK], stored) == second
    assert walk(pair, [RIGHT, DROP], second) == walk(pair, [RIGHT, WAIT], second)  # the toaster is full


def test_alike_toasts_are_one(pair: FlatWorld) -> None:
    """Only what can be reached is a state, and when all is done it does not matter which toast came first."""
    reached = {pair.mdp.start} | {int(s) for s in pair.mdp.successor[~pair.mdp.terminal].ravel()}
    assert reached == set(range(pair.mdp.n_states))
    assert pair.mdp.goal.sum() == 1


@st.composite
def kitchens(draw: st.DrawFn) -> Kitchen:
    """Stations anywhere on 3 x 4 cells, without obstacles."""
    cells = draw(st.permutations([*LETTERS, *"......"]))
    return Kitchen(
        tuple("".join(cells[n : n + 4]) for n in (0, 4, 8)), draw(st.integers(1, 6)), draw(st.integers(1, 6))
    )


@settings(deadline=None, max_examples=15)
@given(kitchens(), st.integers(1, 2))
def test_two_levels_lose_nothing(kitchen: Kitchen, toasts: int) -> None:
    """The exact optimum of the flat problem is that of the cell with shortest transfers."""
    best = optimum(kitchen.cell(toasts, shortest(kitchen, toasts))).optimal_s
    assert shortest_steps(flat_world(kitchen, toasts).mdp) == best


def sequences(kitchen: Kitchen, toasts: int, steps: dict[Way, int]) -> Iterator[tuple[tuple[int, ...], float]]:
    """Every sequence that the cell allows, and its makespan."""
    cell = kitchen.cell(toasts, steps)
    pending: list[tuple[int, ...]] = [()]
    while pending:
        sequence = pending.pop()
        run = Run(cell)
        for decision in sequence:
            run.move(decision)
        if run.done:
            yield sequence, run.now_s
        pending += [(*sequence, decision) for decision in run.allowed()]


def test_what_the_cell_predicts_is_what_the_world_takes() -> None:
    """Every sequence of two toasts, carried out by the shortest ways along the row."""
    steps, world = shortest(LINE, 2), flat_world(LINE, 2)
    moves = {way: [RIGHT if LINE.places[way[1]] > LINE.places[way[0]] else LEFT] * n for way, n in steps.items()}
    cell = LINE.cell(2, steps)
    found = list(sequences(LINE, 2, steps))
    assert len(found) > 10
    for sequence, makespan in found:
        assert steps_in_flat_world(world, cell, sequence, moves, CAP) == makespan
    assert min(makespan for _, makespan in found) == shortest_steps(world.mdp)
    assert serial_makespan(cell) == dict(found)[1, 1, 1, 2, 2, 2]


def test_a_sequence_that_does_not_come_to_its_end() -> None:
    steps, world = shortest(LINE, 1), flat_world(LINE, 1)
    wrong = {way: [WAIT] for way in steps}
    assert steps_in_flat_world(world, LINE.cell(1, steps), [1, 1, 1], wrong, 50) == 51


@pytest.mark.parametrize("name", FLAT)
def test_every_flat_setting_finds_the_optimum_of_one_toast(name: str, line: FlatWorld) -> None:
    makespans = learn_flat(line, FLAT[name], (2, 10_000, 100_000), CAP, np.random.default_rng(0))
    assert makespans[0] == -1  # nothing is known after two steps
    assert makespans[2] == len(ONE_TOAST)


def test_flat_learning_by_seed(line: FlatWorld) -> None:
    """The same chance, the same makespans; what is known never gets longer than the best episode so far."""
    budgets = tuple(range(200, 4000, 200))
    found = [learn_flat(line, FLAT["optimistic"], budgets, CAP, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert (found[0] == found[1]).all()
    assert (found[0] != found[2]).any()
    for one in found:
        assert one.min() == -1 or one.min() >= len(ONE_TOAST)


def test_a_makespan_above_the_cap_is_none(line: FlatWorld) -> None:
    makespans = learn_flat(line, FLAT["optimistic"], (100_000,), len(ONE_TOAST) - 1, np.random.default_rng(0))
    assert makespans.tolist() == [-1]


def test_an_episode_that_is_broken_off(line: FlatWorld) -> None:
    """Episodes of 15 steps never see the end of a task of 16; each begins at the start again."""
    short = FlatSettings(cost=0.0, goal=1.0, discount=0.9, epsilon=1.0, longest=len(ONE_TOAST) - 1)
    assert learn_flat(line, short, (50_000,), CAP, np.random.default_rng(0)).tolist() == [-1]
    enough = FlatSettings(cost=0.0, goal=1.0, discount=0.9, epsilon=1.0, longest=2000)
    assert learn_flat(line, enough, (50_000,), CAP, np.random.default_rng(0)).tolist() == [len(ONE_TOAST)]


def test_practice_goes_on_where_it_stopped() -> None:
    """More episodes take more steps, and the last ones know a shortest way."""
    way = (LETTERS["T"], LETTERS["B"])
    skills = learned_stages(KITCHEN, way, [0])
    assert len(skills) == len(EPISODES)
    assert all(one.steps < other.steps for one, other in pairwise(skills))
    assert skills[-1].moves == (DOWN,) * 3
    assert skills == learned_stages(KITCHEN, way, [0])


@pytest.fixture(scope="module")
def skills() -> dict[Way, tuple[LearnedTransfer, ...]]:
    """Ways along the row that are learned in ten steps an episode, at once but for the one from toaster to butter."""
    empty, loaded = LINE.needed(2)
    known = {}
    for way in {*empty, *loaded}:
        difference = LINE.places[way[1]][1] - LINE.places[way[0]][1]
        moves = (RIGHT if difference > 0 else LEFT,) * abs(difference)
        late = way == (LETTERS["T"], LETTERS["B"])
        known[way] = tuple(LearnedTransfer(10 * n, None if late and n == EPISODES[0] else moves) for n in EPISODES)
    return known


@pytest.mark.parametrize("count_simulated", [True, False])
def test_a_budget_is_kept_to(
    count_simulated: bool, skills: dict[Way, tuple[LearnedTransfer, ...]], pair: FlatWorld
) -> None:
    learner = TwoLevels(LINE, pair, 2, skills, [0])
    best, ways = shortest_steps(pair.mdp), len(skills)
    first = 10 * EPISODES[0] * ways  # all sub-tasks have been tried so often
    assert learner.outcome(first - 1, CAP, count_simulated).makespan is None
    for budget in (first, 2 * first, 5 * first, 50 * first):
        assert learner.outcome(budget, CAP, count_simulated).used <= budget
    assert learner.outcome(50 * first, CAP, count_simulated).makespan == best


def test_simulated_steps_count_or_not(skills: dict[Way, tuple[LearnedTransfer, ...]], pair: FlatWorld) -> None:
    """As many steps as the sub-tasks take are not enough when half of them is kept for the sequencer."""
    learner = TwoLevels(LINE, pair, 2, skills, [0])
    low = 10 * EPISODES[-1] * len(skills)
    without, with_them = (learner.outcome(low, CAP, count) for count in (False, True))
    assert without.used == low
    assert without.makespan == shortest_steps(pair.mdp)
    assert with_them.used < low
    assert learner.outcome(10 * low, CAP, True).used > low


def test_a_transfer_that_is_not_known_is_not_used(
    skills: dict[Way, tuple[LearnedTransfer, ...]], line: FlatWorld
) -> None:
    """One toast has to be carried from the toaster to the butter: not before that is learned."""
    learner = TwoLevels(LINE, line, 1, skills, [0])
    ways = len({*LINE.needed(1)[0], *LINE.needed(1)[1]})
    assert learner.outcome(10 * EPISODES[0] * ways, CAP, False).makespan is None
    assert learner.outcome(10 * EPISODES[1] * ways, CAP, False).makespan == len(ONE_TOAST)


def test_the_sequencer_is_the_labs_own(monkeypatch: pytest.MonkeyPatch, skills: Any, line: FlatWorld) -> None:
    asked = []

    def listening(cell: Any, search: Any, rng: Any) -> Any:
        asked.append((cell.parts, search.episodes))
        return srl_time(cell, search, rng)

    monkeypatch.setattr("lab_studies.comparisons.two_levels.two_level_learner.srl_time", listening)
    learner = TwoLevels(LINE, line, 1, skills, [0])
    for budget in (10_000_000, 20_000_000):
        learner.outcome(budget, CAP, True)
    assert len(asked) == 1  # more budget than it can use: the same again


Study = tuple[Findings, list[tuple[int, int]]]
SMALL = {1: 30_000, 2: 15_000, 3: 1000}


@pytest.fixture(scope="module")
def study() -> Study:
    """Two sessions, though three are asked for, with small budgets; and what was told of its progress."""
    told: list[tuple[int, int]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "LARGEST", SMALL)
        patch.setattr(module, "SESSIONS", 2)
        return flat(Job(3, 3, progress=lambda *both: told.append(both)), {}), told


def test_the_study_has_all_rows(study: Study, tmp_path: Path) -> None:
    found, told = study
    assert found.summary["sessions"] == 2
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    finished = [one for one in found.rows if one["measure"] == "finished_percent"]
    asked = [
        (toasts, method, setting, budget)
        for toasts in TOASTS
        for method, setting in METHODS
        for budget in BUDGETS
        if budget <= SMALL[toasts]
    ]
    assert [(one["toasts"], one["method"], one["setting"], one["budget"]) for one in finished] == asked
    assert all((one["thesis"], one["within"]) == (None, None) for one in found.rows)
    write_rows(tmp_path / "rows.csv", found.rows)
    assert len((tmp_path / "rows.csv").read_text().splitlines()) == len(found.rows) + 1


def test_makespans_of_the_study(study: Study) -> None:
    """None is below the optimum, the gap says how far above, and there is one wherever a session finished."""
    rows = study[0].rows
    measured = {
        (one["toasts"], one["method"], one["setting"], one["budget"], one["measure"]): one["value"] for one in rows
    }
    best = {t: measured[t, "exact", "flat", None, "makespan_steps"] for t in TOASTS}
    assert best == {t: measured[t, "exact", "two levels", None, "makespan_steps"] for t in TOASTS}
    assert best[1] < best[2] < best[3]
    there = {key[:4]: value for key, value in measured.items() if key[4] == "makespan_steps" and key[3] is not None}
    for key, value in there.items():
        assert best[key[0]] <= value <= CAP
        assert measured[*key, "gap_percent"] == pytest.approx(100 * (value / best[key[0]] - 1))
    assert {key[:4] for key, value in measured.items() if key[4] == "finished_percent" and value > 0} == {*there}
    assert there[1, "two-level", "all steps", 30_000] == best[1]
    assert there[1, "flat", "optimistic", 30_000] < 1.1 * best[1]


def test_the_studys_summary_and_picture(study: Study) -> None:
    found = study[0]
    budgets = {key: value for key, value in found.summary.items() if "steps to within" in key}
    assert len(budgets) == len(TOASTS) * len(METHODS)
    assert all(value is None for key, value in budgets.items() if key.startswith("3 toasts"))
    assert budgets["1 toast: steps to within 5 %, two-level, all steps"] in BUDGETS
    assert found.summary["3 toasts: states of the flat problem"] > found.summary["1 toast: states of the flat problem"]
    (picture,) = found.figures.values()
    assert ElementTree.fromstring(picture).tag.endswith("svg")


def test_one_session_that_finished_has_no_interval() -> None:
    named = {"toasts": 1}
    rows = {one["measure"]: one for one in module.rows_of(named, np.array([-1, 20, -1]), 16)}
    assert (rows["makespan_steps"]["value"], rows["makespan_steps"]["ci95"]) == (20.0, None)
    assert rows["gap_percent"]["value"] == 25.0
    assert rows["finished_percent"]["value"] == pytest.approx(100 / 3)
    none = [one["measure"] for one in module.rows_of(named, np.array([-1, -1]), 16)]
    assert none == ["finished_percent"]


def test_the_kitchen_of_the_study() -> None:
    """Every station can be reached, and budgets ascend up to the largest one."""
    assert set(shortest(KITCHEN, max(TOASTS))) == {*KITCHEN.needed(3)[0], *KITCHEN.needed(3)[1]}
    assert [*BUDGETS] == sorted({*BUDGETS})
    assert {*LARGEST.values()} <= {*BUDGETS}
    assert {*LARGEST} == {*TOASTS}
