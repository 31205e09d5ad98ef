"""Whom to believe: advisors of known reliability ranked by a panel, and three limited advisors compared with one and nobody."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lab.advice.advisors import SKILL_TAUS
from lab.advice.panel import DECISIONS, Panel, PanelSettings, members_of
from lab.learning.requests import Advisor
from lab.learning.selection import uniforms
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.mdp import FloatArray
from lab.statistics import interval
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, mean_row, row, share_row, those
from lab.studies.runner import Job, seeds_of
from lab_studies.comparisons.advice_bench.problems import problem

PROBLEMS = ("world-1", "world-2", "insert", "transfer")
RELIABILITIES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)  # those of CLUE's full panel
RANKED, LIMITED = "ranked", "limited"
EARNED = "earned-trust"
GATES = ("always", "ccrl", EARNED)
BEST_IN_A_STATE = 1e-9  # values that differ by less are equally good
MEASURES = (
    "Ranked: seven advisors whose answers are right (among the best actions) in 0 to 100 % of the cases, else wrong; all answer "
    "each question. ranking_right_percent: sessions in which the panel's final trust ranks all seven rightly. In CLUE's setting "
    "every step is asked about, as with the gate always; a session has many steps here, but one decision there. Limited: one "
    "advisor of tau 0.3, or three as a panel; points as in AdviceBench: 100 is the best policy, 0 failure, means over all "
    "episodes; gain_points: points above nobody's with the same seeds, with a 95 % interval."
)


@dataclass(frozen=True)
class Setting:
    """The advisors in a problem, and when they are asked: kind RANKED or LIMITED, their number, how a panel decides."""

    problem: str
    kind: str
    gate: str
    members: int
    decide: str = "trust-weighted"


class SessionResults(NamedTuple):
    """The results of N sessions: points (N,), answers (N,), and the panel's final trusts (N, members)."""

    points: FloatArray
    answers: FloatArray
    trusts: FloatArray


def all_settings() -> list[Setting]:
    """All settings; those with 0 members have nobody to ask."""
    every = [Setting(name, LIMITED, "never", 0) for name in PROBLEMS]
    every += [Setting(name, LIMITED, gate, 1) for name in PROBLEMS for gate in GATES]
    every += [Setting(name, LIMITED, gate, 3, decide) for name in PROBLEMS for gate in GATES for decide in DECISIONS]
    return every + [Setting(name, RANKED, gate, len(RELIABILITIES)) for name in PROBLEMS for gate in GATES]


def reliable_chances(values: FloatArray, share: float) -> FloatArray:
    """The chances (S, A) of the answers of an advisor that is right in `share` of the cases; right ones are equally likely."""
    best = values >= values.max(axis=1, keepdims=True) - BEST_IN_A_STATE
    count, actions = best.sum(axis=1, keepdims=True), values.shape[1]
    chances = np.where(best, share / count, (1.0 - share) / np.maximum(actions - count, 1))
    mixed: FloatArray = np.where(count == actions, 1.0 / actions, chances)
    return mixed


def sessions_of(setting: Setting, sessions: int, seed: int) -> SessionResults:
    """The results of `sessions` sessions of a setting."""
    seeds = seeds_of(Setting(setting.problem, LIMITED, "never", 0), sessions, seed)  # all settings have the same seeds
    runs = [_session(setting, int(own)) for own in seeds]
    return SessionResults(*(np.array([outcome[n] for outcome in runs]) for n in range(3)))


