"""CCRL, IA and combined against an independent program of the thesis, within sampling error.

Six settings of world, learner, advisor and rule for each of the three, and two that the thesis does not have: up to six figures
each, 120 comparisons. A figure may differ by 4 standard errors, so that two programs which do the same would fail once in 130
sets of seeds (120 times 6.3e-5, for normal means). The seeds are fixed.
"""

import ast
import tomllib
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.learning.batch import run_sessions
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.mdp import FloatArray, Rewards, optimal_values
from lab.tasks.grid_world import GridWorld
from tests.learning import advice_oracle
from tests.learning.advice_oracle import Asking, Cell, Setting, Told, World, cells_world

ROOT = Path(__file__).parents[2]
ORACLE_SESSIONS, LAB_SESSIONS = 80, 1000
STANDARD_ERRORS = 4.0

Layout = dict[str, Any]  # the keys of a world's file


def in_text(*rows: str, **rest: Any) -> Layout:
    """A layout from rows of '.', '#', 'S' and 'G'."""
    cells = {(i, j): mark for i, row in enumerate(rows) for j, mark in enumerate(row)}
    places = {mark: [cell for cell in cells if cells[cell] == mark] for mark in "#SG"}
    (start,), (goal,) = places["S"], places["G"]
    return {"shape": (len(rows), len(rows[0])), "start": start, "goal": goal, "obstacles": places["#"], **rest}


def world_1(**rest: Any) -> Layout:
    """World I of the thesis, which has a limited view."""
    said = tomllib.loads((ROOT / "tasks" / "world-1.toml").read_text(encoding="utf-8"))
    places = {name: tuple(said[name]) for name in ("shape", "start", "goal")}
    return {**places, "obstacles": [*map(tuple, said["obstacles"])], "deadly": True, **rest}


WALLS = ("S..#....", ".#.#.##.", ".#...#..", ".####...", "......#G")
MAZE = in_text(*WALLS, deadly=False)
HALF_SEEN = in_text(*WALLS, deadly=False, view={"lower": (0, 4), "upper": (4, 7)})
TRAPS = in_text(*WALLS, deadly=True)
CLIFF = in_text("........", "........", "S######G", deadly=True)
IN_WORLD_1 = Setting("afterstate", count_start=True, episodes=90, omega=3, psi=1.3, max_steps=120, tau=0.1)
SHORT = Setting(episodes=60, max_steps=100, first_episode=10, window=3, omega=2, psi=0.5, lambda_threshold=0.3)
SETTINGS = {
    "world I": (world_1(), IN_WORLD_1),
    "world I, limited view": (
        world_1(view={"lower": (5, 2, 2), "upper": (9, 8, 7)}),
        replace(IN_WORLD_1, first_episode=20, window=10, lambda_threshold=0.2, judge_unhelped=False),
    ),
    "maze, q, expert": (MAZE, replace(SHORT, omega=3, window=5, psi=0.3, tau=0.01, lambda_threshold=0.05)),
    "half seen, q-lambda, limited": (
        HALF_SEEN,
        replace(SHORT, learner="q-lambda", tau=0.3, omega=50, window=2, spare_best=True),
    ),
    "traps, q, novice": (TRAPS, replace(SHORT, tau=1.0, omega=4, first_episode=25)),
    "cliff, q-lambda, budget": (
        CLIFF,
        replace(SHORT, learner="q-lambda", max_steps=16, tau=0.03, window=4, budget=45, psi=0.9),
    ),
}


def oracle_world(layout: Layout, starts: Sequence[Cell] | None = None) -> World:
    """A layout as the oracle's world."""
    view = layout.get("view")
    seen = None if view is None else (view["lower"], view["upper"])
    cells = layout["shape"], layout["obstacles"], starts or [layout["start"]], layout["goal"]
    return cells_world(*cells, view=seen, deadly=layout["deadly"])


def told_by_the_oracle(layout: Layout, setting: Setting, starts: Sequence[Cell] | None = None) -> FloatArray:
    """The figures (N, 6) of the oracle's sessions."""
    return np.array(advice_oracle.sessions(oracle_world(layout, starts), setting, ORACLE_SESSIONS), np.float64)


