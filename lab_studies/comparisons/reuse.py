"""The curriculum: tasks taught one after another into one toolbox, in several orders, compared with each from scratch."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import factorial
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.findings import Findings, Row, row, those, varying_row
from lab.studies.runner import Job
from lab.tasks.task_file import load
from lab_studies.comparisons.reuse_figures import by_place, by_task
from lab_studies.comparisons.skills_taught import (
    Known,
    TaughtSkill,
    distinct_problems,
    is_failing,
    lesson_cost,
    reaches_goals,
    taught_skills,
)

TASKS = ("toast", "two-toasters", "breakfast", "sorting", "fms-arm")
OTHER_ARM = "toast-panda"  # taught after the first task only
SOURCES = ("reused", "adapted", "learned")
FATES = ("taken", "adapted", "own", "learned")
COSTS = ("episodes", "helped_steps", "moves", "wall_s", "cpu_s")
LATER = "later"  # all places of an order but the first
GROWTH = "more_saved_a_place_percent"
CARRIED, NOT_CARRIED = (
    50.0,
    10.0,
)  # the shares [%] of its skills from which a sub-task carries over, and up to which not
_LIVES = 12  # lives that a process remembers; their policies fill up to 100 MB each

ABOUT = (
    "{orders} of the tasks {tasks}: the order that they ship in, then random ones. Each task's skills are reused, fine-tuned or "
    "learned as in `lab run`, with the advisor 'expert', in the toolbox of the tasks before it; the first task of an order has "
    "an empty one. For comparison each task is learned from scratch, where skills are also shared within the task, so that only "
    "earlier tasks save anything. A problem that several skills share counts once. A table fits only a problem with the same "
    "states and moves, so that paths between stations carry over only between workspaces with the same grid. "
    "Intervals are over the orders and say nothing about other tasks or scenes."
)
COLUMNS = (
    "Taken: the policy of an earlier task is used as it is. Adapted: it is fine-tuned. Own: taken or adapted within the "
    "task. Learned: from scratch. from_earlier: the skills that are taken or adapted from earlier tasks. saved_percent: of "
    "the episodes that the same skills take from scratch. Place 'later': all places but the first. after: the toolbox holds "
    f"only that task's skills. {GROWTH}: how much more a task saves for each place that it comes later, from the second "
    "on; a task is only compared with itself. wall_s is time by the clock, cpu_s time of the processor."
)
CHECKS = (
    "Checks that play no part in the verdict: taken_failing_percent: policies of earlier tasks that are used or adapted and "
    "then miss a goal step by step, or fail in physics; unsolved_percent: skills without a path to the goal from each start."
)


@dataclass(frozen=True)
class Life:
    """Tasks taught one after another, in scenes that the seed lays out."""

    order: tuple[str, ...]
    seed: int


@dataclass(frozen=True)
class Outcome:
    """The result of one skill; from_task: the task whose policy was taken or adapted, "" if it was learned from scratch.

    failing: its policy is of an earlier task and fails in physics; unsolved: it does not reach the goal from each start.
    """

    task: str
    subtask: str
    source: str
    from_task: str
    episodes: int
    helped_steps: int
    moves: int
    wall_s: float
    cpu_s: float
    failing: bool = False
    unsolved: bool = False

    @property
    def carried(self) -> bool:
        """Whether its policy was taken or adapted from an earlier task."""
        return self.from_task not in ("", self.task)

    @property
    def fate(self) -> str:
        """One of FATES."""
        if not self.from_task:
            return "learned"
        if not self.carried:
            return "own"
        return "taken" if self.source == "reused" else "adapted"


Place = tuple[Outcome, ...]  # the skills of one task, in the order in which they are taught
Beside = tuple[Sequence[Outcome], Sequence[Outcome]]  # skills, and the same skills from scratch


def reuse(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of `job.sessions` orders of TASKS; the reading has no effect. Raises BadInput for more than there are."""
    orders = orders_of(TASKS, job.sessions, job.seed)
    pairs = [(TASKS[0], other) for other in (*TASKS[1:], OTHER_ARM)]
    alone = [(task,) for task in (*TASKS, OTHER_ARM)]
    places = job.each(places_of_life, [Life(order, job.seed) for order in (*orders, *pairs, *alone)])
    anew = {task: places[Life((task,), job.seed)][0] for (task,) in alone}
    lives = [places[Life(order, job.seed)] for order in orders]
    after = {other: places[Life((first, other), job.seed)][1] for first, other in pairs}
    rows = [*rows_of(lives, anew), *rows_after(after, anew), *rows_of_lives(lives, anew)]
    figures = {"Saved, by place in the order": by_place(rows), "What becomes of the skills of a task": by_task(rows)}
    words = f"{len(orders)} orders" if len(orders) > 1 else "1 order"
    notes = (ABOUT.format(orders=words, tasks=", ".join(TASKS)), COLUMNS, CHECKS)
    return Findings(rows, in_short(rows, len(orders)), figures, notes)


