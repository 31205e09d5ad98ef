"""The roster of a class: its lessons and its pupils, kept in one file of the class's folder.

Pupils are pseudonyms and hashes of keys: nobody's name or key is kept unless the teacher lets pupils type names.
"""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from secrets import choice, compare_digest, token_urlsafe
from typing import Annotated, Any, Final, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import StringConstraints

from lab.classroom.class_lesson import (
    ClassLesson,
    advisors_of,
    is_operation,
    lesson_from_json,
    lesson_to_json,
    name_of,
)
from lab.errors import BadInput
from lab.files import is_file, write_whole
from lab.tasks.record import read_json

FILE = "class.json"
# fields that older files lack, and that are written only where they say something
OPTIONAL_FIELDS = ("study", "teams", "times", "turn_s")
FORMAT: Final = "teaching-lab class 1"
MOST_BYTES = 1 << 22
MOST_PUPILS = 60
MOST_TEAMS = 12
MOST_PARTICIPANTS = 500  # of a study, who are not all there at once
MOST_TURN_S = 3600.0  # of one turn at a run by hand
MOST_JOINED = 900  # numbers of a class in all, with those of who was removed or has withdrawn
NAME_LENGTH = 24
LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"  # without those that look alike
CODE_LENGTH = 6
NAMES = 37  # part of the seed of pseudonyms
COLOURS = (
    *("amber", "azure", "black", "blue", "bronze", "brown", "copper", "coral", "golden", "green", "grey", "indigo"),
    *("ivory", "jade", "lilac", "olive", "orange", "pink", "purple", "red", "silver", "teal", "violet", "white"),
)
ANIMALS = (
    *("badger", "bear", "beaver", "bison", "crane", "deer", "dolphin", "eagle", "falcon", "finch", "fox", "hare"),
    *("heron", "ibex", "lark", "lynx", "marten", "otter", "owl", "panda", "raven", "seal", "swan", "wolf"),
)


@dataclass(frozen=True)
class Pupil:
    """A pupil: a number from 1 on, a name, the SHA-256 of the key in the pupil's address, and the current lesson's number.

    team: the number of the pupil's team from 1 on, 0 in a class without teams. removed: by the teacher; such a
    pupil has no key and no seat, and the number is not used again.

    A participant who has withdrawn leaves the number alone: name and hash are "", and nobody gets the number again.
    """

    number: int
    name: str
    key_hash: str
    lesson: int = 0
    team: int = 0
    removed: bool = False

    @property
    def is_gone(self) -> bool:
        """Whether the pupil was removed, or this is only the number of somebody who has withdrawn."""
        return self.removed or not self.name

    @property
    def folder(self) -> str:
        """The name of the pupil's folder in that of the class."""
        return f"{self.number:02}-{self.name.replace(' ', '-')}"


@dataclass
class StudyEntry:
    """What a class's file keeps of a study: the SHA-256 of its protocol, and the position of each number in the design.

    A position is None for who has withdrawn: the next participant gets it. inputs_sha256: of what each lesson is about.
    """

    protocol_sha256: str
    positions: list[int | None] = field(default_factory=list)
    inputs_sha256: list[str] = field(default_factory=list)

    def free_position(self) -> int:
        """The lowest position (from 0) that no participant has."""
        return next(position for position in range(len(self.positions) + 1) if position not in self.positions)


@dataclass
class _Kept:
    """The class's file."""

    format: Literal["teaching-lab class 1"]
    code: Annotated[str, StringConstraints(pattern=f"^[{LETTERS}]{{{CODE_LENGTH}}}$")]
    lessons: Annotated[list[dict[str, Any]], MinLen(1)]
    seed: Annotated[int, Ge(0)]
    most: Annotated[int, Ge(1), Le(MOST_PARTICIPANTS)]
    typed_names: bool
    port: Annotated[int, Ge(0), Le(65535)]
    pupils: list[Pupil]
    study: StudyEntry | None = None
    teams: Annotated[int, Ge(0), Le(MOST_TEAMS)] = 0
    times: bool = False
    turn_s: Annotated[float, Ge(0.0), Le(MOST_TURN_S)] = 0.0


class Full(Exception):
    """Raised when a class takes no more pupils; the text says why."""


