"""The main job: find or learn the skills, measure their durations, sequence, carry out in physics."""

import hashlib
import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lab.composer import Outcome, carry_out, measure
from lab.crew import Crew, Durations, cell_of
from lab.errors import BadInput, unknown
from lab.listener import Listener
from lab.policy import Policy
from lab.recorder import Viewer
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell import Cell
from lab.sequencing.events import EpisodeSequenced, SequenceResult, simulate
from lab.sequencing.exact import Optimum, optimum
from lab.sequencing.srl import srl
from lab.sim.scene import Layout, draw_layout
from lab.skills import Insert
from lab.skills.skill import Problem
from lab.skills.surveys import Surveys
from lab.taskfile import Task, check_toasts
from lab.teaching import Lesson, Teacher
from lab.view.frames import Recording


@dataclass
class Prepared:
    """A task whose scene is surveyed: nothing is learned yet, and nothing is written."""

    task: Task
    toasts: int
    seed: int
    layout: Layout
    surveys: Surveys
    crew: Crew
    problems: dict[str, Problem]


@dataclass
class Taught:
    """A prepared task whose skills are all there, with the durations of its moves and the cell that they make."""

    lessons: dict[str, Lesson]
    durations: Durations
    cell: Cell


@dataclass
class Report:
    """What a whole run came to."""

    task: str
    seed: int
    toasts: int
    lessons: dict[str, Lesson]
    durations: Durations
    sequenced: SequenceResult
    proven: Optimum
    outcome: Outcome
    recording: Recording
    wall_s: float
    files: dict[str, str] = field(default_factory=dict)

    @property
    def success(self) -> bool:
        """Whether every toast was delivered."""
        return self.outcome.failure is None and len(self.outcome.delivered) == self.toasts

    @property
    def gap(self) -> float:
        """How much longer the used sequence takes than the proven optimum, as a fraction of it."""
        return self.sequenced.makespan_s / self.proven.makespan_s - 1.0

    def to_json(self) -> dict[str, Any]:
        """The document of `lab run --json`."""
        outcome = self.outcome
        return {
            "task": self.task,
            "seed": self.seed,
            "toasts": self.toasts,
            "success": self.success,
            "delivered": len(outcome.delivered),
            "dropped": len(outcome.dropped),
            "failure": outcome.failure,
            "retries": list(outcome.retries),
            "skills": [_skill_row(name, lesson) for name, lesson in self.lessons.items()],
            "sequence": list(self.sequenced.sequence),
            "predicted_makespan_s": self.sequenced.makespan_s,
            "measured_makespan_s": outcome.schedule.makespan_s if self.success else None,
            "optimal_makespan_s": self.proven.makespan_s,
            "optimality_gap": self.gap,
            "optimum_proven": self.proven.proven,
            "camera_deviation_m": max(outcome.camera_deviations_m, default=None),
            "sim_s": outcome.sim_s + self.durations.sim_s,
            "wall_s": self.wall_s,
            "files": self.files,
        }


def _skill_row(name: str, lesson: Lesson) -> dict[str, Any]:
    policy, result = lesson.policy, lesson.result
    return {
        "name": name,
        "subtask": policy.subtask,
        "source": lesson.source,
        "policy": policy.name,
        "episodes": 0 if result is None else len(result.steps),
        "requests": 0 if result is None else result.requests,
        "helped_steps": 0 if result is None else result.helped_steps,
        "rejected_at_episode": None if result is None else result.rejected_at_episode,
        "optimal_steps": policy.optimal_steps,
        "final_steps": policy.final_steps,
        "solved": policy.solved,
    }


def prepare(task: Task, toasts: int, seed: int) -> Prepared:
    """Lay the scene out as the seed says and survey every problem of it. BadInput for whatever cannot be; writes nothing."""
    check_toasts(toasts, task)
    layout = draw_layout(task, toasts, np.random.default_rng([seed, 1]))
    surveys = Surveys(task, layout)
    crew = Crew.of(task, toasts)
    problems = {name: skill.setup(surveys) for name, skill in crew.skills.items()}
    return Prepared(task, toasts, seed, layout, surveys, crew, problems)


