"""What a run is made of and what it leaves behind: its records, its pictures, its replay and its numbers as JSON."""

import json
import os
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from lab.errors import BadInput, WorkFailed, counted
from lab.files import draft, nearest
from lab.mdp import TabularMDP, greedy_path
from lab.production.composer import Outcome
from lab.production.durations import Durations
from lab.production.skillset import SkillSet
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import SequenceResult
from lab.sequencing.methods.exact import Optimum
from lab.sequencing.simulate.run import simulate
from lab.sim.frames import Recording
from lab.sim.scene import Layout
from lab.skills import Skill
from lab.skills.skill import Photo, Problem
from lab.skills.surveys import Surveys
from lab.tasks.task_file import Task
from lab.teaching.lesson_plan import Lesson
from lab.toolbox.policy import Policy

FILES = {
    "gantt": "gantt.png",
    "learning_curves": "learning-curves.png",
    "value_map": "insert-value-map.png",
    "overhead": "overhead.png",
    "replay": "replay.html",
    "sequence": "sequence.json",
    "run": "run.json",
}


@dataclass
class Prepared:
    """A task whose scene is surveyed, which took `wall_s`: nothing is learned yet, and nothing is written."""

    task: Task
    toasts: int
    seed: int
    layout: Layout
    surveys: Surveys
    skillset: SkillSet
    problems: dict[str, Problem]
    wall_s: float = 0.0


@dataclass
class Taught:
    """A prepared task whose skills are all there, with the durations of its moves and the cell that they make."""

    lessons: dict[str, Lesson]
    durations: Durations
    cell: Cell


@dataclass
class Report:
    """What a whole run came to; `began_s` is the clock's reading (`time.perf_counter`) when it began."""

    task: str
    seed: int
    toasts: int
    lessons: dict[str, Lesson]
    durations: Durations
    sequenced: SequenceResult
    proven: Optimum
    outcome: Outcome
    recording: Recording
    began_s: float
    wall_s: float = 0.0
    files: dict[str, str] = field(default_factory=dict)

    @property
    def success(self) -> bool:
        """Whether every toast was delivered."""
        return self.outcome.failure is None and len(self.outcome.delivered) == self.toasts

    @property
    def gap(self) -> float:
        """How much longer the used sequence takes than the proven optimum (or the bound), as a fraction of it."""
        return self.proven.gap(self.sequenced.cost)

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
            "predicted_makespan_s": self.sequenced.cost,
            "measured_makespan_s": outcome.schedule.makespan_s if self.success else None,
            "optimal_makespan_s": self.proven.optimal_s,
            "bound_s": self.proven.bound_s,
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


def check_out(out: Path) -> None:
    """BadInput unless `out` is a folder that can be written, or can be made; makes nothing."""
    try:
        place = nearest(out)
    except OSError as error:
        raise BadInput(f"output folder '{out}' (--out): {error.strerror}") from None
    if not place.is_dir():
        raise BadInput(f"output folder '{out}' (--out): '{place}' is a file; give a folder")
    if not os.access(place, os.W_OK | os.X_OK):
        raise BadInput(f"output folder '{out}' (--out): '{place}' is not writable")


def write_files(prepared: Prepared, taught: Taught, report: Report, out: Path) -> None:
    """Write what there is of `FILES` to `out`, all at once at the end: none is ever half written, none is left of a run before.

    Sets `report.files`. WorkFailed when `out` cannot be written.
    """
    report.files = {name: str(out / FILES[name]) for name in _names(prepared, report)}
    try:
        out.mkdir(parents=True, exist_ok=True)
        with draft(out) as beside:
            _draw_all(prepared, taught, report, beside)
            for name, file in FILES.items():
                if name in report.files:
                    os.replace(beside / file, out / file)
                else:
                    (out / file).unlink(missing_ok=True)
    except OSError as error:
        raise WorkFailed(f"output folder '{out}' (--out) cannot be written: {error.strerror or error}") from error


def _names(prepared: Prepared, report: Report) -> list[str]:
    """The files that this run can have: a Gantt chart needs a move, the camera's pictures need a skill that took one."""
    missing = set() if report.outcome.schedule.robot else {"gantt"}
    if _photographed(prepared) is None:
        missing |= {"value_map", "overhead"}
    return [name for name in FILES if name not in missing]


def _photographed(prepared: Prepared) -> Skill | None:
    """The first skill whose problem was read from a picture."""
    return next((skill for skill in prepared.skillset.skills.values() if skill.photo() is not None), None)


def _draw_all(prepared: Prepared, taught: Taught, report: Report, folder: Path) -> None:
    """The pictures, the replay and the two JSON files."""
    from lab.view.meshcat import replay_html
    from lab.view.plots import gantt, learning_curves
    from lab.vision.pictures import write_picture

    paths = {name: folder / file for name, file in FILES.items()}
    predicted = simulate(taught.cell, report.sequenced.sequence)
    if "gantt" in report.files:
        gantt(report.outcome.schedule, paths["gantt"], predicted=predicted)
    learning_curves(_curves(prepared, taught.lessons), paths["learning_curves"])
    skill = _photographed(prepared)
    photo = None if skill is None else skill.photo()
    if skill is not None and photo is not None:
        draw_value_map(skill.problem.mdp, photo, taught.lessons[skill.name].policy, paths["value_map"])
        write_picture(paths["overhead"], photo.picture)
    title = f"{prepared.task.title or prepared.task.name}: {counted(prepared.toasts, 'toast')}"
    replay_html(report.recording, paths["replay"], title=title)
    _write_json(paths["sequence"], _sequence_document(taught, report))
    report.wall_s = time.perf_counter() - report.began_s
    _write_json(paths["run"], report.to_json() | {"schedule": report.outcome.schedule.to_json()})


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
        "makespan_s": report.sequenced.cost,
        "episode_makespans_s": list(report.sequenced.episode_costs),
        "optimal_s": report.proven.optimal_s,
        "optimal_sequence": list(report.proven.sequence),
        "durations": taught.durations.to_json(),
        "stations": [asdict(station) for station in taught.cell.stations],
        "predicted": simulate(taught.cell, report.sequenced.sequence).to_json(),
    }


def draw_value_map(mdp: TabularMDP, photo: Photo, policy: Policy, path: Path) -> None:
    """The values of a problem over the picture that it was read from, with the learned way."""
    from lab.view.plots import cell_corners, value_map

    states, _, _ = greedy_path(policy.q, mdp, mdp.n_states)
    cells = [mdp.state_cell(state) for state in states]
    value_map(
        policy.q.max(axis=1).reshape(mdp.shape),
        photo.picture,
        path,
        corners=cell_corners(photo.seen.view),
        route=[(cell[0], cell[1]) for cell in cells],
        blocked=(mdp.terminal & ~mdp.goal).reshape(mdp.shape),
        start=photo.seen.start,
        goal=photo.seen.goal,
    )


def _write_json(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
