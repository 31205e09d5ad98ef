"""The teaching seat: a page on which a person watches a learner, and answers its questions by keys and buttons.

The session's thread asks and waits; the server's thread sends and receives. A page may be closed and opened again while
a question is pending. Several pages may watch; one of them has the seat.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from math import inf
from typing import Any

from lab.advice.advisors import shown_name
from lab.advice.journal import Undo
from lab.errors import BadInput, counted
from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, AdvisorLeft, Reply, Request
from lab.mdp import NoPath, shortest_steps
from lab.seat import order_text, request_text
from lab.seat.event_text import Told
from lab.seat.grid_text import Marks, StateWords
from lab.seat.page.page_console import PARTS as RUN_PARTS
from lab.seat.page.page_console import Console, bars_of, made_until
from lab.seat.page.page_messages import PageAnswer
from lab.seat.page.page_panel import CLOSED, SeatPanel
from lab.seat.page.page_question import Json, heard_of, said_of
from lab.seat.page.page_run import hear_run
from lab.seat.page.page_state import Pending, ShownLesson, hear, standing_of
from lab.seat.replay_pace import ReplayPace
from lab.seat.request_text import PathAhead
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.spoken_turns import ASKS, SpokenTurns, Turn, counts_at_once
from lab.seat.timed_answers import Asking
from lab.sequencing.search import SequenceRequest
from lab.teaching.events import ORDER, Event, LessonBegan, LessonEvent
from lab.teaching.lesson_plan import LessonPlan
from lab.view.framing import Framing
from lab.view.meshcat import LiveView
from lab.words.meaning import Intent, Refusal

TITLE = "Teaching lab"
MOST_STATES = 50_000  # of problems whose shortest path is computed


class SeatPage(LiveView):
    """The live page with a seat for one advisor; a context manager, like every live view.

    wait_s: the time limit [s] for each answer; None: no limit. framing: the pages that may show this one in a frame. All methods
    are called by the session's thread. Entering raises BadInput for a port that is taken or not allowed, and for a `wait_s` that
    is not finite and above 0.
    """

    def __init__(self, port: int = 0, *, wait_s: float | None = None, framing: Framing | None = None) -> None:
        if wait_s is not None and not 0 < wait_s < inf:
            raise BadInput(f"time to wait for an answer, {wait_s} s: must be finite and above 0")
        super().__init__(port, title=TITLE, framing=framing)
        self._wait_s = wait_s
        self._panel: SeatPanel = SeatPanel(TITLE)
        self._path = PathAhead()
        self.spoken = SpokenAnswers()  # what the person has said in sentences
        self._turns = SpokenTurns(self.spoken, self._tell, self._command)
        self.asking = Asking()  # how the last question was shown and answered

    def close(self) -> None:
        """Stop serving; whoever waits for an answer is told that the page was closed. Safe to call again."""
        self._panel.end()
        super().close()

    # ---- questions

    def ask(self, request: Request) -> Reply:
        """The answer of the page's advisor: one of `allowed`, None for "skip". Waits for it, at most `wait_s`.

        Raises AdvisorLeft for "auto", after the time limit and when the page is closed, Undo when an answer is taken back,
        and KeyboardInterrupt for "quit".
        """
        self.asking = Asking(means="rule")
        if self._path.goes_on(request):
            self.look(request)
            self.asking.means = "path goes on"
            return self._path.step()
        self._drop_path()
        turn = self._turns.before_asking(request)
        if turn == ASKS:
            try:
                pending, answer, turn = self._answered(request)
            finally:
                self.withdraw()
        if isinstance(turn, tuple) and isinstance(request, AdviceRequest):
            self._path = PathAhead(request, turn)
            return self._path.step()
        if turn is None or isinstance(turn, int | Judgement):
            self.look(request)
            return turn
        if answer is not None and not answer.word and answer.action is not None:
            self.spoken.gave(request, answer.path or (answer.action,))
        if answer is not None and len(answer.path) > 1 and isinstance(request, AdviceRequest):
            self._path = PathAhead(request, answer.path)
            return self._path.step()
        return _said(pending, answer)

    def _answered(self, request: Request) -> tuple[Pending, PageAnswer | None, Turn]:
        """The answer that ends a question, or the turn to which its sentences have led, ASKS for none.

        What a sentence was understood to mean is shown first, and counts once the person agrees.
        """
        heard: Json | None = None
        said: list[Intent] = []
        while True:
            pending = self._pose(request, heard=heard)
            self.asking.show()
            answer = self._panel.wait(pending)
            self.asking.answered(*_means(answer))
            if answer is None or not answer.is_spoken:
                return pending, answer, ASKS
            heard = None
            if answer.say:
                meant = self.spoken.heard(answer.say, request)
                if isinstance(meant, Refusal):
                    said, heard = [], {"refused": meant.reason}
                    continue
                said = meant
                if not counts_at_once(said):
                    heard = heard_of(request, self.spoken.in_words(said, request), self._turns.moves(said, request))
                    continue
            if answer.agree is not False and (turn := self._turns.carry_out(said, request)) != ASKS:
                return pending, answer, turn

    def _tell(self, text: str, tone: str) -> None:
        """A line for the person among the notices."""
        with self._panel.lock:
            self._panel.known.learning.notice(Told(text, "note" if tone == "yellow" else ""))
            self._panel.known.changed("notices")

    def _command(self, word: str, request: Request) -> None:
        """Carry out a command that was said in a sentence."""
        match word:
            case "undo" if request.undoable:
                raise Undo
            case "undo":
                self._tell("There is nothing to take back: you have answered nothing yet in this episode.", "yellow")
            case "quit":
                raise KeyboardInterrupt
            case "why":
                if isinstance(request, AdviceRequest):
                    reasons = request_text.reasons(request, Marks(), 0)
                else:
                    reasons = order_text.reasons(request) if isinstance(request, SequenceRequest) else []
                for line in (*reasons, *(f"Your rule holds: {rule}." for rule in self.spoken.standing(request))):
                    self._tell(line, "")

    def _drop_path(self) -> None:
        """Drop the rest of a drawn path, because the learner has gone elsewhere, with a message."""
        if left := len(self._path.left):
            with self._panel.lock:
                text = f"The rest of your path is dropped ({counted(left, 'move')}): the learner is elsewhere now."
                self._panel.known.learning.notice(Told(text, "note"))
                self._panel.known.changed("notices")
        self._path = PathAhead()

    def offer(
        self, request: Request, on_word: Callable[[str], None] | None = None, text: str = "", moves: Sequence[int] = ()
    ) -> None:
        """Show a question that is also asked elsewhere; returns at once.

        on_word: called from the server's thread with the page's answer, as a word of the terminal. text, moves: of a sentence
        that was understood there and waits for agreement.
        """
        self._panel.on_word = on_word
        self._pose(request, offered=True, heard=heard_of(request, text, moves) if text else None)

    def look(self, request: Request) -> None:
        """Show the learner's state and preferences without a question, because somebody else is asked."""
        with self._panel.lock:
            self._see(request)
        self._wake()

    def paced(self, pace: ReplayPace) -> None:
        """A replay begins: pages pause it, step through it and change its speed."""

        def changed(now: Mapping[str, Any]) -> None:
            with self._panel.lock:
                self._panel.known.replay = {**(self._panel.known.replay or {}), **now}
                self._panel.known.changed("replay")
            self._wake()

        pace.on_change, self._panel.on_pace = changed, pace.do
        changed(pace.now())

    def steer(self, console: Console, on_quit: Callable[[], None] | None = None) -> None:
        """Pages operate this run: they show its status and give its commands; on_quit: called to leave it, if possible."""
        self._panel.on_quit = on_quit
        with self._panel.lock:
            self._panel.known.console = console
            console.watched(len(self._panel.chair.pages))
        console.controls.on_change.append(self._wake)
        self.ran()

    def ran(self) -> None:
        """A command to the run has a result: pages show it."""
        with self._panel.lock:
            self._panel.known.changed(*RUN_PARTS)
        self._wake()

    def asks_nobody(self) -> None:
        """This page only shows; no question goes to it."""
        with self._panel.lock:
            self._panel.known.asks = False
            self._panel.known.changed("lesson")

    def replayed(self, request: Request, action: Reply) -> None:
        """Show a question of a replay with its answer; None: the step was left to the learner."""
        known = self._panel.known
        with self._panel.lock:
            done = None if isinstance(action, Judgement) else action
            known.replay = {**(known.replay or {}), "action": done, "said": said_of(request, action)}
            known.changed("replay")
        self.offer(request)

    def withdraw(self) -> None:
        """The question was answered elsewhere."""
        if self._panel.close():  # otherwise an answer on the page has closed it, and its result follows
            self._wake()

    def _pose(self, request: Request, offered: bool = False, heard: Json | None = None) -> Pending:
        self._running()
        wait_s = None if offered else self._wait_s
        until_s = None if wait_s is None else time.monotonic() + wait_s
        with self._panel.lock:
            self._see(request)
            pending = self._panel.pose(Pending(request, wait_s, until_s, offered, heard=heard))
        self._wake()
        return pending

    def _see(self, request: Request) -> None:
        """Take over the learner's state from a request, as shown beside the question."""
        if isinstance(request, SequenceRequest):
            self._see_order(request)
        elif isinstance(request, AdviceRequest):
            self._see_table(request)
        learning, known = self._panel.known.learning, request.improvement
        learning.rate = None if known is None else known.rate
        learning.means = (None, None) if known is None else (known.current_mean, known.previous_mean)
        standing_of(learning, request.standing)

    def _see_table(self, request: AdviceRequest) -> None:
        known = self._panel.known
        if known.learning.mdp not in (None, request.mdp):
            known.begin(ShownLesson())
        learning = known.learning
        if learning.mdp is None:
            learning.mdp = request.mdp
            known.changed("place")
        learning.q, learning.selection, learning.temperature = request.q, request.selection, request.temperature
        learning.state = request.state

    def _see_order(self, request: SequenceRequest) -> None:
        known = self._panel.known
        if known.learning.kind != "order":
            known.begin(ShownLesson(ORDER, "order"))
        known.work = bars_of(made_until(request), request.run.now_s)
        known.changed("work", "standing")

    # ---- events

    def hear(self, event: Event) -> None:
        """Show an event of a lesson or a run; for a lesson this must be fast."""
        known = self._panel.known
        if type(event) is LessonEvent:
            with self._panel.guard:  # faster than through the condition
                if event.lesson != known.learning.title:  # a lesson of another skill begins a new curve
                    known.begin(ShownLesson(event.lesson))
                known.touched.update(hear(known.learning, event.event))
            return
        made = _lesson(event.plan) if isinstance(event, LessonBegan) else None
        with self._panel.lock:
            if made is None:
                hear_run(known, event)
            else:  # also when the episode restarts because an answer was taken back
                known.receipt, known.ended = None, ""
                known.begin(made)

    def about(self, known: StateWords | None) -> None:
        """Take over the object that describes the new lesson's states in words; None for none."""
        with self._panel.lock:
            self._panel.known.learning.known = self.spoken.about = known

    # ---- one of several people

    @property
    def attended(self) -> bool:
        """Whether somebody sits at the page."""
        return self._panel.attended

    def skip(self) -> None:
        """Leave the pending question to the learner; called by any thread."""
        self._panel.skip()
        self._wake()

    def hurry(self, until_s: float) -> None:
        """Show until when [s of the monotonic clock] the pending question waits; called by any thread."""
        self._panel.hurry(until_s)
        self._wake()

    def waits_for(self, names: Sequence[str]) -> None:
        """Show who else is asked, while this page's person has answered; () for nobody."""
        if [*names] != self._panel.known.waits_for:
            self._show("waits_for", [*names])
            self._wake()

    # ---- receipt, advisors, end

    def receipt(self, document: Mapping[str, Any]) -> None:
        """Show the receipt of the advice so far."""
        self._show("receipt", dict(document))

    def members(self, members: Iterable[Any]) -> None:
        """Show several advisors: records with `name`, `trust`, `low`, `high` and `dropped`."""
        known = [asdict(member) for member in members]
        self._show("members", [member | {"name": shown_name(member["name"])} for member in known])

    def finished(self, text: str) -> None:
        """The lesson is over: show `text`, and ask nothing more."""
        self._panel.close()
        self._show("ended", text)
        self._wake()

    def shown(self) -> Json:
        """A summary of what else the page shows: see `SeatPanel.shown`."""
        return {"page": self._panel.shown()}

    def _show(self, part: str, value: Any) -> None:
        with self._panel.lock:
            setattr(self._panel.known, part, value)
            self._panel.known.changed(part)

    def _wake(self) -> None:
        if self._server is not None:
            self._server.wake()


