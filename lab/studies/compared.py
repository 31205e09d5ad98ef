"""Comparison of settings of learner, gate and advisor in one problem: many sessions each, with the same seeds for all."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from hashlib import sha256
from itertools import product
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from lab.advice.advising import Advising
from lab.advice.advisors import MODEL, not_called
from lab.errors import BadInput
from lab.files import code_key
from lab.lazy import matplotlib
from lab.learning.batch import Batch, run_sessions
from lab.learning.environment import Environment, TableEnvironment, highest_reward
from lab.learning.gates import GATES
from lab.learning.greedy import greedy_every, measure_greedy
from lab.learning.kernels.records import LANES
from lab.learning.own_rules import tell_uncompiled
from lab.learning.physics.environment import PhysicsEnvironment
from lab.learning.problem import Problem
from lab.learning.requests import Advisor, Ask
from lab.learning.session import Session
from lab.learning.simulated_advice import TableAdvisor
from lab.learning.updates import UPDATES
from lab.mdp import BoolArray, FloatArray
from lab.plugins.code_file import files_taken
from lab.statistics import interval, share
from lab.studies.charts import legend_below
from lab.studies.findings import Findings, Row, mean_row, share_row, varying_row
from lab.studies.runner import Job
from lab.tasks.record import Learned
from lab.teaching.lesson import Subject
from lab.teaching.own_members import take_again
from lab.teaching.subjects import Teachable, subject_from
from lab.version import __version__
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

Result = tuple[Row, "ComparedSessions"]
COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY)
DASHES = ("-", "--", ":", "-.")
MOST_CURVES = 12  # more could not be distinguished
MOST_DOTS = 60  # lines of a picture
MOST_ENTRIES = 4_000_000  # of the tables that are held at once, 32 MB, unless a single round of the kernel has more


def figures(results: Sequence[Result]) -> dict[str, bytes]:
    """SVG pictures by caption; if there are many settings, of the best ones."""
    ranked = sorted(results, key=lambda result: (-result[1].solved.mean(), result[1].cost.mean()))
    score = "return" if ranked[0][1].by_return else "steps"
    most = "" if len(ranked) <= MOST_DOTS else f", the best {MOST_DOTS} of {len(ranked)} settings"
    several = "" if len(ranked) <= MOST_CURVES else f", the best {MOST_CURVES} of {len(ranked)} settings"
    return {
        f"Sessions that are solved in the end, {score} and helped steps, with intervals{most}": _dots(
            ranked[:MOST_DOTS]
        ),
        f"Mean {score} of each episode{several}": _curves(ranked[:MOST_CURVES]),
    }


def words(named: Row, among: Sequence[Row]) -> str:
    """A setting in words, by the options that differ among several: "ccrl, expert, psi 0.1"."""
    varies = [name for name in named if len({repr(setting[name]) for setting in among}) > 1] or [*named][:1]
    plain = ("advisor", "gate", "learner", "selection")
    return ", ".join(str(named[name]) if name in plain else f"{name} {named[name]}" for name in varies)


def _dots(results: Sequence[Result]) -> bytes:
    """A picture with a line per setting and a column per measure."""
    names = [words(named, [other for other, _ in results]) for named, _ in results]
    by_return = results[0][1].by_return
    score = "return" if by_return else "steps"

    def draw(figure: "matplotlib.figure.Figure") -> None:
        columns = figure.subplots(1, 3, sharey=True)
        measured: list[tuple[str, list[Any]]] = [
            ("solved [%]", [share(found.solved) for _, found in results]),
            (
                f"mean {score} of an episode",
                [_mean(found.mean_return if by_return else found.mean_steps) for _, found in results],
            ),
            ("helped steps of a session", [_mean(found.helped_steps) for _, found in results]),
        ]
        for axes, (title, values) in zip(columns, measured, strict=True):
            for line, (middle, low, high) in enumerate(values):
                axes.hlines(line, low, high, color=BLUE, linewidth=1.6)
                axes.plot(middle, line, "o", color=BLUE, markersize=4)
            axes.set_title(title)
            axes.grid(axis="x")
            if not by_return or axes is not columns[1]:
                axes.set_xlim(left=0)
        columns[0].set_xlim(0, 103)
        columns[0].set_yticks(range(len(names)), names)
        columns[0].set_ylim(len(names) - 0.5, -0.5)

    return picture_bytes(draw, 9.5, 0.9 + 0.24 * len(results))


def _mean(values: Any) -> tuple[float, float, float]:
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0]), float(values[0])
    return interval(values)


def _curves(results: Sequence[Result]) -> bytes:
    by_return = results[0][1].by_return

    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes: matplotlib.axes.Axes = figure.add_subplot()
        for n, (named, measured) in enumerate(results):
            name = words(named, [other for other, _ in results])
            look: dict[str, Any] = {"color": COLOURS[n % len(COLOURS)], "linestyle": DASHES[n // len(COLOURS)]}
            curve = measured.return_curve if by_return else measured.curve
            axes.plot(np.arange(1, len(curve) + 1), curve, label=name, linewidth=1.3, **look)
        axes.set(xlabel="episode", ylabel="return" if by_return else "steps")
        if not by_return:
            axes.set_ylim(0, None)
        axes.yaxis.label.set_color(INK)
        axes.grid(axis="y")
        legend_below(figure)

    return picture_bytes(draw, 8.0, 4.2)


# ---- the sessions of a setting --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ComparedSessions:
    """The results of N sessions of E episodes: curve (E,), the mean steps by episode; all others (N,), by session.

    return_curve (E,): the mean sum of an episode's rewards; mean_return, last_return: of all episodes and of the last one;
    by_return: whether the problem has no goal, so that returns are its score. greedy_steps, greedy_last_steps: of the greedy
    policy without advice, the mean of its measurements along the way and the last one; empty where no table says what it does.
    """

    curve: FloatArray
    solved: BoolArray
    mean_steps: FloatArray
    last_steps: FloatArray
    helped_steps: FloatArray
    requests: FloatArray
    misleads: FloatArray
    rejected: BoolArray
    return_curve: FloatArray
    mean_return: FloatArray
    last_return: FloatArray
    greedy_steps: FloatArray
    greedy_last_steps: FloatArray
    by_return: bool

    @property
    def cost(self) -> FloatArray:
        """The mean score of each session, lower is better: its steps, or minus its return."""
        return -self.mean_return if self.by_return else self.mean_steps

    def to_json(self) -> dict[str, list[float]]:
        """The arrays as lists of floats, by name."""
        return {name: np.asarray(value, np.float64).tolist() for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, record: Mapping[str, list[float]]) -> "ComparedSessions":
        """The results that `to_json` wrote. Raises KeyError, TypeError or ValueError for anything else."""
        kinds: dict[str, Any] = {"solved": np.bool_, "rejected": np.bool_}
        arrays: dict[str, Any] = {
            name: np.array(record[name], kinds.get(name, np.float64)) for name in cls.__dataclass_fields__
        }
        return cls(**arrays | {"by_return": bool(record["by_return"])})


# ---- the comparison -------------------------------------------------------------------------------------------------


MEASURES = (
    "solved_percent: sessions whose final greedy path is optimal. mean_steps: of all episodes, a failed one as the "
    "step limit + 1 (the area under the learning curve). last_steps: of the last episode. helped_steps, requests, misleads, "
    "rejected_percent: of a session, as lab teach counts them. mean_return, last_return: the undiscounted sum of an episode's "
    "rewards, which is its score where there is no goal. greedy_steps: of the greedy policy without advice, after every tenth "
    "episode, in episodes that nobody learns from, mean over these (a failed one as in mean_steps); greedy_last_steps: of the "
    "last of them; both need a table of the steps. Every setting meets the same chances: session n has the same seed in each."
)


@dataclass(frozen=True)
class Compared:
    """A comparison: the problem (see `lab.teaching.subjects`), the advisors, and the values of settings by name.

    Each combination is one `ComparedSetting`. Raises BadInput for an empty list.
    """

    problem: Teachable
    advisors: Sequence[str | Advisor | Ask | type[Advisor]] = ("expert",)
    values: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    task: str | None = None
    sight: str | None = None
    files: Mapping[str, tuple[str, str]] = field(default_factory=files_taken)  # for another process

    def __post_init__(self) -> None:
        for name, several in (("advisor", self.advisors), *self.values.items()):
            if not several:
                raise BadInput(f"{name}: nothing to compare: wanted one value or several")
            classes = {one.__name__: one for one in several if isinstance(one, type)}
            for one in several:
                if name == "advisor" and isinstance(one, str) and one.startswith(MODEL):
                    raise not_called(one)
                if isinstance(one, type) and classes[one.__name__] is not one:
                    raise BadInput(f"{name}: two classes are called {one.__name__}: give one of them another name")

    def settings(self) -> "Iterator[ComparedSetting]":
        """All combinations, the first name varying slowest."""
        for values in product(*self.values.values()):
            for advisor in self.advisors:
                yield ComparedSetting(self, advisor, tuple(zip(self.values, values, strict=True)))


@dataclass(frozen=True, eq=False)
class ComparedSetting:
    """One combination: an advisor, and a value for each of the compared settings."""

    of: Compared
    advisor: str | Advisor | Ask | type[Advisor]
    values: tuple[tuple[str, Any], ...]

    @property
    def named(self) -> Row:
        """The combination by name, for rows."""
        values = {name: value.__name__ if isinstance(value, type) else value for name, value in self.values}
        return {"advisor": str(Advising.of([self.advisor])), **values}

    def subject(self) -> Subject:
        """The subject with this setting's values. Raises BadInput for an invalid value."""
        subject = subject_from(self.of.problem, self.of.task, self.of.sight)
        subject.settings = subject.settings.changed("--", **dict(self.values))
        return subject


