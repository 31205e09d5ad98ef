"""The families that AdviceBench holds out: fit for measuring, the same for a seed, solved as by an oracle."""

from collections import deque
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench.advice_bench import advice_bench
from lab_studies.comparisons.advice_bench.common_learner import COMMON
from lab_studies.comparisons.advice_bench.families import FAMILIES, Drawn, drawn, hanoi
from lab_studies.comparisons.advice_bench.problems import HELD_OUT, PROBLEMS, problem

INSTANCES = 20
BY_CHANCE = {"windy-grids", "inventory", "queues"}

Outcomes = list[list[list[tuple[float, int, float]]]]  # [state][action]: chance, state entered, reward


# ---- the oracle, which knows lists only -----------------------------------------------------------------------------


def fewest_moves(successor: list[list[int]], ends: list[bool], goals: list[bool], start: int) -> int | None:
    """The length of a shortest path to a goal, by breadth-first search."""
    moves, queue = {start: 0}, deque([start])
    while queue:
        state = queue.popleft()
        if goals[state]:
            return moves[state]
        for entered in [] if ends[state] else successor[state]:
            if entered not in moves:
                moves[entered] = moves[state] + 1
                queue.append(entered)
    return None


def best_values(outcomes: Outcomes, ends: list[bool], discount: float) -> list[list[float]]:
    """The optimal action values, by value iteration in place."""
    best, change = [0.0] * len(ends), 1.0
    q = [[0.0] * len(actions) for actions in outcomes]
    while change > 1e-11:
        change = 0.0
        for state, actions in enumerate(outcomes):
            if ends[state]:
                continue
            q[state] = [
                sum(chance * (reward + (0.0 if ends[to] else discount * best[to])) for chance, to, reward in row)
                for row in actions
            ]
            change = max(change, abs(max(q[state]) - best[state]))
            best[state] = max(q[state])
    return q


def outcomes_of(instance: Drawn) -> Outcomes:
    """The outcomes as the sessions meet them."""
    mdp, place = instance.mdp, instance.chances
    if place is None:
        return [
            [[(1.0, to, reward)] for to, reward in zip(row, rewards, strict=True)]
            for row, rewards in zip(mdp.successor.tolist(), mdp.reward.tolist(), strict=True)
        ]
    rows = []
    for below, entered, reward in zip(place.below.tolist(), place.entered.tolist(), place.reward.tolist(), strict=True):
        row, before = [], 0.0
        for mark, to, gain in zip(below, entered, reward, strict=True):
            row.append((min(mark, 1.0) - before, to, gain))
            before = min(mark, 1.0)
        rows.append(row)
    return [rows[state * mdp.n_actions : (state + 1) * mdp.n_actions] for state in range(mdp.n_states)]


# ---- the families ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("family", FAMILIES)
def test_instances_are_fit_distinct_and_the_same_for_a_seed(family: str) -> None:
    instances = [drawn(family, number, COMMON) for number in range(INSTANCES)]
    assert len({instance.mdp.signature for instance in instances}) == INSTANCES
    assert max(instance.mdp.n_states for instance in instances) <= 2000
    again, other = drawn(family, 3, COMMON), drawn(family, 3, COMMON, seed=1)
    assert again.mdp.signature == instances[3].mdp.signature != other.mdp.signature
    assert again.values.tobytes() == instances[3].values.tobytes()
    for instance in instances:
        assert (instance.chances is not None) == (family in BY_CHANCE)
        mdp = instance.mdp
        worth = instance.model.worth(instance.values.argmax(axis=1), COMMON.max_steps)
        assert 5 <= worth.steps <= 100
        if family not in BY_CHANCE:
            lists: tuple[Any, Any, Any] = mdp.successor.tolist(), mdp.terminal.tolist(), mdp.goal.tolist()
            moves = [fewest_moves(*lists, start) for start in mdp.starts or (mdp.start,)]
            assert None not in moves
            assert worth.steps == pytest.approx(np.mean([move or 0 for move in moves]))


@pytest.mark.parametrize("family", FAMILIES)
def test_the_optimal_values_are_those_of_the_oracle(family: str) -> None:
    small = min((drawn(family, number, COMMON) for number in range(6)), key=lambda instance: instance.mdp.n_states)
    found = best_values(outcomes_of(small), small.mdp.terminal.tolist(), COMMON.discount)
    assert np.abs(np.array(found) - small.values).max() < 1e-8


def test_each_family_is_what_it_is_called() -> None:
    town, trap, maze = (drawn(family, 0, COMMON).mdp for family in ("one-way-towns", "traps", "long-mazes"))
    assert len(town.starts) >= 6
    assert (trap.terminal & ~trap.goal).sum() == 1
    assert 36 <= (fewest_moves(maze.successor.tolist(), [False] * maze.n_states, maze.goal.tolist(), 0) or 0) <= 44
    parts = hanoi(np.random.default_rng(0))
    assert parts is not None
    ((start,), moves, leads) = parts
    for action in range(len(moves)):
        ((entered, chance),) = leads(start, action).items()
        assert chance == 1.0
        assert sum(old != new for old, new in zip(start, entered, strict=True)) <= 1  # one disc, or an illegal move


def test_only_families_are_held_out_with_the_common_learner() -> None:
    assert tuple(FAMILIES) == HELD_OUT
    assert {"other-worlds", "place", "butter", "far-door", "four-rooms", "crossing"} <= {*PROBLEMS}
    place = problem("traps", 2)
    assert place.learner == COMMON
    lists: tuple[Any, Any, Any] = place.mdp.successor.tolist(), place.mdp.terminal.tolist(), place.mdp.goal.tolist()
    assert place.par == fewest_moves(*lists, place.mdp.start)


def test_the_seed_of_the_instances_stands_in_the_result_and_changes_it() -> None:
    reading = {"problem": ["traps", "empty"], "methods": ["always"], "advisors": ["expert"]}
    found, other = (advice_bench(Job(sessions=2), reading | seed) for seed in ({}, {"families_seed": 1}))
    assert (found.summary["families_seed"], other.summary["families_seed"]) == (2026, 1)
    assert {row["problem"]: row["held_out"] for row in found.rows} == {"traps": True, "empty": False}
    assert [row == again for row, again in zip(found.rows, other.rows, strict=True)] == [False] * 6 + [True] * 6
    with pytest.raises(BadInput, match="families_seed -1"):
        advice_bench(Job(sessions=2), reading | {"families_seed": -1})
