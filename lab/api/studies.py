"""`lab.study`, `lab.compare` and `lab.tune`: many sessions, and their results."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from lab.api.options import Advisors, OneAdvisor, check_common, data_frame, several
from lab.api.pictures import Picture
from lab.errors import BadInput
from lab.lazy import pandas
from lab.learning.settings import USUAL
from lab.studies import checked, study_of
from lab.studies.compared import Compared, compared
from lab.studies.findings import Findings, Row
from lab.studies.report import write_report
from lab.studies.runner import Job
from lab.studies.tuning import Tuning, tuned
from lab.teaching.subjects import Teachable


@dataclass(frozen=True, eq=False)
class StudyResult:
    """The result of a study, which notebooks display.

    title: in one line; findings: its rows, summary, pictures and remarks.

        >>> import lab
        >>> compared = lab.compare("world-1", sessions=4, episodes=60)
        >>> [caption.partition(",")[0] for caption in compared.figures]
        ['Sessions that are solved in the end', 'Mean steps of each episode']
    """

    title: str
    findings: Findings

    @property
    def rows(self) -> list[Row]:
        """One row per measured value: settings, measure, value, ci95 (the 95 % interval), thesis (the printed value or None)."""
        return self.findings.rows

    @property
    def summary(self) -> Row:
        """The findings in short, by name."""
        return self.findings.summary

    @property
    def figures(self) -> dict[str, Picture]:
        """The pictures, by caption."""
        return {caption: Picture(data) for caption, data in self.findings.figures.items()}

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. Raises BadInput if pandas is not installed."""
        return data_frame(self.rows)

    def report(self, path: Path | str) -> Path:
        """Writes the report, an HTML page without scripts that needs no network, and returns its path."""
        write_report(Path(path), self.title, self.title, self.findings)
        return Path(path)

    def __str__(self) -> str:
        return f"{self.title}: " + "; ".join(f"{name}: {value}" for name, value in self.summary.items())

    def _repr_html_(self) -> str:
        shown = "".join(f"<p>{escape(caption)}</p>{data.decode()}" for caption, data in self.findings.figures.items())
        return f"<p>{escape(str(self))}</p>{shown}"


def study(name: str, *, sessions: int | None = None, seed: int = 0, workers: int = 1, **reading: Any) -> StudyResult:
    """The result of a study.

    name: as `lab study list` prints it; sessions: per setting, default the study's own; seed: of all randomness; workers: the
    number of processes, on which results do not depend; reading: the options that some studies have.
    Raises BadInput for an unknown study, an option that it does not have, and too few sessions.

        >>> import lab
        >>> figure = lab.study("figure-9.4", sessions=10)
        >>> figure.rows[0]["measure"], figure.rows[0]["beta"]
        ('SP_percent', 0.5)
    """
    check_common("lab.study", sessions=sessions, seed=seed, workers=workers)
    job = Job(study_of(name).sessions if sessions is None else sessions, seed, workers)
    known = checked(name, job, reading)
    return StudyResult(known.title, known.run(job, reading))


def compare(
    problem: Teachable,
    *,
    advisor: Advisors = "expert",
    sessions: int = 100,
    seed: int = 0,
    workers: int = 1,
    task: str | None = None,
    sight: str | None = None,
    **settings: Any,
) -> StudyResult:
    """The comparison of all combinations of advisors and settings, in many sessions each.

    problem, advisor, task, sight, settings: as in `lab.teach`, but each setting, and the advisor, may be a list of values to
    compare; sessions: per combination; seed: of all randomness; workers: the number of processes, on which results do not depend.
    Raises BadInput if these do not fit together.

        >>> import lab
        >>> compared = lab.compare("world-1", advisor=["expert", "none"], sessions=10, episodes=60)
        >>> sorted({row["advisor"] for row in compared.rows})
        ['expert', 'none']
    """
    check_common("lab.compare", sessions=sessions, seed=seed, workers=workers, task=task)
    values = {name: _listed(value) for name, value in settings.items()}
    what = Compared(problem, several(advisor), values, task, sight)
    return StudyResult(
        f"Compared: {problem}" if isinstance(problem, str) else "Compared", compared(what, Job(sessions, seed, workers))
    )


def tune(
    problem: Teachable,
    *,
    advisor: OneAdvisor = "expert",
    over: Sequence[str] = USUAL,
    trials: int = 100,
    sessions: int = 45,
    seed: int = 0,
    workers: int = 1,
    **held: Any,
) -> StudyResult:
    """Settings tuned to a problem, and their gain on unseen seeds; nothing is written.

    problem, advisor: as in `lab.teach`; over: the names of the settings to tune; trials: combinations to try; sessions: per
    trial; seed: of all randomness; workers: the number of processes, on which results do not depend; held: other settings with
    fixed values, and task and sight. The gain is measured in steps an episode.
    Raises BadInput if these do not fit together, and if Optuna is not installed.

        >>> import lab
        >>> tuned = lab.tune("world-1", over=["alpha"], trials=2, sessions=2)
        >>> tuned.summary["trials"], 0.05 <= tuned.summary["alpha"] <= 1
        (2, True)
    """
    check_common("lab.tune", trials=trials, sessions=sessions, seed=seed, workers=workers)
    if isinstance(over, str) or not isinstance(over, Iterable):
        raise BadInput(f"over {over!r} (lab.tune): wanted a list of names of settings")
    where = {name: held.pop(name) for name in ("task", "sight") if name in held}
    what = Tuning(problem, advisor, held, tuple(over), trials, **where)
    title = f"Tuned: {problem}" if isinstance(problem, str) else "Tuned"
    return StudyResult(title, tuned(what, Job(sessions, seed, workers)))


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | tuple) else [value]