@dataclass
class Roster:
    """The lessons and pupils of a class; every change is written to `folder` at once.

    code: what pupils type to join; port: of the last server, so that pupils' pages find the next one; typed_names: whether
    pupils choose their names; modules: those that the teacher has named for lessons such as gym:MODULE:ID, which is not kept;
    study: of a class that is a study; teams: in how many teams the pupils teach, 0 if each teaches alone; times: whether the
    times of pupils' answers are kept beside their journals; turn_s: the length of a turn [s] at a run by hand, 0: no limit.
    """

    folder: Path
    code: str
    lessons: tuple[ClassLesson, ...]
    seed: int = 0
    most: int = MOST_PUPILS
    typed_names: bool = False
    port: int = 0
    pupils: list[Pupil] = field(default_factory=list)
    modules: tuple[str, ...] = ()
    study: StudyEntry | None = None
    teams: int = 0
    times: bool = False
    turn_s: float = 0.0

    @classmethod
    def new(cls, folder: Path, lessons: Sequence[ClassLesson], seed: int, most: int, typed_names: bool) -> "Roster":
        """The roster of a new class, which is not written yet. Raises BadInput for a folder that holds a class."""
        if is_file(folder / FILE):
            raise BadInput(
                f"'{folder}' (--out) holds a class: go on with it (lab class --resume), or choose another folder"
            )
        code = "".join(choice(LETTERS) for _ in range(CODE_LENGTH))
        return cls(folder, code, tuple(lessons), seed, most, typed_names)

    @classmethod
    def read(cls, folder: Path, option: str = "--resume") -> "Roster":
        """The roster in the folder that an option names. Raises BadInput if there is none, or what is there is damaged."""
        path = folder / FILE
        where = f"class '{path}' ({option})"
        if not is_file(path):
            raise BadInput(
                f"'{folder}' ({option}) holds no class: a folder with {FILE} is wanted, as lab class writes it"
            )
        kept = read_json(path, _Kept, where, "a file of lab class is wanted", MOST_BYTES)
        lessons = tuple(lesson_from_json(options, where) for options in kept.lessons)
        for lesson in lessons:
            allowed = advisors_of(lesson, kept.study is not None)
            if lesson.advisor_names not in allowed:
                raise BadInput(
                    f"{where}: lesson '{name_of(lesson)}' has the advisors {lesson.advisor_names}: allowed is {allowed[0]}"
                )
        if is_operation(lessons) and (kept.teams or kept.study is not None):
            raise BadInput(f"{where}: a run by hand with teams, or in a study: a file of lab class is wanted")
        if kept.study is not None and len(kept.study.positions) != len(kept.pupils):
            raise BadInput(
                f"{where}: {len(kept.study.positions)} positions, {len(kept.pupils)} pupils: a file of lab class is wanted"
            )
        seated = sum(not pupil.is_gone for pupil in kept.pupils)
        if seated > kept.most or len(kept.pupils) > MOST_JOINED:
            raise BadInput(
                f"{where}: {seated} of {len(kept.pupils)} pupils have seats: {kept.most} of {MOST_JOINED} may"
            )
        for number, pupil in enumerate(kept.pupils, start=1):
            is_named = pupil.number == number and clean_name(pupil.name) == pupil.name
            is_placed = 0 <= pupil.lesson < len(lessons) and (0 if kept.teams == 0 else 1) <= pupil.team <= kept.teams
            if not (is_named and (is_placed or pupil.is_gone)):
                raise BadInput(f"{where}: pupil {number} is {asdict(pupil)}: a file of lab class is wanted")
        read = cls(folder, kept.code, lessons, kept.seed, kept.most, kept.typed_names, kept.port, kept.pupils)
        read.study, read.teams, read.times, read.turn_s = kept.study, kept.teams, kept.times, kept.turn_s
        return read

    def write(self) -> None:
        """Write the roster, whose folder is made if it is missing. Raises OSError."""
        self.folder.mkdir(0o700, parents=True, exist_ok=True)  # other users of this computer neither read nor write it
        lessons = [lesson_to_json(lesson) for lesson in self.lessons]
        kept = _Kept(
            *(FORMAT, self.code, lessons, self.seed, self.most, self.typed_names, self.port, self.pupils),
            *(self.study, self.teams, self.times, self.turn_s),
        )
        record = {name: value for name, value in asdict(kept).items() if name not in OPTIONAL_FIELDS or value}
        write_whole(self.folder / FILE, (json.dumps(record, indent=1) + "\n").encode())

    # ---- pupils

    def lesson_folder(self, pupil: Pupil, lesson: int) -> Path:
        """The folder of a lesson (from 0) of a pupil, or of a team as it is among `learners`."""
        return self.folder / pupil.folder / f"lesson-{lesson + 1}"

    def join(self, code: str, name: str = "") -> tuple[Pupil, str] | None:
        """A new pupil and the key of their address; None for a wrong code. Raises Full.

        name: what the pupil typed, which counts only in a class of typed names; a name that is taken gets a number.
        Raises OSError if the roster cannot be written; then nobody has joined.
        """
        if not self.is_code(code):
            return None
        self.check_room()
        wanted = clean_name(name) if self.typed_names else ""
        key = token_urlsafe(16)
        team = min(range(1, self.teams + 1), key=lambda team: len(self.members(team)), default=0)
        fellows = self.members(team)
        lesson = fellows[0].lesson if team and fellows else 0
        pupil = Pupil(
            len(self.pupils) + 1, self._free(wanted or self._pseudonym()), hash_of(key), lesson=lesson, team=team
        )
        self._take_over([*self.pupils, pupil])
        return pupil, key

    def is_code(self, code: str) -> bool:
        """Whether somebody has typed the class's code."""
        return compare_digest(code.strip().lower().encode("utf-8", "surrogatepass"), self.code.encode())

    def check_room(self) -> None:
        """Raises Full unless another pupil may join."""
        if len(self.present) >= self.most or len(self.pupils) >= MOST_JOINED:
            raise Full(f"This class is full: it has {self.most} seats.")

    @property
    def present(self) -> list[Pupil]:
        """The pupils, without those who were removed and the numbers of those who have withdrawn."""
        return [pupil for pupil in self.pupils if not pupil.is_gone]

    def members(self, team: int) -> list[Pupil]:
        """The pupils of a team."""
        return [pupil for pupil in self.present if pupil.team == team]

    @property
    def learners(self) -> list[Pupil]:
        """Whose learners there are: the pupils, or teams with anybody in them, with the numbers and names of teams."""
        if not self.teams:
            return self.present
        begun = [(team, self.members(team)) for team in range(1, self.teams + 1)]
        return [Pupil(team, f"team {team}", "", pupils[0].lesson) for team, pupils in begun if pupils]

    def admit(self, key: str, name: str = "") -> tuple[Pupil, int]:
        """A new participant of a study, who has agreed, and the position in its design. name: "" for a pseudonym.

        Raises Full, and OSError if the roster cannot be written: then nobody was admitted.
        """
        assert self.study is not None
        self.check_room()
        pupil = Pupil(len(self.pupils) + 1, self._free(name or self._pseudonym()), hash_of(key))
        position = self.study.free_position()
        self._take_over([*self.pupils, pupil], [*self.study.positions, position])
        return pupil, position

    def retire(self, number: int) -> None:
        """Keep of a participant the number alone; the position in the design is free again.

        Raises OSError; then nothing has changed.
        """
        assert self.study is not None
        positions = [None if at == number else place for at, place in enumerate(self.study.positions, start=1)]
        self._take_over(self._with(Pupil(number, "", "")), positions)

    def of_key(self, key: str) -> Pupil | None:
        """The pupil with this key; None for any other text."""
        hashed = hash_of(key)
        return next((pupil for pupil in self.present if compare_digest(pupil.key_hash, hashed)), None)

    def move(self, lessons: Mapping[int, int]) -> None:
        """Let pupils go on with lessons (from 0), by the pupils' numbers.

        Raises BadInput for a wrong number of either, and OSError; then nobody has moved.
        """
        for number, lesson in lessons.items():
            self._check_number(number)
            if not 0 <= lesson < len(self.lessons):
                raise BadInput(f"lesson {lesson + 1}: the class has {len(self.lessons)}")
        self._take_over(self._with(*(replace(self.pupils[n - 1], lesson=lesson) for n, lesson in lessons.items())))

    def remove(self, number: int) -> None:
        """Take a pupil's seat and key, for good; the folder of the pupil's lessons stays.

        Raises BadInput for a wrong number, and OSError; then the pupil keeps both.
        """
        self._check_number(number)
        self._take_over(self._with(replace(self.pupils[number - 1], key_hash="", removed=True)))

    def _check_number(self, number: int) -> None:
        if not 1 <= number <= len(self.pupils):
            raise BadInput(f"pupil {number}: the class has {len(self.pupils)}")

    def _with(self, *changed: Pupil) -> list[Pupil]:
        """The pupils, some of whom have changed."""
        new = {pupil.number: pupil for pupil in changed}
        return [new.get(pupil.number, pupil) for pupil in self.pupils]

    def _take_over(self, pupils: list[Pupil], positions: list[int | None] | None = None) -> None:
        """Write changed pupils, and a study's positions. Raises OSError: then everything is as it was."""
        before = self.pupils, self.study
        self.pupils = pupils
        if self.study is not None and positions is not None:
            self.study = replace(self.study, positions=positions)
        try:
            self.write()
        except OSError:
            self.pupils, self.study = before
            raise

    def _pseudonym(self) -> str:
        """A name that depends on the class's seed and the pupil's number alone."""
        rng = np.random.default_rng([self.seed, NAMES])
        drawn = rng.permutation(len(COLOURS) * len(ANIMALS))
        colour, animal = divmod(int(drawn[len(self.pupils) % len(drawn)]), len(ANIMALS))
        return f"{COLOURS[colour]} {ANIMALS[animal]}"

    def _free(self, name: str) -> str:
        # a team's journal names its pupils, so there a name stands for one pupil alone
        taken = {pupil.name for pupil in (self.pupils if self.teams else self.present)}
        others = (f"{name[: NAME_LENGTH - 4]} {number}" for number in range(2, len(taken) + 3))
        return name if name not in taken else next(other for other in others if other not in taken)


def hash_of(key: str) -> str:
    """The SHA-256 of a key, in hexadecimal; keys are 128 random bits, so no salt is needed."""
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()


def clean_name(name: str) -> str:
    """A typed name as it is kept: letters, digits and single spaces, at most NAME_LENGTH; "" if nothing is left."""
    return " ".join(re.findall(r"\w+", name.replace("_", " ")))[:NAME_LENGTH].strip()
