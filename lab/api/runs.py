"""`lab.run`: a whole task carried out in physics, and what came of it."""

from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from lab.api.options import Advisors, ToolboxOrPlace, advising_of, checked, data_frame, several, toolbox_of
from lab.api.pictures import Page, Picture
from lab.errors import BadInput
from lab.files import check_out
from lab.production.composer import Conditions
from lab.production.report import Report
from lab.production.run import run as run_task
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunJournal
from lab.production.run_options import RunOptions, begun
from lab.sequencing.cell.schedule import rows_of
from lab.skills.prepared_scene import prepare
from lab.tasks.task_file import load
from lab.teaching.teacher import Teacher
from lab.workers import Workers

if TYPE_CHECKING:
    import pandas


class TaskOptions(TypedDict, total=False):
    """The options of `lab run`, by their names there."""

    toasts: int
    parts: str
    override: int
    faults: int
    order: str
    cyclic: bool
    method: str
    parts_per_cycle: int


@dataclass(frozen=True, eq=False)
class RunResult:
    """What a run came to. document: as `lab run --json` gives it."""

    report: Report
    document: dict[str, Any]
    _replay: str

    @property
    def success(self) -> bool:
        """Whether every part was delivered."""
        return self.report.success

    @property
    def failure(self) -> str | None:
        """Why it ended before that; None where it did not."""
        return self.report.outcome.failure

    @property
    def makespan_s(self) -> float:
        """How long the robot and the machines worked, in simulated seconds."""
        return self.report.outcome.schedule.makespan_s

    def rows(self) -> list[dict[str, Any]]:
        """The schedule as it was carried out: part, operation, station, resource, start_s, end_s."""
        return rows_of(self.report.outcome.schedule, self.report.taught.cell, "measured")

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. BadInput when pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def gantt(self) -> Picture:
        """The Gantt chart: thick as carried out, thin as planned."""
        from lab.sequencing.simulate.follow import simulate
        from lab.view.gantt import gantt

        planned = simulate(self.report.taught.cell, self.report.sequenced.sequence)
        return Picture.drawn(lambda path: gantt(self.report.outcome.schedule, path, predicted=planned))

    @cached_property
    def replay(self) -> Page:
        """The film of the run."""
        return Page(self._replay)

    def __str__(self) -> str:
        delivered = f"{len(self.report.outcome.delivered)} of {len(self.report.prepared.order)} parts"
        why = f"; {self.failure}" if self.failure else ""
        gap = f"planned {self.report.sequenced.cost:.1f} s, {100 * self.report.gap:.1f} % above what is proven"
        return f"{self.report.prepared.task.name}: {delivered} in {self.makespan_s:.1f} s ({gap}){why}"

    def _repr_html_(self) -> str:
        return f"<p>{escape(str(self))}</p>{self.replay._repr_html_()}"


def run(
    task: str | Path = "toast",
    *,
    advisor: Advisors = "expert",
    seed: int = 0,
    toolbox: ToolboxOrPlace = None,
    out: Path | str | None = None,
    workers: int | None = None,
    **options: Unpack[TaskOptions],
) -> RunResult:
    """Find or learn a task's skills, time them, order them, and carry them out in physics, as `lab run` does.

    advisor: as in `lab.teach`; toolbox: where skills are found and kept; None: they are learned anew and not kept; out: a
    folder for pictures, replay, numbers and the journal, with which `lab run --resume` goes on; None: nothing is written.
    workers: processes that survey, time moves and draw, None: one a core, at most 8; the numbers are the same.
    A run that fails raises nothing: see `RunResult.failure`. Raises BadInput for what does not fit, WorkFailed where a
    skill cannot be learned.
    """
    given = checked(options, TaskOptions, "lab.run")
    if workers is not None and workers < 1:
        raise BadInput(f"workers {workers} (lab.run): at least 1, or None for one a core")
    advisors = several(advisor)
    advising = advising_of(advisors, toolbox)
    if out is not None and not all(isinstance(one, str) for one in advisors):
        raise BadInput(f"out '{out}' with the advisor {advising}: a journal can only name advisors that have a name")
    words = RunOptions(task=str(task), advisors=tuple(map(str, advising.names)), seed=seed, **given)
    loaded = load(words.task)
    wanted = words.by_method(loaded)
    with ExitStack() as stack:
        beside = stack.enter_context(Workers(workers))
        prepared = prepare(wanted, words.ordered(loaded), seed, workers=beside)
        nowhere = stack.enter_context(TemporaryDirectory())
        folder = Path(nowhere) / "run" if out is None else Path(out)
        check_out(folder)
        journal = RunJournal() if out is None else begun(words, loaded, folder)
        stack.callback(journal.close)
        teacher = Teacher(toolbox_of(toolbox, f"{nowhere}/toolbox"), advising, seed)
        advice = RunAdvice(
            *(teacher.toolbox, words.lessons(), journal, words.order or ""),
            cyclic=words.cyclic,
            parts_per_cycle=words.parts_per_cycle,
        )
        conditions = Conditions(words.override / 100, journal=journal, fault_seed=words.faults, advice=advice)
        report = run_task(prepared, teacher, folder, conditions, beside)
        replay = (folder / "replay.html").read_text(encoding="utf-8")
    return RunResult(report, report.to_json() | ({"files": {}} if out is None else {}), replay)
