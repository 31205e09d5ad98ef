"""What a session's journal holds: its entries, one line of JSON each, and the reader that takes them in again."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from annotated_types import MaxLen, Predicate

from lab.advice.json_lines import EntryKinds, is_unwritten
from lab.errors import BadInput
from lab.files import read_limited
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    Event,
)
from lab.toolbox.names import JOURNAL

SCHEMA = 1
FILE = JOURNAL
MAX_LINE_BYTES = 1 << 20
MAX_BYTES = 64 << 20  # of a journal: hundreds of thousands of answers
Name = Annotated[str, MaxLen(1000), Predicate(str.isprintable)]


@dataclass(frozen=True)
class Session:
    """What a session was: the words that began it, the problem, and whether it went on from an earlier table.

    words: the options of the command by name; signature: of the problem; learner and gate: their settings by name; lab: the
    version that wrote it; continues: the name of the policy that it went on from, "" for none; command: "teach" or
    "sequence".
    """

    words: dict[str, Any]
    problem: Name
    signature: Name
    lab: Name
    learner: dict[str, Any] = field(default_factory=dict)
    gate: dict[str, Any] = field(default_factory=dict)
    continues: Name = ""
    command: Name = "teach"
    schema: int = SCHEMA


@dataclass(frozen=True)
class Answer:
    """What a person said: an action, None for "skip"; left: nothing more in this session, and why."""

    by: str
    episode: int
    step: int
    state: int
    action: int | None
    left: bool = False
    why: str = ""


@dataclass(frozen=True)
class Undone:
    """The last answer of a person, and all that came of it, was taken back."""

    by: str
    episode: int


@dataclass(frozen=True)
class Closed:
    """The session is over: its last word; the steps of an order are its cost and the proven optimum."""

    episodes: int
    final_steps: int | float | None
    optimal_steps: int | float | None
    solved: bool
    saved_as: str


Entry = Session | Answer | Undone | Closed | Event

KINDS: dict[str, type[Any]] = {
    "session": Session,
    "request": AdviceRequested,
    "answer": Answer,
    "advice": AdviceGiven,
    "remembered": AdviceRemembered,
    "undo": Undone,
    "episode": EpisodeEnded,
    "rejected": AdviceRejected,
    "ended": AdviceEnded,
    "disagreed": AdvisorsDisagreed,
    "dropped": AdvisorDropped,
    "readmitted": AdvisorReadmitted,
    "closed": Closed,
}
_LINES = EntryKinds(KINDS)


def line_of(entry: Entry) -> str:
    """An entry as one line of JSON, without the line's end."""
    return _LINES.line_of(entry)


def entry_of(line: str) -> Entry:
    """What a line holds. Raises ValueError for anything but an entry."""
    entry: Entry = _LINES.entry_of(line.encode(), MAX_LINE_BYTES)
    return entry


@dataclass(frozen=True)
class Read:
    """A journal as it was found: its head, its entries, how many bytes are whole lines, what was cut off at the end."""

    path: Path
    session: Session
    entries: tuple[Entry, ...]
    whole_bytes: int
    cut: str = ""

    def effective(self) -> list[Entry]:
        """The entries without those that were taken back."""
        kept: list[Entry] = []
        for entry in self.entries:
            if isinstance(entry, Undone):
                last = undoable(kept, entry.by)
                del kept[len(kept) if last is None else last :]
            else:
                kept.append(entry)
        return kept

    def said(self) -> dict[int, int]:
        """What was advised by state, the last word counting: by people, where any have answered, else by whoever did."""
        kept = self.effective()
        people = {e.state: e.action for e in kept if isinstance(e, Answer) and e.action is not None}
        return people or {e.state: e.action for e in kept if isinstance(e, AdviceGiven) and e.action is not None}

    @property
    def closed(self) -> Closed | None:
        """The session's last word, None when it is not over."""
        last = self.entries[-1] if self.entries else None
        return last if isinstance(last, Closed) else None

    def check_goes_on(self) -> None:
        """Raises BadInput when the session is over."""
        if self.closed is not None:
            raise BadInput(f"the session in '{self.path.parent}' is over: look at it again with lab replay")


def undoable(entries: Sequence[Entry], by: str) -> int | None:
    """The place of the answer that a person may take back: the last one in the episode under way; None: there is none."""
    for place in range(len(entries) - 1, -1, -1):
        entry = entries[place]
        if isinstance(entry, EpisodeEnded):
            return None
        if isinstance(entry, Answer) and entry.by == by and not entry.left:
            return place
    return None


def read_journal(folder: Path, where: str) -> Read:
    """A journal from its folder, or its file; a last line that was cut off is left out and said.

    Raises BadInput, naming `where` it was asked for and the line, for what is no journal or of another schema.
    """
    path = folder / FILE if folder.is_dir() else folder
    try:
        raw = read_limited(path, MAX_BYTES)
    except OSError as error:
        raise BadInput(f"journal '{path}' ({where}): cannot be read: {error.strerror or error}") from None
    whole = raw.rfind(b"\n") + 1
    entries: list[Entry] = []
    for number, line in enumerate(raw[:whole].split(b"\n")[:-1], start=1):
        try:
            entries.append(_LINES.entry_of(line, MAX_LINE_BYTES))
        except ValueError as error:
            if number == 1:
                _refuse_schema(line, path, where)
            why = " ".join(str(error).split())[:160]
            raise BadInput(f"journal '{path}' ({where}): line {number}: {line[:60]!r}: {why}") from None
    if not entries or not isinstance(entries[0], Session):
        raise BadInput(f"journal '{path}' ({where}): it does not begin with a session: no journal of lab teach")
    if entries[0].schema != SCHEMA:
        _refuse_schema(raw.split(b"\n", 1)[0], path, where)
    for number, entry in enumerate(entries[1:], start=2):
        if isinstance(entry, Session) or (isinstance(entry, Closed) and number < len(entries)):
            raise BadInput(f"journal '{path}' ({where}): line {number}: a second session in one journal")
    cut = raw[whole:].decode("utf-8", "replace")
    return Read(path, entries[0], tuple(entries[1:]), whole, cut)


def is_unbegun(path: Path) -> bool:
    """Whether a journal's first line was cut off: nothing of a session is in it."""
    return is_unwritten(path, b'{"kind": "session", ')


def _refuse_schema(line: bytes, path: Path, where: str) -> None:
    """Raises BadInput when a journal's head is of a schema that this version does not know."""
    try:
        schema = json.loads(line).get("schema")
    except (ValueError, AttributeError, RecursionError):
        return
    if schema != SCHEMA:
        raise BadInput(f"journal '{path}' ({where}): schema {schema!r}: this version of the lab reads schema {SCHEMA}")
