"""The base of all file records: frozen, checked fields; names; settings of learning; and reading and writing of texts."""

import hashlib
from dataclasses import asdict, replace
from math import inf, isfinite
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, cast

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic_core import CoreSchema

from lab import files
from lab.errors import BadInput, counted, shortened, unknown
from lab.learning.gates import GATES
from lab.learning.session_result import check_members
from lab.learning.settings import SETTINGS, GateSettings, LearnerSettings
from lab.learning.updates import UPDATES
from lab.mdp import Rewards

MAX_FILE_BYTES = 10_000_000  # of a text file: enough for the obstacles of a world of 100 x 100 x 100 cells
MAX_SHORT_BYTES = 1_000_000  # of a file without a world: reading a longer one takes seconds
MAX_REWARD = 1_000_000  # in sums with larger rewards, small ones are lost; much larger ones overflow

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9 _-]{0,39}$"
Kept = TypeVar("Kept")
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Count = Annotated[int, Field(ge=1, le=100)]


def as_tuple(value: object) -> object:
    """A list as a tuple, for a strict field; anything else as it is."""
    return tuple(value) if isinstance(value, list) else value


class Record(BaseModel):
    """A frozen record that knows its fields and takes no others.

    The text below a field is its description in the schema and in the reference (`lab.tasks.schema`): its unit stands in
    brackets, [-] for a bare number, and an example after "such as". A key is added as one field with such a text.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


class _FromTable:
    """Lets a dataclass in a strict record be written as a table; its own fields stay strict."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = handler(source)
        cast(dict[str, Any], handler.resolve_ref_schema(schema))["strict"] = False
        return schema


FROM_TABLE = _FromTable()


def walking(step: float, learner: LearnerSettings) -> float:
    """The return of the longest walk: for ever or, without discount, through a whole episode; step: the reward of a move."""
    for_ever = inf if learner.discount == 1.0 else 1.0 / (1.0 - learner.discount)
    return step * min(for_ever, learner.max_steps)


class Learned(Record):
    """Settings of learning: learner, rewards and gate. The gate has `spare_best` on unless a file switches it off.

    A `rewards.collision` that a file leaves out is the return of the longest walk minus the reward of the goal: however long a
    learner has strayed, continuing is worth more than a collision.
    """

    learner: Annotated[LearnerSettings, FROM_TABLE] = LearnerSettings()
    """The settings of the learner, such as `{ learner = "dyna-q", episodes = 300 }`; left-out keys have their defaults."""
    rewards: Annotated[Rewards, FROM_TABLE] = Field(default=cast(Rewards, {}), validate_default=True)
    """The rewards of moves, such as `{ goal = 1.5, step = -0.1 }`."""
    gate: Annotated[GateSettings, FROM_TABLE] = GateSettings(spare_best=True)
    """The settings of the gate, by which the learner asks for advice, such as `{ gate = "ccrl", omega = 7 }`;
    `spare_best` is true by default here.
    """

    @field_validator("rewards", mode="before")
    @classmethod
    def _crash_costs_most(cls, rewards: Any, others: ValidationInfo) -> Any:
        if not isinstance(rewards, dict) or "collision" in rewards or "learner" not in others.data:
            return rewards
        goal, step = (rewards.get(name, getattr(Rewards, name)) for name in ("goal", "step"))
        if (
            not all(isinstance(value, int | float) and isfinite(value) for value in (goal, step))
            or goal <= 0
            or step > 0
        ):
            return rewards  # the field's own validation refuses it
        return rewards | {"collision": round(walking(step, others.data["learner"]) - goal, 6)}

    @field_validator("gate", mode="before")
    @classmethod
    def _best_is_spared(cls, gate: Any) -> Any:
        return {"spare_best": True} | gate if isinstance(gate, dict) else gate

    @field_validator("rewards")
    @classmethod
    def _sums_are_finite(cls, rewards: Rewards) -> Rewards:
        for field, value in asdict(rewards).items():
            if abs(value) > MAX_REWARD:
                raise ValueError(f"{field} = {value}: allowed are -{MAX_REWARD} to {MAX_REWARD}")
        return rewards

    def warning(self) -> str | None:
        """The reason why a strayed learner does better to collide with these rewards; None if it does not."""
        collision, learner, moves, walked = self.rewards.collision, self.learner, 0, 0.0
        if collision < walking(self.rewards.step, learner):
            return None
        while walked > collision and moves < learner.max_steps:
            walked += self.rewards.step * learner.discount**moves
            moves += 1
        fitting = walking(self.rewards.step, learner) - self.rewards.goal
        return (
            f"rewards.collision = {collision}: {counted(moves, 'move')} cost as much, so a learner that has strayed longer "
            f"does better to crash: wanted a lower one; left out, it is {fitting:g}"
        )

    def check_members(self, where: str = "") -> None:
        """Raises BadInput for an unknown learner, selection or gate; `where` comes before the names of the tables."""
        check_members(self.learner, self.gate, (f"{where}learner", f"{where}gate"))

    def changed(self, where: str = "--", **given: object) -> Self:
        """The record with other settings of learner and gate, each by its name, or a class for these two; None: unchanged.

        Raises BadInput for a name that neither has, a value outside its range, and an unknown learner or gate; `where`
        comes before the names of the tables.
        """
        named: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        if "learner" in named:
            named["learner"] = UPDATES.named(named["learner"])
        if "gate" in named:
            named["gate"] = GATES.named(named["gate"])
        for name in named:
            if name not in SETTINGS:
                raise unknown("setting", name, SETTINGS, where or "learner and gate")
        own = replace(self.learner, **{name: value for name, value in named.items() if hasattr(self.learner, name)})
        when = replace(self.gate, **{name: value for name, value in named.items() if hasattr(self.gate, name)})
        other = self.model_copy(update={"learner": own, "gate": when})
        other.check_members(where)
        return other


