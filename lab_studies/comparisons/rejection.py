"""Whom CCRL rejects: each sub-task of the toast task with each learner and advisor, until advice has ended in some way."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.learning import splitmix
from lab.learning.batch import Batch, is_compiled, run_sessions
from lab.learning.problem import Problem
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.learning.updates import UPDATES
from lab.mdp import TabularMDP, optimal_values
from lab.studies.findings import Findings, Row, mean_row, share_row
from lab.studies.runner import Job, seeds_of
from lab_studies.comparisons.advice_worth import SCENE_SEED, TASK, TOASTS, scene

WRONG = "wrong"
ADVISORS = ("expert", "novice", WRONG)
RULES = {"misleads": False, "evidence": True}  # GateSettings.by_evidence
MEASURES = (
    "A session with the task file's gate, whose advisor is rejected after more than Omega misleads (the thesis's rule) or by "
    "evidence. It counts until advice ends: rejected, budget spent, converged, or no more episodes. rejected_percent: sessions "
    "that reject before the budget is spent; helped_steps: until then. 'wrong' takes the worst action for the best. A novice "
    "(tau 1) is right in 45 to 50 % of the states; an advisor that draws evenly in 38 to 45 %."
)
SCENE = f"Task {TASK}, {TOASTS} toasts, the scene of seed {SCENE_SEED}, the first problem of each sub-task."


@dataclass(frozen=True)
class Setting:
    """A sub-task, a learner, an advisor, and the rule by which it is rejected."""

    subtask: str
    learner: str
    advisor: str
    rule: str


class Ended(NamedTuple):
    """How the advice of a session ended: by rejection before the budget was spent, by the budget, after so many helped steps."""

    rejected: bool
    spent: bool
    helped: int


def advice_of(mdp: TabularMDP, discount: float, advisor: str) -> Advice:
    """The answers of an advisor who knows the optimal values."""
    sign, skill = (-1.0, "expert") if advisor == WRONG else (1.0, advisor)
    return Advice.of(advice_chances(sign * optimal_values(mdp, discount), SKILL_TAUS[skill]))


def endings_of(batch: Batch, budget: int) -> list[Ended]:
    """How the advice of each session of a batch ended: as `ended` has it, because nothing is asked or judged after that."""
    spent = batch.helped_steps >= budget
    columns = ((batch.rejected_at_episode > 0) & ~spent, spent, batch.helped_steps)
    return [Ended(*ending) for ending in zip(*(column.tolist() for column in columns), strict=True)]


def ended(session: Session, budget: int) -> Ended:
    """How the advice of a session ends; the episodes after that are not run."""
    gate = session.gate
    session.run(enough=lambda: gate.rejected or gate.converged or session.helped_steps >= budget)
    spent = session.helped_steps >= budget
    return Ended(gate.rejected and not spent, spent, session.helped_steps)


def first_problems() -> dict[str, Problem]:
    """The first problem of each sub-task."""
    return {problem.subtask: problem for problem in reversed(scene().problems.values())}


def sessions_of(setting: Setting, sessions: int, seed: int) -> list[Ended]:
    """How the advice of `sessions` sessions of a setting ended."""
    mdp, how = first_problems()[setting.subtask].mdp, scene().task.subtask(setting.subtask)
    learner = replace(how.learner, learner=setting.learner)
    gate: GateSettings = replace(how.gate, gate="ccrl", by_evidence=RULES[setting.rule])
    advice = advice_of(mdp, learner.discount, setting.advisor)
    seeds = seeds_of(replace(setting, advisor="", rule=""), sessions, seed)
    if is_compiled(mdp, learner, gate, advice):
        return endings_of(run_sessions(mdp, learner, gate, advice, seeds), gate.budget)
    endings = []
    for draw in map(splitmix.stream, seeds.tolist()):
        endings.append(ended(Session(mdp, learner, gate, TableAdvisor(advice, draw), draw), gate.budget))
    return endings


def rejection(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every setting; the reading has no effect."""
    settings = [
        Setting(subtask, learner, advisor, rule)
        for subtask in sorted(first_problems())
        for learner in UPDATES
        if not UPDATES.is_added(learner)
        for advisor in ADVISORS
        for rule in RULES
    ]
    endings = job.each(partial(sessions_of, sessions=job.sessions, seed=job.seed), settings)
    rows = [row for setting, told in endings.items() for row in rows_of(setting, told)]
    return Findings(rows, in_short(rows), {}, (MEASURES, SCENE))


def rows_of(setting: Setting, endings: list[Ended]) -> list[Row]:
    """The measures of a setting."""
    named: Row = dict(vars(setting))
    rejected, spent, helped = (np.array(column) for column in zip(*endings, strict=True))
    return [
        share_row(named, "rejected_percent", rejected),
        share_row(named, "budget_spent_percent", spent),
        mean_row(named, "helped_steps", helped),
    ]


def in_short(rows: list[Row]) -> Row:
    """By rule, sub-task and advisor: the least and the greatest share rejected over the learners."""
    shares: dict[str, list[float]] = {}
    for row in rows:
        if row["measure"] == "rejected_percent":
            shares.setdefault(f"{row['rule']}, {row['subtask']}, {row['advisor']}: rejected [%]", []).append(
                row["value"]
            )
    return {words: f"{min(of):.1f} to {max(of):.1f}" for words, of in shares.items()}