def _means(answer: PageAnswer | None) -> tuple[str, str]:
    """By which means an answer was given (see `lab.advice.answer_times.MEANS`), and the sentence that was said."""
    if answer is None:
        return "time over", ""
    if answer.is_spoken:
        return "sentence", answer.say
    if answer.word in ("+", "-"):
        return "praise", ""
    return answer.word or ("path" if len(answer.path) > 1 else "move"), ""


def _said(pending: Pending, answer: PageAnswer | None) -> Reply:
    """The action or judgement of an answer; raises AdvisorLeft, Undo or KeyboardInterrupt, see `SeatPage.ask`."""
    if answer is None:
        raise AdvisorLeft(f"no answer within {pending.wait_s:g} s")
    if answer.word == "auto":
        raise AdvisorLeft("auto")
    if answer == CLOSED:
        raise AdvisorLeft("the page was closed")
    if answer.word == "undo":
        raise Undo
    if answer.word == "quit":
        raise KeyboardInterrupt
    if answer.word in ("+", "-"):
        return Judgement(1 if answer.word == "+" else -1)
    return answer.action


def _lesson(plan: LessonPlan) -> ShownLesson:
    """A lesson that begins; for a deterministic problem that is small enough, with its fewest steps, as the learner counts."""
    mdp, learner = plan.problem.mdp, plan.learner
    made = ShownLesson(plan.problem.name, mdp=mdp, gate=plan.gate, episodes=learner.episodes)
    if mdp.n_states <= MOST_STATES and (mdp.shape or mdp.coverage_shape):
        with suppress(NoPath):
            made.optimal = shortest_steps(mdp) + learner.count_start
    return made
