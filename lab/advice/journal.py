"""A session's journal: an append-only file of JSON lines, from which the session can be reproduced exactly.

A session is a function of its settings, its seed and people's answers, so the journal is all that has to be stored. To resume
it, or to take an answer back, the session is run again from its beginning: the journal answers for the people, and all other
events are compared with the recorded ones.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lab.advice.entries import (
    FILE,
    Answer,
    Closed,
    Entry,
    Praise,
    Read,
    SessionEntry,
    Undone,
    is_unbegun,
    line_of,
    read_journal,
    undoable,
)
from lab.advice.json_lines import AppendedFile, differing
from lab.errors import BadInput, WorkFailed
from lab.learning.praise import Judgement
from lab.learning.requests import AdvisorLeft, Ask, Reply, Request
from lab.learning.session_events import EpisodeEnded
from lab.plugins.family import allowed_words


class Undo(Exception):
    """Raised by a person's `Ask` function to take the last answer of this episode back."""


class Again(Exception):
    """Raised if an answer was taken back, so that the session has to be run again from its beginning."""


@dataclass
class Journal:
    """The journal of a running session.

    path: of the file, None if nothing is written (answers can be taken back all the same).
    entries: those that count.
    read_only: a replay, which stops the session at the last entry; found: the file that is replayed.
    lines: of the file so far, its head and the answers that were taken back among them.
    """

    path: Path | None = None
    entries: list[Entry] = field(default_factory=list)
    read_only: bool = False
    found: Path | None = None
    lines: int = 0
    _at: int = 0
    _file: AppendedFile | None = None
    _unsafe: bool = False  # an answer may not be on the disk yet
    _holds: dict[str, tuple[dict[str, Any], ...]] = field(default_factory=dict)  # by person: what was said and holds

    @classmethod
    def begin(cls, folder: Path, session: SessionEntry) -> "Journal":
        """A new journal in a folder, which is created. Raises BadInput if it cannot be, or if it holds a journal."""
        path = folder / FILE
        journal = cls(path)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            journal._file = AppendedFile.again(path) if is_unbegun(path) else AppendedFile.new(path)
            if not is_unbegun(path):  # another command has begun a journal meanwhile
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
        """A journal to be continued; an incomplete last line is removed. Raises BadInput if the session has ended.

        The file is read again once it is locked, because another command may have continued it meanwhile.
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
        journal.entries, journal.lines = now.effective(), 1 + len(now.entries)
        return journal

    @property
    def folding(self) -> bool:
        """Whether the session is being run again, so that its next event is in the journal already."""
        return self._at < len(self.entries)

    def rewind(self) -> None:
        """Goes back to the first entry, for running the session again."""
        self._at = 0
        self._holds.clear()

    def tell(self, entry: Entry) -> bool:
        """Records an entry, or compares it with the recorded one if the session is run again; returns whether it is new.

        Raises WorkFailed if it differs.
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
        """Records the end of the session. Raises WorkFailed if it ended later before."""
        if self.folding and not isinstance(self.entries[self._at], Closed):
            raise self._differs(closed)
        if not self.read_only and not self.folding:
            self._append(closed)

    def answer(self, by: str, request: Request, ask: Ask) -> Reply:
        """A person's answer to a request: the recorded one, or one asked for now and written before it is used.

        An `ask` with the methods `holding` and `recall` has what its person has said and what holds from then on recorded with
        the answers, and is told it in a replay. The method `written`, where there is one, is called with this journal once the
        answer is in it, or that the last one is taken back.
        Raises AdvisorLeft, and Again if the person took the last answer of the episode back.
        """
        if self.folding:
            before = self.entries[self._at]
            if isinstance(before, Praise) and request.judgement != "no":
                self.tell(replace(before, by=by, episode=request.episode, step=request.step, state=request.state))
                self._recall(by, request, ask, before.holds)
                return _answered(before)
            known = before if isinstance(before, Answer) else Answer(by, 0, 0, 0, None)
            if known.action is not None and known.action not in request.allowed:
                allowed = "allowed " + allowed_words(request.allowed)
                raise BadInput(f"{self._which}: {line_of(known)}: action {known.action}: {allowed}: it was edited")
            self.tell(replace(known, by=by, episode=request.episode, step=request.step, state=request.state))
            self._recall(by, request, ask, known.holds)
            return _answered(known)
        given = self._asked(by, request, ask)
        self._append(given)
        self._unsafe = True
        _tell_written(ask, self)
        return _answered(given)

    def _asked(self, by: str, request: Request, ask: Ask) -> Answer | Praise:
        if self.read_only:
            raise KeyboardInterrupt  # the replay is over
        last = undoable(self.entries, by)
        at = (by, request.episode, request.step, request.state)
        while True:
            try:
                said = ask(replace(request, undoable=last is not None))
                if isinstance(said, Judgement):
                    return Praise(*at, said.value, said.moves, self._new_holds(by, ask))
                return Answer(*at, said, holds=self._new_holds(by, ask))
            except AdvisorLeft as left:
                return Answer(*at, None, True, str(left), self._new_holds(by, ask))
            except Undo:
                if last is None:
                    continue
                self._write(Undone(by, request.episode))
                del self.entries[last:]
                _tell_written(ask, self)
                raise Again from None

    def _recall(self, by: str, request: Request, ask: Ask, holds: tuple[dict[str, Any], ...] | None) -> None:
        """Tell a person's `ask` what they had said by then, if an entry records it."""
        if holds is not None:
            self._holds[by] = holds
            if (recall := getattr(ask, "recall", None)) is not None:
                recall(request, holds)

    def _new_holds(self, by: str, ask: Ask) -> tuple[dict[str, Any], ...] | None:
        """What a person has said and what holds now, None if that is as recorded before."""
        holding = getattr(ask, "holding", None)
        now = () if holding is None else tuple(holding())
        if now == self._holds.get(by, ()):
            return None
        self._holds[by] = now
        return now

    def _append(self, entry: Entry) -> None:
        self._write(entry)
        self.entries.append(entry)
        self._at = len(self.entries)

    def _write(self, entry: Entry) -> None:
        self.lines += 1
        if self._file is None:
            return
        self._file.write(line_of(entry))
        if self._unsafe and isinstance(entry, EpisodeEnded):
            self._file.sync()  # once per episode with answers, because a sync after each answer would be slow
            self._unsafe = False

    def close(self) -> None:
        """Closes the file; safe to call again."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _tell_written(ask: Ask, journal: Journal) -> None:
    if (written := getattr(ask, "written", None)) is not None:
        written(journal)


def _answered(given: Answer | Praise) -> Reply:
    if isinstance(given, Praise):
        return Judgement(given.value, given.moves)
    if given.left:
        raise AdvisorLeft(given.why)
    return given.action
