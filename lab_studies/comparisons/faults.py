"""Runs with drawn faults over all tasks in physics: is everything delivered, or does the run stop with a true reason?"""

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from lab.production.composer import PUT_RIGHT
from lab.production.faults import FAULTS
from lab.production.faults.truth import pieces, untrue
from lab.statistics import share
from lab.studies.findings import Findings, Row, row
from lab.studies.runner import Job, record_of
from lab.tasks.task_file import load
from lab.view.canvas import BLUE, GREEN, INK, ORANGE, RED, picture_bytes
from lab_studies.comparisons.attendant import COMES_AFTER_S, Attendant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lab.production.taught import Taught
    from lab.sim.frames import Body, Frame
    from lab.skills.prepared_scene import Prepared
    from lab.teaching.teacher import Teacher

TASKS: dict[str, str | None] = {  # task -> its parts; None: as many as its file says
    "toast": "slice=2",
    "toast-panda": "slice=2",
    "toast-xarm6": "slice=2",
    "two-toasters": "slice=3",
    "breakfast": None,
    "sorting": None,
    "fms-arm": None,
}
CAME = {"delivered": BLUE, "attended": GREEN, "stopped": ORANGE, "wrong": RED}
LONGEST = 20.0  # a run that takes so many times the planned time counts as hanging
ABOUT = (
    "{runs} runs of {tasks}. Each has one or two faults; what happens, to what and when is drawn from its seed. They are "
    "carried out in physics, and the composer is not told of them. Delivered: all parts stand at the end of their routes, and "
    "nobody helped. A run that stops is carried out once more with a scripted person, who comes {comes:g} s after each stop, "
    "does what the run asks for (stands a part up, brings it back, repairs a machine, removes an obstacle) and lets it "
    "continue. Attended: all parts were delivered then. Stopped: some were not, and each reason that the run gives is about a "
    "fault that had struck, and can be true of its kind. Wrong: a reason or a request that no fault explains, a part that is "
    "missing without a reason, a finding of the audit, or a run that takes {longest:g} times as long as planned."
)
COLUMNS = (
    "A run counts under each kind of fault that struck in it. noticed_percent: the faults of a kind that the run reported; one "
    "that needs no answer, such as a box that blocks no path, may go unnoticed. "
    "None: no fault could strike, for example because nothing was carried any more."
)


@dataclass(frozen=True)
class Setting:
    """One run: a task, and the seed of its faults."""

    task: str
    seed: int


@dataclass(frozen=True)
class RunOutcome:
    """The outcome of a run: one of CAME, and why; rows: its faults, see `verdict`. Times in seconds.

    asked: the requests to the person who attended the run; did: what the person did. Both are empty for runs without one.
    """

    came: str
    why: str
    failure: str
    rows: list[dict[str, Any]]
    unexplained: list[str]
    drawn: list[str]
    delivered: int
    parts: int
    makespan_s: float
    planned_s: float
    wall_s: float
    asked: list[str] = field(default_factory=list)
    did: list[str] = field(default_factory=list)


