"""The reconstruction of world II of chapter 9, of which the thesis prints only a picture and what was learned there.

Known are its size, 100 obstacle cells in blocks and walls, a shortest path of 15 moves ("16 steps"), and that learning
alone is best with beta .7 and then ends optimal in 37 % of the sessions. Of many such layouts the one is taken whose
success and helped steps in full view come nearest to the printed ones, and then the nearest limited view.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import BoolArray, FloatArray, NoPath, TabularMDP, grid, shortest_steps
from lab.statistics import PERCENT_POINTS, RELATIVE
from lab.studies.findings import Findings, row
from lab.studies.runner import Job, Progress
from lab.tasks.grid_world import AdvisorView, GridWorld
from lab_studies.thesis.chapter_9_cells import BEST_BETA, PrintedLine, printed
from lab_studies.thesis.chapter_9_sessions import gate_of, learned_table
from lab_studies.thesis.used_to_choose import RECONSTRUCTED_BY

COMMENT = """\
World II of the thesis (ch. 9, fig. 9.2 b), RECONSTRUCTED: the thesis prints only a picture of it. Like the printed one
it has 100 obstacle cells in blocks and walls and a shortest way of 15 moves ("16 steps"), and a learner alone does best
with beta .7, where 37 % of the sessions end optimal. Of several such layouts the one was taken whose success and helped
steps with experts and novices come nearest to the printed ones, and then the limited view whose do.
Made by: lab study run world-2 --seed {seed}
Cells are [x, y, z], counted from 0.
"""
SIDE, OBSTACLES, MOVES = 10, 100, 15
BETA, PERCENT = BEST_BETA["world-2"]
POINTS = 2.0  # the largest distance of its success from the printed one
OTHER_BETAS = (0.5, 0.6, 0.8, 0.9, 1.1, 1.3)
QUICK, SURE = 60, 500  # sessions for a first test, and for the decision
LAYOUTS, VIEWS = 16, 100  # the numbers of layouts and views that are compared
COMPARED = 100  # sessions for a printed cell in these comparisons
MAX_TRIES = 20_000
LEARNER = LearnerSettings("afterstate", beta=BETA, count_start=True)

Ints = NDArray[np.int_]


def reconstruct(seed: int, progress: Progress = lambda done, total: None) -> GridWorld:
    """A world like world II, the same for the same seed, after minutes. Raises WorkFailed if none is found."""
    rng = np.random.default_rng(seed)
    full, limited = ([c for c in printed("appendix-v.csv") if is_compared(c, view)] for view in ("full", "limited"))
    layouts: list[tuple[float, GridWorld, FloatArray]] = []
    for world in _similar_worlds(rng, seed):
        table = learned_table(world)
        layouts.append((distance(world, table, full), world, table))
        progress(len(layouts), LAYOUTS + VIEWS)
        if len(layouts) == LAYOUTS:
            break
    if not layouts:
        raise WorkFailed(f"seed {seed}: none of {MAX_TRIES} layouts is like world II: try another seed")
    _, world, table = min(layouts, key=lambda entry: entry[0])
    view = best_view(world, rng, lambda view: distance(_with_view(world, view), table, limited), progress)
    return _with_view(world, view)


def reconstruction(job: Job, reading: Mapping[str, Any]) -> Findings:
    """A world like world II as a task file, and its known features measured. Raises WorkFailed if none is found."""
    world = reconstruct(job.seed, job.progress)
    measured = {"obstacles": len(world.obstacles), "shortest_steps": shortest_steps(world.check())}
    rows = [row({"world": world.name}, measure, value) for measure, value in measured.items()]
    text = world.to_toml(COMMENT.format(seed=job.seed))
    return Findings(rows, {"title": world.title, **measured}, files={f"{world.name}.toml": text})


def best_view(
    world: GridWorld, rng: np.random.Generator, distance: Callable[[Ints], float], progress: Progress
) -> Ints:
    """The corners (2, 3) of the best of some random views, whose faces are then moved by a cell as long as that helps."""
    best, nearest = np.array([[0, 0, 0], [SIDE - 1] * 3]), np.inf
    for tried in range(1, VIEWS + 1):
        view = np.sort(rng.integers(0, SIDE, (2, 3)), axis=0)
        far = distance(view) if (view[1] - view[0]).min() >= 2 else np.inf
        if far < nearest:
            best, nearest = view, far
        progress(LAYOUTS + tried, LAYOUTS + VIEWS)
    climbing = True
    while climbing:
        climbing = False
        for corner, axis, step in product(range(2), range(3), (-1, 1)):
            view = best.copy()
            view[corner, axis] += step
            if 0 <= view[0, axis] <= view[1, axis] < SIDE and (far := distance(view)) < nearest:
                best, nearest, climbing = view, far, True
    return best


def _with_view(world: GridWorld, view: Ints) -> GridWorld:
    return world.model_copy(update={"view": AdvisorView(lower=_tuple(view[0]), upper=_tuple(view[1]))})


def is_compared(cell: PrintedLine, view: str) -> bool:
    """Whether layouts and views are compared by a printed line: those of experts and novices of world II."""
    setting = cell.setting
    return (setting.world, setting.view) == ("world-2", view) and setting.tau in RECONSTRUCTED_BY


def _similar_worlds(rng: np.random.Generator, seed: int) -> Iterator[GridWorld]:
    """Worlds in which learning alone succeeds as in the thesis."""
    for _ in range(MAX_TRIES):
        wall = layout(rng)
        free = np.argwhere(~wall)
        start, goal = free[rng.choice(len(free), 2, replace=False)]
        if np.abs(start - goal).sum() > MOVES:
            continue
        try:
            mdp = grid(wall.shape, wall, _tuple(start), _tuple(goal))
        except NoPath:
            continue
        if shortest_steps(mdp) == MOVES and learns_similarly(mdp):
            yield GridWorld(
                name="world-2",
                title=f"Like world II of the thesis: a reconstruction, seed {seed}",
                shape=wall.shape,
                start=_tuple(start),
                goal=_tuple(goal),
                obstacles=tuple(_tuple(cell) for cell in np.argwhere(wall)),
                learner=LEARNER,
            )


def layout(rng: np.random.Generator) -> BoolArray:
    """100 obstacle cells in blocks, walls and bars; bool (10, 10, 10)."""
    wall = np.zeros((SIDE, SIDE, SIDE), bool)
    while wall.sum() < OBSTACLES:
        sides = np.ones(3, int)
        kind, axis = rng.integers(3), rng.integers(3)
        if kind == 0:  # a wall
            sides = rng.integers(2, 7, 3)
            sides[axis] = 1
        elif kind == 1:  # a bar
            sides[axis] = rng.integers(3, SIDE + 1)
        else:
            sides = rng.integers(1, 4, 3)
        lower = rng.integers(0, SIDE - sides + 1)
        more = wall.copy()
        more[tuple(slice(a, a + n) for a, n in zip(lower, sides, strict=True))] = True
        if more.sum() <= OBSTACLES:
            wall = more
    return wall


def learns_similarly(mdp: TabularMDP) -> bool:
    """Whether learning alone succeeds in 37 % with beta .7, and in no more with another beta."""
    if abs(success_alone(mdp, BETA, QUICK) - PERCENT) > 3 * POINTS:
        return False
    at_best = success_alone(mdp, BETA, SURE)
    return abs(at_best - PERCENT) <= POINTS and all(success_alone(mdp, beta, SURE) <= at_best for beta in OTHER_BETAS)


def success_alone(mdp: TabularMDP, beta: float, sessions: int) -> float:
    """The success of learning alone [%]."""
    from lab.learning.batch import run_sessions

    seeds = np.arange(sessions, dtype=np.uint64)
    batch = run_sessions(mdp, replace(LEARNER, beta=beta), GateSettings("never"), None, seeds)
    return 100.0 * float((batch.steps[:, -1] == MOVES + 1).mean())


def distance(world: GridWorld, table: FloatArray, cells: Sequence[PrintedLine]) -> float:
    """The distance of success and helped steps from the printed ones; 1 is the mean distance that still counts as agreeing."""
    from lab.learning.batch import run_sessions
    from lab.learning.simulated_advice import Advice, advice_chances

    mdp, region, far = world.mdp(), world.region(), 0.0
    for cell in cells:
        assert cell.setting.tau is not None
        advice = Advice.of(advice_chances(table, cell.setting.tau), region if cell.setting.view == "limited" else None)
        gate = gate_of(cell.setting, world.gate)
        batch = run_sessions(mdp, LEARNER, gate, advice, np.arange(COMPARED, dtype=np.uint64))
        success = 100.0 * float((batch.steps[:, -1] == MOVES + 1).mean())
        ratio = float(np.log(max(batch.helped_steps.mean(), 1.0) / cell.hs))
        far += abs(success - cell.sp) / PERCENT_POINTS + abs(ratio) / RELATIVE
    return far / (2 * len(cells))


def _tuple(cell: Ints) -> tuple[int, ...]:
    return tuple(int(i) for i in cell)
