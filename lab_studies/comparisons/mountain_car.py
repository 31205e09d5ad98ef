"""When a teacher should speak, in Mountain Car: Torrey and Taylor's rules compared with our gates and nobody, at equal budgets.

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
SOLVED_MEAN, SOLVED_OF = 110.0, 100  # mean steps, over so many episodes in a row, at which Gymnasium calls it solved
STUDENTS = {"hopeful": 0.0, "sober": SOBER}  # student -> initial value of every move
NOBODY, EXPERT_TAU = "nobody", 0.01
GATE = GateSettings("always", window=5, first_episode=10, omega=30, spare_best=True, budget=BUDGET)

Values = Sequence[float]
Speaks = Callable[[Values, int, int | None, float], bool]


# A rule: (the teacher's values, the move that the student announces, its last move here, the span) -> whether to speak


def _early(values: Values, own: int, last: int | None, span: float) -> bool:
    """The teacher speaks at every step, until the budget is spent."""
    return True


def _importance(values: Values, own: int, last: int | None, span: float) -> bool:
    """It speaks where the range of its values is at least the span."""
    return max(values) - min(values) >= span


def _correcting(values: Values, own: int, last: int | None, span: float) -> bool:
    """It speaks where `_importance` does and the student announces a worse move."""
    return _importance(values, own, last, span) and values[own] < max(values)


def _predictive(values: Values, own: int, last: int | None, span: float) -> bool:
    """It speaks where `_importance` does and the student's last move here, which it expects again, was worse or unknown."""
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
    f"Each session has {EPISODES} episodes of at most 200 steps from random starts; all settings have the same seeds. "
    "mean_steps: the mean over all episodes, of which a failed one counts as 201 (the area under the learning curve); first_100: "
    f"over the first hundred. episodes_to_solve: the episodes after which the mean of the last {SOLVED_OF} is first at most "
    f"{SOLVED_MEAN:g}, {EPISODES} if it never is. solved_percent: sessions whose final greedy policy needs at most "
    f"{SOLVED_MEAN:g} steps in the mean from 200 starts. helped_steps: advised steps, at most {BUDGET}. saved_steps: the steps "
    "of an episode that are saved compared with nobody."
)
STARTS = (
    "The hopeful student has optimistic initial values of 0, better than any true value here, and explores all that nobody has "
    f"shown it; the sober one has pessimistic ones of {SOBER:g}, about the cost of half an episode, and exploits what works."
)
DIFFERS = (
    "Differences to Torrey and Taylor: none of their figures stands beside ours, as only their abstract was at hand, which says "
    "that the same amount of advice has different effects at different moments. They predict the student's move with a "
    "classifier, we by its last move in the same cell (an unvisited cell counts as a mistake); their threshold is tuned, ours "
    "is the median of the teacher's spans on its own paths. The teacher is the best of eight sessions alone."
)


@dataclass(frozen=True)
class Setting:
    """A student, and the rule by which it is advised."""

    student: str
    rule: str


@dataclass(frozen=True, eq=False)
class Outcome:
    """The results of N sessions of E episodes: steps (N, E), helped steps (N,), solved (N,)."""

    steps: NDArray[np.int64]
    helped: NDArray[np.int64]
    solved: NDArray[np.bool_]

    @property
    def to_solve(self) -> NDArray[np.int64]:
        """The episodes (N,) after which the problem counts as solved."""
        return np.array([episodes_to_solve(episodes) for episodes in self.steps])


@dataclass
class Teacher:
    """An advisor with values `known` (S, A) that speaks by a rule; seen: the student's last move in each state."""

    known: list[list[float]]
    speaks: Speaks
    span: float
    seen: dict[int, int] = field(default_factory=dict)

    def advise(self, request: AdviceRequest) -> int | None:
        """The best move by its values, or None if it is silent."""
        values = self.known[request.state]
        speaks = self.speaks(values, request.own, self.seen.get(request.state), self.span)
        best = values.index(max(values))
        self.seen[request.state] = best if speaks else request.own
        return best if speaks else None


@cache
def world() -> PhysicsEnvironment:
    """The environment, whose `values` the teacher knows."""
    return PhysicsEnvironment(PHYSICS["MountainCar-v0"])


