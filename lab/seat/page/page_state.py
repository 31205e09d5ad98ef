"""The state of the teaching page, and the functions that write it as one JSON document in parts.

Nothing here waits, sends or draws. PARTS lists the document's parts; `PageContent.since` finds those that have changed. Events
of a lesson are taken over at the end of the file.
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import accumulate
from math import inf
from typing import Any

from lab.learning.gates import improvement
from lab.learning.requests import Request, Standing
from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    EpisodeEnded,
    Event,
    MoveJudged,
)
from lab.learning.settings import GateSettings
from lab.learning.updates import Table
from lab.mdp import TabularMDP
from lab.seat.event_text import SessionText, Told
from lab.seat.grid_text import StateWords
from lab.seat.page.page_console import Console, measured_of, plan_of, run_of
from lab.seat.page.page_question import place_of, question_of, slice_of, spot
from lab.sequencing.cell.schedule import Move

LESSON_OVER = "The lesson is over."  # what the page says then
MOST = 400  # blocks of episodes that a page draws


@dataclass
class CostCurve:
    """The costs of episodes in blocks of `per`: of each block the mean, the least, and the number of guided episodes.

    best: the least cost of all, and the first episode with it, counted from 1; None before the first episode.
    """

    per: int = 1
    count: int = 0
    sums: list[float] = field(default_factory=list)
    lows: list[float] = field(default_factory=list)
    guided: list[int] = field(default_factory=list)
    best: tuple[float, int] | None = None

    def add(self, cost: float, guided: bool) -> None:
        """Add an episode; blocks become twice as long when there would be too many."""
        if self.count == self.per * MOST:
            self.sums = [a + b for a, b in zip(self.sums[::2], self.sums[1::2], strict=True)]
            self.lows = [*map(min, self.lows[::2], self.lows[1::2])]
            self.guided = [a + b for a, b in zip(self.guided[::2], self.guided[1::2], strict=True)]
            self.per *= 2
        if self.count == self.per * len(self.sums):
            self.sums.append(0.0)
            self.lows.append(inf)
            self.guided.append(0)
        self.sums[-1] += cost
        self.lows[-1] = min(self.lows[-1], cost)
        self.guided[-1] += guided
        self.count += 1
        if self.best is None or cost < self.best[0]:
            self.best = cost, self.count

    def document(self) -> dict[str, Any]:
        """The curve as a JSON document for the page."""
        last = self.count - self.per * (len(self.sums) - 1)
        sizes = [self.per] * (len(self.sums) - 1) + [last] * bool(self.sums)
        means = [float(f"{total / size:.5g}") for total, size in zip(self.sums, sizes, strict=True)]
        bests = [float(f"{low:.5g}") for low in accumulate(self.lows, min)]
        known = {"per": self.per, "count": self.count, "means": means, "guided": self.guided.copy()}
        return known | {"bests": bests, "best": None if self.best is None else [*self.best]}


# ---- the state and its document -----------------------------------------------------------------------------------------


Json = dict[str, Any]
MOST_NOTICES = 60
MOST_LINES = 80


@dataclass(frozen=True)
class Pending:
    """A pending question: its request, its deadline ([s] of the clock, None: never), and its number.

    offered: somebody else waits for the answer, if anybody does. heard: what was understood of a sentence and waits for
    agreement: {"text": in words, "path": cells as the page draws them}; or {"refused": why nothing was understood}; else None.
    """

    request: Request
    wait_s: float | None = None
    until_s: float | None = None
    offered: bool = False
    number: int = 0
    heard: Json | None = None

    @property
    def words(self) -> tuple[str, ...]:
        """The accepted words besides the moves."""
        judgements = () if self.request.judgement == "no" else ("+", "-")
        return ("skip", "auto", "quit", *["undo"] * self.request.undoable, *judgements)

    @property
    def moves(self) -> Sequence[int]:
        """The accepted moves."""
        return () if self.request.judgement == "only" else self.request.allowed


@dataclass
class LessonNotice:
    """A message about a lesson, and how often it came in a row; tone: see `Told`."""

    text: str
    tone: str = ""
    times: int = 1


@dataclass
class ShownLesson:
    """One lesson, or the sessions of a sequencer: its progress, and the learner's messages."""

    title: str = ""
    kind: str = "steps"  # or "order"
    mdp: TabularMDP | None = None
    gate: GateSettings | None = None
    episodes: int = 0
    optimal: float | None = None
    proven: bool = True  # whether `optimal` is the optimum, not only a bound
    method: str = ""  # of a sequencer
    learned: tuple[str, ...] = ()  # how the order was learned, in words
    curve: CostCurve = field(default_factory=CostCurve)
    notices: deque[LessonNotice] = field(default_factory=lambda: deque(maxlen=MOST_NOTICES))
    text: SessionText = field(default_factory=SessionText)
    requests: int = 0  # episodes in which it asked
    taken: int = 0
    skipped: int = 0
    helped_steps: int = 0
    remembered: int = 0  # steps made from memory
    misleads: int = 0
    rate: float | None = None
    means: tuple[float | None, float | None] = (None, None)  # the means at the time of the last question
    lately: deque[float] = field(default_factory=deque)  # costs of the latest episodes, as many as two windows hold
    verdict: str = ""  # "rejected", "converged" or "left", after which it asks no more
    q: Table | None = None
    selection: str = "softmax"
    temperature: float = 1.0
    state: int | None = None  # the last known state
    known: StateWords | None = None  # describes that state in words

    def __post_init__(self) -> None:
        self.text.kind = self.kind
        self.lately = deque(maxlen=2 * self.gate.window if self.gate is not None else 0)

    def notice(self, told: Told) -> None:
        """Add a message for the advisor; a message that repeats the last one is counted."""
        last = self.notices[-1] if self.notices else None
        if last is not None and last.text == told.text:
            last.times += 1
        else:
            self.notices.append(LessonNotice(told.text, told.tone))