def teach_all(prepared: Prepared, teacher: Teacher, listener: Listener) -> Taught:
    """Find or learn every skill, then find or measure the durations of every move."""
    task, crew = prepared.task, prepared.crew
    known, damaged = teacher.toolbox.index()
    for what in damaged:
        listener.skipped(what)
    listener.phase("learn", len(prepared.problems))
    lessons = {}
    for name, problem in prepared.problems.items():
        lesson = teacher.find_or_teach(problem, task.subtask(problem.subtask), task.name, known)
        known[problem.subtask, problem.mdp.signature] = lesson.policy
        crew.policies[name] = lesson.policy
        lessons[name] = lesson
        listener.lesson(name, lesson)
    durations = _durations(prepared, teacher, listener)
    return Taught(lessons, durations, cell_of(task, durations, prepared.toasts))


def _durations(prepared: Prepared, teacher: Teacher, listener: Listener) -> Durations:
    """The durations measured earlier for exactly these policies in exactly this scene, or measured now and kept."""
    crew = prepared.crew
    key = _fingerprint(prepared.task, prepared.layout, crew)
    kept = teacher.toolbox.load_record("durations", key)
    if kept is not None:
        return Durations.from_json(kept)
    listener.phase("measure", len(crew.moves.loaded) + len(crew.moves.empty))
    durations = measure(crew, prepared.surveys, listener.measured)
    teacher.toolbox.save_record("durations", key, durations.to_json())
    return durations


def _fingerprint(task: Task, layout: Layout, crew: Crew) -> str:
    """A hash of all that a move's duration depends on: the scene, where things stand, and the tables that are followed."""
    physical = task.model_dump_json(exclude={"name", "title", "sequencing", "subtasks"})
    digest = hashlib.sha256(f"{physical}{layout.obstacles}{crew.moves}".encode())
    for name in sorted(crew.policies):
        policy: Policy = crew.policies[name]
        digest.update(f"{name}{policy.signature}".encode() + policy.q.tobytes())
    return digest.hexdigest()[:24]


def sequence(
    task: Task,
    cell: Cell,
    seed: int,
    *,
    method: str | None = None,
    episodes: int | None = None,
    on_episode: Callable[[EpisodeSequenced], None] | None = None,
) -> SequenceResult:
    """The best sequence that a method finds, by default the task's own with its settings. BadInput for an unknown method."""
    settings = task.sequencing
    name, count = method or settings.method, episodes or settings.episodes
    rng = np.random.default_rng([seed, 2])
    if name not in SEQUENCERS:
        raise unknown("method", name, SEQUENCERS, "--method")
    if name != "srl":
        return SEQUENCERS[name](cell, count, rng, on_episode)
    return srl(
        cell,
        count,
        rng,
        alpha=settings.alpha,
        discount=settings.discount,
        beta=settings.beta,
        factor=settings.reward_factor,
        on_episode=on_episode,
    )


def run(
    prepared: Prepared, teacher: Teacher, out: Path, *, listener: Listener | None = None, viewer: Viewer | None = None
) -> Report:
    """The whole job on a prepared task; pictures, replay and JSON files go to `out` (see `check_out`)."""
    began = time.perf_counter()
    listener = listener or Listener()
    taught = teach_all(prepared, teacher, listener)
    listener.phase("sequence", 1)
    found, proven = sequence(prepared.task, taught.cell, prepared.seed), optimum(taught.cell)
    listener.sequenced(found, proven)
    listener.phase("carry out", len(found.sequence))
    outcome, recording = carry_out(
        prepared.crew,
        prepared.surveys,
        prepared.layout,
        taught.cell,
        found.sequence,
        viewer=viewer,
        on_move=listener.moved,
        on_retry=listener.retried,
    )
    report = Report(
        prepared.task.name,
        prepared.seed,
        prepared.toasts,
        taught.lessons,
        taught.durations,
        found,
        proven,
        outcome,
        recording,
        time.perf_counter() - began,
    )
    listener.phase("draw", 1)
    _write_files(prepared, taught, report, out, began)
    return report


