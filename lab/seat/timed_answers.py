"""How a question was shown and answered at a seat, and what was seen there; kept beside the journal on request."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from math import isfinite
from typing import Any, Protocol

from lab.advice.answer_times import AnswerTime, AnswerTimes
from lab.advice.journal import Journal
from lab.learning.requests import AdviceRequest, Reply, Request

Json = dict[str, Any]


@dataclass
class Asking:
    """One question at a seat: when it was shown, and how and when it was answered. The seat fills it in meanwhile.

    shown: None if nothing was shown; means: see `lab.advice.answer_times.MEANS`; said: the sentences that were said.
    """

    shown: datetime | None = None
    means: str = ""
    said: list[str] = field(default_factory=list)
    latency_s: float | None = None
    _shown_s: float = 0.0

    def show(self) -> None:
        """The question is shown now; only the first time counts."""
        if self.shown is None:
            self.shown, self._shown_s = datetime.now(UTC), time.monotonic()

    def answered(self, means: str, said: str = "") -> None:
        """An answer, or a part of one, is given now; the last one counts."""
        self.means = means
        if said:
            self.said.append(said)
        if self.shown is not None:
            self.latency_s = round(time.monotonic() - self._shown_s, 3)


class Asks(Protocol):
    """Asks a person, and knows what the person has said that holds, such as `lab.seat.lesson_seat.SpokenAsk`."""

    def __call__(self, request: Request) -> Reply:
        """The person's answer."""

    def holding(self) -> Sequence[Mapping[str, Any]]:
        """What has been said and holds."""

    def recall(self, request: Request, holds: tuple[dict[str, Any], ...]) -> None:
        """Take over what a journal has of what was said."""


class TimedAsk:
    """Asks a person, and writes down when and how they answered, and what they saw, once the journal has the answer.

    by: the advisor's name; asking: returns the seat's record of the question; shown: returns what else the seat shows.
    """

    def __init__(
        self,
        by: str,
        ask: Asks,
        times: AnswerTimes,
        asking: Callable[[], Asking],
        shown: Callable[[], Json] = dict,
    ) -> None:
        self._by, self._ask, self._times = by, ask, times
        self._asking, self._shown = asking, shown
        self.holding, self.recall = ask.holding, ask.recall
        self._seen: Json = {}

    def __call__(self, request: Request) -> Reply:
        """The person's answer."""
        self._seen = seen_of(request)
        return self._ask(request)

    def written(self, journal: Journal) -> None:
        """The journal's last line is the answer, or takes one back."""
        given = self._asking()
        shown = None if given.shown is None else utc_text(given.shown)
        seen = self._seen | self._shown()
        line = AnswerTime(journal.lines, self._by, given.means, shown, given.latency_s, tuple(given.said), seen)
        self._times.write(journal, line)


def seen_of(request: Request) -> Json:
    """What a question shows: the learner's state, its moves, its own choice, why it asks, and how it stands with advice.

    For a table also the state's label and the values of all its actions, None for one that is not finite.
    """
    known = request.improvement
    seen: Json = {
        "episode": request.episode,
        "step": request.step,
        "state": request.state,
        "allowed": [int(action) for action in request.allowed],
        "own": request.own,
        "judgement": request.judgement,
        "reason": None if request.reason is None else str(request.reason),
        "improvement": None if known is None else known.rate,
        "standing": asdict(request.standing),
    }
    if isinstance(request, AdviceRequest):
        values = [float(value) for value in request.q[request.state]]
        seen["label"] = request.mdp.state_label(request.state)
        seen["values"] = [value if isfinite(value) else None for value in values]
    return seen


def utc_text(moment: datetime) -> str:
    """A moment as ISO 8601 in UTC with milliseconds: "2026-11-28T19:00:00.123Z"."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
