"""A lesson of a class: one of `lab teach`, or advice on an order, as `lab sequence` asks for it."""

from pathlib import Path
from typing import Any

from lab.errors import BadInput
from lab.files import is_file
from lab.gym import parse_name
from lab.production.order_session import check_order_session
from lab.teaching.kept_order import OrderSessionOptions
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.subjects import subject_of
from lab.toolbox.registry import Toolbox

ADVISORS = ("web",)  # of every lesson of a class
ADVISED = (ADVISORS, ("praise:web",))  # of a lesson of a study
ORDER = "order:"  # begins the name of a lesson on an order; the rest is what lab sequence takes as TASK
METHOD = "srl"  # of a lesson on an order: the only method that asks
ClassLesson = LessonOptions | OrderSessionOptions


def order_lesson_named(name: str, gate: str | None, episodes: int | None, seed: int) -> OrderSessionOptions:
    """The lesson on an order that "order:TASK" names; gate, episodes: None for the defaults of `lab sequence`.

    Raises BadInput for a name without a task.
    """
    gate = OrderSessionOptions.gate if gate is None else gate
    named = OrderSessionOptions(
        name.removeprefix(ORDER), method=METHOD, episodes=episodes, advisor=ADVISORS[0], gate=gate, seed=seed
    )
    return named.complete()


def name_of(lesson: ClassLesson) -> str:
    """The name that `lab class` takes for a lesson."""
    return f"{ORDER}{lesson.task}" if isinstance(lesson, OrderSessionOptions) else lesson.subtask


def named_by(lesson: ClassLesson) -> list[str]:
    """The world or sub-task, and the task, that a lesson names."""
    about = lesson.task if isinstance(lesson, OrderSessionOptions) else lesson.subtask
    return [name for name in dict.fromkeys([about, lesson.task]) if name]


def title_of(lesson: ClassLesson) -> str:
    """A lesson for people, such as "insert of toast", "world-1" or "order of toast-case-1"."""
    if isinstance(lesson, OrderSessionOptions):
        return f"order of {_shown(lesson.task)}"
    return f"{lesson.subtask} of {_shown(lesson.task)}" if lesson.task else _shown(lesson.subtask)


def _shown(name: str) -> str:
    """A name for people: of a file, its name alone, whose folders are the teacher's own business."""
    return Path(name).name if Path(name).suffix and is_file(name) else name


def module_of(lesson: ClassLesson) -> str:
    """The module that a lesson such as gym:MODULE:ID would import, "" for none."""
    name = name_of(lesson)
    return parse_name(name, "LESSON").module if name.startswith("gym:") else ""


def check_lesson(lesson: ClassLesson) -> None:
    """Raises BadInput for a lesson that cannot be given, before anybody is asked. The code of its module is run."""
    if isinstance(lesson, OrderSessionOptions):
        check_order_session(lesson, Toolbox())
    else:
        subject_of(lesson)


def lesson_to_json(lesson: ClassLesson) -> dict[str, Any]:
    """The options of a lesson as a plain dict; only that of a lesson on an order says its kind."""
    return {"kind": "order"} | lesson.to_json() if isinstance(lesson, OrderSessionOptions) else lesson.to_json()


def lesson_from_json(record: dict[str, Any], where: str) -> ClassLesson:
    """The lesson that `lesson_to_json` wrote. Raises BadInput, which names `where`, for anything else."""
    options = {name: value for name, value in record.items() if name != "kind"}
    match record.get("kind", "lesson"):
        case "lesson":
            lesson: ClassLesson = LessonOptions.from_json(options, where)
        case "order":
            lesson = OrderSessionOptions.from_json(options, where).complete()
        case other:
            raise BadInput(f"{where}: a lesson is of the kind {other!r:.60}: allowed are 'lesson' and 'order'")
    return lesson