def orders_of(tasks: Sequence[str], count: int, seed: int) -> list[tuple[str, ...]]:
    """`count` different orders of the tasks: the given one, then random ones. Raises BadInput if there are fewer."""
    if not 1 <= count <= factorial(len(tasks)):
        raise BadInput(f"{count} orders (--sessions) of {len(tasks)} tasks: allowed are 1 to {factorial(len(tasks))}")
    rng, orders = np.random.default_rng([seed, len(tasks)]), {tuple(tasks): None}
    while len(orders) < count:
        orders[tuple(tasks[at] for at in rng.permutation(len(tasks)))] = None
    return [*orders]


def places_of_life(life: Life) -> tuple[Place, ...]:
    """The results of each task of a life, in its order."""
    return _life(life)[0]


@lru_cache(maxsize=_LIVES)
def _life(life: Life) -> tuple[tuple[Place, ...], Known]:
    """The results of each task of a life, and the policies then in the toolbox; lives that begin alike share that begin."""
    if not life.order:
        return (), {}
    before, known = _life(Life(life.order[:-1], life.seed))
    prepared = _prepared(life.order[-1], life.seed)
    problems = distinct_problems(prepared)
    skills = taught_skills(prepared, known, problems, life.seed)
    place = tuple(outcome_of(prepared, problem, skill) for problem, skill in zip(problems, skills, strict=True))
    policies = [skill.lesson.policy for skill in skills]
    learned = {(policy.subtask, policy.signature): policy for policy in policies}
    return (*before, place), {**known, **learned}


@lru_cache(maxsize=len(TASKS) + 1)
def _prepared(name: str, seed: int) -> Prepared:
    task = load(name)
    return prepare(task, task.order(), seed)


def outcome_of(prepared: Prepared, problem: Problem, skill: TaughtSkill) -> Outcome:
    """The result of a lesson; a policy of an earlier task is tried in physics."""
    lesson, (episodes, helped_steps) = skill.lesson, lesson_cost(skill.lesson)
    outcome = Outcome(
        prepared.task.name,
        problem.subtask,
        lesson.source if lesson.source in SOURCES else "learned",
        lesson.from_task,
        episodes,
        helped_steps,
        0 if lesson.result is None else int(lesson.result.visits.sum()),
        skill.wall_s,
        skill.cpu_s,
        unsolved=not reaches_goals(problem, lesson.policy),
    )
    return replace(outcome, failing=outcome.carried and is_failing(prepared, problem, lesson.policy))


# ---- rows ----------------------------------------------------------------------------------------------------------


def rows_of(lives: Sequence[Sequence[Place]], anew: Mapping[str, Place]) -> list[Row]:
    """The measures of each place, and of all later ones together, by sub-task, and by task."""

    def at(places: slice, **wanted: str) -> list[Beside]:
        return [_beside(life[places], anew, wanted) for life in lives]

    rows, later = [], slice(1, None)
    for place in range(1, len(lives[0])):
        rows += measures({"place": place + 1}, at(slice(place, place + 1)))
    rows += measures({"place": LATER}, at(later)) + _growth(lives, anew)
    for subtask in dict.fromkeys(outcome.subtask for place in anew.values() for outcome in place):
        rows += measures({"place": LATER, "subtask": subtask}, at(later, subtask=subtask))
    for task in anew:
        rows += measures({"place": LATER, "task": task}, at(later, task=task))
    return rows


