"""`lab.run`: a whole task carried out in physics, and its result."""

from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, TypedDict, Unpack

from annotated_types import Ge, Le

from lab.api.options import (
    Advisors,
    ToolboxOrPlace,
    advising_of,
    check_common,
    checked,
    data_frame,
    heard_by,
    several,
    toolbox_of,
)
from lab.api.pictures import Page, Picture
from lab.errors import BadInput
from lab.files import check_out
from lab.lazy import pandas
from lab.production.composer import Conditions
from lab.production.report import Report
from lab.production.run import run as run_task
from lab.production.run_advice import RunAdvice
from lab.production.run_journal import RunJournal
from lab.production.run_options import RunOptions, begun
from lab.sequencing.cell.schedule import rows_of
from lab.sequencing.simulate.follow import simulate
from lab.skills.prepared_scene import prepare
from lab.tasks.task_file import load
from lab.teaching.events import unheard
from lab.teaching.teacher import Teacher
from lab.view.gantt import gantt
from lab.workers import Workers


class TaskOptions(TypedDict, total=False):
    """The options of `lab run`, by their names there.

    toasts: the number of parts of the first kind, 1 to 50; parts: of each kind, such as "slice=2,cup=1".
    override: of the arm's speed [%]; faults: the seed with which faults are drawn, default none.
    order: of the moves by part numbers, such as "1,2,1,1,2,2"; cyclic: the shortest cycle is repeated; parts_per_cycle: its
    most parts; method: the name of the method that finds the order; ways: "learned" (default), or "composed" of shorter ones.
    """

    toasts: int
    parts: str
    override: Annotated[int, Ge(10), Le(100)]
    faults: Annotated[int, Ge(0)]
    order: str
    cyclic: bool
    method: str
    parts_per_cycle: Annotated[int, Ge(1)]
    ways: str


@dataclass(frozen=True, eq=False)
class RunResult:
    """The result of a run, which notebooks display; report: its details; document: the dict that `lab run --json` prints."""

    report: Report
    document: dict[str, Any]
    _replay: str

    @property
    def success(self) -> bool:
        """Whether every part was delivered."""
        return self.report.success

    @property
    def failure(self) -> str | None:
        """Why the run failed, None if it did not."""
        return self.report.outcome.failure

    @property
    def makespan_s(self) -> float:
        """The duration of the work of robot and machines [s], in simulated time."""
        return self.report.outcome.schedule.makespan_s

    def rows(self) -> list[dict[str, Any]]:
        """The schedule as it was carried out: part, operation, station, resource, start_s, end_s."""
        return rows_of(self.report.outcome.schedule, self.report.taught.cell, "measured")

    def to_dataframe(self) -> "pandas.DataFrame":
        """`rows` as a DataFrame. Raises BadInput if pandas is not installed."""
        return data_frame(self.rows())

    @cached_property
    def gantt(self) -> Picture:
        """The Gantt chart: thick bars show what was carried out, thin bars what was planned."""
        planned = simulate(self.report.taught.cell, self.report.sequenced.sequence)
        return Picture.drawn(lambda path: gantt(self.report.outcome.schedule, path, predicted=planned))

    @cached_property
    def replay(self) -> Page:
        """The replay of the run in 3D."""
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
    """The result of a task whose skills are found or learned, timed, sequenced and carried out in physics.

    task: a name or a task file.
    advisor: as in `lab.teach`.
    seed: of all randomness.
    toolbox: provides and saves skills; None (default): they are learned anew and not saved.
    out: a folder for pictures, replay, numbers and the journal, which `lab run --resume` continues; None: nothing is written.
    workers: the number of processes for surveys, timing and drawing; None: one per core, at most 8; results do not depend on it.
    options: those of `lab run`, by their names there; override in percent.

    Raises BadInput if these do not fit together, WorkFailed if a skill cannot be learned. A run that fails raises nothing:
    see `RunResult.failure`.

        >>> import lab
        >>> run = lab.run("kit", parts="box=1", workers=1)
        >>> run.success, run.failure, round(run.makespan_s) == round(max(row["end_s"] for row in run.rows()))
        (True, None, True)
    """
    check_common("lab.run", seed=seed, workers=workers, out=out)
    given = checked(options, TaskOptions, "lab.run")
    advisors = several(advisor)
    advising = advising_of(advisors, toolbox)
    if out is not None and not all(isinstance(one, str) for one in advisors):
        raise BadInput(f"out '{out}' with the advisor {advising}: a journal can only name advisors that have a name")
    words = RunOptions(task=str(task), advisors=tuple(map(str, advising.names)), seed=seed, **given)
    loaded = load(words.task)
    wanted, composes = words.by_method(loaded), words.composes
    with ExitStack() as stack:
        worker_pool = stack.enter_context(Workers(workers))
        prepared = prepare(wanted, words.ordered(loaded), seed, workers=worker_pool)
        nowhere = stack.enter_context(TemporaryDirectory())
        folder = Path(nowhere) / "run" if out is None else Path(out)
        check_out(folder)
        journal = RunJournal() if out is None else begun(words, loaded, folder)
        stack.callback(journal.close)
        teacher = Teacher(
            *(toolbox_of(toolbox, f"{nowhere}/toolbox"), advising, seed, heard_by(advising, unheard)), composes=composes
        )
        advice = RunAdvice(
            *(teacher.toolbox, words.lessons(), journal, words.order or ""),
            cyclic=words.cyclic,
            parts_per_cycle=words.parts_per_cycle,
        )
        conditions = Conditions(words.override / 100, journal=journal, fault_seed=words.faults, advice=advice)
        report = run_task(prepared, teacher, folder, conditions, worker_pool)
        replay = (folder / "replay.html").read_text(encoding="utf-8")
    return RunResult(report, report.to_json() | ({"files": {}} if out is None else {}), replay)
