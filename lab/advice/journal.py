"""A session's journal: an append-only file of JSON lines, from which the session can be had again, bit for bit.

A session is a function of its settings, its seed and what people answered. So nothing but the journal has to be kept: to go
on after a break, or to take an answer back, the session is run again from its beginning while the journal answers for the
people, and everything else that it tells is held against what was written.
"""

import fcntl
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from lab.advice.events import (
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
from lab.advice.requests import AdviceRequest, AdvisorLeft, Ask
from lab.errors import BadInput, WorkFailed

SCHEMA = 1
FILE = "events.jsonl"
MAX_LINE_BYTES = 1 << 20


class Undo(Exception):
    """The person takes the last answer of this episode back."""


class Again(Exception):
    """The session must be run again from its beginning: an answer was taken back."""


@dataclass(frozen=True)
class Session:
    """What a session was: the words that began it, the problem, and whether it went on from an earlier table.

    words: the options of `lab teach` by name; signature: of the problem; learner and gate: their settings by name; lab: the
    version that wrote it; continues: the name of the policy that it went on from, "" for none.
    """

    words: dict[str, Any]
    problem: str
    signature: str
    lab: str
    learner: dict[str, Any] = field(default_factory=dict)
    gate: dict[str, Any] = field(default_factory=dict)
    continues: str = ""
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
    """The session is over: its last word."""

    episodes: int
    final_steps: int | None
    optimal_steps: int | None
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
_KIND_OF = {kind: name for name, kind in KINDS.items()}


def line_of(entry: Entry) -> str:
    """An entry as one line of JSON, without the line's end."""
    return json.dumps({"kind": _KIND_OF[type(entry)], **asdict(entry)}, allow_nan=False)


@cache
def _reader(kind: str) -> Any:
    from pydantic import ConfigDict, TypeAdapter

    model = KINDS[kind]
    strict = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    return TypeAdapter(type(model.__name__, (model,), {"__pydantic_config__": strict, "__doc__": model.__doc__}))


def entry_of(line: str) -> Entry:
    """What a line holds. Raises ValueError for anything but an entry."""
    try:
        record = json.loads(line)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    kind = record.pop("kind", None) if isinstance(record, dict) else None
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    from pydantic import ValidationError

    try:
        found = _reader(kind).validate_json(json.dumps(record))
    except ValidationError as error:
        wrong = [f"{'.'.join(map(str, one['loc']))}: {one['msg']}" for one in error.errors(include_url=False)]
        raise ValueError(f"{kind}: {'; '.join(wrong)}") from None
    entry: Entry = KINDS[kind](**{name: getattr(found, name) for name in found.__dataclass_fields__})
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
        raw = path.read_bytes()
    except OSError as error:
        raise BadInput(f"journal '{path}' ({where}): cannot be read: {error.strerror or error}") from None
    whole = raw.rfind(b"\n") + 1
    entries: list[Entry] = []
    for number, line in enumerate(raw[:whole].split(b"\n")[:-1], start=1):
        try:
            if len(line) > MAX_LINE_BYTES:
                raise ValueError(f"{len(line)} bytes long, allowed {MAX_LINE_BYTES}")
            entries.append(entry_of(line.decode("utf-8")))
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


def _refuse_schema(line: bytes, path: Path, where: str) -> None:
    """Raises BadInput when a journal's head is of a schema that this version does not know."""
    try:
        schema = json.loads(line).get("schema")
    except (ValueError, AttributeError, RecursionError):
        return
    if schema != SCHEMA:
        raise BadInput(f"journal '{path}' ({where}): schema {schema!r}: this version of the lab reads schema {SCHEMA}")


@dataclass
class Journal:
    """A journal under way; without a path nothing is written, and answers can be taken back all the same.

    `folding`: the session is being run again, and what it tells was told before. `read_only`: a replay; when the
    entries are used up, the session is stopped.
    """

    path: Path | None = None
    entries: list[Entry] = field(default_factory=list)
    read_only: bool = False
    _at: int = 0
    _file: int | None = None
    _unsafe: bool = False  # a person has said something that the disk may not have

    @classmethod
    def begin(cls, folder: Path, session: Session) -> "Journal":
        """A new journal in a folder, which is made; raises BadInput when it cannot be, or there is one already."""
        path = folder / FILE
        journal = cls(path)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            journal._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError:
            raise BadInput(
                f"'{folder}' holds a session already: go on with it (--resume {folder}), or choose another folder"
            ) from None
        except OSError as error:
            raise BadInput(f"journal '{path}' cannot be written: {error.strerror or error}") from error
        journal._lock()
        journal._write(session)
        return journal

    @classmethod
    def resume(cls, found: Read) -> "Journal":
        """Go on with a journal: what was cut off at its end is taken away first. Raises BadInput when it is over."""
        if found.closed is not None:
            raise BadInput(f"the session in '{found.path.parent}' is over: look at it again with lab replay")
        journal = cls(found.path, found.effective())
        try:
            journal._file = os.open(found.path, os.O_WRONLY | os.O_APPEND)
            journal._lock()
            os.ftruncate(journal._file, found.whole_bytes)
        except OSError as error:
            raise BadInput(f"journal '{found.path}' cannot be written: {error.strerror or error}") from error
        return journal

    def _lock(self) -> None:
        """Raises BadInput when another command is writing the journal."""
        assert self._file is not None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.close()
            raise BadInput(f"journal '{self.path}': another command is writing it: wait until that has ended") from None

    @property
    def folding(self) -> bool:
        """Whether what the session does now was done before."""
        return self._at < len(self.entries)

    def rewind(self) -> None:
        """The session is run again from its beginning."""
        self._at = 0

    def tell(self, entry: Entry) -> bool:
        """Writes an entry; of a session that is run again, holds it against what was written. Whether it is new.

        Raises WorkFailed when the session goes another way than it did.
        """
        if not self.folding:
            if self.read_only:
                raise KeyboardInterrupt  # the replay is over
            self._append(entry)
            return True
        before = self.entries[self._at]
        if before != entry:
            raise self._differs(entry)
        self._at += 1
        return False

    def _differs(self, entry: Entry) -> WorkFailed:
        return WorkFailed(
            f"journal '{self.path}': it cannot be run again: it says {line_of(self.entries[self._at])[:200]}, and now "
            f"comes {line_of(entry)[:200]}: another version of the lab made it, or what it was made with has changed"
        )

    def closes(self, closed: Closed) -> None:
        """The session is over. Raises WorkFailed when it was over sooner than it once was."""
        if self.folding and not isinstance(self.entries[self._at], Closed):
            raise self._differs(closed)
        if not self.read_only and not self.folding:
            self._append(closed)

    def answer(self, by: str, request: AdviceRequest, ask: Ask) -> int | None:
        """What the person `by` says to a request: from the journal, or asked now and written before it is followed.

        Raises AdvisorLeft, and Again when the person has taken the last answer of the episode back.
        """
        if self.folding:
            before = self.entries[self._at]
            known = before if isinstance(before, Answer) else Answer(by, 0, 0, 0, None)
            if known.action is not None and not 0 <= known.action < request.mdp.n_actions:
                allowed = f"allowed 0..{request.mdp.n_actions - 1}"
                raise BadInput(
                    f"journal '{self.path}': {line_of(known)}: action {known.action}: {allowed}: it was edited"
                )
            self.tell(replace(known, by=by, episode=request.episode, step=request.step, state=request.state))
            return _said(known)
        given = self._asked(by, request, ask)
        self._append(given)
        self._unsafe = True
        return _said(given)

    def _asked(self, by: str, request: AdviceRequest, ask: Ask) -> Answer:
        if self.read_only:
            raise KeyboardInterrupt  # the replay is over
        last = undoable(self.entries, by)
        while True:
            try:
                action = ask(replace(request, undoable=last is not None))
                return Answer(by, request.episode, request.step, request.state, action)
            except AdvisorLeft as left:
                return Answer(by, request.episode, request.step, request.state, None, True, str(left))
            except Undo:
                if last is None:
                    continue
                self._write(Undone(by, request.episode))
                del self.entries[last:]
                raise Again from None

    def _append(self, entry: Entry) -> None:
        self._write(entry)
        self.entries.append(entry)
        self._at = len(self.entries)

    def _write(self, entry: Entry) -> None:
        if self._file is None:
            return
        line = (line_of(entry) + "\n").encode()
        try:
            while line:
                line = line[os.write(self._file, line) :]
            if self._unsafe and isinstance(entry, EpisodeEnded):
                os.fsync(self._file)  # a person's words are dear, and waiting for the disk at each of them is slow
                self._unsafe = False
        except OSError as error:
            raise WorkFailed(f"journal '{self.path}' cannot be written: {error.strerror or error}") from error

    def close(self) -> None:
        """Closes the file; safe to call again."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


def _said(given: Answer) -> int | None:
    if given.left:
        raise AdvisorLeft(given.why)
    return given.action
