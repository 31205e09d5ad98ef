"""A lesson of a class: one of `lab teach`, advice on an order, as `lab sequence` asks for it, or a run of `lab operate`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.errors import BadInput
from lab.files import is_file
from lab.production.run_options import RunOptions
from lab.tasks.task_file import load
from lab.teaching.kept_order import OrderSessionOptions
from lab.teaching.lesson_options import DEFAULT_ADVISORS, LessonOptions

ADVISORS = ("web",)  # of every lesson of a class
ADVISED = (ADVISORS, ("praise:web",))  # of a lesson of a study
ORDER = "order:"  # begins the name of a lesson on an order; the rest is what lab sequence takes as TASK
OPERATE = "operate:"  # begins the name of a run by hand; the rest is what lab operate takes as TASK
METHOD = "srl"  # of a lesson on an order: the only method that asks
ClassLesson = LessonOptions | OrderSessionOptions | RunOptions


def order_lesson_named(name: str, gate: str | None, episodes: int | None, seed: int) -> OrderSessionOptions:
    """The lesson on an order that "order:TASK" names; gate, episodes: None for the defaults of `lab sequence`.

    Raises BadInput for a name without a task.
    """
    gate = OrderSessionOptions.gate if gate is None else gate
    named = OrderSessionOptions(
        name.removeprefix(ORDER), method=METHOD, episodes=episodes, advisor=ADVISORS[0], gate=gate, seed=seed
    )
    return named.complete()


def operation_named(name: str, seed: int) -> RunOptions:
    """The run by hand that "operate:TASK" names. Raises BadInput for a name without a task."""
    task = name.removeprefix(OPERATE)
    if not task:
        raise BadInput(f"lesson '{name}': a task is missing, such as {OPERATE}toast")
    return RunOptions(task, advisors=DEFAULT_ADVISORS, seed=seed)


def is_operation(lessons: Sequence[ClassLesson]) -> bool:
    """Whether the lesson of a class is a run by hand. Raises BadInput for one that is not the only lesson."""
    runs = [lesson for lesson in lessons if isinstance(lesson, RunOptions)]
    if runs and len(lessons) > 1:
        raise BadInput(
            f"lesson '{name_of(runs[0])}' beside {len(lessons) - 1} other(s): all pupils operate one run in turns, "
            "so it is a class's only lesson"
        )
    return bool(runs)


def name_of(lesson: ClassLesson) -> str:
    """The name that `lab class` takes for a lesson."""
    if isinstance(lesson, RunOptions):
        return f"{OPERATE}{lesson.task}"
    return f"{ORDER}{lesson.task}" if isinstance(lesson, OrderSessionOptions) else lesson.subtask


def check_own(begun: ClassLesson, lesson: ClassLesson, journal: Path) -> None:
    """Raises BadInput if a journal is of another lesson than the class has there: its folder may come from somebody else."""
    if begun.to_json() != lesson.to_json():
        raise BadInput(f"journal '{journal}' (lab class --resume): it is of another lesson than the class has there")


def title_of(lesson: ClassLesson) -> str:
    """A lesson for people, such as "insert of toast", "world-1", "order of toast-case-1" or "toast by hand"."""
    if isinstance(lesson, RunOptions):
        return f"{_shown(lesson.task)} by hand"
    if isinstance(lesson, OrderSessionOptions):
        return f"order of {_shown(lesson.task)}"
    return f"{lesson.subtask} of {_shown(lesson.task)}" if lesson.task else _shown(lesson.subtask)


def _shown(name: str) -> str:
    """A name for people: of a file, its name alone, whose folders are the teacher's own business."""
    return Path(name).name if Path(name).suffix and is_file(name) else name


def module_of(lesson: ClassLesson) -> str:
    """The module that a lesson such as gym:MODULE:ID would import, "" for none."""
    name = name_of(lesson)
    if not name.startswith("gym:"):
        return ""
    from lab.gym import parse_name

    return parse_name(name, "LESSON").module


def check_lesson(lesson: ClassLesson) -> None:
    """Raises BadInput for a lesson that cannot be given, before anybody is asked. The code of its module is run."""
    if isinstance(lesson, RunOptions):
        lesson.ordered(load(lesson.task))
    elif isinstance(lesson, OrderSessionOptions):
        from lab.production.order_session import check_order_session
        from lab.toolbox.registry import Toolbox

        check_order_session(lesson, Toolbox())
    else:
        from lab.teaching.subjects import subject_of

        subject_of(lesson)


def advisors_of(lesson: ClassLesson, of_study: bool = False) -> Sequence[tuple[str, ...]]:
    """The advisors that a lesson of a class may have, one of these; of_study: whether the class is a study."""
    if isinstance(lesson, RunOptions):
        return (DEFAULT_ADVISORS,)  # who teaches the robot its skills; the pupils operate it
    return ADVISED if of_study else (ADVISORS,)


def lesson_to_json(lesson: ClassLesson) -> dict[str, Any]:
    """The options of a lesson as a plain dict; those that `lab teach` does not give say their kind."""
    kind = "operate" if isinstance(lesson, RunOptions) else "order" if isinstance(lesson, OrderSessionOptions) else ""
    return {"kind": kind} | lesson.to_json() if kind else lesson.to_json()


def lesson_from_json(record: dict[str, Any], where: str) -> ClassLesson:
    """The lesson that `lesson_to_json` wrote. Raises BadInput, which names `where`, for anything else."""
    options = {name: value for name, value in record.items() if name != "kind"}
    match record.get("kind", "lesson"):
        case "lesson":
            lesson: ClassLesson = LessonOptions.from_json(options, where)
        case "order":
            lesson = OrderSessionOptions.from_json(options, where).complete()
        case "operate":
            lesson = RunOptions.from_json(options, where)
        case other:
            raise BadInput(
                f"{where}: a lesson is of the kind {other!r:.60}: allowed are 'lesson', 'order' and 'operate'"
            )
    return lesson
