"""A whole run, or a sequencer's sessions, in the panel of the teaching page: phases, skills, times, the order, the moves."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Protocol

from lab.errors import counted
from lab.learning.settings import GateSettings
from lab.seat.order_text import ORDER
from lab.seat.page.page_state import MOST_LINES, Progress
from lab.sequencing.cell.schedule import Move
from lab.sequencing.search import EpisodeSequenced, Reference, SequenceResult
from lab.teaching.listener import Listener
from lab.teaching.teacher import Lesson
from lab.view.figures import beside
from lab.view.progress import PHASES

SHOWN_MOVES = 24


class Shows(Protocol):
    """The page, as far as a run's listener needs it."""

    def begin_order(self, title: str, episodes: int, gate: GateSettings | None, optimal: float | None) -> None:
        """A session of a sequencer begins."""

    def on_order_episode(self, event: EpisodeSequenced) -> None:
        """An order was tried."""

    def work(self, moves: Iterable[Move]) -> None:
        """The moves so far."""

    def progress(self, progress: Progress) -> None:
        """How the run goes."""


class SeatListener(Listener):
    """Writes lines into the panel, and draws the moves as they are made."""

    def __init__(self, page: Shows) -> None:
        self._page, self._progress = page, Progress()
        self._moves: list[Move] = []

    def phase(self, name: str, parts: int) -> None:
        """A phase with so many parts begins."""
        title = PHASES.get(name, name)
        self._progress = Progress(title, parts, 0, self._progress.lines)
        self._say(title, done=0)
        if name == "carry out":
            self._moves = []

    def skipped(self, what: str) -> None:
        """A damaged policy file was not read."""
        self._say(f"skipped: {what}", done=0)

    def lesson(self, name: str, lesson: Lesson) -> None:
        """A skill was found or learned."""
        reached, fewest = lesson.policy.final_steps, lesson.policy.optimal_steps
        steps = "the goal is not reached" if reached is None else counted(reached, "step")
        best = "" if reached is None or fewest is None or reached <= fewest else f", the fewest are {fewest}"
        helped = "" if lesson.result is None else f", {lesson.result.helped_steps} of all moves advised"
        self._say(f"{lesson.source} {name}: {steps}{best}{helped}")

    def measured(self, name: str, seconds: float) -> None:
        """A move was timed."""
        self._say(f"{name}: {seconds:.2f} s")

    def sequences(self, episodes: int, known: Reference | None, gate: GateSettings | None) -> None:
        """A sequencer begins to try orders."""
        self._page.begin_order(ORDER, episodes, gate, None if known is None else known.bound)

    def tried(self, order: EpisodeSequenced) -> None:
        """An order was tried."""
        self._page.on_order_episode(order)

    def sequenced(self, best: SequenceResult, known: Reference | None) -> None:
        """An order was found."""
        order = " ".join(map(str, best.sequence[:SHOWN_MOVES]))
        more = f" and {len(best.sequence) - SHOWN_MOVES} more" if len(best.sequence) > SHOWN_MOVES else ""
        cost, bound = f"{best.cost:.1f} s", ""
        if known is not None:
            cost, least = beside(best.cost, known.bound, known.unit, 1)
            bound = f"; no order takes less than {least}"
        self._say(f"order {order}{more}: {cost}{bound}")

    def moved(self, move: Move) -> None:
        """A toast was brought on."""
        self._moves.append(move)
        self._page.work(self._moves)
        self._say(f"{move.drop_s:.1f} s: part {move.part} from {move.origin} to {move.target}")

    def retried(self, text: str) -> None:
        """A step failed and is tried again."""
        self._say(f"failed, trying again: {text}", done=0)

    def _say(self, line: str, done: int = 1) -> None:
        before = self._progress
        lines = (*before.lines[1 - MOST_LINES :], line)
        self._progress = replace(before, done=before.done + done, lines=lines)
        self._page.progress(self._progress)
