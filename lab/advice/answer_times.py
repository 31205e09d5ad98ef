"""When and by which means a person answered, and what they saw: a file of JSON lines beside the session's journal.

The journal alone reproduces a session, and holds no times: with the same answers it has the same bytes.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Le
from pydantic import AfterValidator

from lab.advice.entries import Name
from lab.advice.journal import Journal
from lab.advice.json_lines import AppendedFile, EntryKinds
from lab.errors import BadInput, shortened
from lab.files import read_limited

FILE = "times.jsonl"
MAX_BYTES = 256 << 20
MOST_S = 1e9  # of an answer: thirty years
MEANS = {  # by which an answer is given -> what that is
    "move": "a button, a key or a word for one move",
    "path": "the first move of a path that was drawn or typed",
    "path goes on": "a further move of that path; no question was shown",
    "sentence": "a sentence, which led to a move, a path or a command",
    "rule": "what an earlier sentence said to do here; no question was shown",
    "own": "the learner's own choice, confirmed",
    "praise": "a judgement of the learner's moves",
    "skip": "no answer: the learner chooses",
    "undo": "the last answer was taken back",
    "auto": "the person answers no more",
    "time over": "no answer within the time limit",
    "closed": "the page or the input was closed",
}


def moment(text: str) -> str:
    """The text itself. Raises ValueError unless it is a date and time as ISO 8601 with a zone."""
    with suppress(ValueError):
        if datetime.fromisoformat(text).tzinfo is not None:
            return text
    raise ValueError(f"'{shortened(text)}' is no date and time with a zone, such as 2026-11-28T19:00:00.123Z")


Moment = Annotated[str, AfterValidator(moment)]


@dataclass(frozen=True)
class AnswerTime:
    """How one answer was given.

    entry: the number of its line in the journal, from 1; by: the advisor's name; means: one of MEANS.
    shown: when the question was shown (UTC, ISO 8601, ms), None if it was not; latency_s: the time [s] from then to the answer.
    said: the sentences that were said at this question. seen: what was seen then, see `lab.seat.timed_answers`.
    """

    entry: Annotated[int, Ge(1)]
    by: Name
    means: Name
    shown: Moment | None
    latency_s: Annotated[float, Ge(0.0), Le(MOST_S)] | None
    said: tuple[str, ...] = ()
    seen: dict[str, Any] = field(default_factory=dict)


_LINES = EntryKinds({"time": AnswerTime})


class AnswerTimes:
    """The file of times beside a journal, which is opened with the first answer. A line is whole once it is written."""

    def __init__(self) -> None:
        self._files: dict[Path, AppendedFile] = {}

    def write(self, journal: Journal, time: AnswerTime) -> None:
        """Add a line; nothing if the journal itself is not written. Raises BadInput or WorkFailed if it cannot be written."""
        if journal.path is None:
            return
        path = journal.path.with_name(FILE)
        if path not in self._files:
            self._files[path] = _opened(path)
        self._files[path].write(_LINES.line_of(time))

    def close(self) -> None:
        """Close the files; safe to call again."""
        while self._files:
            self._files.popitem()[1].close()


def _opened(path: Path) -> AppendedFile:
    """The file, open for appending, without a last line that was cut off."""
    try:
        try:
            return AppendedFile.new(path)
        except FileExistsError:
            file = AppendedFile.again(path)
        file.cut(read_limited(path, MAX_BYTES).rfind(b"\n") + 1)
    except OSError as error:
        raise BadInput(f"times '{path}' cannot be written: {error.strerror or error}") from None
    return file


def read_times(folder: Path) -> dict[int, AnswerTime]:
    """The times of a session's answers by the number of the journal's line; {} if none were kept.

    A last line that was cut off is left out. Raises BadInput, which names the line, for a damaged file.
    """
    path = folder / FILE
    try:
        raw = read_limited(path, MAX_BYTES)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise BadInput(f"times '{path}': cannot be read: {error.strerror or error}") from None
    times: dict[int, AnswerTime] = {}
    for number, line in enumerate(raw[: raw.rfind(b"\n") + 1].split(b"\n")[:-1], start=1):
        try:
            time: AnswerTime = _LINES.entry_of(line)
        except ValueError as error:
            raise BadInput(
                f"times '{path}': line {number}: {line[:60]!r}: {' '.join(str(error).split())[:160]}"
            ) from None
        times[time.entry] = time
    return times
