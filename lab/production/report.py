"""What a run is made of and what it leaves behind: its records, its pictures, its replay with a story, its numbers as JSON."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from lab.audit.tracks import FILE as FRAMES
from lab.audit.tracks import packed, tracks_of
from lab.errors import LabError, WorkFailed
from lab.export.program import PROGRAM, TRAJECTORY
from lab.files import csv_of, draft, read_limited, write_whole
from lab.operating_system import replace
from lab.production.cyclic_order import measured_period
from lab.production.order_learning import OrderLearning
from lab.production.outcome import Outcome
from lab.production.taught import Taught
from lab.sequencing.cell.cell import EVERY_PLAN
from lab.sequencing.cell.schedule import COLUMNS, Schedule, rows_of
from lab.sequencing.cyclic.several import Rhythm
from lab.sequencing.methods.exact import Optimum
from lab.sequencing.search import SequenceResult
from lab.sequencing.simulate.follow import simulate
from lab.sim.frames import Recording
from lab.skills import Skill
from lab.skills.prepared_scene import Prepared
from lab.teaching.events import (
    Event,
    MachineFailed,
    MoveBegan,
    OperatorActed,
    PartDone,
    PartLost,
    PlanMade,
    RunHeld,
    RunWentOn,
    SkillBegan,
    TroubleMet,
)
from lab.teaching.lesson_plan import Lesson
from lab.toolbox.policy import Policy
from lab.view.gantt import gantt
from lab.view.meshcat import replay_html
from lab.view.plots import learning_curves, values_seen
from lab.view.scene_data import Mark, Story
from lab.vision import write_picture
from lab.workers import Workers, WorkerTask

LEAST_WAIT_S = 0.5  # that is worth a word
FILES = {
    "gantt": "gantt.png",
    "order_learning": "order-learning.png",
    "learning_curves": "learning-curves.png",
    "value_map": "insert-value-map.png",
    "overhead": "overhead.png",
    "replay": "replay.html",
    "sequence": "sequence.json",
    "schedule_table": "schedule.csv",
    "schedule": "schedule.json",
    "frames": FRAMES,
    "program": PROGRAM,
    "trajectory": TRAJECTORY,
    "run": "run.json",
}


@dataclass
class _Story:
    """What people read of a run's events."""

    captions: list[tuple[float, str]] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    begins_s: list[float] = field(default_factory=list)

    def hear(self, event: Event) -> None:
        """Add the captions and marks of an event."""
        match event:
            case SkillBegan(words=words, at_s=at_s):
                self._say(at_s, f"The robot {words}")
            case MoveBegan(part=part, origin=origin, target=target, at_s=at_s):
                self.begins_s.append(at_s)
                self._say(at_s, f"The robot brings {part} from '{origin}' to '{target}'")
            case PartDone(part, at_s):
                self._say(at_s, f"{part} is done")
            case PartLost(part, why, at_s):
                self._mark(Mark(at_s, "lost", f"{part} is given up: {why}"))
            case TroubleMet(what, answer, part, _, at_s):
                self._mark(Mark(at_s, "trouble", f"{part}: {what}; {answer}" if part else f"{what}; {answer}"))
            case MachineFailed(station, part, why, at_s):
                self._mark(Mark(at_s, "trouble", f"'{station}' with {part}: {why}"))
            case RunHeld(kind, why, by, at_s):
                self._mark(Mark(at_s, "stop", f"{held_words(kind)} by the {by}{why and f': {why}'}"))
            case RunWentOn(at_s):
                self._say(at_s, "The run goes on")
            case OperatorActed(words, _, at_s, refused):
                self._mark(Mark(at_s, "operator", f"{words}{refused and f': refused, {refused}'}"))
            case PlanMade(at_s=at_s, why=why, method=by) if why:
                self._say(at_s, f"A new plan{by and f' by {by}'}: {why}")

    def _say(self, at_s: float, words: str) -> None:
        self.captions.append((round(at_s, 3), words))

    def _mark(self, mark: Mark) -> None:
        self.marks.append(mark)
        self._say(mark.at_s, mark.words)


