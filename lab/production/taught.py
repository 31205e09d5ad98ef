"""What a run has learned: its skills, how long their moves take, and the cell that they make."""

from dataclasses import asdict, dataclass
from typing import Any

from lab.production.durations import Durations
from lab.sequencing.cell.cell import Cell
from lab.teaching.lesson_plan import Lesson


@dataclass
class Taught:
    """A prepared task whose skills are all there, with the durations of its moves and the cell that they make.

    rows: each skill as `lab run --json` shows it. durations_key: under which they are kept; "": they are not.
    """

    lessons: dict[str, Lesson]
    rows: dict[str, dict[str, Any]]
    durations: Durations
    cell: Cell
    durations_key: str = ""


def skill_row(name: str, lesson: Lesson) -> dict[str, Any]:
    """What the document says of a skill: where it came from, why, and what it took."""
    policy, result = lesson.policy, lesson.result
    return {
        "name": name,
        "subtask": policy.subtask,
        "source": lesson.source,
        "from_task": lesson.from_task or None,
        "reason": lesson.reason,
        "policy": policy.name,
        "parent": policy.parent,
        "saved_episodes": lesson.saved[0],
        "saved_helped_steps": lesson.saved[1],
        "fitness": None if lesson.fitness is None else asdict(lesson.fitness),
        "episodes": 0 if result is None else len(result.steps),
        "moves": 0 if result is None else int(result.visits.sum()),
        "requests": 0 if result is None else result.requests,
        "helped_steps": 0 if result is None else result.helped_steps,
        "rejected_at_episode": None if result is None else result.rejected_at_episode,
        "optimal_steps": lesson.steps[1],
        "final_steps": lesson.steps[0],
        "solved": policy.solved,
    }
