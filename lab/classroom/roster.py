"""The roster of a class: its lessons and its pupils, kept in one file of the class's folder.

Pupils are pseudonyms and hashes of keys: nobody's name or key is kept unless the teacher lets pupils type names.
"""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from secrets import choice, compare_digest, token_urlsafe
from typing import Annotated, Any, Final, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import StringConstraints, TypeAdapter, ValidationError

from lab.errors import BadInput
from lab.files import is_file, read_limited, write_whole
from lab.teaching.lesson_options import LessonOptions

FILE = "class.json"
FORMAT: Final = "teaching-lab class 1"
MOST_BYTES = 1 << 22
MOST_PUPILS = 60
MOST_JOINED = 900  # pupils of a class in all, with removed ones
NAME_LENGTH = 24
LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"  # without those that look alike
CODE_LENGTH = 6
ADVISORS = ("web",)  # of every lesson
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

    removed: by the teacher; such a pupil has no key and no seat, and the number is not used again.
    """

    number: int
    name: str
    key_hash: str
    lesson: int = 0
    removed: bool = False

    @property
    def folder(self) -> str:
        """The name of the pupil's folder in that of the class."""
        return f"{self.number:02}-{self.name.replace(' ', '-')}"


@dataclass
class _Kept:
    """The class's file."""

    format: Literal["teaching-lab class 1"]
    code: Annotated[str, StringConstraints(pattern=f"^[{LETTERS}]{{{CODE_LENGTH}}}$")]
    lessons: Annotated[list[dict[str, Any]], MinLen(1)]
    seed: Annotated[int, Ge(0)]
    most: Annotated[int, Ge(1), Le(MOST_PUPILS)]
    typed_names: bool
    port: Annotated[int, Ge(0), Le(65535)]
    pupils: list[Pupil]


class Full(Exception):
    """Raised when a class takes no more pupils; the text says why."""