@dataclass(frozen=True)
class Progress:
    """The progress of a whole run: the current phase, how many of its items are done, and the lines so far."""

    phase: str = ""
    parts: int = 0
    done: int = 0
    lines: tuple[str, ...] = ()


@dataclass
class PageContent:
    """Everything that the page may show. `changed` marks parts as changed; versions ensure that nothing is sent twice."""

    title: str
    learning: ShownLesson = field(default_factory=ShownLesson)
    progress: Progress | None = None
    pending: Pending | None = None
    work: Json | None = None  # bars of the order
    moves: list[Move] = field(default_factory=list)  # of the run that is carried out
    members: list[Json] = field(default_factory=list)
    receipt: Json | None = None
    ended: str = ""
    waits_for: list[str] = field(default_factory=list)  # the names of others who are asked as well
    asks: bool = True  # whether questions of a lesson may be answered here
    console: Console | None = None  # of a run that is operated here
    replay: Json | None = None  # of a replay: its pace, and the last answer
    questions: int = 0
    version: int = 1
    versions: dict[str, int] = field(default_factory=dict)
    touched: set[str] = field(default_factory=set)

    def changed(self, *parts: str) -> None:
        """Mark these parts of the document as changed."""
        self.touched.update(parts)

    def begin(self, learning: ShownLesson) -> None:
        """A lesson, or a sequencer's session, begins."""
        self.learning = learning
        self.changed("lesson", "place", "robot", "curve", "standing", "notices", "slice")

    def settle(self) -> int:
        """The version of the whole document, after giving changed parts a new version."""
        if self.touched:
            self.version += 1
            self.versions |= dict.fromkeys(self.touched, self.version)
            self.touched.clear()
        return self.version

    def since(self, seen: Mapping[str, int]) -> list[str]:
        """The parts that have changed since these versions, by part."""
        return [part for part in PARTS if self.versions.get(part, 1) > seen.get(part, 0)]


def _lesson(known: PageContent, now_s: float) -> Json:
    learning, gate = known.learning, known.learning.gate
    return {
        "title": learning.title,
        "page": known.title,
        "asks": known.asks,
        "kind": learning.kind,
        "unit": "s" if learning.kind == "order" else "steps",
        "episodes": learning.episodes,
        "optimal": learning.optimal,
        "proven": learning.proven,
        "method": learning.method,
        "learned": list(learning.learned),
        "threshold": None if gate is None else gate.lambda_threshold,
    }


def _place(known: PageContent, now_s: float) -> Json | None:
    return None if known.learning.mdp is None else place_of(known.learning.mdp)


def _robot(known: PageContent, now_s: float) -> list[int] | None:
    mdp, state = known.learning.mdp, known.learning.state
    return None if mdp is None or state is None else spot(mdp, state)


def _question(known: PageContent, now_s: float) -> Json | None:
    pending = known.pending
    if pending is None:
        return None
    left_s = None if pending.until_s is None else round(max(0.0, pending.until_s - now_s), 1)
    return question_of(pending.request, known.learning.known) | {
        "number": pending.number,
        "left_s": left_s,
        "words": list(pending.words),
        "offered": pending.offered,
        "heard": pending.heard,
    }


