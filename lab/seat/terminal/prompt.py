"""Teaching at a terminal: questions and a person's answers to them."""

from collections.abc import Callable, Iterable
from itertools import groupby
from typing import Any

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from lab.advice.journal import Undo
from lab.errors import counted, printable
from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, AdvisorLeft, Reply, Request
from lab.learning.session_events import EpisodeEnded
from lab.seat import request_text
from lab.seat.event_text import SessionText
from lab.seat.grid_text import StateWords
from lab.seat.request_text import PathAhead
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.spoken_turns import ASKS, NO_MORE, SpokenTurns, Turn, counts_at_once
from lab.seat.terminal.line_reader import Outside, ReadLine, default_reader
from lab.seat.terminal.question_views import OrderQuestion, TableQuestion
from lab.seat.terminal.screen import folded, room
from lab.seat.terminal.typed_answer import (
    ANSWERS,
    JUDGE_HINT,
    is_sentence,
)
from lab.seat.timed_answers import Asking
from lab.sequencing.search import SequenceRequest
from lab.teaching.events import ORDER, Event, LessonEvent
from lab.words.meaning import Refusal

STYLES = {"": "", "ask": "bold", "note": "yellow", "good": "green", "bad": "yellow", "lost": "bold red"}
AGREED = "Is that what you mean? [enter = yes, no] "
YES = ("", "y", "yes", "yeah", "ok", "okay")
MOST_DRAWN = 5  # equal moves of a path that are drawn one by one