def faults(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of as many runs as there are sessions, divided among TASKS; the reading has no effect."""
    names = [*TASKS]
    settings = [Setting(names[n % len(names)], job.seed + n) for n in range(job.sessions)]
    runs = measured(job, settings)
    rows = [*rows_of("task", {name: [r for s, r in runs.items() if s.task == name] for name in names})]
    kinds = [*FAULTS, "none"]
    rows += rows_of("fault", {kind: [r for r in runs.values() if kind in kinds_struck(r)] for kind in kinds})
    rows += rows_of("", {"all": [*runs.values()]})
    wrong = [f"{s.task}, seed {s.seed}: {r.why}" for s, r in runs.items() if r.came == "wrong"]
    words = ABOUT.format(runs=len(runs), tasks=", ".join(names), longest=LONGEST, comes=COMES_AFTER_S)
    figures = {"What came of the runs, by task": picture(rows, "task"), "and by fault": picture(rows, "fault")}
    return Findings(rows, in_short([*runs.values()]), figures, (words, COLUMNS, *(f"Wrong: {why}." for why in wrong)))


def kinds_struck(ran: RunOutcome) -> list[str]:
    """The kinds of the faults that struck, or ["none"]."""
    return [str(fault["what"]) for fault in ran.rows] or ["none"]


def measured(job: Job, settings: Sequence[Setting]) -> dict[Setting, RunOutcome]:
    """The outcome of every run; the job's folder keeps them."""
    kept = job.kept_as(lambda entry: (record_of(Setting, entry["setting"]), record_of(RunOutcome, entry["ran"])))
    done: dict[Setting, RunOutcome] = {setting: ran for setting, ran in kept.items() if setting in settings}
    left = [setting for setting in settings if setting not in done]
    left.sort(key=lambda setting: (setting.task, setting.seed))
    job.progress(len(done), len(settings))
    for setting, ran in job.computed(run_outcome, left):
        done[setting] = ran
        job.keep({"setting": asdict(setting), "ran": asdict(ran)})
        job.progress(len(done), len(settings))
    return {setting: done[setting] for setting in settings}


class _TooLong(Exception):
    """Raised to end a run that takes too long."""


@dataclass
class _Clock:
    """A viewer that ends a run which takes too long."""

    limit_s: float

    def show(self, bodies: "tuple[Body, ...]") -> None:
        """Do nothing."""

    def update(self, frame: "Frame") -> None:
        """Raise _TooLong once the limit is passed."""
        if frame.time_s > self.limit_s:
            raise _TooLong(f"the run had not ended after {frame.time_s:.0f} s")


@dataclass
class _Ready:
    """A task that was prepared and taught once, for all runs of a process."""

    prepared: "Prepared"
    taught: "Taught"
    teacher: "Teacher"
    sequence: tuple[int, ...]
    planned_s: float
    folder: Any = field(repr=False)


@lru_cache(maxsize=len(TASKS))
def _ready(name: str) -> _Ready:
    from lab.production.taught import teach_all
    from lab.sequencing import find_sequence
    from lab.skills.prepared_scene import prepare
    from lab.tasks.sequencing import search_for
    from lab.teaching.teacher import Teacher
    from lab.toolbox.registry import Toolbox

    task, folder = load(name), TemporaryDirectory(prefix="lab-faults-")
    prepared = prepare(task, task.ordered(parts=TASKS.get(name)), 0)
    teacher = Teacher(Toolbox(Path(folder.name)))
    taught = teach_all(prepared, teacher)
    order = find_sequence(taught.cell, task.sequencing.method, search_for(task.sequencing), 0)
    return _Ready(prepared, taught, teacher, tuple(order.sequence), order.cost, folder)


def run_outcome(setting: Setting) -> RunOutcome:
    """The outcome of one run with its random faults, repeated with a person if it stops."""
    alone = _single_run(setting, None)
    if alone.came != "stopped":
        return alone
    person = Attendant()
    ran = _single_run(setting, person)
    came = "attended" if ran.came == "delivered" else ran.came
    return replace(ran, came=came, asked=person.asked, did=person.did, wall_s=alone.wall_s + ran.wall_s)


def _single_run(setting: Setting, person: Attendant | None) -> RunOutcome:
    """The outcome of one run, attended by a person, or by nobody (None)."""
    from lab.production.composer import Conditions, carry_out
    from lab.production.faults.injector import draw
    from lab.production.taught import Relearner

    ready, began = _ready(setting.task), time.perf_counter()
    prepared, planned_s = ready.prepared, ready.planned_s
    drawn = draw(prepared.task, prepared.order, setting.seed, planned_s)

    ran = RunOutcome(
        "wrong", "", "", [], [], [fault.what for fault in drawn], 0, len(prepared.order), 0.0, planned_s, 0.0
    )
    try:
        conditions = Conditions(faults=drawn, viewer=_Clock(LONGEST * planned_s))
        if person is not None:
            conditions = replace(conditions, controls=person, on_floor=person.on_floor, before_step=person.before_step)
        relearner = Relearner(prepared, ready.taught, ready.teacher)
        outcome, _ = carry_out(prepared, ready.taught.cell, ready.sequence, conditions, relearner=relearner)
    except Exception as error:  # a run may end with no exception at all
        return replace(ran, why=f"{type(error).__name__}: {error}", wall_s=time.perf_counter() - began)
    cell = ready.taught.cell
    verdict = outcome.verdict([cell.part_name(part) for part in range(1, cell.parts + 1)])
    wrong = [verdict.why] if verdict.came == "wrong" else []
    if not outcome.happened and outcome.failure is not None:  # without a fault no reason can be true
        wrong.append("it stopped, and no fault had struck")
    if outcome.audit is not None and outcome.audit.findings:
        wrong.append(str(outcome.audit.failure))
    called = [why.removesuffix(PUT_RIGHT) for why in (person.asked if person else ()) if why.endswith(PUT_RIGHT)]
    asked = [piece for why in called for piece in pieces(why)]
    wrong += [f"no fault explains what it asked: {reason}" for reason in untrue(asked, outcome.happened)]
    return replace(
        ran,
        came="wrong" if wrong else verdict.came,
        why="; ".join(wrong),
        failure=outcome.failure or "",
        rows=[*verdict.rows],
        unexplained=[*verdict.unexplained],
        delivered=len(outcome.delivered),
        makespan_s=outcome.sim_s,
        wall_s=time.perf_counter() - began,
    )


def rows_of(by: str, groups: Mapping[str, Sequence[RunOutcome]]) -> list[Row]:
    """For each group, the shares of outcomes of its runs [%], and the share of its faults that were noticed."""
    rows: list[Row] = []
    for name, runs in groups.items():
        if not runs:
            continue
        named: Row = {by or "group": name, "runs": len(runs)}
        for came in CAME:
            percent, *ends = share([ran.came == came for ran in runs])
            rows.append(row(named, f"{came}_percent", percent, ends))
        noticed = [
            fault["noticed"] is not None for ran in runs for fault in ran.rows if by != "fault" or fault["what"] == name
        ]
        if noticed:
            percent, *ends = share(noticed)
            rows.append(row(named, "noticed_percent", percent, ends))
        rows.append(
            row(named, "parts_delivered_percent", 100 * sum(r.delivered for r in runs) / sum(r.parts for r in runs))
        )
    return rows


def in_short(runs: Sequence[RunOutcome]) -> Row:
    """The numbers of runs by outcome."""
    came = Counter(ran.came for ran in runs)
    says: Row = {"runs": len(runs), **{name: came[name] for name in CAME}}
    says["delivered or attended percent"] = round(100 * (came["delivered"] + came["attended"]) / max(1, len(runs)), 2)
    says["delivered or stopped percent"] = round(100 * (len(runs) - came["wrong"]) / max(1, len(runs)), 2)
    says["faults that struck"] = sum(len(ran.rows) for ran in runs)
    says["runs without one"] = sum(not ran.rows for ran in runs)
    says["parts delivered"] = f"{sum(ran.delivered for ran in runs)} of {sum(ran.parts for ran in runs)}"
    return says


def picture(rows: Sequence[Row], by: str) -> bytes:
    """A picture with a bar for each task or kind of fault: the shares of the outcomes of its runs."""
    names = list(dict.fromkeys(result[by] for result in rows if by in result))

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        left = [0.0] * len(names)
        for came, colour in CAME.items():
            own = {row[by]: row["value"] for row in rows if row.get(by) and row["measure"] == f"{came}_percent"}
            values = [own[name] for name in names]
            axes.barh(names, values, left=left, color=colour, edgecolor=INK, linewidth=0.5, label=came)
            left = [a + b for a, b in zip(left, values, strict=True)]
        axes.invert_yaxis()
        axes.set(xlim=(0, 100), xlabel="runs [%]")
        figure.legend(loc="outside lower center", ncols=len(CAME))

    return picture_bytes(draw, 6.5, 1.4 + 0.32 * len(names))
