"""World II, reconstructed: what is known of it holds for the one that ships and for any that is found again."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lab.errors import WorkFailed
from lab.learning import batch as compiled
from lab.learning.batch import Batch
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import Advice
from lab.mdp import grid, shortest_steps
from lab.tasks.grid_world import GridWorld
from lab.tasks.task_file import load_world
from lab_studies.thesis import world_2 as module
from lab_studies.thesis.chapter_9_cells import BEST_BETA, PrintedLine, printed
from lab_studies.thesis.chapter_9_sessions import AdviceSetting, sessions_of
from lab_studies.thesis.world_2 import COMMENT, reconstruct


def holds_what_is_known(world: GridWorld) -> None:
    """Size, obstacles, shortest way, free ends, a limited view, how it is learned (thesis, fig. 9.2 b and section 9.9.1)."""
    assert (world.name, world.shape, len(world.obstacles)) == ("world-2", (10, 10, 10), 100)
    assert len({*world.obstacles}) == 100
    assert not {world.start, world.goal} & {*world.obstacles}
    assert shortest_steps(world.check()) == 15
    assert world.view is not None
    assert 0 < world.region().sum() < 1000
    learner = world.learner
    assert (learner.learner, learner.beta, learner.count_start) == ("afterstate", 0.7, True)
    assert (learner.episodes, learner.max_steps, learner.alpha, learner.discount) == (200, 200, 0.95, 0.99)
    assert "reconstruction" in world.title


# ---- the one that ships -------------------------------------------------------------------------------------------


def test_the_world_that_ships(root: Path) -> None:
    holds_what_is_known(load_world("world-2"))
    text = (root / "tasks" / "world-2.toml").read_text(encoding="utf-8")
    comment = "".join(line for line in text.splitlines(keepends=True) if line.startswith("#"))
    assert "RECONSTRUCTED" in comment
    assert re.search(r"# Made by: lab study run world-2 --seed \d+\n", comment)


def test_learning_alone_does_best_where_the_thesis_says() -> None:
    """In 500 sessions; the printed 37 % are of 500, too, with an interval of 4 points on either side."""
    beta, percent = BEST_BETA["world-2"]
    alone = {b: 100 * sessions_of(AdviceSetting("world-2", beta=b), 500, 0).success.mean() for b in (0.5, beta, 1.3)}
    assert abs(alone[beta] - percent) <= 6
    assert alone[beta] == max(alone.values())


# ---- looking for it -----------------------------------------------------------------------------------------------


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search of a second: any layout with the right way, learned in a few sessions, compared by two printed cells."""
    cells = {
        cell.setting.view: cell for cell in printed("appendix-v.csv") if module.is_compared(cell, cell.setting.view)
    }
    monkeypatch.setattr(module, "printed", lambda file: tuple(cells.values()))
    names: dict[str, Any] = {"LAYOUTS": 2, "VIEWS": 4, "QUICK": 3, "SURE": 3, "COMPARED": 3, "POINTS": 100.0}
    for name, value in names.items():
        monkeypatch.setattr(module, name, value)
    monkeypatch.setattr(module, "OTHER_BETAS", ())


def test_the_same_seed_finds_the_same_world(small: None) -> None:
    told: list[tuple[int, int]] = []
    world = reconstruct(3, lambda *both: told.append(both))
    holds_what_is_known(world)
    assert "seed 3" in world.title
    assert told == [(n, 6) for n in range(1, 7)]
    assert reconstruct(3) == world
    assert reconstruct(4).obstacles != world.obstacles


def test_what_was_found_can_be_written_and_read(small: None, tmp_path: Path) -> None:
    world = reconstruct(3)
    path = tmp_path / "found.toml"
    path.write_text(world.to_toml(COMMENT.format(seed=3)), encoding="utf-8")
    assert load_world(str(path)) == world
    assert "# Made by: lab study run world-2 --seed 3\n" in path.read_text(encoding="utf-8")


def test_no_tries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_TRIES", 0)
    with pytest.raises(WorkFailed, match=r"^seed 5: none of 0 layouts is like world II: try another seed$"):
        reconstruct(5)


def test_layouts_have_a_hundred_obstacles() -> None:
    rng = np.random.default_rng(0)
    layouts = [module.layout(rng) for _ in range(20)]
    assert {(wall.shape, int(wall.sum())) for wall in layouts} == {((10, 10, 10), 100)}
    assert len({wall.tobytes() for wall in layouts}) == 20