class TeachingPrompt:
    """Asks a person for advice: call it with a request (it is an `Ask`), pass events to `hear`.

    console: where everything is written, usually stderr. read_line shows a prompt and returns one line or raises
    EOFError; by default the terminal with arrow keys when stdin is one, else plain lines of stdin. plain: sentences
    instead of pictures, for screen readers. Returns the action, None for "skip".
    Raises AdvisorLeft for "auto" and at the end of the input, Undo for "undo", KeyboardInterrupt for "quit" and Ctrl-C.
    After "done" every request raises AdvisorLeft, and nothing more is written.
    """

    def __init__(self, console: Console, read_line: ReadLine | None = None, plain: bool = False):
        self._console, self._read_line, self._plain = console, read_line, plain
        self._outside: Outside = getattr(read_line, "outside", None) or Outside()
        self._done = False
        self._path = PathAhead()
        self._wall: tuple[int, int, int] | None = None  # last warned about: episode, state, action
        self._table, self._order = TableQuestion(console, plain), OrderQuestion(console, plain)
        self._last: Request | None = None  # the last question
        self._text, self._order_text = SessionText(self._table.marks.named), SessionText(kind="order")
        self._guided = self._misleads = 0
        self.spoken = SpokenAnswers()  # what the person has said in sentences
        self._turns = SpokenTurns(self.spoken, self._say, self._command)
        self.asking = Asking()  # how the last question was shown and answered
        self.on_heard: Callable[[Request, str, tuple[int, ...]], None] | None = (
            None  # what waits for agreement: text, path
        )

    def __call__(self, request: Request) -> Reply:
        """The person's answer, after showing the learner's state."""
        if self._done:
            raise AdvisorLeft
        self._meet(request)
        self.asking = Asking(means="rule")
        if self._path.goes_on(request):
            self.asking.means = "path goes on"
            return self._give(request, self._path.step())
        self._drop_path(f"the learner is {self._way(request).where(request, request.state)} now")
        try:
            turn = self._turns.before_asking(request)
        except AdvisorLeft:
            self._done = True
            raise
        if turn != ASKS:
            return self._take(turn, request)
        with self._outside.question():
            if self._read_line is None:
                self._read_line = default_reader(self._console, plain=self._plain, outside=self._outside)
            self.show(request)
            self.asking.show()
            return self._answer(request, self._read_line)

    def answer_from_outside(self, word: str) -> None:
        """Answer the pending question with a word as if it were typed, from any thread; no effect when none is pending."""
        self._outside.answer(word)

    def about(self, known: StateWords | None) -> None:
        """Take over the object that describes the next lesson's states in words; None for none."""
        self._table.known = self.spoken.about = known

    def show(self, request: Request) -> None:
        """Show the learner's state, its own choice, and its progress."""
        self._last = request
        self._print(self._way(request).shown(request))
        if rules := self.spoken.standing(request):
            self._say(f"Your rules: {'; '.join(rules)}.", "dim")

    def told(self, request: Request, action: Reply) -> None:
        """Show the answer to a request, such as "Answer: right"; None: the step was left to the learner."""
        if isinstance(action, Judgement):
            self._say(f"Answer: {action}", "bold")
            return
        self._say(f"Answer: {'skip' if action is None else self._way(request).named(request, action)}", "bold")

    def _way(self, request: Request | None) -> Any:
        """How such a question is shown."""
        return self._order if isinstance(request, SequenceRequest) else self._table

    # ---- answers ------------------------------------------------------------------------------------------------------

    def _answer(self, request: Request, read_line: ReadLine) -> Reply:
        way = self._way(request)
        asked = way.asked(request)
        while True:
            try:
                line = read_line(asked)
                answer = way.understood(line, request)
                self.asking.answered(_means(answer))
                alone = answer == JUDGE_HINT and len(line.split()) == 1
                if isinstance(answer, str) and answer not in ANSWERS and is_sentence(line) and not alone:
                    self.asking.answered("sentence", line.strip())
                    turn = self._hear(line, answer, request, read_line)
                    if turn != ASKS:
                        return self._take(turn, request)
                    if self.on_heard is not None:
                        self.on_heard(request, "", ())
                    continue
            except EOFError:
                self.asking.answered("closed")
                self._say("No more answers: the learner goes on alone.")
                raise AdvisorLeft from None
            match answer:
                case Judgement():
                    self._say(f"Noted: {answer}.", "dim")
                    return answer
                case int():
                    self.spoken.gave(request, (answer,))
                    return self._give(request, answer)
                case tuple() if isinstance(request, AdviceRequest):
                    return self._begin_path(request, answer)
                case "own":
                    self.spoken.gave(request, (request.own,))
                    return request.own
                case "skip":
                    return None
                case _:
                    self._command(answer, request)

    def _begin_path(self, request: AdviceRequest, moves: tuple[int, ...]) -> int:
        """The first move of a path; its others answer the next questions along it."""
        self.spoken.gave(request, moves)
        self._path = PathAhead(request, moves)
        self._say(f"A path of {counted(len(moves), 'move')}: {self._drawn(request, moves)}", "dim")
        return self._give(request, self._path.step())

    # ---- sentences ----------------------------------------------------------------------------------------------------

    def _hear(self, line: str, hint: str, request: Request, read_line: ReadLine) -> Turn:
        """What a sentence leads to; a person at a terminal agrees to what was understood first.

        hint: shown for a single word that is no sentence.
        """
        heard = self.spoken.heard(line, request)
        if isinstance(heard, Refusal):
            self._say(heard.reason if len(line.split()) > 1 else hint, "yellow")
            return ASKS
        text = self.spoken.in_words(heard, request)
        self._say(f"Understood: {text}.", "bold")
        if getattr(read_line, "confirms", False) and not counts_at_once(heard):
            if moves := self._turns.moves(heard, request):
                self._say(f"That is {self._drawn(request, moves)}", "dim")
            if self.on_heard is not None:
                self.on_heard(request, text, moves)
            if read_line(AGREED).strip().lower() not in YES:
                self._say("Dropped.")
                return ASKS
        try:
            return self._turns.carry_out(heard, request)
        except AdvisorLeft:
            self._done = True
            raise

    def _take(self, turn: Turn, request: Request) -> Reply:
        """The answer that a turn gives; a path begins with its first move."""
        if isinstance(turn, Judgement):
            self._say(f"Noted: {turn}.", "dim")
            return turn
        if isinstance(turn, tuple) and isinstance(request, AdviceRequest):
            return self._begin_path(request, turn)
        assert turn is None or isinstance(turn, int)
        return turn if turn is None or turn == request.own else self._give(request, turn)

    def _command(self, word: str, request: Request) -> None:
        """Carry out a command word that gives no advice; any other word is a hint, which is shown."""
        match word:
            case "auto":
                raise AdvisorLeft
            case "done":
                self._say(NO_MORE)
                self._done = True
                raise AdvisorLeft
            case "quit":
                raise KeyboardInterrupt
            case "undo" if request.undoable:
                self._say("Your last answer is taken back.", "bold")
                raise Undo
            case "undo":
                self._say("There is nothing to take back: you have answered nothing yet in this episode.", "yellow")
            case "why":
                for line in self._way(request).why(request, self._guided):
                    self._say(line)
                if rules := self.spoken.standing(request):
                    self._say(f"Your rules hold: {'; '.join(rules)}.")
            case "help":
                self._help(request)
            case _:
                self._say(word, "yellow")

    def _give(self, request: Request, action: int) -> int:
        """The action that the person gave; an action that leads nowhere counts as well, after a warning."""
        wall = (request.episode, request.state, action)
        if warned := self._way(request).warned(request, action):
            if wall != self._wall:  # warned once, however often a path runs against the wall
                self._say(warned, "yellow")
            self._wall = wall if self._path.left else None
        return action

    def _drawn(self, request: Request, actions: Iterable[int]) -> str:
        """A path in text: arrows for moves that have one; many equal moves are counted."""
        parts = []
        for action, run in groupby(actions):
            word = self._way(request).briefly(request, action)
            times = len(list(run))
            parts += [word] * times if times <= MOST_DRAWN else [f"{times} x {word}"]
        return " ".join(parts)

    def _drop_path(self, why: str) -> None:
        request, left = self._path.request, self._path.left
        self._path = PathAhead()
        if request is not None and left:
            self._say(f"The rest of your path is dropped ({self._drawn(request, left)}): {why}.", "yellow")

    def _meet(self, request: Request) -> None:
        """Before a question, show the standing of advice if an episode with it did not help."""
        now = request.standing
        before, self._last = self._last, request
        is_same = before is not None and self._way(before).subject(before) is self._way(request).subject(request)
        if not is_same or now.misleads < self._misleads:  # another skill, or another session
            self._guided, self._misleads = min(self._guided, now.misleads), now.misleads
        if now.misleads > self._misleads:
            self._misleads = now.misleads
            limit = "" if now.by_evidence else f"; it tolerates {now.omega}"
            self._say(f"{request_text.misled(now.misleads, self._guided)}{limit}.", "yellow")

    def _help(self, request: Request) -> None:
        width, way = room(self._console)[0], self._way(request)
        introduction = way.judging if request.judgement == "only" else way.introduction
        if self._plain:
            self._print(folded([introduction, *(f"{word}: {does}." for word, does in way.explained(request))], width))
            return
        rows = Table.grid(padding=(0, 2))
        for word, does in way.explained(request):
            rows.add_row(Text(f"  {word}", "bold"), Text(does))
        self._print(folded([introduction], width))
        self._console.print(rows, width=width)

    # ---- events of the session ----------------------------------------------------------------------------------------

    def hear(self, event: Event) -> None:
        """Tell the person when a learner starts asking, the results, and why it stops."""
        if self._done or not isinstance(event, LessonEvent):
            return
        if isinstance(event.event, EpisodeEnded):
            self._drop_path(f"episode {event.event.episode} is over")
            self._guided += event.event.guided
        last, text = self._last, self._order_text if event.lesson == ORDER else self._text
        mdp = last.mdp if isinstance(last, AdviceRequest) else None
        told = text.told(event.event, mdp, event.lesson)
        if told is not None:
            self._say(told.text, STYLES[told.tone])

    def _say(self, text: str, style: str = "") -> None:
        self._print(folded([printable(text)], room(self._console)[0], style))

    def _print(self, lines: Iterable[RenderableType]) -> None:
        for line in lines:
            if isinstance(line, Text):
                line.rstrip()
                self._console.print(line, no_wrap=True, crop=False, overflow="ignore")
            else:
                self._console.print(line)


def _means(answer: object) -> str:
    """By which means an answer was typed, see `lab.advice.answer_times.MEANS`."""
    if isinstance(answer, Judgement):
        return "praise"
    if isinstance(answer, tuple):
        return "path"
    return "move" if isinstance(answer, int) else "auto" if answer == "done" else str(answer)
