"""Two arms that learn the same toast and advise each other, sub-task by sub-task, compared with each of them alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from lab.learning.settings import GateSettings
from lab.mdp import FloatArray, shortest_steps
from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, mean_row, those
from lab.studies.runner import Job, seeds_of
from lab.tasks.task_file import load
from lab.teaching.peers import PeerGroup, PeerPlan
from lab_studies.comparisons.peers import ALONE, NEVER, TOGETHER, Watch

TASKS, TOASTS, SCENE_SEED = ("toast", "toast-panda"), 3, 0
EVERYWHERE = "together, reach not judged"
COMPANIES = (ALONE, TOGETHER, EVERYWHERE)

MEASURES = (
    "Two peers, one with each arm, in rounds of an episode each, with the learner, the gate and the number of episodes of the "
    "task files. Goal: the episodes until the greedy path from the first start reaches the goal; solved: until it is a shortest "
    "one; all episodes if that never happens. Moves: of all episodes. Saved: how many fewer than the same learner alone, paired "
    "by seed. A sub-task's value is the mean of its skills, in each session. Reach not judged: a peer is also followed "
    "where the asker's arm cannot reach all of its path."
)
SCENE = (
    f"Tasks {' and '.join(TASKS)}, {TOASTS} toasts, the scenes of seed {SCENE_SEED}; skills whose problems are the same count "
    "once. Cells match by their place relative to the goal."
)


@dataclass(frozen=True)
class Setting:
    """The skill that both arms learn, and their company."""

    skill: str
    company: str


class Outcome(NamedTuple):
    """The results of N sessions of a learner, (N,) each."""

    goal_episodes: FloatArray
    solved_episodes: FloatArray
    moves: FloatArray
    helped_steps: FloatArray


SAVED = ("goal_episodes", "solved_episodes", "moves")


@cache
def scenes() -> tuple[Prepared, ...]:
    """The scene of each arm."""
    tasks = [load(name) for name in TASKS]
    return tuple(prepare(task, task.order(TOASTS), SCENE_SEED) for task in tasks)


def arms() -> list[str]:
    """The arm of each task."""
    return [scene.task.robot.model for scene in scenes()]


def skills() -> dict[str, str]:
    """The sub-task of each skill, one skill for each pair of problems."""
    first, second = (scene.problems for scene in scenes())
    pairs = {(first[name].mdp.signature, second[name].mdp.signature): name for name in reversed([*first])}
    return {name: first[name].subtask for name in first if name in pairs.values()}


def outcome(setting: Setting, *, sessions: int, seed: int) -> FloatArray:
    """The values of each arm's learner, (sessions, arms, measures); every company has the same seeds."""
    seeds = seeds_of(replace(setting, company=""), sessions, seed)
    return np.array([one_session(setting, int(own)) for own in seeds], np.float64)


def one_session(setting: Setting, seed: int) -> list[list[float]]:
    """The values of each arm's learner, in the order of `Outcome`."""
    plans = []
    for scene in scenes():
        problem = scene.problems[setting.skill]
        how = scene.task.subtask(problem.subtask)
        gate = GateSettings(NEVER) if setting.company == ALONE else how.gate
        reach = scene.reach(setting.skill) if setting.company == TOGETHER else None
        plans.append(PeerPlan(problem, how.learner, gate, reach=reach))
    group, watches = PeerGroup(plans, seed), []
    for plan in plans:
        mdp, learner = plan.problem.mdp, plan.learner
        watches.append(Watch(mdp, shortest_steps(mdp), learner.max_steps, learner.episodes * learner.max_steps))
    result = group.run(lambda peer: watches[peer.number - 1].look(peer))
    return [
        [watch.first(1e-9)[0], watch.first(100.0)[0], peer.moves, peer.session.helped_steps]
        for watch, peer in zip(watches, result.peers, strict=True)
    ]


def peers_of_two_arms(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every skill and company; the reading has no effect."""
    subtasks = skills()
    settings = [Setting(skill, company) for skill in subtasks for company in COMPANIES]
    values = job.each(partial(outcome, sessions=job.sessions, seed=job.seed), settings)
    groups = {
        f"all of {subtask}": [skill for skill, of in subtasks.items() if of == subtask] for subtask in _each(subtasks)
    }
    groups |= {skill: [skill] for skill in subtasks}
    rows = [row for name, of in groups.items() for company in COMPANIES for row in rows_of(name, of, company, values)]
    summary = in_short(those(rows, company=TOGETHER))
    return Findings(
        rows, summary, {"Episodes saved until the greedy path reaches the goal": _picture(rows)}, (MEASURES, SCENE)
    )


def _each(subtasks: Mapping[str, str]) -> list[str]:
    return [*dict.fromkeys(subtasks.values())]


def rows_of(name: str, of: Sequence[str], company: str, values: Mapping[Setting, FloatArray]) -> list[Row]:
    """The measures of each arm as means over some skills, and what it saves compared with being alone."""
    here, alone = (np.mean([values[Setting(skill, one)] for skill in of], axis=0) for one in (company, ALONE))
    rows = []
    for number, arm in enumerate(arms()):
        named: Row = {"skill": name, "arm": arm, "company": company, "skills": len(of)}
        mine, mine_alone = Outcome(*here[:, number].T), Outcome(*alone[:, number].T)
        rows += [mean_row(named, measure, getattr(mine, measure)) for measure in Outcome._fields]
        if company != ALONE:
            rows += [
                mean_row(named, f"saved_{measure}", getattr(mine_alone, measure) - getattr(mine, measure))
                for measure in SAVED
            ]
    return rows


def in_short(rows: Sequence[Row]) -> Row:
    """For each arm and measure: the sub-tasks and skills in which the interval of what is saved is above 0, and below 0."""
    says: Row = {}
    for arm in arms():
        for measure in SAVED:
            saved = those(rows, arm=arm, measure=f"saved_{measure}")
            above = [row["skill"] for row in saved if row["ci95"][0] > 0.0]
            below = [row["skill"] for row in saved if row["ci95"][1] < 0.0]
            says[f"{arm}: saved {measure} above 0"] = ", ".join(above) or "none"
            says[f"{arm}: saved {measure} below 0"] = ", ".join(below) or "none"
    return says


def _picture(rows: Sequence[Row]) -> bytes:
    """Bars of the episodes saved by sub-task and arm."""
    saved = [
        row
        for row in those(rows, company=TOGETHER, measure="saved_goal_episodes")
        if row["skill"].startswith("all of ")
    ]
    groups = [*dict.fromkeys(row["skill"].removeprefix("all of ") for row in saved)]
    return bars(groups, {arm: those(saved, arm=arm) for arm in arms()}, "episodes saved")
