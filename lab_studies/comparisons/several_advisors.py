"""Several advisors at once: whom to follow when they disagree, compared with the best and the worst alone, and with nobody."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.advice.advisors import SKILL_TAUS
from lab.advice.panel import DECISIONS, Panel, PanelSettings, members_of
from lab.learning.requests import Advisor
from lab.learning.selection import uniforms
from lab.learning.session import Session
from lab.learning.session_events import AdvisorDropped, AdvisorReadmitted, AdvisorsDisagreed, Event
from lab.learning.simulated_advice import Advice, TableAdvisor, advice_chances
from lab.studies.charts import bars
from lab.studies.findings import Findings, Row, share_row, those, varying_row
from lab.studies.runner import Job, seeds_of
from lab_studies.thesis.chapter_9 import advisor_note
from lab_studies.thesis.chapter_9_sessions import (
    AdviceSetting,
    gate_of,
    learner_of,
    problem,
    succeeded,
    table_of,
    world,
)

WORLD = "world-1"
PANELS: tuple[tuple[str, ...], ...] = (
    ("expert", "novice"),
    ("expert", "wrong"),
    ("expert", "wrong", "wrong"),
    ("moderate", "limited", "novice"),
    ("limited", "limited", "limited"),
)
IN_TURN, BEST, WORST = "in turn", "best alone", "worst alone"
WAYS = (*DECISIONS, IN_TURN, BEST, WORST)
MOST = 100  # the most sessions of a setting, as they are run one by one in plain Python
POINTS = 2.0  # a panel counts as good as its best member alone if its success is at most so many points below

MEASURES = (
    "SP: sessions whose last episode took the shortest path. HS: helped steps. Dropped and readmitted: how often advisors were, "
    "the mean of a session; by advisor: sessions in which it was dropped at least once. The thesis prints none of this, and "
    "proposes it as future work (section 10.2.4)."
)
WAYS_NOTE = (
    "All advisors are asked in each step, and one decision follows: majority, best-trusted or trust-weighted; in turn: one "
    "advisor in each episode. Between two advisors the three decisions are the same, since the more trusted one decides a tie. "
    "Best and worst alone: the member of the panel, asked without it, whose sessions succeeded most and least often. Wrong: an "
    "advisor that takes the worst action for the best. World I, full view, CCRL with the world's own Lambda and Omega, which "
    "rejects a panel as one advisor."
)
LIMITS = f"At most {MOST} sessions of a setting, as they are run in plain Python, a tenth of a second each."


@dataclass(frozen=True)
class PanelSetting:
    """The advisors that are asked, and how: one of DECISIONS or IN_TURN; way None: the first member alone, or nobody."""

    members: tuple[str, ...]
    way: str | None
    lesson: AdviceSetting


@dataclass(frozen=True, eq=False)
class PanelOutcome:
    """The results of N sessions, (N,) each. dropped: how often, by member; readmitted, disagreed: how often in all."""

    success: NDArray[np.bool_]
    helped_steps: NDArray[np.int64]
    disagreed: NDArray[np.int64]
    readmitted: NDArray[np.int64]
    dropped: Mapping[str, NDArray[np.int64]]


def advisors(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every panel with every way to decide; the reading changes the lesson, as in chapter 9."""
    lesson = replace(AdviceSetting(WORLD, gate="ccrl"), **reading)
    alone = {name: PanelSetting((name,), None, lesson) for panel in PANELS for name in panel}
    nobody = PanelSetting((), None, lesson)
    together = {(panel, way): PanelSetting(panel, way, lesson) for panel in PANELS for way in (*DECISIONS, IN_TURN)}
    settings = [*together.values(), *alone.values(), nobody]
    outcomes = job.each(
        partial(panel_outcome, sessions=min(job.sessions, MOST), seed=job.seed),
        sorted(settings, key=lambda setting: -len(setting.members)),  # those that take longest first
    )
    cells = {(panel, way): ("", outcomes[setting]) for (panel, way), setting in together.items()}
    for panel in PANELS:
        ranked = sorted(dict.fromkeys(panel), key=lambda name: _merit(outcomes[alone[name]]))
        cells |= {(panel, way): (name, outcomes[alone[name]]) for way, name in ((BEST, ranked[-1]), (WORST, ranked[0]))}
    rows = [row for panel in PANELS for way in WAYS for row in rows_of(panel, way, *cells[panel, way])]
    rows += rows_of((), "nobody", "", outcomes[nobody])
    pictures = {
        f"Sessions that end on the shortest way; nobody: {_value(rows, (), 'nobody', 'SP_percent'):.0f} %": _picture(
            rows, "SP_percent", "sessions that end optimal [%]"
        ),
        "Helped steps of a session": _picture(rows, "HS_steps", "helped steps"),
    }
    return Findings(rows, in_short(rows), pictures, (MEASURES, WAYS_NOTE, advisor_note(reading), LIMITS))


def _merit(outcome: PanelOutcome) -> tuple[float, float]:
    return float(outcome.success.mean()), -float(outcome.helped_steps.mean())


