"""Who hears how a run goes on: the composer and the teacher tell, a view or nobody listens."""

from lab.learning.session import Event
from lab.sequencing.events import Move, SequenceResult
from lab.sequencing.search import Reference
from lab.teaching import Lesson


class Listener:
    """Who hears how a run goes on; the base hears nothing."""

    def phase(self, name: str, parts: int) -> None:
        """A phase with so many parts begins."""

    def skipped(self, what: str) -> None:
        """A damaged policy file was not read."""

    def lesson(self, name: str, lesson: Lesson) -> None:
        """A skill was found or learned."""

    def learning(self, name: str, event: Event) -> None:
        """Something happened in a session."""

    def measured(self, name: str, seconds: float) -> None:
        """A move was timed."""

    def sequenced(self, best: SequenceResult, known: Reference | None) -> None:
        """An order was found."""

    def moved(self, move: Move) -> None:
        """A toast was brought on."""

    def retried(self, text: str) -> None:
        """A step failed and is tried again."""
