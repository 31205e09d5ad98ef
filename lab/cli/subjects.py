"""What a lesson is about, from the word that a person typed or that a journal's head holds."""

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from lab.errors import BadInput

if TYPE_CHECKING:
    from lab.teaching.kept_session import KeptSession
    from lab.teaching.lesson import Subject
    from lab.teaching.lesson_options import LessonOptions

GYM = "gym:"


def subject_of(options: "LessonOptions", kept: "KeptSession | None" = None) -> "Subject":
    """The subject that the options name: an environment, a world or a skill of a task. BadInput for bad options.

    A module whose name comes out of a file, `kept`, is imported only when the user has said that it is trusted.
    """
    from lab.tasks.task_file import names_file

    if options.subtask.startswith(GYM):
        from lab.gym import parse_name

        module = "" if kept is None else parse_name(options.subtask, kept.where).module
        if kept is not None and module and module not in kept.trusted:
            raise BadInput(
                f"journal '{kept.read.path}' ({kept.where}): it names the module '{module}', whose code would run: if you "
                f"trust whoever made it, say --trust-module {quote(module)}"
            )
        from lab.gym.gym_subject import GymSubject

        return GymSubject.of(options)
    if names_file(options.subtask):
        from lab.teaching.world_subject import WorldSubject

        return WorldSubject.of(options)
    from lab.production.skill_subject import SkillSubject

    return SkillSubject.of(options)


def files_outside(kept: "KeptSession") -> list[str]:
    """The files outside its own folder that a session names, and that are read when it goes on or is shown again."""
    from lab.tasks.task_file import is_path

    options = kept.options
    named: list[object] = [options.subtask, options.task]
    if options.subtask.startswith(GYM):
        from lab.gym import parse_name

        named = list(parse_name(options.subtask, kept.where).options.values())
    files = [word for word in named if isinstance(word, str) and is_path(word) and Path(word).is_file()]
    files += [name.removeprefix("recorded:") for name in options.advisors if name.startswith("recorded:")]
    here = kept.read.path.parent.resolve()
    return [name for name in files if not Path(name).resolve().is_relative_to(here)]