def story_of(outcome: Outcome, planned: Schedule | None) -> Story:
    """The story of a run for its replay: captions and marks, the measured schedule beside the plan, the faults that struck."""
    story = _Story()
    for event in outcome.heard:
        story.hear(event)
    schedule = outcome.schedule
    names = {activity.part: activity.resource for activity in schedule.parts}
    for did in schedule.robot:
        if did.kind == "wait" and did.end_s - did.start_s > LEAST_WAIT_S:
            story._say(did.start_s, f"The robot waits at '{did.origin}' for {names.get(did.part, 'its part')}")
    struck = tuple(Mark(fault.at_s, "fault", fault.words) for fault in outcome.happened)
    return Story(schedule, planned, tuple(story.captions), (*story.marks, *struck), tuple(story.begins_s))


def held_words(kind: str) -> str:
    """A kind of stop in words."""
    return "paused" if kind == "pause" else f"{kind} stop"


@dataclass
class Report:
    """What a whole run came to; `began_s` is the clock's reading (`time.perf_counter`) when it began.

    method: by what the sequence was found (see `lab.sequencing.method_in_words`). files: by name, those that are written;
    missing: why another one could not be. learning: how the order, or the one beside it, was found.
    """

    prepared: Prepared
    taught: Taught
    sequenced: SequenceResult
    method: str
    proven: Optimum
    outcome: Outcome
    recording: Recording
    began_s: float
    wall_s: float = 0.0
    files: dict[str, str] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    receipts: dict[str, Any] | None = None
    rhythm: Rhythm | None = None
    learning: OrderLearning | None = None

    @property
    def success(self) -> bool:
        """Whether every part was delivered."""
        return self.outcome.failure is None and len(self.outcome.delivered) == len(self.prepared.order)

    @property
    def gap(self) -> float:
        """How much longer the used sequence takes than the proven optimum (or the bound), as a fraction of it."""
        return self.proven.gap(self.predicted_s)

    @property
    def predicted_s(self) -> float:
        """The makespan of the used sequence by the planned times [s], whatever it was judged by."""
        return simulate(self.taught.cell, self.sequenced.sequence).makespan_s

    @property
    def lost(self) -> str:
        """What could not be written, in words; "" where nothing is missing."""
        return "; ".join(f"'{FILES[name]}' is missing: {why}" for name, why in self.missing.items())

    def to_json(self) -> dict[str, Any]:
        """The document of `lab run --json`."""
        outcome, prepared, cell = self.outcome, self.prepared, self.taught.cell
        verdict = outcome.verdict([cell.part_name(part) for part in range(1, cell.parts + 1)])
        return {
            "task": prepared.task.name,
            "seed": prepared.seed,
            "toasts": len(prepared.order),
            "parts": {kind: prepared.order.count(kind) for kind in dict.fromkeys(prepared.order)},
            "success": self.success,
            "delivered": len(outcome.delivered),
            "dropped": len(outcome.dropped),
            "failure": outcome.failure,
            "retries": list(outcome.retries),
            "skills": list(self.taught.rows.values()),
            "sequence": list(self.sequenced.sequence),
            "method": self.method,
            "order_learning": None if self.learning is None else self.learning.to_json(),
            "replanned": [asdict(replan) for replan in outcome.replanned],
            "predicted_makespan_s": self.predicted_s,
            "measured_makespan_s": outcome.schedule.makespan_s if self.success else None,
            "optimal_makespan_s": self.proven.optimal_s,
            "bound_s": self.proven.bound_s,
            "optimality_gap": self.gap,
            "optimum_proven": self.proven.proven,
            "proven_of": EVERY_PLAN,
            "camera_deviation_m": max(outcome.camera_deviations_m, default=None),
            "sim_s": outcome.sim_s - outcome.skipped_s + self.taught.durations.sim_s,
            "skipped_s": outcome.skipped_s,
            "timed_s": self.taught.durations.sim_s,  # of sim_s; 0: all durations were known
            "faults": [*verdict.rows],
            "outcome": verdict.came,
            "audit": None if outcome.audit is None else outcome.audit.to_json(),
            "interrupted": outcome.interrupted,
            "receipts": self.receipts,
            "cyclic": self._cyclic(),
            "wall_s": self.wall_s,
            "files": self.files,
        }

    def _cyclic(self) -> dict[str, Any] | None:
        """The cycle that was carried out, and its period as planned and as measured; None where none was asked for."""
        if self.rhythm is None:
            return None
        planned = simulate(self.taught.cell, self.sequenced.sequence)
        return measured_period(self.rhythm, planned, self.outcome.schedule)


