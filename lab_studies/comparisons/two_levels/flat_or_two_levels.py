"""One flat problem or two levels: the comparison that the thesis leaves to others (10.2.3), on the same budget of steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.mdp import shortest_steps
from lab.sequencing.methods.exact import optimum
from lab.studies.charts import Look, curve, legend_below
from lab.studies.findings import Findings, Row, agreement, mean_row, row, share_row, those
from lab.studies.runner import Job
from lab.view.canvas import BLUE, GREY, INK, ORANGE, RED, SKY, picture_bytes
from lab_studies.comparisons.two_levels.flat_learner import FlatSettings, learn_flat
from lab_studies.comparisons.two_levels.kitchen import FlatWorld, Kitchen, Way, flat_world
from lab_studies.comparisons.two_levels.two_level_learner import LearnedTransfer, TwoLevels, learned_stages

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KITCHEN = Kitchen(("P.#..T", "..#.#.", "t.....", ".#b.#B", "F..#.."), 25, 25)
TOASTS = (1, 2, 3)
BUDGETS = (
    *(1000, 2000, 3000, 5000, 7000, 10_000, 15_000, 20_000, 30_000, 50_000),
    *(100_000, 300_000, 1_000_000, 3_000_000, 10_000_000),
)
LARGEST = {1: 1_000_000, 2: 3_000_000, 3: 10_000_000}  # toasts -> the largest budget
CAP = 500  # steps; a longer makespan counts as unfinished
SESSIONS = 20  # the most, as the flat learner needs millions of steps in each
NEAR_PERCENT = 5.0  # the gap that the summary counts as reaching the optimum
FLAT = {
    "optimistic": FlatSettings(cost=1.0, goal=0.0, discount=1.0),
    "goal reward": FlatSettings(cost=0.0, goal=1.0, discount=0.99, epsilon=1.0, beta=0.2, least=0.3),
    "both": FlatSettings(cost=0.02, goal=1.0, discount=0.99, epsilon=1.0, beta=0.3, least=0.1),
}
PRACTICE, FLAT_LEARNING, SEQUENCING = 1, 2, 3  # parts of seeds, so that no two share random numbers
ALL_STEPS, LOW_STEPS = "all steps", "low level's steps"
Skills = Sequence[Mapping[Way, tuple[LearnedTransfer, ...]]]  # of each session
Method = tuple[str, str]  # method and setting of a row
METHODS: dict[Method, Look] = {
    **{
        ("flat", name): (colour, marker, f"flat, {name}")
        for name, colour, marker in zip(FLAT, (RED, ORANGE, GREY), "^vX", strict=True)
    },
    ("two-level", ALL_STEPS): (BLUE, "o", "two levels, all steps counted"),
    ("two-level", LOW_STEPS): (SKY, "s", "two levels, low level's steps counted"),
}
CAPTION = "Makespan by the steps of learning: one flat problem and two levels (bands: 95 % intervals)"
ABOUT = (
    f"A kitchen of 5 x 6 cells with the six stations of the toast cell and six obstacles; a step is a move, a pick, a "
    f"drop or a wait, and each machine takes {KITCHEN.toaster_steps}. Makespans are those of learned policies in the same "
    f"world without exploration; one above {CAP} steps counts as unfinished and is left out of the means. "
    f"At most {SESSIONS} sessions."
)
ABOUT_FLAT = (
    "Flat: Q-learning, alpha 1, alike toasts merged; each episode is learned from again backwards, and the result is the better "
    "of its greedy policy and its best episode. Three settings, of 26 tried with five sessions each: 'optimistic': a step "
    "costs 1 and values begin at 0, greedy; 'goal reward': 1 at the end, discount .99, random actions with probability "
    "n^-.2, at least .3; 'both': the same with a cost of .02 for a step, n^-.3, at least .1. Running into an obstacle is a wait."
)
ABOUT_TWO_LEVELS = (
    "Two levels: each transfer is a grid sub-task, learned by Q-learning with the thesis's alpha .95 and discount .99, greedy "
    "from values of 0 (a step costs .1), one of nine learners tried; all get as many episodes as fit, then srl-time orders "
    "them by the steps that they take. 'all steps' also counts the sequencer's simulated steps, and keeps half of the "
    "budget for them; 'low level's steps' counts none of them. Two levels also know the transfers, the machines' times, and "
    "episodes that begin at any station."
)
ABOUT_LOSS = (
    "In this world two levels lose nothing by deciding only at drops: the exact optimum of the cell with shortest "
    "transfers is that of the flat problem (rows of method 'exact'). Times are certain here; with random times a flat "
    "policy could change its decision on the way, which this study does not measure."
)


def flat(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The makespans of both by budget, with 1 to 3 toasts, and the exact optimum; at most SESSIONS sessions of each."""
    sessions = min(job.sessions, SESSIONS)
    skills = [_skills(job.seed, session) for session in range(sessions)]
    measured = job.in_turn([partial(_measured, toasts, job.seed, skills) for toasts in TOASTS])
    rows = [result for results, _ in measured for result in results]
    summary: Row = {"sessions": sessions}
    for _, says in measured:
        summary |= says
    notes = (ABOUT, ABOUT_FLAT, ABOUT_TWO_LEVELS, ABOUT_LOSS)
    return Findings(rows, summary | agreement(rows), {CAPTION: _picture(rows)}, notes)