def compared(what: Compared, job: Job) -> Findings:
    """The findings from the sessions of every setting; those in the job's folder are not repeated.

    Raises BadInput for an invalid value before any session is run.
    """
    settings = list(what.settings())
    for setting in settings:
        setting.subject()
    problem = prepared(what, job.seed)
    keys = {key_of(setting, problem, job): setting for setting in settings}
    done: dict[str, ComparedSessions] = job.kept_as(
        lambda entry: (entry["key"], ComparedSessions.from_json(entry)) if entry["key"] in keys else None
    )
    left = [key for key in keys if key not in done]
    for how in (keys[key].subject().settings for key in left if problem.environment is None):
        tell_uncompiled(how.learner.learner, how.gate.gate, job.sessions * how.learner.episodes)
    job.progress(len(done), len(keys))
    work = partial(sessions_of, sessions=job.sessions, seed=job.seed)
    for setting, measured in job.computed(work, [keys[key] for key in left], 1):
        key = key_of(setting, problem, job)
        done[key] = measured
        job.keep({"key": key, **measured.to_json()})
        job.progress(len(done), len(keys))
    results = {key: (setting.named, done[key]) for key, setting in keys.items()}
    rows = [row for named, measured in results.values() for row in rows_of(named, measured)]
    return Findings(rows, in_short(results.values()), figures([*results.values()]), (MEASURES,))


