"""The protocol of a study with people: a TOML file with its arms, texts, questionnaires and order, checked whole."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from lab.classroom.arm_order import Design, arms_at
from lab.classroom.questionnaire import MOST_TEXT, SHIPPED, Place, QuestionItem, Text
from lab.classroom.roster import MOST_PARTICIPANTS
from lab.errors import BadInput, unknown
from lab.files import is_file
from lab.plugins.code_file import is_file_word
from lab.skills import SKILLS
from lab.tasks.record import MAX_SHORT_BYTES, Name, Record, as_tuple, read_text
from lab.tasks.task_faults import fields_at, within
from lab.tasks.toml_text import Loc, TomlText, explain, finding
from lab.teaching.lesson_options import LessonOptions

MOST_ARMS = 12
MOST_BYTES = MAX_SHORT_BYTES
Kind = Literal["text", "lesson", "questionnaire"]
TeacherAct = Literal["next", "help", "hint", "pause"]
OptionalText = Annotated[str, Field(max_length=MOST_TEXT)]


class StudyTexts(Record):
    """What participants read besides the texts of the arms; blank lines part paragraphs."""

    consent: Text
    """What participants agree to before anything about them is kept."""
    welcome: OptionalText = ""
    """The text above the consent."""
    thanks: OptionalText = ""
    """The text at the end."""


class StudyArm(Record):
    """An arm of the study: a condition, with its lessons and the options that `lab class` has for them."""

    name: Name
    """The arm's name, such as `"asks-often"`; participants do not see it."""
    lessons: Annotated[tuple[Text, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=20)]
    """The lessons in their order, such as `["world-1", "insert"]`."""
    text: OptionalText = ""
    """A text before the arm's first lesson; left out: none."""
    task: str | None = None
    """The task that sub-tasks are of, such as `"toast"`."""
    learner: str | None = None
    """The learner, such as `"dyna-q"`; left out: the task's."""
    gate: str | None = None
    """The gate, by which the learner decides when to ask, such as `"ccrl"`; left out: the task's."""
    episodes: Annotated[int, Field(ge=1)] | None = None
    """The length of a lesson, such as `60`; left out: the task's."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """The seed of the arm's lessons, such as `3`; left out: the study's."""
    advisor: Literal["web", "praise:web"] = "web"
    """Whether participants name moves ("web") or praise and blame them ("praise:web")."""
    time_limit_s: Annotated[int, Field(ge=1, le=86400)] | None = None
    """The time limit [s] of each lesson, such as `300`; left out: none."""

    @model_validator(mode="after")
    def _no_code_is_named(self) -> Self:
        for word in filter(None, (*self.lessons, self.learner, self.gate)):
            if is_file_word(word):
                file, _, name = word.rpartition(":")
                raise ValueError(
                    f"'{word}' in arm '{self.name}': a protocol runs no code: wanted '{Path(file).stem}.{name}' here, and "
                    f"--own {word} on the command line"
                )
        return self


class Questionnaire(Record):
    """A questionnaire, of items of its own or one that ships with the lab, and where it is asked."""

    name: Name
    """The questionnaire's name, such as `"tlx"`."""
    ask: Annotated[tuple[Place, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    """Where it is asked, such as `["after-arm"]`."""
    use: str | None = None
    """A questionnaire that ships with the lab, such as `"nasa-tlx"`, instead of `items`."""
    title: Annotated[str, Field(max_length=200)] = ""
    """The heading of its page."""
    text: OptionalText = ""
    """The text above its items."""
    items: Annotated[tuple[QuestionItem, ...], BeforeValidator(as_tuple), Field(max_length=100)] = ()
    """Its items, in their order."""

    @model_validator(mode="after")
    def _either_own_or_shipped(self) -> Self:
        if self.use is not None and self.use not in SHIPPED:
            raise ValueError(str(unknown("questionnaire", self.use, SHIPPED, "use")))
        if (self.use is None) != bool(self.items):
            raise ValueError(f"questionnaire '{self.name}': wanted either items of its own or use = \"nasa-tlx\"")
        return self

    @property
    def asked(self) -> tuple[QuestionItem, ...]:
        """The items, in their order."""
        return self.items if self.use is None else SHIPPED[self.use]


@dataclass(frozen=True)
class PlannedStep:
    """A step of a participant's way: what it is, its name, the arm it belongs to, and the number (from 1) of its lesson."""

    kind: Kind
    name: str
    arm: str | None = None
    lesson: int | None = None


class StudyProtocol(Record):
    """A study with people: who meets which arms in which order, what they read, and what they are asked."""

    format: Literal["teaching-lab study 1"]
    """The format of the file; always "teaching-lab study 1"."""
    name: Name
    """The study's name, such as `"who-asks"`."""
    title: Annotated[str, Field(min_length=1, max_length=200)]
    """The title that participants see."""
    order: Design
    """How the order of arms is found: a balanced Latin square, drawn for each participant, or one arm for each."""
    seed: Annotated[int, Field(ge=0)] = 0
    """The seed of orders, of lessons and of pseudonyms."""
    participants: Annotated[int, Field(ge=1, le=MOST_PARTICIPANTS)] = 60
    """The most participants."""
    names: Literal["ids", "pseudonyms"] = "ids"
    """Whether participants are P01, P02, ... or have pseudonyms such as "silver deer"."""
    teacher_may: Annotated[tuple[TeacherAct, ...], BeforeValidator(as_tuple)] = ()
    """What whoever leads the study may do besides looking on, such as `["next"]`; left out: nothing."""
    texts: StudyTexts
    """What participants read."""
    arms: Annotated[tuple[StudyArm, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=MOST_ARMS)]
    """The arms."""
    questionnaires: Annotated[tuple[Questionnaire, ...], BeforeValidator(as_tuple), Field(max_length=50)] = ()
    """The questionnaires."""

    @classmethod
    def read(cls, path: Path) -> tuple[Self, TomlText]:
        """The protocol in a file, and the file's text. Raises BadInput, with file and line, for anything that is wrong in it.

        What its lessons name is checked by `checked_lessons`.
        """
        text = read_text(path)
        if len(text) > MOST_BYTES:
            raise BadInput(f"{path}: {len(text)} characters: a protocol has up to {MOST_BYTES}")
        toml = TomlText.parsed(path, text)
        try:
            protocol = cls.model_validate(toml.raw)
        except ValidationError as error:
            first = finding(error)
            at: Loc = first["loc"]
            if first["type"] == "value_error":
                at += within(toml.raw, at, first["msg"])
            raise toml.refusal(at, explain(error, partial(fields_at, cls), toml.raw)) from None
        for place, what in protocol._twice():
            raise toml.refusal(place, what)
        return protocol, toml

    def _twice(self) -> Iterator[tuple[Loc, str]]:
        """The places of names that stand twice where each may stand once, and what is to be said of them."""
        groups: list[tuple[Loc, str, Sequence[str]]] = [
            (("arms",), "arm", [arm.name for arm in self.arms]),
            (("questionnaires",), "questionnaire", [asked.name for asked in self.questionnaires]),
        ]
        for number, asked in enumerate(self.questionnaires):
            items = [item.name for item in asked.items]
            groups.append((("questionnaires", number, "items"), f"item of questionnaire '{asked.name}'", items))
        for place, what, names in groups:
            for number, name in enumerate(names):
                if name in names[:number]:
                    yield (*place, number, "name"), f"{what} '{name}' stands twice: wanted another name"

    def lessons(self, folder: Path) -> list[LessonOptions]:
        """The lessons of all arms, one arm after the other; folder: in which files of worlds and tasks are looked for."""
        return [self._lesson(arm, lesson, folder) for arm in self.arms for lesson in arm.lessons]

    def _lesson(self, arm: StudyArm, lesson: str, folder: Path) -> LessonOptions:
        task = None if arm.task is None or lesson not in SKILLS else _beside(arm.task, folder)
        seed = self.seed if arm.seed is None else arm.seed
        advisors = (arm.advisor,)
        return LessonOptions(
            *(_beside(lesson, folder), task, None, arm.learner, arm.gate, None, advisors),
            episodes=arm.episodes,
            seed=seed,
        )

    def places_of_lessons(self) -> list[Loc]:
        """The place in the file of each lesson of `lessons`."""
        return [("arms", at, "lessons", k) for at, arm in enumerate(self.arms) for k in range(len(arm.lessons))]

    # ---- a participant's way

    def order_at(self, position: int) -> tuple[str, ...]:
        """The names of the arms of the participant at a position (from 0), in their order."""
        return arms_at(self.order, [arm.name for arm in self.arms], position, self.seed)

    def steps(self, order: Sequence[str]) -> list[PlannedStep]:
        """The steps after the consent for an order of arms."""
        first = {arm.name: 1 + sum(len(b.lessons) for b in self.arms[:at]) for at, arm in enumerate(self.arms)}
        steps = self._asked("before")
        for name in order:
            arm = self.arm(name)
            if arm.text:
                steps.append(PlannedStep("text", "introduction", name))
            for k, lesson in enumerate(arm.lessons):
                steps.append(PlannedStep("lesson", lesson, name, first[name] + k))
                steps += self._asked("after-lesson", name, first[name] + k)
            steps += self._asked("after-arm", name)
        return steps + self._asked("end")

    def _asked(self, place: Place, arm: str | None = None, lesson: int | None = None) -> list[PlannedStep]:
        asked = [wanted.name for wanted in self.questionnaires if place in wanted.ask]
        return [PlannedStep("questionnaire", name, arm, lesson) for name in asked]

    def arm(self, name: str) -> StudyArm:
        """The arm with a name."""
        return next(arm for arm in self.arms if arm.name == name)

    def questionnaire(self, name: str) -> Questionnaire:
        """The questionnaire with a name."""
        return next(asked for asked in self.questionnaires if asked.name == name)


def _beside(word: str, folder: Path) -> str:
    """The path of a file that a protocol in `folder` names; any other word unchanged."""
    path = folder / word
    return str(path.absolute()) if path.suffix and is_file(path) else word