def _measured(toasts: int, seed: int, skills: Skills) -> tuple[list[Row], Row]:
    """All rows with so many toasts, and their summary."""
    world = flat_world(KITCHEN, toasts)
    exact = _exact(world, toasts)
    asked = _Asked(world, toasts, tuple(b for b in BUDGETS if b <= LARGEST[toasts]), int(exact[0]["value"]), seed)
    measured = [*_flat_rows(asked, len(skills)), *_two_level_rows(asked, skills)]
    return [*exact, *measured], _in_short(measured, toasts, exact)


def _skills(seed: int, session: int) -> dict[Way, tuple[LearnedTransfer, ...]]:
    """All learned sub-tasks of one session, the same for every number of toasts."""
    empty, loaded = KITCHEN.needed(max(TOASTS))
    ways = sorted({*empty, *loaded})
    return {way: learned_stages(KITCHEN, way, [seed, session, PRACTICE, number]) for number, way in enumerate(ways)}


def _exact(world: FlatWorld, toasts: int) -> list[Row]:
    """The rows of the optimum of the flat problem, of that of the cell with shortest transfers, and of their sizes."""
    empty, loaded = KITCHEN.needed(toasts)
    ways = {way: shortest_steps(KITCHEN.way(way)) for way in (*empty, *loaded)}
    best = optimum(KITCHEN.cell(toasts, ways))
    figures = {
        ("flat", "makespan_steps"): shortest_steps(world.mdp),
        ("two levels", "makespan_steps"): best.cost,
        ("flat", "problem_states"): world.mdp.n_states,
        ("two levels", "problem_subtasks"): len(ways),
    }
    return [row(_named(("exact", s), toasts, None), measure, v) for (s, measure), v in figures.items()]


@dataclass(frozen=True, eq=False)
class _Asked:
    """What both learn: the problem, the budgets, and the shortest makespan."""

    world: FlatWorld
    toasts: int
    budgets: tuple[int, ...]
    best: int
    seed: int


def _flat_rows(asked: _Asked, sessions: int) -> list[Row]:
    rows: list[Row] = []
    for number, (name, settings) in enumerate(FLAT.items()):
        seeds = [[asked.seed, session, FLAT_LEARNING, asked.toasts, number] for session in range(sessions)]
        chances = map(np.random.default_rng, seeds)
        learned = np.array([learn_flat(asked.world, settings, asked.budgets, CAP, chance) for chance in chances])
        for budget, makespans in zip(asked.budgets, learned.T, strict=True):
            rows += rows_of(_named(("flat", name), asked.toasts, budget), makespans, asked.best)
    return rows


