"""`lab.study` and `lab.compare`: many sessions, and what they come to."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.api.options import Advisors, OneAdvisor, data_frame, several
from lab.api.pictures import Picture
from lab.learning.tuned_ranges import USUAL
from lab.studies import checked, study_of
from lab.studies.compared import Compared, compared
from lab.studies.findings import Findings, Row
from lab.studies.runner import Job
from lab.studies.tuning import Tuning, tuned
from lab.teaching.subjects import Teachable

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class StudyResult:
    """What a study comes to. findings: rows, summary, pictures, remarks."""

    title: str
    findings: Findings

    @property
    def rows(self) -> list[Row]:
        """A row a measure: its settings, the value, its 95 % interval, what is printed where something is."""
        return self.findings.rows

    @property
    def summary(self) -> Row:
        """It in short."""
        return self.findings.summary

    @property
    def figures(self) -> dict[str, Picture]:
        """The pictures, by caption."""
        return {caption: Picture(data) for caption, data in self.findings.figures.items()}

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. BadInput when pandas is not installed."""
        return data_frame(self.rows)

    def report(self, path: Path | str) -> Path:
        """Write the report, one page (HTML) without network or scripts; where it is."""
        from lab.studies.report import write_report

        write_report(Path(path), self.title, self.title, self.findings)
        return Path(path)

    def __str__(self) -> str:
        return f"{self.title}: " + "; ".join(f"{name}: {value}" for name, value in self.summary.items())

    def _repr_html_(self) -> str:
        shown = "".join(f"<p>{escape(caption)}</p>{data.decode()}" for caption, data in self.findings.figures.items())
        return f"<p>{escape(str(self))}</p>{shown}"


def study(name: str, *, sessions: int | None = None, seed: int = 0, workers: int = 1, **reading: Any) -> StudyResult:
    """A study of `lab study list`; reading: the options that only some have. BadInput for what it does not know."""
    job = Job(sessions or study_of(name).sessions, seed, workers)
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
    """Every combination of advisors and of the values of settings, in many sessions each, as `lab study compare` does.

    problem, advisor, settings: as in `lab.teach`, but each setting, and the advisor, may be a list of values to compare.
    Raises BadInput for whatever does not fit.
    """
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
    """Settings tuned to a problem, and what that gains on unseen seeds, as `lab tune` does; nothing is written.

    problem, advisor: as in `lab.teach`; over: the settings that are tuned; held: others, at a value, task and sight among them.
    Raises BadInput for whatever does not fit, and where Optuna is not installed.
    """
    where = {name: held.pop(name) for name in ("task", "sight") if name in held}
    what = Tuning(problem, advisor, held, tuple(over), trials, **where)
    title = f"Tuned: {problem}" if isinstance(problem, str) else "Tuned"
    return StudyResult(title, tuned(what, Job(sessions, seed, workers)))


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | tuple) else [value]
