"""Settings of learner and gate tuned to a problem, and what that gains over its own on seeds that were not seen."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from lab.advice.advising import Advising
from lab.errors import BadInput, counted, unknown
from lab.learning.gates import GATES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import SETTINGS, LearnerSettings
from lab.learning.tuned_ranges import RANGES, USUAL, Range, Span
from lab.learning.updates import UPDATES
from lab.mdp import FloatArray
from lab.statistics import interval
from lab.studies.compared import Compared, Setting, key_of, prepared, sessions_of
from lab.studies.compared_sessions import Sessions
from lab.studies.findings import Findings, Row, mean_row, row, share_row
from lab.studies.report import write_file
from lab.studies.runner import Job
from lab.studies.tuning_figures import figures
from lab.studies.tuning_search import Trial, Values, search
from lab.teaching.subjects import Teachable

FAMILIES: dict[str, Mapping[str, Any]] = {"learner": UPDATES, "gate": GATES, "selection": SELECTIONS}
SHARES = (9, 3, 1)  # of the sessions of a trial that each rung has, one in so many: the last one has all
UNSEEN = 400  # sessions of the comparison at the end
UNSEEN_STREAM = 1_000_000  # their seeds are drawn apart from those of the rungs
FILE = "settings.toml"
OBJECTIVE = (
    "cost: the mean steps of a session's episodes (the area under the learning curve), a failed one as the step limit + 1; a "
    "session whose greedy way is not as good as can be in the end costs the step limit + 1 as a whole. gain: the cost with the "
    "problem's own settings less that with the tuned ones, session by session with the same seed, on seeds that no trial had."
)


@dataclass(frozen=True)
class Tuning:
    """What is tuned: a problem (see `lab.teaching.subjects`), who advises, settings that are held, and those looked for.

    Raises BadInput for a setting that cannot be tuned, is held as well, or is named twice, and for too few trials.
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
        """Where each setting is looked for."""
        return {name: RANGES[name] or tuple(sorted(FAMILIES[name])) for name in self.over}

    def setting(self, values: Values) -> Setting:
        """These values beside those that are held."""
        what = Compared(self.problem, (self.advisor,), {}, self.task, self.sight)
        return Setting(what, self.advisor, tuple({**self.held, **values}.items()))