def _two_level_rows(asked: _Asked, skills: Skills) -> list[Row]:
    rows: list[Row] = []
    seeds = ([asked.seed, n, SEQUENCING, asked.toasts] for n in range(len(skills)))
    learners = [TwoLevels(KITCHEN, asked.world, asked.toasts, *own) for own in zip(skills, seeds, strict=True)]
    for name in (ALL_STEPS, LOW_STEPS):
        for budget in asked.budgets:
            outcomes = [learner.outcome(budget, CAP, name == ALL_STEPS) for learner in learners]
            named = _named(("two-level", name), asked.toasts, budget)
            makespans = np.array([-1 if outcome.makespan is None else outcome.makespan for outcome in outcomes])
            rows += rows_of(named, makespans, asked.best)
            rows.append(row(named, "used_steps", float(np.mean([outcome.used for outcome in outcomes]))))
    return rows


def _named(method: Method, toasts: int, budget: int | None) -> Row:
    table = f"{toasts} toast{'s' if toasts > 1 else ''}"
    return {"table": table, "method": method[0], "setting": method[1], "toasts": toasts, "budget": budget}


def rows_of(named: Row, makespans: NDArray[np.int64], best: int) -> list[Row]:
    """The rows of the makespan and the gap over the finished sessions, if any, and of the share of these."""
    finished = makespans[makespans >= 0]
    rows = []
    for measure, values in (("makespan_steps", finished), ("gap_percent", 100.0 * (finished / best - 1.0))):
        if len(values):
            rows.append(mean_row(named, measure, values) if len(values) > 1 else row(named, measure, values[0]))
    return [*rows, share_row(named, "finished_percent", makespans >= 0)]


def _in_short(rows: Sequence[Row], toasts: int, exact: Sequence[Row]) -> Row:
    """The optimum, and the least budget with which all sessions of a method finish, on average near the optimum."""
    table = exact[0]["table"]
    says = ("optimum, flat", "optimum, two levels", "states of the flat problem", "sub-tasks")
    told: Row = {f"{table}: {what}": int(result["value"]) for what, result in zip(says, exact, strict=True)}
    for method, setting in METHODS:
        own = those(rows, method=method, setting=setting)
        sure = {result["budget"] for result in those(own, measure="finished_percent", value=100.0)}
        near = [result["budget"] for result in those(own, measure="gap_percent") if result["value"] <= NEAR_PERCENT]
        steps = min((budget for budget in near if budget in sure), default=None)
        told[f"{table}: steps to within {NEAR_PERCENT:g} %, {method}, {setting}"] = steps
    return told


def _picture(rows: Sequence[Row]) -> bytes:
    """A picture with a plot for each number of toasts; hollow marks: not all sessions finished."""

    def draw(figure: "Figure") -> None:
        plots = figure.subplots(1, len(TOASTS), squeeze=False)[0]
        for axes, toasts in zip(plots, TOASTS, strict=True):
            _draw(axes, those(rows, toasts=toasts))
        plots[0].set_ylabel("makespan [steps]")
        legend_below(figure)

    return picture_bytes(draw, 3.4 * len(TOASTS), 3.9)


def _draw(axes: "Axes", rows: Sequence[Row]) -> None:
    finished = {
        (result["method"], result["setting"], result["budget"]): result["value"] == 100.0
        for result in those(rows, measure="finished_percent")
    }
    for (method, setting), (colour, marker, name) in METHODS.items():
        line = those(rows, method=method, setting=setting, measure="makespan_steps")
        curve(axes, line, "budget", (colour, marker, name))
        for result in line:
            if not finished[method, setting, result["budget"]]:
                look: dict[str, Any] = {"color": colour, "markerfacecolor": "white", "markersize": 4.5, "zorder": 3}
                axes.plot(result["budget"], result["value"], marker, **look)
    best = those(rows, method="exact")[0]["value"]
    axes.axhline(best, color=INK, linestyle="--", linewidth=1.0, label="exact optimum")
    axes.set(xscale="log", xlabel="steps of learning", title=f"{rows[0]['table']}, optimum {best:.0f}")
    asked = [budget for _, _, budget in finished]
    axes.set_xlim(0.8 * min(asked), 1.25 * max(asked))  # also budgets with which nothing finished
    axes.set_ylim(0.9 * best, None)
    axes.grid()