@dataclass
class Roster:
    """The lessons and pupils of a class; every change is written to `folder` at once.

    code: what pupils type to join; port: of the last server, so that pupils' pages find the next one; typed_names: whether
    pupils choose their names; modules: those that the teacher has named for lessons such as gym:MODULE:ID, which is not kept.
    """

    folder: Path
    code: str
    lessons: tuple[LessonOptions, ...]
    seed: int = 0
    most: int = MOST_PUPILS
    typed_names: bool = False
    port: int = 0
    pupils: list[Pupil] = field(default_factory=list)
    modules: tuple[str, ...] = ()

    @classmethod
    def new(cls, folder: Path, lessons: Sequence[LessonOptions], seed: int, most: int, typed_names: bool) -> "Roster":
        """The roster of a new class, which is not written yet. Raises BadInput for a folder that holds a class."""
        if is_file(folder / FILE):
            raise BadInput(
                f"'{folder}' (--out) holds a class: go on with it (lab class --resume), or choose another folder"
            )
        code = "".join(choice(LETTERS) for _ in range(CODE_LENGTH))
        return cls(folder, code, tuple(lessons), seed, most, typed_names)

    @classmethod
    def read(cls, folder: Path) -> "Roster":
        """The roster in a folder. Raises BadInput if there is none, or what is there is damaged."""
        path = folder / FILE
        if not is_file(path):
            raise BadInput(
                f"'{folder}' (--resume) holds no class: a folder with {FILE} is wanted, as lab class writes it"
            )
        try:
            kept = TypeAdapter(_Kept).validate_json(read_limited(path, MOST_BYTES), strict=True)
        except OSError as error:
            raise BadInput(f"class '{path}' (--resume): {error.strerror or error}") from None
        except ValidationError as error:
            why = error.errors(include_url=False)[0]
            at = ".".join(map(str, why["loc"]))
            raise BadInput(f"class '{path}' (--resume): {at}: {why['msg']}: a file of lab class is wanted") from None
        where = f"class '{path}' (--resume)"
        lessons = tuple(LessonOptions.from_json(options, where) for options in kept.lessons)
        for options in lessons:
            if options.advisors != ADVISORS:
                raise BadInput(
                    f"{where}: lesson '{options.subtask}' has the advisors {options.advisors}: pupils advise: {ADVISORS}"
                )
        seated = sum(not pupil.removed for pupil in kept.pupils)
        if seated > kept.most or len(kept.pupils) > MOST_JOINED:
            raise BadInput(
                f"{where}: {seated} of {len(kept.pupils)} pupils have seats: {kept.most} of {MOST_JOINED} may"
            )
        for number, pupil in enumerate(kept.pupils, start=1):
            if pupil.number != number or clean_name(pupil.name) != pupil.name or not 0 <= pupil.lesson < len(lessons):
                raise BadInput(f"{where}: pupil {number} is {asdict(pupil)}: a file of lab class is wanted")
        return cls(folder, kept.code, lessons, kept.seed, kept.most, kept.typed_names, kept.port, kept.pupils)

    def write(self) -> None:
        """Write the roster, whose folder is made if it is missing. Raises OSError."""
        self.folder.mkdir(0o700, parents=True, exist_ok=True)  # other users of this computer neither read nor write it
        lessons = [options.to_json() for options in self.lessons]
        kept = _Kept(FORMAT, self.code, lessons, self.seed, self.most, self.typed_names, self.port, self.pupils)
        write_whole(self.folder / FILE, (json.dumps(asdict(kept), indent=1) + "\n").encode())

    # ---- pupils

    @property
    def seated(self) -> list[Pupil]:
        """The pupils who were not removed."""
        return [pupil for pupil in self.pupils if not pupil.removed]

    def join(self, code: str, name: str = "") -> tuple[Pupil, str] | None:
        """A new pupil and the key of their address; None for a wrong code. Raises Full.

        name: what the pupil typed, which counts only in a class of typed names; a name that is taken gets a number.
        """
        if not compare_digest(code.strip().lower().encode("utf-8", "surrogatepass"), self.code.encode()):
            return None
        if len(self.seated) >= self.most or len(self.pupils) >= MOST_JOINED:
            raise Full(f"This class is full: it has {self.most} seats.")
        wanted = clean_name(name) if self.typed_names else ""
        key = token_urlsafe(16)
        pupil = Pupil(len(self.pupils) + 1, self._free(wanted or self._pseudonym()), hash_of(key))
        self.pupils.append(pupil)
        self.write()
        return pupil, key

    def of_key(self, key: str) -> Pupil | None:
        """The pupil with this key; None for any other text."""
        hashed = hash_of(key)
        return next((pupil for pupil in self.seated if compare_digest(pupil.key_hash, hashed)), None)

    def move(self, number: int, lesson: int) -> Pupil:
        """The pupil with this number, who goes on with a lesson. Raises BadInput for a wrong number of either."""
        if not 1 <= number <= len(self.pupils):
            raise BadInput(f"pupil {number}: the class has {len(self.pupils)}")
        if not 0 <= lesson < len(self.lessons):
            raise BadInput(f"lesson {lesson + 1}: the class has {len(self.lessons)}")
        moved = self.pupils[number - 1] = replace(self.pupils[number - 1], lesson=lesson)
        self.write()
        return moved

    def remove(self, number: int) -> None:
        """Take a pupil's seat and key, for good; the folder of the pupil's lessons stays. Raises BadInput for a wrong number."""
        if not 1 <= number <= len(self.pupils):
            raise BadInput(f"pupil {number}: the class has {len(self.pupils)}")
        self.pupils[number - 1] = replace(self.pupils[number - 1], key_hash="", removed=True)
        self.write()

    def _pseudonym(self) -> str:
        """A name that depends on the class's seed and the pupil's number alone."""
        rng = np.random.default_rng([self.seed, NAMES])
        drawn = rng.permutation(len(COLOURS) * len(ANIMALS))
        colour, animal = divmod(int(drawn[len(self.pupils) % len(drawn)]), len(ANIMALS))
        return f"{COLOURS[colour]} {ANIMALS[animal]}"

    def _free(self, name: str) -> str:
        taken = {pupil.name for pupil in self.seated}
        others = (f"{name[: NAME_LENGTH - 4]} {number}" for number in range(2, MOST_PUPILS + 2))
        return name if name not in taken else next(other for other in others if other not in taken)


def hash_of(key: str) -> str:
    """The SHA-256 of a key, in hexadecimal; keys are 128 random bits, so no salt is needed."""
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()


def clean_name(name: str) -> str:
    """A typed name as it is kept: letters, digits and single spaces, at most NAME_LENGTH; "" if nothing is left."""
    return " ".join(re.findall(r"\w+", name.replace("_", " ")))[:NAME_LENGTH].strip()