def check_out(out: Path) -> None:
    """BadInput unless `out` is a folder that can be written, or can be made; makes nothing."""
    place = out
    while not place.exists() and place != place.parent:
        place = place.parent
    if not place.is_dir():
        raise BadInput(f"output folder '{out}' (--out): '{place}' is a file; give a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise BadInput(f"output folder '{out}' (--out): '{place}' is not writable")


def _write_files(prepared: Prepared, taught: Taught, report: Report, out: Path, began: float) -> None:
    """The pictures, the replay and the two JSON files."""
    from lab.view.meshcat import replay_html
    from lab.view.plots import gantt, learning_curves
    from lab.vision import write_picture

    out.mkdir(parents=True, exist_ok=True)
    files = {
        "gantt": out / "gantt.png",
        "learning_curves": out / "learning-curves.png",
        "value_map": out / "insert-value-map.png",
        "overhead": out / "overhead.png",
        "replay": out / "replay.html",
        "sequence": out / "sequence.json",
        "run": out / "run.json",
    }
    predicted = simulate(taught.cell, report.sequenced.sequence)
    if report.outcome.schedule.robot:
        gantt(report.outcome.schedule, files["gantt"], predicted=predicted)
    else:
        del files["gantt"]
    learning_curves(_curves(prepared, taught.lessons), files["learning_curves"])
    insert = next((skill for skill in prepared.crew.skills.values() if isinstance(skill, Insert)), None)
    if insert is None:
        del files["value_map"], files["overhead"]
    else:
        draw_value_map(insert, taught.lessons[insert.name].policy, files["value_map"])
        write_picture(files["overhead"], insert.picture)
    title = f"{prepared.task.title or prepared.task.name}: {prepared.toasts} toasts"
    replay_html(report.recording, files["replay"], title=title)
    report.files = {name: str(path) for name, path in files.items()}
    _write_json(files["sequence"], _sequence_document(taught, report))
    report.wall_s = time.perf_counter() - began
    _write_json(files["run"], report.to_json() | {"schedule": report.outcome.schedule.to_json()})


def _curves(prepared: Prepared, lessons: dict[str, Lesson]) -> dict[str, Policy]:
    """Each policy once, under the skill that it was first found for."""
    first = {lesson.policy.name: name for name, lesson in reversed(lessons.items())}
    several = {name for name, problem in prepared.problems.items() if problem.mdp.starts}
    return {
        f"{name}, starts vary" if name in several else name: lesson.policy
        for name, lesson in lessons.items()
        if first[lesson.policy.name] == name
    }


def _sequence_document(taught: Taught, report: Report) -> dict[str, Any]:
    return {
        "sequence": list(report.sequenced.sequence),
        "makespan_s": report.sequenced.makespan_s,
        "episode_makespans_s": list(report.sequenced.episode_makespans_s),
        "optimal_s": report.proven.makespan_s,
        "optimal_sequence": list(report.proven.sequence),
        "durations": taught.durations.to_json(),
        "stations": [asdict(station) for station in taught.cell.stations],
        "predicted": simulate(taught.cell, report.sequenced.sequence).to_json(),
    }


def draw_value_map(insert: Insert, policy: Policy, path: Path) -> None:
    """The insert task's values over the camera's picture, with the learned way."""
    from lab.mdp import greedy_path
    from lab.view.plots import cell_corners, value_map

    mdp = insert.problem.mdp
    states, _, _ = greedy_path(policy.q, mdp, mdp.n_states)
    cells = [mdp.state_cell(state) for state in states]
    value_map(
        policy.q.max(axis=1).reshape(mdp.shape),
        insert.picture,
        path,
        corners=cell_corners(insert.seen.view),
        route=[(cell[0], cell[1]) for cell in cells],
        blocked=(mdp.terminal & ~mdp.goal).reshape(mdp.shape),
        start=insert.seen.start,
        goal=insert.seen.goal,
    )


def _write_json(path: Path, document: dict[str, Any]) -> None:
    beside = path.with_name(f".{path.name}.part")
    beside.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n")
    os.replace(beside, path)
