"""The main job: find or learn the skills, measure their durations, sequence, carry out in physics."""

import hashlib
import time
from math import isfinite
from pathlib import Path

import numpy as np

from lab.composer import carry_out
from lab.crew import Crew, Durations, cell_of
from lab.line import measure
from lab.listener import Listener
from lab.policy import Policy
from lab.recorder import Viewer, show_scene
from lab.report import Prepared, Report, Taught, write_files
from lab.sequencing import find_sequence
from lab.sequencing.methods.exact import optimum
from lab.sequencing.search import Reference
from lab.sim.scene import Layout, check_apart, draw_layout
from lab.skills.surveys import Surveys
from lab.taskfile import Task, check_toasts
from lab.tasks.sequencing import search_for
from lab.teaching import Teacher

_LAB = Path(__file__).resolve().parent  # whose code the kept durations depend on


def prepare(task: Task, toasts: int, seed: int, only: str | None = None) -> Prepared:
    """Lay the scene out as the seed says and survey every problem of it, or `only` one skill's.

    BadInput for whatever cannot be; writes nothing.
    """
    began = time.perf_counter()
    check_toasts(toasts, task)
    check_apart(task, toasts)
    layout = draw_layout(task, toasts, np.random.default_rng([seed, 1]))
    surveys = Surveys(task, layout)
    crew = Crew.of(task, toasts)
    problems = {name: skill.setup(surveys) for name, skill in crew.skills.items() if only in (None, name)}
    return Prepared(task, toasts, seed, layout, surveys, crew, problems, time.perf_counter() - began)


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
    kept = _kept_durations(teacher, key, crew)
    if kept is not None:
        return kept
    processes = sum(station.process is not None for station in prepared.task.stations)
    listener.phase("measure", len(crew.moves.loaded) + len(crew.moves.empty) + processes)
    durations = measure(crew, prepared.surveys, listener.measured)
    teacher.toolbox.save_record("durations", key, durations.to_json())
    return durations


def _kept_durations(teacher: Teacher, key: str, crew: Crew) -> Durations | None:
    """The record of that key; None when there is none, or it is not whole."""
    record = teacher.toolbox.load_record("durations", key)
    try:
        kept = None if record is None else Durations.from_json(record)
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    if (
        kept is None
        or not set(crew.moves.empty) <= kept.empty_s.keys()
        or not set(crew.moves.loaded) <= kept.loaded_s.keys()
        or not {station.name for station in crew.task.stations if station.process} <= kept.process_s.keys()
    ):
        return None
    times = (*kept.empty_s.values(), *kept.loaded_s.values(), *kept.process_s.values())
    return kept if all(isfinite(seconds) and seconds >= 0.0 for seconds in times) else None


def _fingerprint(task: Task, layout: Layout, crew: Crew) -> str:
    """A hash of all that a move's duration depends on: the code, the scene, where things stand, the tables followed."""
    physical = task.model_dump_json(exclude={"name", "title", "sequencing", "subtasks"})
    digest = hashlib.sha256(f"{physical}{layout.obstacles}{crew.moves}".encode())
    for code in sorted([*_LAB.glob("sim/*.py"), *_LAB.glob("skills/*.py"), _LAB / "line.py"]):
        digest.update(code.read_bytes())
    for name in sorted(crew.policies):
        policy: Policy = crew.policies[name]
        digest.update(f"{name}{policy.signature}".encode() + policy.q.tobytes())
    return digest.hexdigest()[:24]


def run(
    prepared: Prepared, teacher: Teacher, out: Path, *, listener: Listener | None = None, viewer: Viewer | None = None
) -> Report:
    """The whole job on a prepared task; pictures, replay and JSON files go to `out` (see `lab.report.check_out`)."""
    began = time.perf_counter() - prepared.wall_s
    listener = listener or Listener()
    if viewer is not None:
        show_scene(prepared.task, prepared.toasts, prepared.layout, viewer)
    taught = teach_all(prepared, teacher, listener)
    listener.phase("sequence", 1)
    settings = prepared.task.sequencing
    found = find_sequence(taught.cell, settings.method, search_for(settings), prepared.seed)
    proven = optimum(taught.cell)
    listener.sequenced(found, Reference(proven.bound_s, proven.proven, "A*"))
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
        began,
    )
    listener.phase("draw", 1)
    write_files(prepared, taught, report, out)
    return report