Drawn = dict[str, WorkerTask[bytes]]  # PNG files by their names in FILES, drawn or being drawn


def begin_pictures(prepared: Prepared, taught: Taught, workers: Workers) -> Drawn:
    """What can be drawn as soon as the skills are there: the learning curves, and the value map where there is a photo."""

    drawn = {"learning_curves": workers.begin(_png, partial(learning_curves, _curves(prepared, taught.lessons)))}
    skill = _photographed(prepared)
    photo = None if skill is None else skill.photo()
    if skill is not None and photo is not None:
        q, mdp = taught.lessons[skill.name].policy.q, skill.problem.mdp
        drawn["value_map"] = workers.begin(_png, partial(values_seen, q, mdp, photo.picture, photo.seen))
    return drawn


def _png(draw: Callable[[Path], None]) -> bytes:
    """The PNG file that `draw` writes. Raises OSError and BadInput as it does."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "picture.png")
        draw(path)
        return read_limited(path)


def write_files(
    report: Report,
    out: Path,
    drawn: Drawn | None = None,
    scene: WorkerTask[dict[str, Any]] | None = None,
    workers: Workers | None = None,
) -> None:
    """Write what there is of `FILES` to `out`, all at once at the end: none is ever half written, none is left of a run before.

    drawn: what was begun by `begin_pictures`; scene: what the recording shows (see `describe`); None: they are made now.
    workers: who draws the rest, None: this process.

    The numbers come first; a picture, the replay or the program may fail alone, as on a full disk. Sets `report.files`, and
    `report.missing`. WorkFailed when the numbers cannot be written.
    """
    report.files, report.missing = {}, {}
    predicted = simulate(report.taught.cell, report.sequenced.sequence)
    workers = workers or Workers()
    drawn = begin_pictures(report.prepared, report.taught, workers) if drawn is None else drawn
    if report.outcome.schedule.robot:
        drawn = drawn | {"gantt": workers.begin(_png, partial(gantt, report.outcome.schedule, predicted=predicted))}
    if report.learning is not None and len(report.learning.found.episode_costs) > 1:
        drawn = drawn | {"order_learning": workers.begin(_png, report.learning.drawn(report.taught.cell))}
    try:
        out.mkdir(parents=True, exist_ok=True)
        with draft(out) as beside:
            paths = {name: beside / file for name, file in FILES.items()}
            written = _write_numbers(report, paths, predicted)
            report.files = {name: str(out / FILES[name]) for name in written}
            _write_json(paths["run"], _run_document(report))  # in case that there is no room for it any more
            for names, write in _pictures(report, paths, predicted, drawn, scene):
                try:
                    write()
                except (OSError, LabError) as error:
                    report.missing[names[0]] = getattr(error, "strerror", None) or str(error)
                    for name in names:
                        paths[name].unlink(missing_ok=True)
                else:
                    written += names
            report.files = {name: str(out / file) for name, file in FILES.items() if name in written}
            report.wall_s = time.perf_counter() - report.began_s
            with suppress(OSError):
                write_whole(paths["run"], _json(_run_document(report)))
            for name, file in FILES.items():
                if name in report.files:
                    replace(paths[name], out / file)
                else:
                    (out / file).unlink(missing_ok=True)
    except OSError as error:
        raise WorkFailed(f"output folder '{out}' (--out) cannot be written: {error.strerror or error}") from error


def _photographed(prepared: Prepared) -> Skill | None:
    """The first skill whose problem was read from a picture."""
    return next((skill for skill in prepared.skillset.skills.values() if skill.photo() is not None), None)


def _write_numbers(report: Report, paths: dict[str, Path], predicted: Schedule) -> list[str]:
    """The order and the schedules; the names of these files, and of the run's own. Raises OSError."""
    cell = report.taught.cell
    _write_json(paths["sequence"], _sequence_document(report, predicted))
    rows = rows_of(predicted, cell, "planned") + rows_of(report.outcome.schedule, cell, "measured")
    paths["schedule_table"].write_text(csv_of(rows, COLUMNS), encoding="utf-8")
    _write_json(paths["schedule"], {"schedule": rows})
    audited = report.outcome.audit
    tracks = tracks_of(report.recording) if audited is None else audited.evidence.tracks
    paths["frames"].write_bytes(packed(tracks))
    return ["sequence", "schedule_table", "schedule", "frames", "run"]


