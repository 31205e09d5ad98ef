"""Several people who advise one learner, each on a page of their own: a question goes to all of them at once."""

import time
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from lab.advice.advisors import shown_name
from lab.learning.requests import AdvisorLeft, Reply, Request

if TYPE_CHECKING:
    from lab.seat.page.teaching_page import SeatPage

WITHIN_S = 20.0  # time that the others have once one has answered
LOOK_S = 0.1  # interval at which it is checked who is there


@dataclass
class _Round:
    """A question that is put to several people.

    until_s: until when [s of the clock] it waits, None before the first answer.
    """

    at: tuple[int, int]  # episode and step
    answers: dict[str, Future[Reply]]
    until_s: float | None = None
    taken: set[str] = field(default_factory=set)  # whose answers have been handed out


class Team:
    """The people of a lesson, by the advisors' names ("web:PERSON"), with a page each.

    The first of them who is asked about a step puts the question on the pages of all who come after. Once somebody has
    answered, the others have `within_s` [s], and whoever is not there is not waited for: they have said nothing about this
    step. Nothing can be taken back, because others have answered since. A context manager.

    silent: returns the names of those who are asked now and then only, because they were dropped, or no more.
    """

    def __init__(self, pages: "Mapping[str, SeatPage]", within_s: float = WITHIN_S) -> None:
        self.pages, self._within_s = dict(pages), within_s
        self.silent: Callable[[], Collection[str]] = tuple
        self._round: _Round | None = None
        self._pool = ThreadPoolExecutor(max(1, len(self.pages)), thread_name_prefix="team")

    def __enter__(self) -> "Team":
        return self

    def __exit__(self, *error: object) -> None:
        self._drop()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def ask(self, name: str, request: Request) -> Reply:
        """The answer of one of them. Raises AdvisorLeft as `SeatPage.ask` does, also for "quit"."""
        at = (request.episode, request.step)
        known = self._round
        if known is None or known.at != at or name not in known.answers or name in known.taken:
            known = self._round = self._begun(at, name, replace(request, undoable=False))
        known.taken.add(name)
        try:
            self._collect(known, name)
        except BaseException:  # Ctrl-C
            self._drop()
            raise
        return known.answers[name].result()

    def _begun(self, at: tuple[int, int], name: str, request: Request) -> _Round:
        """Put the question to `name` and all who come after; to `name` alone when the others have been asked already."""
        names = list(self.pages)
        is_later = self._round is not None and self._round.at == at
        self._drop()
        silent = {*self.silent()} if not is_later else {*names}
        asked = [name, *(other for other in names[names.index(name) + 1 :] if other not in silent)]
        until_s = time.monotonic() + self._within_s if is_later else None
        answers = {other: self._pool.submit(partial(_answer, self.pages[other], request)) for other in asked}
        return _Round(at, answers, until_s)

    def _collect(self, known: _Round, name: str) -> None:
        """Wait until `name` has answered; those who take too long, or are not there, say nothing."""
        while not known.answers[name].done():
            left = {other: answer for other, answer in known.answers.items() if not answer.done()}
            if known.until_s is None and len(left) < len(known.answers):
                known.until_s = time.monotonic() + self._within_s
            self._show(known, left)
            if known.until_s is not None:
                for other in left:
                    if not self.pages[other].attended or time.monotonic() >= known.until_s:
                        self.pages[other].skip()
            wait(left.values(), LOOK_S, FIRST_COMPLETED)
        self._show(known, {other: answer for other, answer in known.answers.items() if not answer.done()})

    def _show(self, known: _Round, left: "Mapping[str, Future[Reply]]") -> None:
        names = [shown_name(other) for other in left]
        for other in known.answers:
            if other in left and known.until_s is not None:
                self.pages[other].hurry(known.until_s)
            self.pages[other].waits_for(() if other in left else names)

    def _drop(self) -> None:
        """Withdraw what is still asked."""
        known, self._round = self._round, None
        for other, answer in () if known is None else known.answers.items():
            while not (answer.done() or answer.cancel()):
                self.pages[other].skip()
                wait([answer], LOOK_S)


def _answer(page: "SeatPage", request: Request) -> Reply:
    """The answer of the person at a page; who quits leaves, and the others go on."""
    try:
        return page.ask(request)
    except KeyboardInterrupt:
        raise AdvisorLeft("quit") from None
