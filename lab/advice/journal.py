"""A session's journal: an append-only file of JSON lines, from which the session can be had again, bit for bit.

A session is a function of its settings, its seed and what people answered. So nothing but the journal has to be kept: to go
on after a break, or to take an answer back, the session is run again from its beginning while the journal answers for the
people, and everything else that it tells is held against what was written.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

from lab.advice.entries import (
    FILE,
    Answer,
    Closed,
    Entry,
    Read,
    Session,
    Undone,
    is_unbegun,
    line_of,
    read_journal,
    undoable,
)
from lab.advice.json_lines import AppendedFile, differing
from lab.errors import BadInput, WorkFailed
from lab.learning.requests import AdvisorLeft, Ask, Request, allowed_words
from lab.learning.session_events import EpisodeEnded


class Undo(Exception):
    """The person takes the last answer of this episode back."""


class Again(Exception):
    """The session must be run again from its beginning: an answer was taken back."""


@dataclass
class Journal:
    """A journal under way; without a path nothing is written, and answers can be taken back all the same.

    `folding`: the session is being run again, and what it tells was told before. `read_only`: a replay; when the
    entries are used up, the session is stopped. found: where one was read that is not written.
    """

    path: Path | None = None
    entries: list[Entry] = field(default_factory=list)
    read_only: bool = False
    found: Path | None = None
    _at: int = 0
    _file: AppendedFile | None = None
    _unsafe: bool = False  # a person has said something that the disk may not have

    @classmethod
    def begin(cls, folder: Path, session: Session) -> "Journal":
        """A new journal in a folder, which is made; raises BadInput when it cannot be, or there is one already."""
        path = folder / FILE
        journal = cls(path)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            journal._file = AppendedFile.again(path) if is_unbegun(path) else AppendedFile.new(path)
            if not is_unbegun(path):  # another command has been faster
                journal.close()
                raise FileExistsError
            journal._file.cut(0)
        except FileExistsError:
            raise BadInput(
                f"'{folder}' holds a session already: go on with it (--resume {folder}), or choose another folder"
            ) from None
        except OSError as error:
            raise BadInput(f"journal '{path}' cannot be written: {error.strerror or error}") from error
        journal._write(session)
        return journal

    @classmethod
    def resume(cls, found: Read) -> "Journal":
        """Go on with a journal: what was cut off at its end is taken away first. Raises BadInput when it is over.

        Another command may have gone on with it since it was found: it is read again once no other can write it.
        """
        journal = cls(found.path)
        try:
            journal._file = AppendedFile.again(found.path)
            now = read_journal(found.path, "--resume")
            if now.session != found.session:
                raise BadInput(f"journal '{found.path}': it was another session's when it was first read")
            now.check_goes_on()
            journal._file.cut(now.whole_bytes)
        except OSError as error:
            journal.close()
            raise BadInput(f"journal '{found.path}' cannot be written: {error.strerror or error}") from error
        except BadInput:
            journal.close()
            raise
        journal.entries = now.effective()
        return journal

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

    @property
    def _which(self) -> str:
        place = self.path or self.found
        return "the session's journal" if place is None else f"journal '{place}'"

    def _differs(self, entry: Entry) -> WorkFailed:
        how = differing(line_of(self.entries[self._at]), line_of(entry))
        return WorkFailed(
            f"{self._which}: it cannot be run again: {how}: another lab made it, or what it was made with has changed"
        )

    def closes(self, closed: Closed) -> None:
        """The session is over. Raises WorkFailed when it was over sooner than it once was."""
        if self.folding and not isinstance(self.entries[self._at], Closed):
            raise self._differs(closed)
        if not self.read_only and not self.folding:
            self._append(closed)

    def answer(self, by: str, request: Request, ask: Ask) -> int | None:
        """What the person `by` says to a request: from the journal, or asked now and written before it is followed.

        Raises AdvisorLeft, and Again when the person has taken the last answer of the episode back.
        """
        if self.folding:
            before = self.entries[self._at]
            known = before if isinstance(before, Answer) else Answer(by, 0, 0, 0, None)
            if known.action is not None and known.action not in request.allowed:
                allowed = "allowed " + allowed_words(request)
                raise BadInput(f"{self._which}: {line_of(known)}: action {known.action}: {allowed}: it was edited")
            self.tell(replace(known, by=by, episode=request.episode, step=request.step, state=request.state))
            return _said(known)
        given = self._asked(by, request, ask)
        self._append(given)
        self._unsafe = True
        return _said(given)

    def _asked(self, by: str, request: Request, ask: Ask) -> Answer:
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
        self._file.write(line_of(entry))
        if self._unsafe and isinstance(entry, EpisodeEnded):
            self._file.sync()  # a person's words are dear, and waiting for the disk at each of them is slow
            self._unsafe = False

    def close(self) -> None:
        """Closes the file; safe to call again."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _said(given: Answer) -> int | None:
    if given.left:
        raise AdvisorLeft(given.why)
    return given.action