def read_text(path: Path) -> str:
    """The text of a file; raises BadInput when it cannot be read, is not UTF-8, or is longer than MAX_FILE_BYTES."""
    try:
        return files.read_limited(path, MAX_FILE_BYTES).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: cannot be read: {error}") from None


def first_fault(error: ValidationError) -> str:
    """The first fault that a validation found, with its place and the bad value: "port = 'x': Input should be ..."."""
    first = error.errors(include_url=False)[0]
    value = f" = {shortened(repr(first['input']))}"
    if first["type"] in ("missing", "value_error"):  # there is none; the message of a check of our own names it
        value = ""
    return f"{'.'.join(map(str, first['loc']))}{value}: {first['msg'].removeprefix('Value error, ')}"


def read_json(path: Path, kind: type[Kept], which: str, wanted: str, most_bytes: int = MAX_FILE_BYTES) -> Kept:
    """The record in a JSON file that the lab has kept; kind: its dataclass, whose fields are checked strictly.

    which: the file for messages, such as "class 'monday/class.json' (--resume)"; wanted: what it should be. Raises BadInput for
    a file that cannot be read, is longer than `most_bytes`, or holds anything else.
    """
    try:
        return TypeAdapter(kind).validate_json(files.read_limited(path, most_bytes), strict=True)
    except OSError as error:
        raise BadInput(f"{which}: '{path.name}': {error.strerror or error}: {wanted}") from None
    except ValidationError as error:
        raise BadInput(f"{which}: {first_fault(error)}: {wanted}") from None
    except BadInput as error:  # what the record itself refuses
        raise BadInput(f"{which}: {error}") from None


def hash_of(record: Record) -> str:
    """A hash (24 hex digits) of all that a record says, such as a task; what was kept of it is resumed only with the same one."""
    return hashlib.sha256(record.model_dump_json(exclude_defaults=True).encode()).hexdigest()[:24]


def write_whole(path: Path, text: str) -> None:
    """Writes a text file whole or not at all, replacing one that is there; raises BadInput when it cannot be written."""
    try:
        files.write_whole(path, text.encode())
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror or error}") from error