@pytest.mark.parametrize(
    ("success", "alike"),
    [
        ({0.7: 37}, True),
        ({0.7: 39}, True),
        ({0.7: 39.1}, False),  # more than 2 points off
        ({0.7: 43.1}, False),  # at first sight
        ({0.7: 36, 0.5: 36.1}, False),  # better with another beta
        ({0.7: 38, 1.3: 38}, True),
    ],
)
def test_which_layouts_are_alike(monkeypatch: pytest.MonkeyPatch, success: dict[float, float], alike: bool) -> None:
    """By their success, 30 % where nothing else is said."""
    monkeypatch.setattr(module, "success_alone", lambda mdp, beta, sessions: success.get(beta, 30.0))
    assert module.learns_similarly(grid((1, 2, 1), np.zeros((1, 2, 1), bool), (0, 0, 0), (0, 1, 0))) is alike


def test_the_nearest_layout_is_taken_and_the_nearest_view(small: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Made-up distances: the second of three layouts is nearest; a view's is by how many cells its corners are off."""
    best = np.array([[2, 1, 4], [7, 8, 9]])
    seen: list[GridWorld] = []
    far = [3.0, 1.0, 2.0]

    def distance(world: GridWorld, table: Any, cells: list[PrintedLine]) -> float:
        (view,) = {cell.setting.view for cell in cells}
        if view == "full":
            seen.append(world)
            return far[len(seen) - 1]
        assert world.view is not None
        return float(np.abs(np.array([world.view.lower, world.view.upper]) - best).sum())

    monkeypatch.setattr(module, "LAYOUTS", 3)
    monkeypatch.setattr(module, "distance", distance)
    world = reconstruct(0)
    assert len({one.obstacles for one in seen}) == 3
    assert world.obstacles == seen[1].obstacles
    assert world.view is not None
    assert (world.view.lower, world.view.upper) == ((2, 1, 4), (7, 8, 9))


def test_the_best_of_the_drawn_views_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four are drawn; the flat one, only two cells high, would be nearest; what lies around them is far."""
    drawn = [[[7, 6, 5], [1, 2, 3]], [[0, 0, 0], [9, 9, 1]], [[2, 2, 2], [4, 5, 6]], [[3, 3, 3], [6, 6, 6]]]
    far: dict[tuple[int, ...], float] = {
        (1, 2, 3, 7, 6, 5): 3.0,
        (0, 0, 0, 9, 9, 1): 0.0,
        (2, 2, 2, 4, 5, 6): 1.0,
        (3, 3, 3, 6, 6, 6): 2.0,
    }
    rng: Any = SimpleNamespace(integers=lambda low, high, shape: np.array(drawn.pop(0)))
    monkeypatch.setattr(module, "VIEWS", 4)
    told: list[tuple[int, int]] = []
    best = module.best_view(
        load_world("world-2"), rng, lambda view: far.get(tuple(view.ravel().tolist()), 9.0), lambda *n: told.append(n)
    )
    assert best.tolist() == [[2, 2, 2], [4, 5, 6]]
    assert told == [(module.LAYOUTS + n, module.LAYOUTS + 4) for n in (1, 2, 3, 4)]


@pytest.mark.parametrize(
    ("percent", "helped", "expected"),
    [(40, 100, 0.0), (45, 100, 0.5), (40, 115, np.log(1.15) / 0.15 / 2), (30, 0, 1 + np.log(100) / 0.15 / 2)],
)
def test_how_far_a_world_is(monkeypatch: pytest.MonkeyPatch, percent: int, helped: int, expected: float) -> None:
    """Cells printed with 40 % and 100 steps: half of 1 for 5 points, half of the ratio's logarithm over .15.

    Made-up sessions end with the shortest way's 16 steps or with 18; no help counts as one step.
    """
    world = load_world("world-2")

    def made_up(mdp: Any, learner: Any, gate: GateSettings, advice: Advice, seeds: Any) -> Batch:
        assert (gate.gate, gate.psi, gate.omega) == ("ia", 0.3, world.gate.omega)
        assert advice.region.tolist() == world.region().tolist()
        steps = np.where(np.arange(100) < percent, 16, 18).astype(np.int32)[:, None]
        counts = np.full(100, helped)
        return Batch(steps, steps < 0, counts, counts, counts, counts, counts, np.zeros(0))

    monkeypatch.setattr(compiled, "run_sessions", made_up)
    cell = PrintedLine(AdviceSetting("world-2", "limited", "ia", 0.01, psi=0.3), False, sp=40.0, hs=100.0, score=0.5)
    assert module.distance(world, np.zeros((1000, 6)), [cell] * 3) == pytest.approx(expected)
