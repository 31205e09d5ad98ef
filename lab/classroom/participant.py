"""What is kept of a participant of a study beside the lessons: consent, order of arms, and every step with its answers."""

import datetime
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

from lab.advice.answer_times import Moment
from lab.classroom.questionnaire import Answer
from lab.classroom.study_protocol import Kind, PlannedStep
from lab.errors import BadInput
from lab.files import write_whole
from lab.tasks.record import read_json

FILE = "participant.json"
FORMAT: Final = "teaching-lab participant 1"
MOST_BYTES = 1 << 24


@dataclass(frozen=True)
class Step:
    """A step that has begun: what it is (see `PlannedStep`), its times (ISO 8601, UTC), and its answers by item."""

    kind: Kind
    name: str
    arm: str | None
    lesson: int | None
    began: Moment
    ended: Moment | None = None
    timed_out: bool = False
    answers: dict[str, Answer] = field(default_factory=dict)

    @classmethod
    def of(cls, planned: PlannedStep) -> "Step":
        """The planned step, which begins now."""
        return cls(planned.kind, planned.name, planned.arm, planned.lesson, timestamp())

    @property
    def plan(self) -> PlannedStep:
        """What was planned."""
        return PlannedStep(self.kind, self.name, self.arm, self.lesson)


@dataclass(frozen=True)
class Participant:
    """A participant who has agreed; `steps` are those that have begun, and only the last of them may not have ended."""

    format: Literal["teaching-lab participant 1"]
    participant: str
    number: int
    order: list[str]
    consented: Moment
    finished: Moment | None = None
    steps: list[Step] = field(default_factory=list)

    @classmethod
    def read(cls, folder: Path, number: int, name: str) -> "Participant":
        """The participant of a folder. Raises BadInput if the file is missing or damaged, or is of somebody else."""
        path = folder / FILE
        read = read_json(path, cls, f"participant '{path}'", "a file of lab class --study is wanted", MOST_BYTES)
        if (read.number, read.participant) != (number, name):
            raise BadInput(f"participant '{path}' is {read.participant} ({read.number}): wanted {name} ({number})")
        return read

    def write(self, folder: Path) -> None:
        """Write the file, whose folder is made if it is missing. Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / FILE, (json.dumps(asdict(self), indent=1) + "\n").encode())

    @property
    def step(self) -> Step | None:
        """The current step; None once all are over."""
        return None if self.finished is not None or not self.steps else self.steps[-1]

    def with_step(self, step: Step) -> "Participant":
        """The participant, whose current step is replaced by this one."""
        return replace(self, steps=[*self.steps[:-1], step])

    def with_end(self, timed_out: bool = False, answers: Mapping[str, Answer] | None = None) -> "Participant":
        """The participant whose current step, if it has not ended yet, ends now."""
        step = self.steps[-1]
        if step.ended is not None:
            return self
        return self.with_step(replace(step, ended=timestamp(), timed_out=timed_out, answers={**(answers or {})}))

    def at_next(self, planned: Sequence[PlannedStep]) -> "Participant":
        """The participant at the next of the planned steps, which begins now; after the last one everything is finished."""
        if len(self.steps) >= len(planned):
            return replace(self, finished=timestamp())
        return replace(self, steps=[*self.steps, Step.of(planned[len(self.steps)])])


def timestamp() -> str:
    """The time now, in UTC, to the millisecond: "2026-11-28T19:00:00.123Z"."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def seconds_since(at: str) -> float:
    """The time [s] that has passed since a timestamp."""
    return (datetime.datetime.now(datetime.UTC) - datetime.datetime.fromisoformat(at)).total_seconds()