def tuned(what: Tuning, job: Job) -> Findings:
    """Trials, then the best against the problem's own settings on seeds that it did not see; written beside, settings.toml.

    job.sessions: of a trial that is not given up. What the job's folder holds is not run again, so that the same command goes
    on, also with more trials. Raises BadInput for what does not fit, and WorkFailed where the folder cannot be written.
    """
    own = what.setting({}).subject().settings
    plain = vars(own.learner) | vars(own.gate)
    kept = _Kept(what, job)
    ranges = what.ranges
    first = {name: _within(plain[name], allowed) for name, allowed in ranges.items()}
    limit = own.learner.max_steps + 1
    shares = [max(2, job.sessions // share) for share in SHARES]
    total, done = what.trials * len(SHARES) + 2, 0

    def measure(rung: int, those: Sequence[Values]) -> list[float | None]:
        nonlocal done
        found = kept.sessions([what.setting(values) for values in those], shares[rung], rung)
        done += len(those)
        job.progress(done, total)
        return [None if one is None else float(costs(one, limit).mean()) for one in found]

    trials, importances = search(ranges, first, what.trials, job.seed, len(SHARES), measure)
    ended = [one for one in trials if not one.pruned]
    if not ended:
        raise BadInput("tuning: none of the settings that were tried can be: hold other ones, or tune fewer")
    best = min(ended, key=lambda one: (one.costs[-1], one.number))
    pair = kept.sessions([what.setting({}), what.setting(best.values)], UNSEEN, UNSEEN_STREAM)
    job.progress(total, total)
    before, after = (one for one in pair if one is not None)
    if job.folder is not None:
        write_file(job.folder / FILE, settings_text(what, best.values))
    return _findings(trials, importances, best, (before, after), limit)


def costs(found: Sessions, limit: int) -> FloatArray:
    """The cost of each session, (N,)."""
    return found.mean_steps * found.solved + limit * ~found.solved


def _within(value: Any, allowed: Range) -> Any:
    """A value, or what lies nearest to it among those that are tried."""
    if isinstance(allowed, Span):
        return type(allowed.low)(min(max(value, allowed.low), allowed.high))
    return value if value in allowed else allowed[0]


class _Kept:
    """Sessions of settings, read from the job's folder where they are there."""

    def __init__(self, what: Tuning, job: Job):
        own = what.setting({})
        self.job, self.problem = job, prepared(own.of, job.seed)
        key_of(own, self.problem, job)  # BadInput here for an advisor or a value that cannot be, not after the trials
        self.entries: dict[str, Any] = job.kept_as(lambda entry: (str(entry["key"]), entry))

    def sessions(self, settings: Sequence[Setting], sessions: int, stream: int) -> list[Sessions | None]:
        """So many of each setting, all with the chances of that stream; None for a setting that cannot be."""
        found: dict[str, Sessions | None] = {}
        keys: list[str] = []
        left: list[Setting] = []
        for one in settings:
            try:
                key = f"{key_of(one, self.problem, replace(self.job, sessions=sessions))}-{stream}"
            except BadInput:
                key = f"none-{len(keys)}"
                found[key] = None
            keys.append(key)
            if key in found:
                continue
            try:
                found[key] = Sessions.from_json(self.entries[key], sessions)
            except (KeyError, TypeError, ValueError, OverflowError):
                found[key] = None
                left.append(one)
        by_setting = dict(zip(settings, keys, strict=True))
        work = partial(sessions_of, sessions=sessions, seed=self.job.seed, stream=stream)
        for one, result in self.job.computed(work, left, 1):
            found[by_setting[one]] = result
            self.job.keep({"key": by_setting[one], **result.to_json()})
        return [found[key] for key in keys]


def settings_text(what: Tuning, values: Values) -> str:
    """The settings as a task file takes them: tables that are pasted into it, in place of the same names there."""
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
    trials: Sequence[Trial], importances: Mapping[str, float], best: Trial, pair: tuple[Sessions, Sessions], limit: int
) -> Findings:
    before, after = pair
    gained = costs(before, limit) - costs(after, limit)
    gain, low, high = interval(gained) if gained.any() else (0.0, 0.0, 0.0)
    rows: list[Row] = []
    for settings, found in (("own", before), ("tuned", after)):
        named = {"settings": settings, "trial": None, "setting": None}
        rows.append(mean_row(named, "cost", costs(found, limit)))
        rows.append(share_row(named, "solved_percent", found.solved))
        rows.append(mean_row(named, "helped_steps", found.helped_steps))
    rows.append(row({"settings": "tuned", "trial": None, "setting": None}, "gain", gain, (low, high)))
    rows += [
        row({"settings": None, "trial": None, "setting": name}, "importance", share)
        for name, share in importances.items()
    ]
    rows += [*_trial_rows(trials)]
    summary: Row = {
        "trials": len(trials),
        "given up early": sum(one.pruned for one in trials),
        "cost with its own settings": round(float(costs(before, limit).mean()), 2),
        "cost tuned": round(float(costs(after, limit).mean()), 2),
        "gain": f"{gain:.2f} ({low:.2f} to {high:.2f})",
        **best.values,
    }
    return Findings(rows, summary, figures(trials, importances, gained), (OBJECTIVE,))


def _trial_rows(trials: Sequence[Trial]) -> Iterator[Row]:
    for one in trials:
        if one.costs:
            settings = "given up" if one.pruned else "tried"
            yield row({"settings": settings, "trial": one.number, "setting": None}, "cost", one.costs[-1])