@cache
def median_span(places: int = 20) -> float:
    """The median span of the teacher's values on its own paths from `places` random starts."""
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
    """The results of every rule with both students; the reading has no effect."""
    settings = [Setting(student, rule) for student in STUDENTS for rule in RULES]
    outcomes = job.each(partial(setting_outcome, sessions=job.sessions, seed=job.seed), settings)
    rows = [result for setting, outcome in outcomes.items() for result in rows_of(setting, outcome, outcomes)]
    pictures = {
        f"Mountain Car: steps of an episode, {student}": curves(
            {rule: outcomes[Setting(student, rule)] for rule in RULES}
        )
        for student in STUDENTS
    }
    return Findings(rows, in_short(outcomes), pictures, (MEASURES, STARTS, DIFFERS))


def student_settings(name: str) -> LearnerSettings:
    """A student's settings."""
    return replace(fitting(world().physics), episodes=EPISODES, start_value=STUDENTS[name])


def setting_outcome(setting: Setting, *, sessions: int, seed: int) -> Outcome:
    """The outcome of `sessions` sessions of a setting."""
    place, learner = world(), student_settings(setting.student)
    seeds = seeds_of(replace(setting, rule=""), sessions, seed)  # every rule has the same seeds
    if setting.rule in TEACHERS:
        return _readable_outcome(setting, learner, seeds)
    gate = replace(
        GATE, gate="never" if setting.rule == NOBODY else setting.rule.removesuffix(" gate"), psi=median_span()
    )
    advice = None if setting.rule == NOBODY else Advice.of(advice_chances(place.values(1.0), EXPERT_TAU))
    batch = run_sessions(place, learner, gate, advice, seeds, keep_tables=True)
    return Outcome(batch.steps.astype(np.int64), batch.helped_steps, _solved(batch.q, learner))


def _readable_outcome(setting: Setting, learner: LearnerSettings, seeds: NDArray[np.uint64]) -> Outcome:
    """The outcome of a rule that sees what the student is about to do, in readable sessions."""
    known = world().values(1.0).tolist()
    steps, helped, tables = [], [], []
    for seed in seeds.tolist():
        teacher = Teacher(known, TEACHERS[setting.rule], median_span())
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
    """The episodes after which the mean of the last SOLVED_OF is at most SOLVED_MEAN; all episodes if it never is."""
    sums = np.concatenate([[0], np.cumsum(steps)])
    quick = np.flatnonzero(sums[SOLVED_OF:] - sums[:-SOLVED_OF] <= SOLVED_MEAN * SOLVED_OF)
    return int(quick[0]) + SOLVED_OF if len(quick) else len(steps)


def rows_of(setting: Setting, outcome: Outcome, outcomes: Mapping[Setting, Outcome]) -> list[Row]:
    """The measures of a setting, and the steps of an episode that it saves compared with nobody."""
    named: Row = {"student": setting.student, "rule": setting.rule, "sessions": len(outcome.steps)}
    rows = [
        mean_row(named, "mean_steps", outcome.steps.mean(axis=1)),
        mean_row(named, "first_100", outcome.steps[:, :100].mean(axis=1)),
        mean_row(named, "episodes_to_solve", outcome.to_solve),
        share_row(named, "solved_percent", outcome.solved),
        row(named, "helped_steps", float(outcome.helped.mean())),
    ]
    if setting.rule == NOBODY:
        return rows
    alone = outcomes[replace(setting, rule=NOBODY)]
    return [*rows, mean_row(named, "saved_steps", alone.steps.mean(axis=1) - outcome.steps.mean(axis=1))]


def in_short(outcomes: Mapping[Setting, Outcome]) -> Row:
    """The area under the learning curve, its beginning, and the episodes to solve, by student and rule."""
    says: Row = {"span": round(median_span(), 2)}
    for setting, outcome in outcomes.items():
        which = f"{setting.student}, {setting.rule}"
        says[f"{which}: mean steps"] = round(float(outcome.steps.mean()), 1)
        says[f"{which}: first 100"] = round(float(outcome.steps[:, :100].mean()), 1)
        says[f"{which}: episodes to solve"] = round(float(outcome.to_solve.mean()))
    return says


def curves(by_rule: Mapping[str, Outcome]) -> bytes:
    """A picture of the mean steps of ten episodes at a time, a curve for each rule."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for rule, outcome in by_rule.items():
            mean = outcome.steps.mean(axis=0).reshape(-1, 10).mean(axis=1)
            axes.plot(np.arange(len(mean)) * 10 + 5, mean, color=COLOURS[rule], label=rule, linewidth=1.4)
        axes.set(xlabel="episode", ylabel="steps", xlim=(0, EPISODES))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 5.6, 3.8)
