"""The worth of an advisor's help: the cost of a lesson until it is solved, for each skill of the toast task and advisor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lab.advice.advising import Advising
from lab.advice.advisors import SKILL_TAUS
from lab.advice.journal import Journal
from lab.learning.session_events import EpisodeEnded
from lab.learning.values import fewest_moves, greedy_moves
from lab.mdp import FloatArray, TabularMDP
from lab.skills.prepared_scene import Prepared, prepare
from lab.studies.charts import bars, legend_below
from lab.studies.findings import Findings, Row, row, share_row, varying_row
from lab.studies.runner import Job, seeds_of
from lab.tasks.task_file import load
from lab.teaching.events import Event, LessonEvent, SessionBegan
from lab.teaching.lesson_plan import LessonPlan
from lab.teaching.lesson_sessions import Sessions
from lab.view.canvas import BLUE, GREEN, INK, ORANGE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TASK, TOASTS, SCENE_SEED = "toast", 3, 0
NOBODY = "none"
ADVISORS = (NOBODY, *SKILL_TAUS, "wrong")
COLOURS = dict(zip(ADVISORS, (INK, BLUE, GREEN, SKY, ORANGE, RED), strict=True))
MOST = 40  # the most lessons for a skill and an advisor
LOOKED = 10  # with several starts, whose paths take longer to check, the table is checked every tenth episode

MEASURES = (
    "A lesson is that of lab run: sessions one after the other, with the task file's learner and gate. It is solved when the "
    "greedy path from every start is a shortest one. Episodes and moves: the learner's until then, advised ones included "
    f"(checked after each episode, after every {LOOKED}th where episodes begin in several places). Helped: advised steps until "
    "then. Saved: how many fewer moves it takes than without advice, by the means, with the interval of the difference (Welch)."
)
SCENE = (
    f"Task {TASK}, {TOASTS} toasts, the scene of seed {SCENE_SEED}; at most {MOST} lessons for a skill and an advisor. A "
    "simulated advisor knows the optimal values, which nobody does in a kitchen; 'wrong' takes the worst action for the best."
)


@dataclass(frozen=True)
class Pupil:
    """The skill that is learned, and the advisor."""

    skill: str
    advisor: str


@dataclass(frozen=True, eq=False)
class Cost:
    """The cost of N lessons until they were solved, (N,) each; an unsolved lesson counts with its whole cost."""

    solved: NDArray[np.bool_]
    episodes: NDArray[np.int64]
    moves: NDArray[np.int64]
    helped: NDArray[np.int64]


@dataclass
class Watch:
    """A listener that counts the cost of a lesson until its greedy paths are shortest."""

    mdp: TabularMDP
    fewest: FloatArray
    solved: bool = False
    episodes: int = 0
    moves: int = 0
    helped: int = 0

    @classmethod
    def over(cls, mdp: TabularMDP) -> "Watch":
        """A watch on lessons of a problem, from every state in which an episode may begin."""
        return cls(mdp, fewest_moves(mdp))

    def hear(self, event: Event) -> None:
        """Count an episode, and check the table after it."""
        if isinstance(event, SessionBegan):
            self.session, self.before = event.session, self.moves
        if self.solved or not isinstance(event, LessonEvent) or not isinstance(event.event, EpisodeEnded):
            return
        self.episodes += 1
        self.helped += event.event.helped_steps
        self.moves = self.before + sum(map(sum, self.session.visits))
        starts = list(self.mdp.starts or (self.mdp.start,))
        if len(starts) == 1 or self.episodes % LOOKED == 0:
            ways = greedy_moves(np.array(list(self.session.q)), self.mdp)
            self.solved = np.array_equal(ways[starts], self.fewest[starts])


def advice_worth(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of every skill of the toast task with every advisor and nobody; the reading has no effect."""
    skills = list(scene().problems)
    pupils = [Pupil(skill, advisor) for skill in skills for advisor in ADVISORS]
    costs_by_pupil = job.each(partial(lessons_cost, lessons=min(job.sessions, MOST), seed=job.seed), pupils)
    subtasks = dict.fromkeys(problem.subtask for problem in scene().problems.values())
    costs: dict[str, dict[str, Cost]] = {}
    rows: list[Row] = []
    for skill in skills:
        rows += [result for advisor in ADVISORS for result in rows_of(skill, advisor, costs_by_pupil)]
    for subtask in subtasks:
        of = [skill for skill in skills if scene().problems[skill].subtask == subtask]
        costs[subtask] = {name: joined_costs([costs_by_pupil[Pupil(skill, name)] for skill in of]) for name in ADVISORS}
    pictures = {
        f"{subtask}: lessons that are solved after so many moves": solved_picture(of) for subtask, of in costs.items()
    }
    return Findings(
        rows, in_short(costs), {"Moves until a lesson is solved": moves_picture(costs)} | pictures, (MEASURES, SCENE)
    )