def _pictures(
    report: Report, paths: dict[str, Path], predicted: Schedule, drawn: Drawn, scene: WorkerTask[dict[str, Any]] | None
) -> Iterator[tuple[tuple[str, ...], Callable[[], object]]]:
    """What else this run has, and what writes it; what other processes draw comes last."""

    prepared, outcome = report.prepared, report.outcome
    program = outcome.program
    if program is not None:
        yield ("program", "trajectory"), lambda: program.save(paths["program"].parent)
    skill = _photographed(prepared)
    photo = None if skill is None else skill.photo()
    if photo is not None:
        yield ("overhead",), lambda: write_picture(paths["overhead"], photo.picture)
    title = f"{prepared.task.title or prepared.task.name}: {prepared.words}"
    story = story_of(outcome, predicted)
    yield (
        ("replay",),
        lambda: replay_html(
            report.recording, paths["replay"], title=title, story=story, scene=None if scene is None else scene.result()
        ),
    )
    for name, picture in drawn.items():
        yield (name,), partial(_write_picture, paths[name], picture)


def _write_picture(path: Path, picture: WorkerTask[bytes]) -> None:
    path.write_bytes(picture.result())


def _run_document(report: Report) -> dict[str, Any]:
    return report.to_json() | {"schedule": report.outcome.schedule.to_json()}


def _curves(prepared: Prepared, lessons: dict[str, Lesson]) -> dict[str, Policy]:
    """Each policy once, under the skill that it was first found for."""
    first = {lesson.policy.name: name for name, lesson in reversed(lessons.items())}
    several = {name for name, problem in prepared.problems.items() if problem.mdp.starts}
    return {
        f"{name}, starts vary" if name in several else name: lesson.policy
        for name, lesson in lessons.items()
        if first[lesson.policy.name] == name
    }


def _sequence_document(report: Report, predicted: Schedule) -> dict[str, Any]:
    return {
        "sequence": list(report.sequenced.sequence),
        "makespan_s": report.predicted_s,
        "episode_makespans_s": list(report.sequenced.episode_costs),
        "optimal_s": report.proven.optimal_s,
        "optimal_sequence": list(report.proven.sequence),
        "durations": report.taught.durations.to_json(),
        "stations": [asdict(station) for station in report.taught.cell.stations],
        "predicted": predicted.to_json(),
    }


def _json(document: dict[str, Any]) -> bytes:
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def _write_json(path: Path, document: dict[str, Any]) -> None:
    path.write_bytes(_json(document))