def sessions_of(setting: ComparedSetting, sessions: int, seed: int, stream: int | None = None) -> ComparedSessions:
    """The results of sessions of a setting, compiled if learner, gate and advisor are; stream: selects other seeds."""
    take_again(setting.of.files)
    subject, problem = setting.subject(), prepared(setting.of, seed)
    how, environment = subject.settings, problem.environment or TableEnvironment(problem.mdp)
    advising = replace(Advising.of([setting.advisor]), region=subject.region)
    chances = [seed, crc32(problem.mdp.signature.encode())]
    rng = np.random.default_rng(chances if stream is None else [*chances, stream])
    seeds = rng.integers(2**64, size=sessions, dtype=np.uint64)
    advisor = advising.for_session().gather(environment, how.learner, np.random.default_rng(0))
    every = greedy_every(environment, how.learner)
    at_once = problem.environment is None or isinstance(environment, PhysicsEnvironment)
    if at_once and (advisor is None or isinstance(advisor, TableAdvisor)):
        advice = None if advisor is None else advisor.advice
        # so many sessions at once that their tables, which are judged and not kept, take little memory
        some = max(LANES, MOST_ENTRIES // problem.mdp.successor.size)
        run = partial(run_sessions, environment, how.learner, how.gate, advice)
        parts = np.split(seeds, range(some, sessions, some))
        told = [
            _judged(run(part, keep_tables=True, keep_returns=True, greedy_every=every), environment, how)
            for part in parts
        ]
    else:
        told = [_alone(environment, how, advising, int(own), every) for own in seeds]
    steps, solved, rejected, helped, requests, misleads, returned, greedy = (
        np.concatenate(several) for several in zip(*told, strict=True)
    )
    measured = bool(greedy.shape[1])
    return ComparedSessions(
        curve=steps.mean(axis=0),
        solved=solved,
        mean_steps=steps.mean(axis=1),
        last_steps=steps[:, -1].astype(float),
        helped_steps=helped.astype(float),
        requests=requests.astype(float),
        misleads=misleads.astype(float),
        rejected=rejected,
        return_curve=returned.mean(axis=0),
        mean_return=returned.mean(axis=1),
        last_return=returned[:, -1],
        greedy_steps=greedy.mean(axis=1) if measured else np.zeros(0),
        greedy_last_steps=greedy[:, -1] if measured else np.zeros(0),
        by_return=highest_reward(environment) is not None,
    )


# Of N sessions of E episodes: steps (N, E), solved (N,), rejected (N,), three counts (N,): helped steps, requests, misleads; the
# returns (N, E), and the steps of the greedy policy (N, K).
Measured = tuple[NDArray[Any], BoolArray, BoolArray, NDArray[Any], NDArray[Any], NDArray[Any], FloatArray, FloatArray]


def _judged(batch: Batch, environment: Environment, how: Learned) -> Measured:
    """The results of compiled sessions, whose tables are judged and not kept."""
    solved = np.array([environment.judge(table, how.learner).solved for table in batch.q])
    counts = batch.helped_steps, batch.requests, batch.misleads
    return batch.steps, solved, batch.rejected_at_episode > 0, *counts, batch.returns, batch.greedy


def _alone(environment: Environment, how: Learned, advising: Advising, seed: int, every: int) -> Measured:
    """The results of one session that is not compiled; every: as in `measure_greedy`."""
    rng = np.random.default_rng(seed)
    advisor, greedy = advising.for_session().gather(environment, how.learner, rng), np.zeros(0)
    if every:
        greedy = np.zeros(how.learner.episodes // every)
    running = Session(environment, how.learner, how.gate, advisor, rng)
    session = running.run(enough=partial(measure_greedy, running, seed, every, greedy))
    if session.interrupted:
        raise KeyboardInterrupt
    helped, requests, misleads = (np.array([n]) for n in (session.helped_steps, session.requests, session.misleads))
    rejected, solved = np.array([session.rejected_at_episode is not None]), np.array([session.solved])
    return session.steps[None], solved, rejected, helped, requests, misleads, session.returns[None], greedy[None]


def rows_of(named: Row, measured: ComparedSessions) -> list[Row]:
    """The rows of one setting, one per measure."""
    greedy = ("greedy_steps", "greedy_last_steps") if len(measured.greedy_steps) else ()
    returns = [mean_row(named, "mean_return", measured.mean_return)]
    returns.append(varying_row(named, "last_return", measured.last_return))
    return [
        share_row(named, "solved_percent", measured.solved),
        *returns,
        mean_row(named, "mean_steps", measured.mean_steps),
        *(varying_row(named, name, getattr(measured, name)) for name in ("last_steps", "helped_steps")),
        *(varying_row(named, name, getattr(measured, name)) for name in ("requests", "misleads")),
        share_row(named, "rejected_percent", measured.rejected),
        *(varying_row(named, name, getattr(measured, name)) for name in greedy),
    ]


def in_short(results: "Iterator[tuple[Row, ComparedSessions]] | Any") -> Row:
    """The summary: the setting that solves most sessions, of equal ones that with the fewest steps, or the highest return."""
    named, best = max(results, key=lambda result: (result[1].solved.mean(), -result[1].cost.mean()))
    what = ", ".join(f"{name} {value}" for name, value in named.items())
    return {"best": what, "best solves [%]": round(100 * float(best.solved.mean()), 1)}


@lru_cache(maxsize=8)
def _surveyed(problem: str, task: str | None, sight: str | None, seed: int) -> Problem:
    return subject_from(problem, task, sight).prepare(seed)


def prepared(what: Compared, seed: int) -> Problem:
    """The problem; one with a name is surveyed once per process."""
    if isinstance(what.problem, str):
        return _surveyed(what.problem, what.task, what.sight, seed)
    return subject_from(what.problem, what.task, what.sight).prepare(seed)


def key_of(setting: ComparedSetting, problem: Problem, job: Job) -> str:
    """The key of a setting's sessions in the job's folder."""
    how = setting.subject().settings
    region = None if setting.of.sight is None else setting.of.sight
    whole: list[Any] = [__version__, problem.mdp.signature, region, setting.named, vars(how.learner), vars(how.gate)]
    advising = Advising.of([setting.advisor])
    whole += [record.said.tolist() for record in advising.check_records(problem.mdp)]
    if job.folder is not None:  # otherwise nothing is kept, and own code needs no source file
        own = UPDATES.modules_of(how.learner.learner) + GATES.modules_of(how.gate.gate) + advising.modules()
        whole.append(code_key(*own, *getattr(problem.environment, "modules", ())))
    return sha256(json.dumps([*whole, job.sessions, job.seed], default=str).encode()).hexdigest()[:24]