@cache
def scene() -> Prepared:
    """The scene whose skills are learned."""
    task = load(TASK)
    return prepare(task, task.order(TOASTS), SCENE_SEED)


def lessons_cost(pupil: Pupil, *, lessons: int, seed: int) -> Cost:
    """The cost of `lessons` lessons of a skill with an advisor."""
    problem = scene().problems[pupil.skill]
    how, advising = scene().task.subtask(problem.subtask), Advising.of([pupil.advisor])
    plan = LessonPlan(problem, how.learner, how.gate, TASK)
    watches = []
    for own in seeds_of(replace(pupil, advisor=""), lessons, seed):  # every advisor has the same lessons
        watch = Watch.over(problem.mdp)
        Sessions(plan, advising, int(own), Journal(), watch.hear).run()
        watches.append(watch)
    columns = zip(*((watch.solved, watch.episodes, watch.moves, watch.helped) for watch in watches), strict=True)
    solved, episodes, moves, helped = (np.array(column) for column in columns)
    return Cost(solved, episodes, moves, helped)


def joined_costs(costs: Sequence[Cost]) -> Cost:
    """The costs of several skills' lessons, joined."""
    return Cost(*(np.concatenate([getattr(cost, name) for cost in costs]) for name in Cost.__dataclass_fields__))


def rows_of(skill: str, advisor: str, costs_by_pupil: Mapping[Pupil, Cost]) -> list[Row]:
    """The measures of a skill and an advisor, and what the advisor saves compared with nobody."""
    cost, alone = costs_by_pupil[Pupil(skill, advisor)], costs_by_pupil[Pupil(skill, NOBODY)]
    named: Row = {
        "skill": skill,
        "subtask": scene().problems[skill].subtask,
        "advisor": advisor,
        "lessons": len(cost.moves),
    }
    rows = [
        share_row(named, "solved_percent", cost.solved),
        varying_row(named, "episodes_to_solve", cost.episodes),
        varying_row(named, "moves_to_solve", cost.moves),
        varying_row(named, "helped_steps", cost.helped),
    ]
    return rows if advisor == NOBODY else [*rows, saved_row(named, cost, alone)]


def saved_row(named: Row, cost: Cost, alone: Cost) -> Row:
    """The moves that a lesson saves compared with nobody [%], with the interval of the difference of the means."""
    from scipy.stats import ttest_ind

    low, high = ttest_ind(alone.moves, cost.moves, equal_var=False).confidence_interval(0.95)
    percent = 100.0 / alone.moves.mean()
    ends = None if np.isnan(low) else (low * percent, high * percent)
    return row(named, "saved_percent", (alone.moves.mean() - cost.moves.mean()) * percent, ends)


def in_short(costs: Mapping[str, Mapping[str, Cost]]) -> Row:
    """Means over the skills of a sub-task, and whether every lesson was solved."""
    says: Row = {}
    for subtask, by_advisor in costs.items():
        for name, cost in by_advisor.items():
            says[f"{subtask}, {name}: moves"] = round(float(cost.moves.mean()))
            says[f"{subtask}, {name}: helped"] = round(float(cost.helped.mean()))
            says[f"{subtask}, {name}: solved [%]"] = round(100.0 * float(cost.solved.mean()), 1)
    return says


def moves_picture(costs: Mapping[str, Mapping[str, Cost]]) -> bytes:
    """Bars of the moves until a lesson is solved, by sub-task and advisor."""
    lines = {
        name: [varying_row({}, "moves_to_solve", by_advisor[name].moves) for by_advisor in costs.values()]
        for name in ADVISORS
    }
    named = {("nobody" if name == NOBODY else name): line for name, line in lines.items()}
    return bars(list(costs), named, "moves until it is solved")


def solved_picture(by_advisor: Mapping[str, Cost]) -> bytes:
    """The share of lessons that are solved after so many moves, a curve for each advisor."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for name, cost in by_advisor.items():
            moves = np.sort(np.where(cost.solved, cost.moves, np.inf))
            share = 100.0 * np.arange(1, len(moves) + 1) / len(moves)
            axes.step(moves, share, where="post", color=COLOURS[name], label="nobody" if name == NOBODY else name)
        axes.set(xlabel="moves of the learner", ylabel="lessons solved [%]", ylim=(0, 103), xlim=(0, None))
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 5.6, 3.6)