def _growth(lives: Sequence[Sequence[Place]], anew: Mapping[str, Place]) -> list[Row]:
    """The row of GROWTH by least squares; no row if no task comes at two places."""
    at: dict[str, list[tuple[float, float]]] = {}
    for life in lives:
        for place, skills in enumerate(life[1:], 2):
            then = _sum(anew[skills[0].task], "episodes")
            at.setdefault(skills[0].task, []).append((place, 100.0 * (1 - _sum(skills, "episodes") / then)))
    off = np.concatenate([np.array(own) - np.mean(own, axis=0) for own in at.values()]) if at else np.zeros((0, 2))
    spread = float((off[:, 0] ** 2).sum())
    slope = float((off[:, 0] * off[:, 1]).sum()) / spread if spread else None
    return [] if slope is None else [row({"place": LATER}, GROWTH, slope)]


def rows_after(after: Mapping[str, Place], anew: Mapping[str, Place]) -> list[Row]:
    """The measures of each task whose toolbox holds only the skills of the first one."""
    first = TASKS[0]
    return [
        result
        for task, place in after.items()
        for result in measures({"after": first, "task": task}, [(place, anew[task])])
    ]


def rows_of_lives(lives: Sequence[Sequence[Place]], anew: Mapping[str, Place]) -> list[Row]:
    """The results of each task in each order, a row for all its skills and for each source."""
    rows = []
    for order, life in enumerate(lives, 1):
        for place, skills in enumerate(life, 1):
            pairs = [*zip(skills, anew[skills[0].task], strict=True)]
            for source in ("all", *SOURCES):
                own = [pair for pair in pairs if source in ("all", pair[0].source)]
                named: Row = {"order": order, "place": place, "task": skills[0].task, "source": source}
                rows += [_row_of(named, [outcome for outcome, _ in own], [other for _, other in own])] if own else []
    return rows


def _row_of(named: Row, now: Sequence[Outcome], anew: Sequence[Outcome]) -> Row:
    then = _sum(anew, "episodes")
    spent_now = {what: round(_sum(now, what), 3) for what in COSTS}
    spent_anew = {f"{what}_anew": round(_sum(anew, what), 3) for what in COSTS}
    saved = None if not then else 100.0 * (1 - _sum(now, "episodes") / then)
    carried = sum(outcome.carried for outcome in now)
    return row(
        {**named, "from_earlier": carried, **spent_now, "saved_percent": saved, **spent_anew}, "skills", len(now)
    )


def _beside(places: Iterable[Place], anew: Mapping[str, Place], wanted: Mapping[str, str]) -> Beside:
    """The skills of some places with the wanted attributes, and the same skills from scratch."""
    pairs = [pair for place in places for pair in zip(place, anew[place[0].task], strict=True)]
    pairs = [pair for pair in pairs if all(getattr(pair[0], name) == value for name, value in wanted.items())]
    return [outcome for outcome, _ in pairs], [other for _, other in pairs]


def measures(named: Row, orders: Sequence[Beside]) -> list[Row]:
    """The shares of FATES and the savings [%], with an interval over the orders if they vary."""
    orders = [order for order in orders if order[0]]
    rows = []
    for fate in FATES:
        rows += _mean(
            named, f"{fate}_percent", [_share([outcome.fate == fate for outcome in now]) for now, _ in orders]
        )
    for what in COSTS:
        costs = [(_sum(now, what), _sum(anew, what)) for now, anew in orders]
        rows += _mean(named, f"saved_{what}_percent", [100.0 * (1 - now / then) for now, then in costs if then])
    failing = [[outcome.failing for outcome in now if outcome.carried] for now, _ in orders]
    rows += _mean(named, "taken_failing_percent", [_share(flags) for flags in failing if flags])
    return rows + _mean(named, "unsolved_percent", [_share([outcome.unsolved for outcome in now]) for now, _ in orders])


