"""Who hears how a run goes on: the composer and the teacher tell, a view or nobody listens."""

from lab.learning.settings import GateSettings
from lab.sequencing.cell.schedule import Move
from lab.sequencing.search import EpisodeSequenced, Reference, SequenceResult
from lab.teaching.teacher import Lesson


class Listener:
    """Who hears how a run goes on; the base hears nothing."""

    def phase(self, name: str, parts: int) -> None:
        """A phase with so many parts begins."""

    def skipped(self, what: str) -> None:
        """A damaged policy file was not read."""

    def lesson(self, name: str, lesson: Lesson) -> None:
        """A skill was found or learned."""

    def measured(self, name: str, seconds: float) -> None:
        """A move was timed."""

    def sequences(self, episodes: int, known: Reference | None, gate: GateSettings | None) -> None:
        """A sequencer begins to try orders; gate: when it asks which part to move, None: it asks nobody."""

    def tried(self, order: EpisodeSequenced) -> None:
        """An order was tried."""

    def sequenced(self, best: SequenceResult, known: Reference | None) -> None:
        """An order was found."""

    def moved(self, move: Move) -> None:
        """A toast was brought on."""

    def retried(self, text: str) -> None:
        """A step failed and is tried again."""


class Both(Listener):
    """Tells everything to two listeners."""

    def __init__(self, one: Listener, other: Listener) -> None:
        self._listeners = (one, other)

    def phase(self, name: str, parts: int) -> None:
        for listener in self._listeners:
            listener.phase(name, parts)

    def skipped(self, what: str) -> None:
        for listener in self._listeners:
            listener.skipped(what)

    def lesson(self, name: str, lesson: Lesson) -> None:
        for listener in self._listeners:
            listener.lesson(name, lesson)

    def measured(self, name: str, seconds: float) -> None:
        for listener in self._listeners:
            listener.measured(name, seconds)

    def sequences(self, episodes: int, known: Reference | None, gate: GateSettings | None) -> None:
        for listener in self._listeners:
            listener.sequences(episodes, known, gate)

    def tried(self, order: EpisodeSequenced) -> None:
        for listener in self._listeners:
            listener.tried(order)

    def sequenced(self, best: SequenceResult, known: Reference | None) -> None:
        for listener in self._listeners:
            listener.sequenced(best, known)

    def moved(self, move: Move) -> None:
        for listener in self._listeners:
            listener.moved(move)

    def retried(self, text: str) -> None:
        for listener in self._listeners:
            listener.retried(text)