def panel_outcome(setting: PanelSetting, *, sessions: int, seed: int) -> PanelOutcome:
    """The outcome of `sessions` sessions of a setting."""
    seeds = seeds_of(replace(setting, way=None), sessions, seed)  # every way of a panel has the same seeds
    runs = [one_session(setting, int(own)) for own in seeds]
    events = [told for _, _, told in runs]
    names = sorted({event.advisor for told in events for event in told if isinstance(event, AdvisorDropped)})

    def counted(kind: type[Event], name: str | None = None) -> NDArray[np.int64]:
        return np.array(
            [
                sum(isinstance(event, kind) and name in (None, getattr(event, "advisor", None)) for event in told)
                for told in events
            ],
            np.int64,
        )

    return PanelOutcome(
        np.array([success for success, _, _ in runs], np.bool_),
        np.array([helped for _, helped, _ in runs], np.int64),
        counted(AdvisorsDisagreed),
        counted(AdvisorReadmitted),
        {name: counted(AdvisorDropped, name) for name in names},
    )


def one_session(setting: PanelSetting, seed: int) -> tuple[bool, int, list[Event]]:
    """One session: whether its last episode took the shortest path, its helped steps, and the panel's events."""
    lesson, mdp, told = setting.lesson, problem(setting.lesson.world), list[Event]()
    rng = np.random.default_rng(seed)
    streams = rng.spawn(len(setting.members) + 2)
    members = [
        TableAdvisor(_advice(name, lesson), uniforms(rng)) for name, rng in zip(setting.members, streams, strict=False)
    ]
    advisor: Advisor | None = members[0] if members else None
    if setting.way is not None:
        in_turn = setting.way == IN_TURN
        advisor = Panel(
            members_of(setting.members, members),
            mdp.n_states,
            PanelSettings("in-turn", "best-trusted") if in_turn else PanelSettings(decide=setting.way),
            draw=uniforms(streams[-2]),
            tell=told.append,
        )
    gate = gate_of(lesson, world(lesson.world).gate)
    result = Session(mdp, learner_of(lesson), gate, advisor, streams[-1]).run()
    (success,) = succeeded(lesson, np.array([result.steps]))
    return bool(success), result.helped_steps, told


@lru_cache(maxsize=64)
def _advice(name: str, lesson: AdviceSetting) -> Advice:
    wrong, values = name == "wrong", table_of(lesson)
    return Advice.of(advice_chances(-values if wrong else values, SKILL_TAUS["expert" if wrong else name]))


def rows_of(panel: Sequence[str], way: str, who: str, outcome: PanelOutcome) -> list[Row]:
    """The measures of one panel and way; who: the member that was asked alone, or ""."""
    sessions = len(outcome.success)
    named: Row = {"table": "World I", "panel": ", ".join(panel) or None, "way": way, "asked": who or None}
    named = {name: value for name, value in named.items() if value is not None} | {"sessions": sessions}
    rows = [share_row(named, "SP_percent", outcome.success), varying_row(named, "HS_steps", outcome.helped_steps)]
    if way not in (*DECISIONS, IN_TURN):
        return rows
    never = np.zeros(sessions, np.int64)
    rows += [
        varying_row(named, "dropped", sum(outcome.dropped.values(), never)),
        varying_row(named, "readmitted", outcome.readmitted),
        varying_row(named, "disagreed_steps", outcome.disagreed),
    ]
    for name in member_names(panel):
        rows.append(share_row(named | {"advisor": name}, "ever_dropped_percent", outcome.dropped.get(name, never) > 0))
    return rows


def member_names(panel: Sequence[str]) -> list[str]:
    """The names of the members in the panel, such as "wrong" and "wrong 2"."""
    return [
        name if not panel[:n].count(name) else f"{name} {panel[:n].count(name) + 1}" for n, name in enumerate(panel)
    ]


def _row(rows: Sequence[Row], panel: Sequence[str], way: str, measure: str) -> Row:
    return those(rows, panel=", ".join(panel) or None, way=way, measure=measure, advisor=None)[0]


def _value(rows: Sequence[Row], panel: Sequence[str], way: str, measure: str) -> float:
    return float(_row(rows, panel, way, measure)["value"])


def in_short(rows: Sequence[Row]) -> Row:
    """The means over the panels, by way, and the number of panels that are as good as their best member."""
    says: Row = {"nobody: SP [%]": round(_value(rows, (), "nobody", "SP_percent"), 1)}
    for way in WAYS:
        for measure, unit in (("SP_percent", "SP [%]"), ("HS_steps", "HS [steps]")):
            mean = np.mean([_value(rows, panel, way, measure) for panel in PANELS])
            says[f"{way}: mean {unit} of {len(PANELS)} panels"] = round(float(mean), 1)
    for way in (*DECISIONS, IN_TURN):
        behind = [_value(rows, panel, BEST, "SP_percent") - _value(rows, panel, way, "SP_percent") for panel in PANELS]
        says[f"{way}: panels within {POINTS:g} points of their best member"] = sum(gap <= POINTS for gap in behind)
    for name in ("wrong", "expert"):
        shares = [row["value"] for row in rows if str(row.get("advisor", "")).split(" ")[0] == name]
        says[f"{name}: sessions that drop it [%]"] = round(float(np.mean(shares)), 1)
    return says


def _picture(rows: Sequence[Row], measure: str, ylabel: str) -> bytes:
    """A picture with bars by panel, a bar for each way."""
    lines = {way: [_row(rows, panel, way, measure) for panel in PANELS] for way in WAYS}
    return bars([",\n".join(panel) for panel in PANELS], lines, ylabel)
