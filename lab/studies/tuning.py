"""Tuning of the settings of learner and gate to a problem, and the gain over its own settings on unseen seeds."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any
from warnings import simplefilter

import numpy as np

from lab.advice.advising import Advising
from lab.errors import BadInput, counted, unknown
from lab.lazy import matplotlib, optuna
from lab.learning.gates import GATES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import RANGES, SETTINGS, USUAL, LearnerSettings, Range, Span
from lab.learning.updates import UPDATES
from lab.mdp import FloatArray
from lab.optional import require
from lab.statistics import interval
from lab.studies.compared import Compared, ComparedSessions, ComparedSetting, key_of, prepared, sessions_of
from lab.studies.findings import Findings, Row, mean_row, row, share_row
from lab.studies.report import write_file
from lab.studies.runner import Job
from lab.teaching.subjects import Teachable
from lab.view.canvas import BLUE, GREY, INK, ORANGE, picture_bytes

BATCH = 8  # trials per round, whatever the number of workers
Values = dict[str, Any]
# (rung, settings that are still in it) -> their costs, None for invalid settings
Measure = Callable[[int, Sequence[Values]], list[float | None]]


@dataclass(frozen=True)
class Trial:
    """One trial: its settings, their cost on each rung that they reached, and whether they were pruned before the last."""

    number: int
    values: Values
    costs: tuple[float, ...]
    pruned: bool


def search(
    ranges: Mapping[str, Range], first: Values, trials: int, seed: int, rungs: int, measure: Measure
) -> tuple[list[Trial], dict[str, float]]:
    """(trials, importances): the trials in order, and the importance of each setting (shares of 1; empty if unknown).

    first: the settings of the first trial. On each rung but the last a trial is pruned if it is worse than the median of the
    finished ones. Source of the sampler: Bergstra et al., NIPS 24 (2011); of the importances: Watanabe et al.,
    IJCAI 2023. Raises BadInput if Optuna is not installed.
    """
    _load_optuna()
    kinds = {name: _distribution(allowed) for name, allowed in ranges.items()}
    study = optuna.create_study(
        sampler=optuna.samplers.TPESampler(seed=seed, constant_liar=True),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=BATCH),
    )
    study.enqueue_trial(first)
    done: list[Trial] = []
    while len(done) < trials:
        asked = [study.ask(kinds) for _ in range(min(BATCH, trials - len(done)))]
        costs: dict[int, list[float]] = {trial.number: [] for trial in asked}
        left, given_up = list(asked), set()
        for rung in range(rungs):
            measured = measure(rung, [trial.params for trial in left])
            for trial, cost in zip(list(left), measured, strict=True):
                if cost is not None:
                    costs[trial.number].append(cost)
                    trial.report(cost, rung)
                if cost is None or (rung < rungs - 1 and trial.should_prune()):
                    given_up.add(trial.number)
            left = [trial for trial in left if trial.number not in given_up]
        for trial in asked:
            pruned = trial.number in given_up
            state = optuna.trial.TrialState
            if not costs[trial.number]:
                study.tell(trial, state=state.FAIL)
            elif pruned:
                study.tell(trial, state=state.PRUNED)
            else:
                study.tell(trial, costs[trial.number][-1])
            done.append(Trial(trial.number, trial.params, tuple(costs[trial.number]), pruned))
    return done, _importances(study)


def _load_optuna() -> None:
    require("tuning", optuna)
    simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
    optuna.logging.set_verbosity(optuna.logging.ERROR)


def _distribution(allowed: Range) -> Any:
    if not isinstance(allowed, Span):
        return optuna.distributions.CategoricalDistribution(allowed)
    if isinstance(allowed.low, int) and isinstance(allowed.high, int):
        return optuna.distributions.IntDistribution(allowed.low, allowed.high, log=allowed.log)
    return optuna.distributions.FloatDistribution(allowed.low, allowed.high, log=allowed.log)


def _importances(study: Any) -> dict[str, float]:
    ended = study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    if len({trial.value for trial in ended}) < BATCH:
        return {}
    evaluator = optuna.importance.PedAnovaImportanceEvaluator()
    importances = optuna.importance.get_param_importances(study, evaluator=evaluator)
    return {name: float(share) for name, share in importances.items()}


# ---- the figures ----------------------------------------------------------------------------------------------------


def figures(trials: Sequence[Trial], importances: Mapping[str, float], gained: FloatArray) -> dict[str, bytes]:
    """SVG pictures by caption; gained: (N,), the gain of each unseen session."""
    drawn = {"Gain of each session over the problem's own settings, on unseen seeds": _gain(gained)}
    if importances:
        drawn["Which settings the cost hangs on"] = _importance(importances)
    return drawn | {"Cost of each trial, and the best so far": _history(trials)}


def _gain(gained: FloatArray) -> bytes:
    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        axes.hist(gained, bins=30, color=BLUE)
        axes.axvline(0.0, color=INK, linewidth=1.0)
        axes.axvline(float(gained.mean()), color=ORANGE, linewidth=1.6, label="mean")
        axes.set_xlabel("steps an episode less than with its own settings")
        axes.set_ylabel("sessions")
        axes.legend()

    return picture_bytes(draw, 6.5, 3.0)


def _importance(importances: Mapping[str, float]) -> bytes:
    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        axes.barh(range(len(importances)), [100 * importance for importance in importances.values()], color=BLUE)
        axes.set_yticks(range(len(importances)), list(importances))
        axes.invert_yaxis()
        axes.set_xlabel("share of the importance [%]")

    return picture_bytes(draw, 6.5, 0.9 + 0.26 * len(importances))


def _history(trials: Sequence[Trial]) -> bytes:
    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        for pruned, colour, name in ((True, GREY, "given up early"), (False, BLUE, "tried to the end")):
            shown = [trial for trial in trials if trial.pruned == pruned and trial.costs]
            axes.plot(
                [trial.number for trial in shown],
                [trial.costs[-1] for trial in shown],
                "o",
                ms=4,
                color=colour,
                label=name,
            )
        ended = [trial for trial in trials if not trial.pruned]
        best = np.minimum.accumulate([trial.costs[-1] for trial in ended])
        axes.step([trial.number for trial in ended], best, where="post", color=ORANGE, label="best so far")
        axes.set_xlabel("trial")
        axes.set_ylabel("cost [steps an episode]")
        axes.legend()

    return picture_bytes(draw, 6.5, 3.2)


# ---- a tuning and its findings --------------------------------------------------------------------------------------


FAMILIES: dict[str, Mapping[str, Any]] = {"learner": UPDATES, "gate": GATES, "selection": SELECTIONS}
SHARES = (9, 3, 1)  # each rung has the sessions of a trial divided by this; the last one has all
UNSEEN = 400  # sessions of the comparison at the end
UNSEEN_STREAM = 1_000_000  # the stream of their seeds, apart from those of the rungs
FILE = "settings.toml"
OBJECTIVE = (
    "cost: the mean steps of a session's episodes (the area under the learning curve), a failed one as the step limit + 1; a "
    "session whose final greedy path is not optimal costs the step limit + 1 as a whole. gain: the cost with the "
    "problem's own settings less that with the tuned ones, session by session with the same seed, on seeds that no trial had."
)


@dataclass(frozen=True)
class Tuning:
    """A tuning: the problem (see `lab.teaching.subjects`), the advisor, settings with fixed values, the settings to tune.

    Raises BadInput for a setting that cannot be tuned, is also held, or is named twice, and for fewer than one trial.
    """

    problem: Teachable
    advisor: Any = "expert"
    held: Mapping[str, Any] = field(default_factory=dict)
    over: Sequence[str] = USUAL
    trials: int = 100
    task: str | None = None
    sight: str | None = None

    def __post_init__(self) -> None:
        for name in self.over:
            if name not in RANGES:
                raise unknown("setting to tune", name, RANGES, "--over")
            if name in self.held or list(self.over).count(name) > 1:
                raise BadInput(f"setting '{name}' (--over): it is named twice, or held at a value")
        if not self.over or self.trials < 1:
            raise BadInput(
                f"{counted(self.trials, 'trial')} over {counted(len(self.over), 'setting')}: wanted one or more"
            )

    @property
    def ranges(self) -> dict[str, Range]:
        """The search range of each setting."""
        return {name: RANGES[name] or tuple(sorted(FAMILIES[name])) for name in self.over}

    def setting(self, values: Values) -> ComparedSetting:
        """The setting with these values and the held ones."""
        what = Compared(self.problem, (self.advisor,), {}, self.task, self.sight)
        return ComparedSetting(what, self.advisor, tuple({**self.held, **values}.items()))


def tuned(what: Tuning, job: Job) -> Findings:
    """The findings: the trials, and the best one compared with the problem's own settings on unseen seeds.

    job.sessions: of a trial that is not pruned. Sessions in the job's folder are not repeated, so the same command continues,
    also with more trials; settings.toml is written there. Raises BadInput for unsuitable settings, WorkFailed if a file cannot be
    written.
    """
    own = what.setting({}).subject().settings
    plain = vars(own.learner) | vars(own.gate)
    kept = _KeptSessions(what, job)
    ranges = what.ranges
    first = {name: _within(plain[name], allowed) for name, allowed in ranges.items()}
    limit = own.learner.max_steps + 1
    shares = [max(2, job.sessions // share) for share in SHARES]
    total, done = what.trials * len(SHARES) + 2, 0

    def measure(rung: int, those: Sequence[Values]) -> list[float | None]:
        nonlocal done
        measured = kept.sessions([what.setting(values) for values in those], shares[rung], rung)
        done += len(those)
        job.progress(done, total)
        return [None if sessions is None else float(costs(sessions, limit).mean()) for sessions in measured]

    trials, importances = search(ranges, first, what.trials, job.seed, len(SHARES), measure)
    ended = [trial for trial in trials if not trial.pruned]
    if not ended:
        raise BadInput("tuning: none of the settings that were tried can be: hold other ones, or tune fewer")
    best = min(ended, key=lambda trial: (trial.costs[-1], trial.number))
    pair = kept.sessions([what.setting({}), what.setting(best.values)], UNSEEN, UNSEEN_STREAM)
    job.progress(total, total)
    before, after = (sessions for sessions in pair if sessions is not None)
    if job.folder is not None:
        write_file(job.folder / FILE, settings_text(what, best.values))
    return _findings(trials, importances, best, (before, after), limit)


def costs(measured: ComparedSessions, limit: int) -> FloatArray:
    """The cost of each session, (N,)."""
    return measured.mean_steps * measured.solved + limit * ~measured.solved


def _within(value: Any, allowed: Range) -> Any:
    """The value, or the nearest one in the search range."""
    if isinstance(allowed, Span):
        return type(allowed.low)(min(max(value, allowed.low), allowed.high))
    return value if value in allowed else allowed[0]


class _KeptSessions:
    """The sessions of settings, which are read from the job's folder if they are there."""

    def __init__(self, what: Tuning, job: Job):
        own = what.setting({})
        self.job, self.problem = job, prepared(own.of, job.seed)
        key_of(own, self.problem, job)  # raises BadInput for an invalid advisor or value before any trial
        self.kept = job.kept_as(lambda entry: (str(entry["key"]), ComparedSessions.from_json(entry)))

    def sessions(
        self, settings: Sequence[ComparedSetting], sessions: int, stream: int
    ) -> list[ComparedSessions | None]:
        """The sessions of each setting, with the seeds of that stream; None for an invalid setting."""
        by_key: dict[str, ComparedSessions | None] = {}
        keys: list[str] = []
        left: list[ComparedSetting] = []
        for setting in settings:
            try:
                key = f"{key_of(setting, self.problem, replace(self.job, sessions=sessions))}-{stream}"
            except BadInput:
                key = f"none-{len(keys)}"
                by_key[key] = None
            keys.append(key)
            if key in by_key:
                continue
            by_key[key] = self.kept.get(key)
            if by_key[key] is None:
                left.append(setting)
        by_setting = dict(zip(settings, keys, strict=True))
        work = partial(sessions_of, sessions=sessions, seed=self.job.seed, stream=stream)
        for setting, result in self.job.computed(work, left, 1):
            by_key[by_setting[setting]] = result
            self.job.keep({"key": by_setting[setting], **result.to_json()})
        return [by_key[key] for key in keys]