def told_by_the_lab(layout: Layout, setting: Setting, starts: Sequence[Cell] | None = None) -> FloatArray:
    """The figures (N, 6) of the lab's sessions."""
    world, named = GridWorld(name="layout", rewards=Rewards(), **layout), vars(setting)
    learner = LearnerSettings(**{part.name: named[part.name] for part in fields(LearnerSettings) if part.name in named})
    gate = GateSettings(**{part.name: named[part.name] for part in fields(GateSettings) if part.name in named})
    mdp = world.mdp()
    if starts:
        mdp = replace(mdp, starts=tuple(int(np.ravel_multi_index(start, world.shape)) for start in starts))
    advice = Advice.of(advice_chances(optimal_values(mdp, learner.discount), setting.tau), world.region())
    found = run_sessions(mdp, learner, gate, advice, np.arange(LAB_SESSIONS, dtype=np.uint64))
    guided, rejected = found.guided.sum(axis=1), found.rejected_at_episode > 0
    counts = found.helped_steps, guided, found.misleads, rejected
    return np.column_stack([found.steps.mean(axis=1), found.steps[:, -1], *counts]).astype(np.float64)


def apart(some: FloatArray, others: FloatArray) -> dict[str, float]:
    """By figure: the difference of two means in standard errors.

    If both programs do the same, any two sessions can be exchanged; so all of them together give the standard error.
    """
    deviation = np.concatenate([some, others]).std(axis=0, ddof=1)
    error = deviation * np.sqrt(1 / len(some) + 1 / len(others))
    difference = np.abs(some.mean(axis=0) - others.mean(axis=0))
    errors = difference / np.where(error > 0, error, 1.0)  # without any deviation there is no difference either
    return dict(zip(Told._fields, errors.tolist(), strict=True))


def test_the_oracle_imports_nothing_of_the_lab() -> None:
    tree = ast.parse(Path(advice_oracle.__file__).read_text(encoding="utf-8"))
    modules = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    assert modules == {
        "collections.abc",
        "dataclasses",
        "itertools",
        "math",
        "random",
        "statistics",
        "typing",
        "numpy",
        "numpy.typing",
    }


def test_the_oracle_asks_and_rejects_as_by_hand() -> None:
    """With K = 2 and Lambda = 0.1 it asks while the last two episodes take more than 0.9 of the two before; Omega = 0."""
    asking = Asking(replace(SHORT, window=2, first_episode=4, lambda_threshold=0.1, omega=0), several_starts=False)
    for result, opens in ((10, False), (10, False), (8, False), (8, False), (8, False), (8, True)):
        asking.ended([0], result, may_ask=False, helped=0)
        assert asking.opens() == opens
    asking.ended([0], 7, may_ask=True, helped=7)  # better than the mean of 8 and 8
    assert (asking.misleads, asking.rejected) == (0, False)
    asking.ended([0], 8, may_ask=True, helped=8)  # no better than the mean of 8 and 7
    assert (asking.misleads, asking.rejected, asking.opens()) == (1, True, False)


@pytest.mark.parametrize("gate", ["ccrl", "ia", "combined"])
@pytest.mark.parametrize("where", SETTINGS)
def test_figures_agree_within_sampling_error(where: str, gate: str) -> None:
    layout, setting = SETTINGS[where]
    setting = replace(setting, gate=gate)
    found = apart(told_by_the_oracle(layout, setting), told_by_the_lab(layout, setting))
    assert max(found.values()) < STANDARD_ERRORS, found


BEYOND = {  # what the thesis does not have: episodes that begin in several states, rejection by evidence
    "four starts": (HALF_SEEN, replace(SHORT, tau=0.3, omega=6, spare_best=True), [(0, 0), (4, 5), (0, 6), (2, 2)]),
    "evidence": (CLIFF, replace(SHORT, tau=0.6, by_evidence=True, lambda_threshold=0.9), None),
}


@pytest.mark.parametrize("gate", ["ccrl", "combined"])
@pytest.mark.parametrize("what", BEYOND)
def test_what_is_new_agrees_within_sampling_error(what: str, gate: str) -> None:
    layout, setting, starts = BEYOND[what]
    setting = replace(setting, gate=gate)
    found = apart(told_by_the_oracle(layout, setting, starts), told_by_the_lab(layout, setting, starts))
    assert max(found.values()) < STANDARD_ERRORS, found