def _standing(known: PageContent, now_s: float) -> Json:
    learning = known.learning
    gate = learning.gate
    means = improvement([*learning.lately], gate.window) if gate is not None else None
    current, previous = learning.means if means is None else (means.current_mean, means.previous_mean)
    budget = None if gate is None or gate.budget >= GateSettings.budget else gate.budget
    return {
        "rate": learning.rate,
        "current": current,
        "previous": previous,
        "requests": learning.requests,
        "taken": learning.taken,
        "skipped": learning.skipped,
        "helped_steps": learning.helped_steps,
        "remembered": learning.remembered,
        "budget": budget,
        "misleads": learning.misleads,
        "omega": None if gate is None or gate.by_evidence else gate.omega,
        "verdict": learning.verdict,
    }


PARTS: dict[str, Callable[[PageContent, float], Any]] = {
    "lesson": _lesson,
    "place": _place,
    "robot": _robot,
    "question": _question,
    "curve": lambda known, now_s: known.learning.curve.document(),
    "standing": _standing,
    "notices": lambda known, now_s: [vars(notice) for notice in known.learning.notices],
    "progress": lambda known, now_s: None if known.progress is None else asdict(known.progress),
    "work": lambda known, now_s: known.work,
    "members": lambda known, now_s: known.members,
    "receipt": lambda known, now_s: known.receipt,
    "ended": lambda known, now_s: known.ended,
    "waits_for": lambda known, now_s: known.waits_for,
    "replay": lambda known, now_s: known.replay,
    "run": lambda known, now_s: run_of(known.console),
    "plan": lambda known, now_s: plan_of(known.console),
    "measured": lambda known, now_s: measured_of(known.console),
}


def layer_of(known: PageContent, layer: int | None = None) -> Json | None:
    """The marks and values of a layer's cells, by default of the robot's layer; None when there is no grid."""
    learning, mdp = known.learning, known.learning.mdp
    place = None if mdp is None else place_of(mdp)
    if mdp is None or place is None:
        return None
    state = mdp.start if learning.state is None else learning.state
    wanted = spot(mdp, state)[2] if layer is None else layer
    wanted = min(max(wanted, 0), place["layers"] - 1)
    return slice_of(mdp, state, wanted, learning.q, learning.selection, learning.temperature)


def standing_of(learning: ShownLesson, standing: Standing) -> None:
    """Take over the learner's standing of advice; a message says what has become worse."""
    if standing.misleads > learning.misleads:
        text = f"The last lesson did not help: {standing.misleads} so far"
        text += "." if standing.by_evidence else f", {standing.omega} are tolerated."
        learning.notice(Told(text, "bad"))
    learning.misleads, learning.helped_steps = standing.misleads, standing.helped_steps


# ---- events of a lesson -------------------------------------------------------------------------------------------------


STEP = ("standing", "robot", "slice")
EPISODE = ("standing", "curve", "slice", "notices")


def hear(learning: ShownLesson, event: Event) -> tuple[str, ...]:
    """Take an event over; returns the changed parts of the document. Called for every answer, so it must be fast."""
    kind = type(event)
    if kind is AdviceGiven or kind is MoveJudged:
        return _given(learning, event)  # type: ignore[arg-type]
    if kind is EpisodeEnded:
        return _episode(learning, event)  # type: ignore[arg-type]
    told = learning.text.told(event, learning.mdp)
    match event:
        case AdviceRequested():
            learning.requests += 1
            learning.means = (event.current_mean, event.previous_mean)
            return STEP
        case AdviceRemembered():
            learning.remembered += event.steps
            return STEP
        case AdviceRejected():
            learning.verdict, learning.misleads = "rejected", event.misleads
        case AdviceEnded():
            learning.verdict = "converged" if event.reason == "converged" else "left"
    if told is not None:
        learning.notice(told)
    return ("standing", "notices")


def _given(learning: ShownLesson, event: AdviceGiven | MoveJudged) -> tuple[str, ...]:
    if event.action is None:
        learning.skipped += 1
    else:
        learning.taken += 1
        learning.helped_steps += 1
    learning.state = event.state
    return STEP


def _episode(learning: ShownLesson, event: EpisodeEnded) -> tuple[str, ...]:
    learning.curve.add(event.steps, event.guided)
    learning.lately.append(event.steps)
    learning.rate = event.improvement_rate
    if told := learning.text.told(event, learning.mdp):
        learning.notice(told)
    return EPISODE if event.guided else EPISODE[:-1]
