"""The options of `lab run` that decide what comes of it: typed by a person, or read from the head of a run's journal."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from annotated_types import Ge, Le

from lab.errors import BadInput, unknown
from lab.production import deferred
from lab.production.cyclic_order import check_parts, mix_of
from lab.production.run_journal import RunBegan, RunJournal, read_run
from lab.sequencing import SEQUENCERS, check_method
from lab.tasks.record import hash_of
from lab.tasks.task import Task
from lab.tasks.task_file import load, whole_path
from lab.teaching.kept_session import check_alone, check_named
from lab.teaching.lesson_options import LessonOptions, SessionOptions, recorded_whole

WAYS = (
    "learned",
    "composed",
)  # what becomes of a way that is not known: learned, or put together out of shorter ones first


@dataclass(frozen=True)
class RunOptions(SessionOptions):
    """What a run depends on, by name; None or empty: not given.

    override: of the arm's speed [%]; faults: their seed; method: who finds the order, None: whom the task says; ways: WAYS.
    """

    command = "run"
    wanted = "it is no run"
    typed: ClassVar[Mapping[str, str]] = {
        "task": "TASK",
        "advisors": "--advisor",
        "asked": "--ask",
        "parts_per_cycle": "--parts-per-cycle",
    }

    task: str = "toast"
    toasts: int | None = None
    parts: str | None = None
    advisors: tuple[str, ...] = ()
    asked: str = "together"
    decide: str = "trust-weighted"
    override: Annotated[int, Ge(10), Le(100)] = 100
    seed: Annotated[int, Ge(0)] = 0
    faults: Annotated[int, Ge(0)] | None = None
    order: str | None = None
    cyclic: bool = False
    method: str | None = None
    parts_per_cycle: int | None = None
    ways: str = WAYS[0]

    def by_method(self, task: Task) -> Task:
        """The task, its order found as these options say. BadInput for an unknown method."""
        if self.method is None:
            return task
        check_method(self.method)
        return task.changed(sequencing=task.sequencing.model_copy(update={"method": self.method}))

    def to_json(self) -> dict[str, Any]:
        """A plain dict, files by their whole paths, so that they are found from another folder."""
        return asdict(self) | {"task": whole_path(self.task), "advisors": [recorded_whole(a) for a in self.advisors]}

    def ordered(self, task: Task) -> tuple[str, ...]:
        """The kinds of the ordered parts. BadInput, too, for an impossible order of the moves, and for --cyclic beside one."""
        if self.cyclic and self.order is not None:
            raise BadInput(f"--cyclic and --order {self.order}: an order is one or the other")
        order = task.ordered(self.toasts, self.parts)
        if self.parts_per_cycle is not None:
            check_parts(self.parts_per_cycle, mix_of(order), self.cyclic)
        if self.order is not None or self.cyclic:
            deferred.check_order(deferred.untimed(task, order), self.order, mix_of(order) if self.cyclic else ())
        return order

    @property
    def composes(self) -> bool:
        """Whether ways are put together out of shorter ones. Raises BadInput for ways that are neither of WAYS."""
        if self.ways not in WAYS:
            raise unknown("ways", self.ways, WAYS, "--ways")
        return self.ways == "composed"

    def lessons(self) -> LessonOptions:
        """The options of the lessons in the run."""
        return LessonOptions(
            task=self.task,
            advisors=self.advisors,
            asked=self.asked,
            decide=self.decide,
            seed=self.seed,
            toasts=self.toasts,
            parts=self.parts,
        )


def begun(options: RunOptions, task: Task, folder: Path, command: str = "run") -> RunJournal:
    """The journal of a new run in its folder. BadInput when it cannot be written."""
    return RunJournal.begin(folder, RunBegan(options.to_json(), task.name, hash_of(task), command))


def gone_on(given: RunOptions, folder: Path, out: Path | None, command: str = "run") -> tuple[RunOptions, Task]:
    """The options with which the run in a folder was begun, and its task. BadInput for other options beside it, for the run of
    another command, and when the task has changed."""
    if out is not None:
        raise BadInput(f"--out {out} beside --resume {folder}: a run is resumed in its own folder; remove --out")
    head, _, _ = read_run(folder, "--resume")
    if head.command != command:
        raise BadInput(
            f"the run in '{folder}' (--resume) was begun by lab {head.command}: "
            f"resume it with lab {head.command} --resume {folder}"
        )
    options, task = kept_task(folder, "--resume")
    if options.method is not None and options.method not in SEQUENCERS:
        raise BadInput(
            f"the run in '{folder}' (--resume) finds its order by '{options.method}', which is no method of the lab: "
            "name its code again, --method FILE.py:NAME"
        )
    if given.method == options.method:  # one's own has to be named again: no file says which code runs
        given = replace(given, method=None)
    nothing = RunOptions(task="")
    check_alone(check_named(given, options, nothing, folder), nothing, folder)
    return options, task


def kept_task(folder: Path, where: str) -> tuple[RunOptions, Task]:
    """The options with which the run in a folder was begun, and its task. BadInput when the task has changed since."""
    head, _, _ = read_run(folder, where)
    options = RunOptions.from_json(head.words, f"journal in '{folder}' ({where})")
    task = load(options.task)
    if hash_of(task) != head.task_hash:
        raise BadInput(f"run in '{folder}' ({where}): its task '{options.task}' has changed since it was begun")
    return options, task
