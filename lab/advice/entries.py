"""The entries of a session's journal, one line of JSON each, and the reader of journals."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from annotated_types import Ge, Le, MaxLen, Predicate

from lab.advice.json_lines import EntryKinds, is_unwritten
from lab.errors import BadInput
from lab.files import read_limited
from lab.learning.praise import MOST_MOVES, MOST_VALUE
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
    MoveJudged,
)
from lab.toolbox.names import JOURNAL

SCHEMA = 1
FILE = JOURNAL
MAX_BYTES = 64 << 20  # of a journal: hundreds of thousands of answers
Name = Annotated[str, MaxLen(1000), Predicate(str.isprintable)]


@dataclass(frozen=True)
class SessionEntry:
    """The head of a journal: how the session was started.

    words: the options of the command, by name; problem, signature: of the problem; lab: the version that wrote it; learner, gate:
    their settings, by name; continues: the name of the policy that the session continued or was warm-started from, "" for
    none; command: "teach" or "sequence".
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
    """The answer of a person or a language model: an action, None for "skip"; left: it advises no more, and why.

    holds: what the person has said in words that holds from here on (rules and times without questions, see
    `lab.seat.spoken_answers`), None if that is as before.
    """

    by: str
    episode: int
    step: int
    state: int
    action: int | None
    left: bool = False
    why: str = ""
    holds: tuple[dict[str, Any], ...] | None = field(default=None, metadata={"written": "if not None"})


@dataclass(frozen=True)
class Praise:
    """A person's judgement in answer to a question, see `lab.learning.praise.Judgement`; holds: as in `Answer`."""

    by: str
    episode: int
    step: int
    state: int
    value: Annotated[int, Ge(-MOST_VALUE), Le(MOST_VALUE)]
    moves: Annotated[int, Ge(0), Le(MOST_MOVES)]
    holds: tuple[dict[str, Any], ...] | None = field(default=None, metadata={"written": "if not None"})


@dataclass(frozen=True)
class Undone:
    """A person took the last answer back; the entries since then do not count."""

    by: str
    episode: int


@dataclass(frozen=True)
class Closed:
    """The session has ended; for an order, the steps are its cost and the proven optimum [s]."""

    episodes: int
    final_steps: int | float | None
    optimal_steps: int | float | None
    solved: bool
    saved_as: str


Entry = SessionEntry | Answer | Praise | Undone | Closed | Event

KINDS: dict[str, type[Any]] = {
    "session": SessionEntry,
    "request": AdviceRequested,
    "answer": Answer,
    "advice": AdviceGiven,
    "praise": Praise,
    "judged": MoveJudged,
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
    """An entry as one line of JSON, without a line break."""
    return _LINES.line_of(entry)


def entry_of(line: str) -> Entry:
    """The entry in a line. Raises ValueError if it holds none."""
    entry: Entry = _LINES.entry_of(line.encode())
    return entry


@dataclass(frozen=True)
class Read:
    """A journal that was read: its head, its entries, the size of its complete lines, and an incomplete last line."""

    path: Path
    session: SessionEntry
    entries: tuple[Entry, ...]
    whole_bytes: int
    cut: str = ""

    def effective(self) -> list[Entry]:
        """The entries that count: without those that were taken back."""
        kept: list[Entry] = []
        for entry in self.entries:
            if isinstance(entry, Undone):
                last = undoable(kept, entry.by)
                del kept[len(kept) if last is None else last :]
            else:
                kept.append(entry)
        return kept

    def said(self) -> dict[int, int]:
        """The last advised action by state: of people if any have answered, otherwise of all advisors."""
        kept = self.effective()
        people = {e.state: e.action for e in kept if isinstance(e, Answer) and e.action is not None}
        return people or {e.state: e.action for e in kept if isinstance(e, AdviceGiven) and e.action is not None}

    @property
    def closed(self) -> Closed | None:
        """The entry that ends the session, None if it has not ended."""
        last = self.entries[-1] if self.entries else None
        return last if isinstance(last, Closed) else None

    def check_goes_on(self) -> None:
        """Raises BadInput if the session has ended."""
        if self.closed is not None:
            raise BadInput(f"the session in '{self.path.parent}' is over: look at it again with lab replay")


def undoable(entries: Sequence[Entry], by: str) -> int | None:
    """The index of the answer or judgement that a person may take back, the last one in the current episode; None for none."""
    for place in range(len(entries) - 1, -1, -1):
        entry = entries[place]
        if isinstance(entry, EpisodeEnded):
            return None
        if isinstance(entry, Praise) and entry.by == by:
            return place
        if isinstance(entry, Answer) and entry.by == by and not entry.left:
            return place
    return None


def read_journal(folder: Path, where: str) -> Read:
    """The journal in a folder, or in a file; an incomplete last line is reported in `Read.cut` and otherwise ignored.

    Raises BadInput, which names `where` and the line, if it is no journal or has another schema.
    """
    path = folder / FILE if folder.is_dir() else folder
    try:
        raw = read_limited(path, MAX_BYTES)
    except OSError as error:
        raise BadInput(f"journal '{path}' ({where}): cannot be read: {error.strerror or error}") from None
    complete_bytes = raw.rfind(b"\n") + 1
    entries: list[Entry] = []
    for number, line in enumerate(raw[:complete_bytes].split(b"\n")[:-1], start=1):
        try:
            entries.append(_LINES.entry_of(line))
        except ValueError as error:
            if number == 1:
                _refuse_schema(line, path, where)
            why = " ".join(str(error).split())[:160]
            raise BadInput(f"journal '{path}' ({where}): line {number}: {line[:60]!r}: {why}") from None
    if not entries or not isinstance(entries[0], SessionEntry):
        raise BadInput(f"journal '{path}' ({where}): it does not begin with a session: no journal of lab teach")
    if entries[0].schema != SCHEMA:
        _refuse_schema(raw.split(b"\n", 1)[0], path, where)
    for number, entry in enumerate(entries[1:], start=2):
        if isinstance(entry, SessionEntry) or (isinstance(entry, Closed) and number < len(entries)):
            raise BadInput(f"journal '{path}' ({where}): line {number}: a second session in one journal")
    cut = raw[complete_bytes:].decode("utf-8", "replace")
    return Read(path, entries[0], tuple(entries[1:]), complete_bytes, cut)


def is_unbegun(path: Path) -> bool:
    """Whether a journal's first line is incomplete, so that it holds no session."""
    return is_unwritten(path, b'{"kind": "session", ')


def _refuse_schema(line: bytes, path: Path, where: str) -> None:
    """Raises BadInput if the head of a journal has a schema that this version cannot read."""
    try:
        schema = json.loads(line).get("schema")
    except (ValueError, AttributeError, RecursionError):
        return
    if schema != SCHEMA:
        raise BadInput(f"journal '{path}' ({where}): schema {schema!r}: this version of the lab reads schema {SCHEMA}")
