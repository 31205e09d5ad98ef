"""A study with people as it is kept: its protocol, and the records of the participants who have agreed."""

import hashlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from shutil import rmtree

from lab.classroom.class_lesson import ClassLesson
from lab.classroom.participant import FORMAT, Participant, timestamp
from lab.classroom.roster import Pupil, Roster, StudyEntry
from lab.classroom.study_protocol import MOST_BYTES, PlannedStep, StudyProtocol
from lab.classroom.tile import HAND_OUTS, REPORT, TABLE
from lab.errors import BadInput
from lab.files import read_limited, write_whole
from lab.teaching.kept_inputs import sha256_of
from lab.teaching.kept_session import named_files
from lab.teaching.lesson_options import LessonOptions

PROTOCOL = "protocol.toml"
OPTIONS = ("learner", "gate", "task", "episodes")  # of an arm, which errors name as those of the command line
WITHDRAWN = ".withdrawn-"  # beginning of the name of a folder that is being deleted


@dataclass
class Study:
    """A study in the folder of its roster. people: the participants who have agreed, by number."""

    protocol: StudyProtocol
    content: bytes  # of the protocol's file
    roster: Roster
    people: dict[int, Participant] = field(default_factory=dict)

    @classmethod
    def new(cls, file: Path, out: Path, check: Callable[[LessonOptions], object]) -> "Study":
        """A new study by a protocol's file, which is not written yet.

        check: raises BadInput for a lesson that cannot be taught. Raises BadInput, with the protocol's line, for what is wrong
        in it, and for a folder that holds a class.
        """
        protocol, toml = StudyProtocol.read(file)
        lessons = protocol.lessons(file.parent)
        for lesson, place in zip(lessons, protocol.places_of_lessons(), strict=True):
            try:
                check(lesson)
            except BadInput as error:
                key = next((key for key in OPTIONS if f"--{key}" in str(error)), None)
                at = place if key is None else (*place[:2], key)
                raise toml.refusal(at, str(error).replace(f"--{key}", str(key))) from None
        roster = Roster.new(out, lessons, protocol.seed, protocol.participants, False)
        content = _content(file)
        roster.study = StudyEntry(hashlib.sha256(content).hexdigest(), inputs_sha256=inputs_of(lessons))
        return cls(protocol, content, roster)

    @classmethod
    def read(cls, roster: Roster) -> "Study":
        """The study in the folder of a roster. Raises BadInput if its protocol has been changed, or a record is damaged."""
        assert roster.study is not None
        file = roster.folder / PROTOCOL
        content = _content(file)
        if (now := hashlib.sha256(content).hexdigest()) != roster.study.protocol_sha256:
            raise BadInput(
                f"protocol '{file}' (--resume) has been changed since the study began: SHA-256 {now[:12]}..., wanted "
                f"{roster.study.protocol_sha256[:12]}...: put the old file back, or begin a new study"
            )
        if roster.study.inputs_sha256 and (changed := _changed(roster)):
            raise BadInput(
                f"'{changed}', which a lesson of the study '{roster.folder}' (--resume) is about, has been changed since the "
                "study began: put the old one back, or begin a new study"
            )
        study = cls(StudyProtocol.read(file)[0], content, roster)
        if len(study.protocol.places_of_lessons()) != len(roster.lessons):
            raise BadInput(f"study '{roster.folder}' (--resume): its lessons are not those of its protocol")
        for pupil in roster.present:
            if study.folder(pupil).is_dir():
                study.people[pupil.number] = study._checked(
                    Participant.read(study.folder(pupil), pupil.number, pupil.name)
                )
        return study

    def _checked(self, person: Participant) -> Participant:
        arms = sorted(arm.name for arm in self.protocol.arms)
        fits = sorted(person.order) == arms or (
            self.protocol.order == "between" and person.order in [[arm] for arm in arms]
        )
        planned = self.protocol.steps(person.order) if fits else []
        if [step.plan for step in person.steps] != planned[: len(person.steps)] or not person.steps:
            raise BadInput(
                f"participant {person.participant} of '{self.roster.folder}' (--resume): the steps are not the protocol's"
            )
        lesson = next((step.lesson for step in reversed(person.steps) if step.kind == "lesson"), None) or 1
        pupil = self.roster.pupils[person.number - 1]
        if pupil.lesson != lesson - 1:  # the roster could not be written when the lesson began
            self.roster.pupils[person.number - 1] = replace(pupil, lesson=lesson - 1)
        return person

    def begin(self) -> None:
        """Write the protocol into the study's folder, and finish withdrawals that were cut off. Raises OSError."""
        self.roster.folder.mkdir(parents=True, exist_ok=True)
        write_whole(self.roster.folder / PROTOCOL, self.content)
        for left in self.roster.folder.glob(f"{WITHDRAWN}*"):
            rmtree(left)
        for pupil in self.roster.present:
            if pupil.number not in self.people:  # the folder is gone, or was never made
                self._delete_written()
                self.roster.retire(pupil.number)

    # ---- participants

    def folder(self, pupil: Pupil) -> Path:
        """The folder of a participant."""
        return self.roster.folder / pupil.folder

    def admit(self, key: str) -> Pupil:
        """A new participant, who has agreed and is at the first step. Raises Full, and OSError: then nothing is kept."""
        name = f"P{len(self.roster.pupils) + 1:02}" if self.protocol.names == "ids" else ""
        pupil, position = self.roster.admit(key, name)
        order = [*self.protocol.order_at(position)]
        person = Participant(FORMAT, pupil.name, pupil.number, order, timestamp())
        try:
            self.keep(person.at_next(self.protocol.steps(order)))
        except OSError:
            with suppress(OSError):
                self.erase(pupil)
                self.roster.retire(pupil.number)
            raise
        return pupil

    def keep(self, person: Participant) -> None:
        """Take over a participant's new record and write it. Raises OSError: then the old one stays."""
        person.write(self.folder(self.roster.pupils[person.number - 1]))
        self.people[person.number] = person

    def told(self) -> dict[str, object]:
        """What the page of whoever leads the study needs: its title, and what that page may do."""
        return {"title": self.protocol.title, "may": self.protocol.teacher_may}

    def planned(self, person: Participant) -> list[PlannedStep]:
        """All steps of a participant."""
        return self.protocol.steps(person.order)

    def erase(self, pupil: Pupil) -> None:
        """Delete all files about a participant. Raises OSError; it may be called again, and a study that goes on finishes it.

        Once it is done, `Roster.retire` keeps the number alone.
        """
        self.people.pop(pupil.number, None)
        self._delete_written()
        folder, leaving = self.folder(pupil), self.roster.folder / f"{WITHDRAWN}{pupil.number}"
        for _ in range(2):  # what an erasure before this one has left, then the folder itself
            if leaving.is_dir():
                rmtree(leaving)
            if folder.is_dir():
                folder.rename(leaving)

    def _delete_written(self) -> None:
        """Delete the table and the pages, which are written anew when the study's server ends."""
        for written in (TABLE, REPORT, HAND_OUTS):
            (self.roster.folder / written).unlink(missing_ok=True)


def inputs_of(lessons: Sequence[ClassLesson]) -> list[str]:
    """The SHA-256 of what each lesson is about: its world or task, and the files that these name."""
    return [sha256_of(_files_of(lesson).values()) for lesson in lessons]


def _files_of(lesson: ClassLesson) -> dict[str, str]:
    return named_files(lesson) if isinstance(lesson, LessonOptions) else {}


def _changed(roster: Roster) -> str:
    """The first lesson's world or task that is not the one with which the study began, "" for none."""
    assert roster.study is not None
    known = zip(roster.lessons, inputs_of(roster.lessons), roster.study.inputs_sha256, strict=False)
    return next((", ".join(_files_of(lesson).values()) for lesson, now, then in known if now != then), "")


def _content(file: Path) -> bytes:
    try:
        return read_limited(file, MOST_BYTES)
    except OSError as error:
        raise BadInput(f"protocol '{file}': {error.strerror or error}") from None