def settings_text(what: Tuning, values: Values) -> str:
    """The settings as TOML tables for a task file."""
    where = ""
    if isinstance(what.problem, str):
        problem = prepared(what.setting({}).of, 0)
        where = "" if problem.subtask in ("world", "gym") else f"subtasks.{problem.subtask}."
    named = dict(what.held) | values
    of_learner = {name for name in named if hasattr(LearnerSettings, name)}
    lines = [f"# Tuned for {what.problem}, advisor {Advising.of([what.advisor])}."]
    for table, names in (("learner", of_learner), ("gate", {*named} - of_learner)):
        if names:
            lines += [
                "",
                f"[{where}{table}]",
                *(f"{name} = {_toml(named[name])}" for name in SETTINGS if name in names),
            ]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    return json.dumps(value.__name__ if isinstance(value, type) else value)


def _findings(
    trials: Sequence[Trial],
    importances: Mapping[str, float],
    best: Trial,
    pair: tuple[ComparedSessions, ComparedSessions],
    limit: int,
) -> Findings:
    before, after = pair
    gained = costs(before, limit) - costs(after, limit)
    gain, low, high = interval(gained) if gained.any() else (0.0, 0.0, 0.0)
    rows: list[Row] = []
    for settings, measured in (("own", before), ("tuned", after)):
        named = {"settings": settings, "trial": None, "setting": None}
        rows.append(mean_row(named, "cost", costs(measured, limit)))
        rows.append(share_row(named, "solved_percent", measured.solved))
        rows.append(mean_row(named, "helped_steps", measured.helped_steps))
    rows.append(row({"settings": "tuned", "trial": None, "setting": None}, "gain", gain, (low, high)))
    rows += [
        row({"settings": None, "trial": None, "setting": name}, "importance", share)
        for name, share in importances.items()
    ]
    rows += [*_trial_rows(trials)]
    summary: Row = {
        "trials": len(trials),
        "given up early": sum(trial.pruned for trial in trials),
        "cost with its own settings": round(float(costs(before, limit).mean()), 2),
        "cost tuned": round(float(costs(after, limit).mean()), 2),
        "gain": f"{gain:.2f} ({low:.2f} to {high:.2f})",
        **best.values,
    }
    return Findings(rows, summary, figures(trials, importances, gained), (OBJECTIVE,))


def _trial_rows(trials: Sequence[Trial]) -> Iterator[Row]:
    for trial in trials:
        if trial.costs:
            settings = "given up" if trial.pruned else "tried"
            yield row({"settings": settings, "trial": trial.number, "setting": None}, "cost", trial.costs[-1])
