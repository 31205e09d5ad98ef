"""When a teacher should speak, in Mountain Car: Torrey and Taylor's rules at equal budgets, beside nobody and our gates.

Source: Torrey and Taylor, Teaching on a budget: agents advising agents in reinforcement learning, AAMAS 2013.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.learning.batch import run_sessions
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import SOBER, PhysicsEnvironment, fitting
from lab.learning.requests import AdviceRequest
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.simulated_advice import Advice, advice_chances
from lab.learning.splitmix import stream
from lab.mdp import FloatArray
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, row, share_row
from lab.studies.runner import Job, seeds_of
from lab.view.canvas import BLUE, GREEN, INK, ORANGE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EPISODES, BUDGET = 300, 1000
SOLVED_MEAN, SOLVED_OF = 110.0, 100  # steps, over so many episodes in a row: what Gymnasium calls solved
STUDENTS = {"hopeful": 0.0, "sober": SOBER}  # what they think of every move at first
NOBODY, EXPERT_TAU = "nobody", 0.01
GATE = GateSettings("always", window=5, first_episode=10, omega=30, spare_best=True, budget=BUDGET)

Values = Sequence[float]
Speaks = Callable[
    [Values, int, int | None, float], bool
]  # teacher's values, the student's own move, the last one here, span


# what a teacher goes by: its values here, the move that the student announces, the one that it made here last, the span


def _early(values: Values, own: int, last: int | None, span: float) -> bool:
    """At every step, until the budget is spent."""
    return True


def _importance(values: Values, own: int, last: int | None, span: float) -> bool:
    """Where the teacher's values of the moves lie apart by the span or more."""
    return max(values) - min(values) >= span


def _correcting(values: Values, own: int, last: int | None, span: float) -> bool:
    """Where that is so and the student announces another move than the teacher's."""
    return _importance(values, own, last, span) and values[own] < max(values)


def _predictive(values: Values, own: int, last: int | None, span: float) -> bool:
    """As correcting, of the move that the student is expected to make: the one that it made here last."""
    return _importance(values, own, last, span) and (last is None or values[last] < max(values))


TEACHERS: dict[str, Speaks] = {
    "early": _early,
    "importance": _importance,
    "correcting": _correcting,
    "predictive": _predictive,
}
GATES = ("ccrl", "ia", "importance gate")  # the student asks; compiled
RULES = (NOBODY, *TEACHERS, *GATES)
COLOURS = dict(zip(RULES, (INK, SKY, ORANGE, RED, GREEN, BLUE, "#7b5aa6", "#8a6d3b"), strict=True))
MEASURES = (
    f"Each session has {EPISODES} episodes of at most 200 steps from drawn starts; all settings have the same seeds. mean_steps: "
    "of all episodes, a failed one as 201 (the area under the learning curve); first_100: of the first hundred. "
    f"episodes_to_solve: after how many the mean of the last {SOLVED_OF} is at most {SOLVED_MEAN:g} for the first time, "
    f"{EPISODES} where it never is. solved_percent: sessions whose greedy policy in the end needs at most {SOLVED_MEAN:g} steps "
    f"in the mean from 200 starts. helped_steps: what was advised, at most {BUDGET}. saved_steps: an episode, over nobody."
)
STARTS = (
    "The hopeful student begins with zeros, better than any true value here, and so looks for itself into whatever nobody has "
    f"shown it; the sober one with {SOBER:g}, about what an episode costs from the middle of a way, and keeps to what works."
)
DIFFERS = (
    "What differs from Torrey and Taylor: no figure of theirs stands beside ours, for none was at hand but their abstract's, "
    "that the same amount of advice has other effects at other moments. Their student's move is foretold by a classifier, ours "
    "by what it did last in the same cell (a cell where it never was counts as a mistake); their threshold is tuned, ours is "
    "the median of the teacher's spans on its own ways. The teacher is the best of eight sessions alone."
)


@dataclass(frozen=True)
class Setting:
    """Which student learns, and by which rule it is advised."""

    student: str
    rule: str


@dataclass(frozen=True, eq=False)
class Outcome:
    """What N sessions came to: steps (N, E), helped (N,), solved (N,)."""

    steps: NDArray[np.int64]
    helped: NDArray[np.int64]
    solved: NDArray[np.bool_]

    @property
    def to_solve(self) -> NDArray[np.int64]:
        """The episodes after which the last hundred were quick enough, (N,)."""
        return np.array([episodes_to_solve(episodes) for episodes in self.steps])


@dataclass
class Teacher:
    """An advisor that knows its values (S, A) and speaks by a rule; what the student did last in a cell, it has seen."""

    known: list[list[float]]
    speaks: Speaks
    span: float
    seen: dict[int, int] = field(default_factory=dict)

    def advise(self, request: AdviceRequest) -> int | None:
        """The best move by its values, or nothing."""
        values = self.known[request.state]
        speaks = self.speaks(values, request.own, self.seen.get(request.state), self.span)
        best = values.index(max(values))
        self.seen[request.state] = best if speaks else request.own
        return best if speaks else None


@cache
def world() -> PhysicsEnvironment:
    """The car, with what the teacher knows of it."""
    return PhysicsEnvironment(PHYSICS["MountainCar-v0"])


