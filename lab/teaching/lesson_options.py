"""The options of a session as one record, from the command line or from the head of a journal."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar

from annotated_types import Ge, Le
from pydantic import TypeAdapter, ValidationError

from lab.advice.advising import Advising
from lab.advice.advisors import PRAISE, split_praise
from lab.errors import BadInput
from lab.files import is_file
from lab.learning.requests import Ask
from lab.tasks.record import Learned
from lab.tasks.task_file import whole_path
from lab.teaching.lesson_plan import MAX_SESSIONS

DEFAULT_ADVISORS = ("expert",)
DEFAULT_TASK = "toast"  # of sub-tasks
Settings = TypeVar("Settings", bound=Learned)


class SessionOptions:
    """The base class of the options of commands that store a session; a journal holds them by name.

    command: the command; wanted: the error text for a session of another command; typed: option by field, where names differ.
    advisor_field: the field that holds the advisor, or all of them.
    """

    command: ClassVar[str]
    wanted: ClassVar[str]
    typed: ClassVar[Mapping[str, str]]
    advisor_field: ClassVar[str] = "advisors"
    seed: int

    @property
    def advisor_names(self) -> tuple[str, ...]:
        """The names of all advisors."""
        given: str | tuple[str, ...] = getattr(self, self.advisor_field)
        return (given,) if isinstance(given, str) else given

    @classmethod
    def from_json(cls, record: dict[str, Any], where: str) -> Self:
        """The options that `to_json` wrote. Raises BadInput, which names `where`, for anything else."""
        try:
            return TypeAdapter(cls).validate_python(record)
        except ValidationError as error:
            wrong = [
                f"{'.'.join(map(str, finding['loc']))}: {finding['msg']}" for finding in error.errors(include_url=False)
            ]
            raise BadInput(f"{where}: its options are none of lab {cls.command}: {'; '.join(wrong)[:160]}") from None


def recorded_whole(advisor: str) -> str:
    """An advisor's name, in which the path of a record or of a policy's file is absolute."""
    if (judge := split_praise(advisor)) != (advisor, ""):
        return f"{PRAISE}:{judge[1]}{recorded_whole(judge[0])}"
    kind, _, path = advisor.partition(":")
    is_path = path and (kind == "recorded" or (kind == "policy" and is_file(path)))
    return f"{kind}:{Path(path).absolute()}" if is_path else advisor


@dataclass(frozen=True)
class LessonOptions(SessionOptions):
    """The options of `lab teach` that a session depends on; None or empty if not given.

    view: where in a world the advisor sees (--sight); toasts, parts, sessions: for a lesson of `lab run`, the order, and the
    limit on sessions.
    """

    command = "teach"
    wanted = "it is advice on an order: wanted a session of lab teach"
    typed: ClassVar[Mapping[str, str]] = {
        "subtask": "SUBTASK",
        "advisors": "--advisor",
        "asked": "--ask",
        "view": "--sight",
    }

    subtask: str = ""
    task: str | None = None
    view: str | None = None
    learner: str | None = None
    gate: str | None = None
    memory: bool | None = None
    advisors: tuple[str, ...] = ()
    asked: str = "together"
    decide: str = "trust-weighted"
    episodes: Annotated[int, Ge(1)] | None = None
    seed: Annotated[int, Ge(0)] = 0
    save: str | None = None
    toasts: int | None = None
    parts: str | None = None
    sessions: Annotated[int, Ge(1), Le(MAX_SESSIONS)] | None = None

    def complete(self) -> "LessonOptions":
        """The options with the default advisor filled in. Raises BadInput if they name nothing to learn."""
        if not self.subtask:
            raise BadInput("nothing to learn (SUBTASK): name a sub-task, a world or gym:ID, or go on with --resume DIR")
        return replace(self, advisors=self.advisors or DEFAULT_ADVISORS)

    def changed(self, settings: Settings) -> Settings:
        """The settings, changed by these options. Raises BadInput for an unknown learner or gate."""
        return settings.changed(learner=self.learner, gate=self.gate, episodes=self.episodes, memory=self.memory)

    def advising(self, people: Mapping[str, Ask] | None = None) -> Advising:
        """The advisors; people: the functions that ask the people behind names such as "terminal"."""
        return Advising.of(self.advisors, people, self.asked, self.decide)

    def to_json(self) -> dict[str, Any]:
        """A plain dict with absolute paths, which are valid from any folder."""
        changed = {"subtask": whole_path(self.subtask), "task": whole_path(self.task)}
        return asdict(self) | changed | {"advisors": [recorded_whole(name) for name in self.advisors]}