def _session(setting: Setting, seed: int) -> tuple[float, float, list[float]]:
    """The points, answers and trusts of a session."""
    place = problem(setting.problem)
    rng = np.random.default_rng(seed)
    streams = rng.spawn(setting.members + 2)
    ranked = setting.kind == RANKED
    chances = [
        reliable_chances(place.values, RELIABILITIES[n])
        if ranked
        else advice_chances(place.values, SKILL_TAUS["limited"])
        for n in range(setting.members)
    ]
    members = [TableAdvisor(Advice.of(table), uniforms(own)) for table, own in zip(chances, streams, strict=False)]
    advisor: Advisor | None = members[0] if members else None
    panel = None
    if len(members) > 1:
        advisor = panel = Panel(
            members_of(["advisor"] * len(members), members),
            place.mdp.n_states,
            PanelSettings(decide=setting.decide),
            draw=uniforms(streams[-2]),
            tell=lambda event: None,
        )
    gate = GateSettings(setting.gate, first_episode=10, spare_best=True)
    session = Session(place.mdp, place.learner, gate, advisor, streams[-1]).run()
    most = place.learner.max_steps + 1
    points = float((100.0 * (most - session.steps) / (most - place.par)).mean())
    return points, session.helped_steps, [] if panel is None else [member.trust for member in panel.standing()]


def whom_to_believe(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every setting; the reading has no effect."""
    outcomes = job.each(partial(sessions_of, sessions=job.sessions, seed=job.seed), all_settings())
    rows = [result for setting, told in outcomes.items() for result in rows_of(setting, told, outcomes)]
    right = [_row(rows, name, RANKED, "always") for name in PROBLEMS]
    gains = {
        f"{gate}, {'one' if members == 1 else 'three'}": [
            _row(rows, name, LIMITED, gate, members=members, decide="trust-weighted") for name in PROBLEMS
        ]
        for gate in ("always", EARNED)
        for members in (1, 3)
    }
    says: Row = {
        "ranking of seven right, asked always [%]": ", ".join(
            f"{result['problem']} {result['value']:.0f}" for result in right
        ),
        "three limited over nobody, gate earned-trust [points]": ", ".join(
            f"{result['problem']} {result['value']:+.1f} ({result['ci95'][0]:+.1f} to {result['ci95'][1]:+.1f})"
            for result in gains[f"{EARNED}, three"]
        ),
    }
    pictures = {"Points of limited advisors": bars(PROBLEMS, _points_of(gains, rows), "points", label="")}
    return Findings(rows, says, pictures, (MEASURES,))


def rows_of(setting: Setting, told: SessionResults, outcomes: Mapping[Setting, SessionResults]) -> list[Row]:
    """The measures of a setting."""
    named: Row = {"problem": setting.problem, "advisors": setting.kind, "gate": setting.gate}
    named |= {"members": setting.members, "decide": setting.decide, "answers": float(told.answers.mean())}
    nobody = outcomes[Setting(setting.problem, LIMITED, "never", 0)]
    rows = [mean_row(named, "points", told.points)]
    if setting.members:
        mean, *ends = interval(told.points - nobody.points)
        rows.append(row(named, "gain_points", mean, ends))
    if setting.kind == RANKED:
        rows.append(share_row(named, "ranking_right_percent", (np.diff(told.trusts, axis=1) > 0.0).all(axis=1)))
        for share, trusts in zip(RELIABILITIES, told.trusts.T, strict=True):
            rows.append(mean_row(named | {"right_share": share}, "trust", trusts))
    return rows


def _row(rows: Sequence[Row], name: str, kind: str, gate: str, **more: Any) -> Row:
    measure = "ranking_right_percent" if kind == RANKED else "gain_points"
    return those(rows, problem=name, advisors=kind, gate=gate, measure=measure, **more)[0]


def _points_of(gains: Mapping[str, Sequence[Row]], rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows of points that belong to rows of gains, and nobody's, as bars begin at 0."""
    shown = {"nobody": [those(rows, problem=name, gate="never", measure="points")[0] for name in PROBLEMS]}
    for words, gain_rows in gains.items():
        same = (
            {key: result[key] for key in ("problem", "advisors", "gate", "members", "decide")} for result in gain_rows
        )
        shown[words] = [those(rows, measure="points", **names)[0] for names in same]
    return shown