def _share(flags: Sequence[bool]) -> float:
    return 100.0 * sum(flags) / len(flags)


def _sum(outcomes: Iterable[Outcome], what: str) -> float:
    total: float = sum(getattr(outcome, what) for outcome in outcomes)
    return total


def _mean(named: Row, measure: str, values: Sequence[float]) -> list[Row]:
    return [varying_row(named, measure, values)] if values else []


# ---- summary -------------------------------------------------------------------------------------------------------


def in_short(rows: Sequence[Row], orders: int) -> Row:
    """Whether a lab that has lived longer learns less, and what carries over, in words and numbers."""
    whole = [
        result
        for result in rows
        if result.get("place") is not None and not (result.get("subtask") or result.get("task"))
    ]
    later = {result["measure"]: result for result in those(whole, place=LATER)}
    saved = [result for result in rows if result["measure"] == "saved_episodes_percent"]
    places = [
        f"{ordinal(result['place'])} {percent(result)}" for result in saved if isinstance(result.get("place"), int)
    ]
    tasks = [
        f"{result['task']} {percent(result)}" for result in saved if result.get("place") == LATER and result.get("task")
    ]
    after = [f"{result['task']} {percent(result)}" for result in saved if result.get("after")]
    shares = _carried(rows)
    says: Row = {
        "orders": orders,
        "answer": _answer(later),
        "episodes saved by place": ", ".join(places),
        "episodes saved by task": ", ".join(tasks),
        f"episodes saved after {TASKS[0]}": ", ".join(after),
        "carry over": _named(shares, lambda share: share >= CARRIED),
        "carry over in part": _named(shares, lambda share: NOT_CARRIED < share < CARRIED),
        "do not carry over": _named(shares, lambda share: share <= NOT_CARRIED),
    }
    for measure in (*(f"saved_{what}_percent" for what in COSTS[1:]), "taken_failing_percent", "unsolved_percent"):
        if measure in later:
            says[measure] = round(later[measure]["value"], 2)
    return says


def _named(shares: Mapping[str, float], wanted: Callable[[float], bool]) -> str:
    return ", ".join(f"{name} {share:.0f} %" for name, share in shares.items() if wanted(share)) or "none"


def _answer(later: Mapping[str, Row]) -> str:
    """The verdict over all tasks that are not the first of their order, from their measures."""
    saved = later.get("saved_episodes_percent")
    if saved is None:
        return "a single task has nothing to take over"
    ends = saved["ci95"] or [saved["value"]] * 2
    verdict = "yes" if ends[0] > 0 else "no" if ends[1] <= 0 else "not shown"
    said = f"{verdict}: later tasks of an order save {percent(saved)} of the episodes that they take from scratch"
    growth = later.get(GROWTH)
    if growth is None:
        return said
    points = f"{abs(growth['value']):.1f} points {'more' if growth['value'] >= 0 else 'less'}"
    return f"{said}, and {points} for each place that a task comes later"


def _carried(rows: Sequence[Row]) -> dict[str, float]:
    """By sub-task, the share of its skills taken or adapted from earlier tasks [%], largest first."""
    later = [result for result in rows if result.get("place") == LATER and result.get("subtask")]
    shares: dict[str, float] = {}
    for result in later:
        if result["measure"] in ("taken_percent", "adapted_percent"):
            shares[result["subtask"]] = shares.get(result["subtask"], 0.0) + result["value"]
    return dict(sorted(shares.items(), key=lambda pair: -pair[1]))


def percent(result: Row) -> str:
    """A measure and its interval, such as "31 % (20 to 42)"."""
    ends = "" if result["ci95"] is None else f" ({result['ci95'][0]:.0f} to {result['ci95'][1]:.0f})"
    return f"{result['value']:.0f} %{ends}"


def ordinal(number: int) -> str:
    """The ordinal of a number up to 20, such as "2nd"."""
    return f"{number}{dict(enumerate(('st', 'nd', 'rd'), 1)).get(number, 'th')}"