@cache
def span_of(places: int = 20) -> float:
    """The median span of the teacher's values where it comes by itself, from so many drawn starts."""
    place, known, draw = world(), world().values(1.0), stream(0)
    spans: list[float] = []
    for _ in range(places):
        state, over = place.reset(1, draw), False
        for _ in range(place.physics.limit):
            if over:
                break
            spans.append(float(np.ptp(known[state])))
            _, state, over, *_ = place.step(state, int(known[state].argmax()), draw)
    return float(np.median(spans))


def mountain_car(job: Job, reading: Mapping[str, Any]) -> Findings:
    """Every rule, for both students."""
    settings = [Setting(student, rule) for student in STUDENTS for rule in RULES]
    outcomes = job.each(partial(taught, sessions=job.sessions, seed=job.seed), settings)
    rows = [result for setting, outcome in outcomes.items() for result in rows_of(setting, outcome, outcomes)]
    pictures = {
        f"Mountain Car: steps of an episode, {student}": curves(
            {rule: outcomes[Setting(student, rule)] for rule in RULES}
        )
        for student in STUDENTS
    }
    return Findings(rows, in_short(outcomes), pictures, (MEASURES, STARTS, DIFFERS))


def student_of(name: str) -> LearnerSettings:
    """A student's settings."""
    return replace(fitting(world().physics), episodes=EPISODES, start_value=STUDENTS[name])


def taught(setting: Setting, *, sessions: int, seed: int) -> Outcome:
    """So many sessions of a setting."""
    place, learner = world(), student_of(setting.student)
    seeds = seeds_of(replace(setting, rule=""), sessions, seed)  # every rule meets the same chances
    if setting.rule in TEACHERS:
        return _told(setting, learner, seeds)
    gate = replace(GATE, gate="never" if setting.rule == NOBODY else setting.rule.removesuffix(" gate"), psi=span_of())
    advice = None if setting.rule == NOBODY else Advice.of(advice_chances(place.values(1.0), EXPERT_TAU))
    batch = run_sessions(place, learner, gate, advice, seeds, keep_tables=True)
    return Outcome(batch.steps.astype(np.int64), batch.helped_steps, _solved(batch.q, learner))


def _told(setting: Setting, learner: LearnerSettings, seeds: NDArray[np.uint64]) -> Outcome:
    """The sessions of a rule that looks at what the student is about to do: in the readable session."""
    known = world().values(1.0).tolist()
    steps, helped, tables = [], [], []
    for seed in seeds.tolist():
        teacher = Teacher(known, TEACHERS[setting.rule], span_of())
        session = Session(world(), learner, GATE, teacher, stream(seed)).run()
        if session.interrupted:
            raise KeyboardInterrupt
        steps.append(session.steps)
        helped.append(session.helped_steps)
        tables.append(session.q)
    return Outcome(np.array(steps), np.array(helped), _solved(tables, learner))


def _solved(tables: Sequence[FloatArray] | FloatArray, learner: LearnerSettings) -> NDArray[np.bool_]:
    return np.array([world().judge(q, learner).solved for q in tables])


def episodes_to_solve(steps: NDArray[np.int64]) -> int:
    """After how many episodes the mean of the last SOLVED_OF is at most SOLVED_MEAN; all of them where it never is."""
    sums = np.concatenate([[0], np.cumsum(steps)])
    quick = np.flatnonzero(sums[SOLVED_OF:] - sums[:-SOLVED_OF] <= SOLVED_MEAN * SOLVED_OF)
    return int(quick[0]) + SOLVED_OF if len(quick) else len(steps)


def rows_of(setting: Setting, of: Outcome, outcomes: Mapping[Setting, Outcome]) -> list[Row]:
    """The measures of a setting, and how many steps an episode it saves over nobody."""
    named: Row = {"student": setting.student, "rule": setting.rule, "sessions": len(of.steps)}
    rows = [
        mean_row(named, "mean_steps", of.steps.mean(axis=1)),
        mean_row(named, "first_100", of.steps[:, :100].mean(axis=1)),
        mean_row(named, "episodes_to_solve", of.to_solve),
        share_row(named, "solved_percent", of.solved),
        row(named, "helped_steps", float(of.helped.mean())),
    ]
    if setting.rule == NOBODY:
        return rows
    alone = outcomes[replace(setting, rule=NOBODY)]
    return [*rows, mean_row(named, "saved_steps", alone.steps.mean(axis=1) - of.steps.mean(axis=1))]


def in_short(outcomes: Mapping[Setting, Outcome]) -> Row:
    """The area under the curve, its beginning, and when it is solved, by student and rule."""
    says: Row = {"span": round(span_of(), 2)}
    for setting, of in outcomes.items():
        which = f"{setting.student}, {setting.rule}"
        says[f"{which}: mean steps"] = round(float(of.steps.mean()), 1)
        says[f"{which}: first 100"] = round(float(of.steps[:, :100].mean()), 1)
        says[f"{which}: episodes to solve"] = round(float(of.to_solve.mean()))
    return says


def curves(of: Mapping[str, Outcome]) -> bytes:
    """The mean steps of each episode, ten averaged, a curve for each rule."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for rule, outcome in of.items():
            mean = outcome.steps.mean(axis=0).reshape(-1, 10).mean(axis=1)
            axes.plot(np.arange(len(mean)) * 10 + 5, mean, color=COLOURS[rule], label=rule, linewidth=1.4)
        axes.set(xlabel="episode", ylabel="steps", xlim=(0, EPISODES))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 5.6, 3.8)
