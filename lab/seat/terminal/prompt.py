"""Teaching at a terminal: questions as text and a person's answers, for moves in a table and for the order of transfers."""

from collections.abc import Callable, Iterable
from difflib import get_close_matches
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
from lab.seat import order_text, request_text
from lab.seat.event_text import SessionText
from lab.seat.grid_text import Marks, StateWords
from lab.seat.request_text import PathAhead
from lab.seat.spoken_answers import SpokenAnswers
from lab.seat.spoken_turns import ASKS, NO_MORE, SpokenTurns, Turn, counts_at_once
from lab.seat.terminal.line_reader import Outside, ReadLine, default_reader
from lab.seat.terminal.screen import folded, question, room, screen
from lab.seat.terminal.typed_answer import (
    ANSWERS,
    COMMANDS,
    IN_WORDS,
    JUDGE_HINT,
    PRAISES,
    Understood,
    explained,
    explained_words,
    is_sentence,
    judged,
    understand,
)
from lab.sequencing.search import SequenceRequest
from lab.teaching.events import ORDER, Event, LessonEvent
from lab.words.meaning import Refusal

WORDS = ("why", "undo", "skip", "auto", "quit")
TABLE = 56  # columns of a terminal, below which each move is a line of words instead of a table row


class OrderQuestion:
    """The display of a `SequenceRequest`, and its possible answers; plain: sentences instead of a table."""

    introduction = (
        "The learner is stuck and asks you which part to move next. It does what you say, and learns from it as if the "
        "move were its own. When episodes with your advice are no better than those before, it counts that, and after a "
        "few of them it asks no more. You can type:"
    )

    def __init__(self, console: Console, plain: bool) -> None:
        self._console, self._plain = console, plain
        self._episode = 0

    def subject(self, request: SequenceRequest) -> object:
        """The subject of the question: what is learned."""
        return request.run.cell

    def asked(self, request: SequenceRequest) -> str:
        """The prompt before the cursor."""
        wide = room(self._console)[0] >= TABLE
        return f"Which move? [enter = {request.own}, ? explains] " if wide else f"Which move? [{request.own}] "

    def shown(self, request: SequenceRequest) -> list[RenderableType]:
        """The state of the work and the allowed moves; in the first question of an episode also its reason."""
        width = room(self._console)[0]
        lines: list[RenderableType] = [Text(), *folded([f"{order_text.title(request)}."], width, "bold")]
        if request.episode != self._episode:
            self._episode = request.episode
            lines += folded([order_text.progress(request)], width, "dim")
        moves = [order_text.move_of(request, decision) for decision in request.allowed]
        if self._plain or width < TABLE:
            own = ", its own choice"
            return [*lines, *folded([f"{move}{own * (move.decision == request.own)}." for move in moves], width)]
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in ("move", "part", "from", "to", "ready in", ""):
            table.add_column(column, justify="right" if column in ("move", "ready in") else "left")
        for move in moves:
            is_own = move.decision == request.own
            cells = (str(move.decision), move.name, move.origin, move.target, move.ready, "its own choice" * is_own)
            table.add_row(*map(Text, cells), style="green" if is_own else None)
        return [*lines, table]

    def understood(self, line: str, request: SequenceRequest) -> Understood:
        """The decision with this number, one of ANSWERS, or a hint of one line."""
        word = line.strip().lower()
        if word in map(str, request.allowed):
            return int(word)
        if word in COMMANDS and word != "path":
            return COMMANDS[word][0]
        near = get_close_matches(word, WORDS, n=1, cutoff=0.7)
        hint = f"did you mean '{near[0]}'? " if near else ""
        known = f"{', '.join(map(str, request.allowed))}, enter, {', '.join(WORDS)} or ?"
        return f"'{word[:20]}' is none of the moves: {hint}type {known}"

    def warned(self, request: SequenceRequest, decision: int) -> str:
        """An empty string, because every allowed decision leads on."""
        return ""

    def why(self, request: SequenceRequest, guided: int) -> list[str]:
        """The reason for the question."""
        return order_text.reasons(request)

    def explained(self, request: SequenceRequest) -> list[tuple[str, str]]:
        """The possible inputs and their effects."""
        return [("a number", "of the list: that move is made next"), *explained_words(), IN_WORDS]

    def named(self, request: SequenceRequest, decision: int) -> str:
        """A decision in words."""
        return f"move {decision}"

    def briefly(self, request: SequenceRequest, decision: int) -> str:
        """A decision in short, for a list of many."""
        return str(decision)

    def where(self, request: SequenceRequest, state: int) -> str:
        """The robot's position."""
        return f"at {request.run.cell.names[request.run.robot]}"


# ---- questions on moves in a table --------------------------------------------------------------------------------------


ROOMY = 18  # lines of a terminal, below which no empty line separates the questions


class TableQuestion:
    """The display of an `AdviceRequest`, and its possible answers; plain: sentences instead of a picture."""

    introduction = (
        "The learner is stuck and asks you where to go. It does what you say, and learns from it as if the move were its "
        "own. When episodes with your advice are no shorter than those before, it counts that, and after a few of them, or when "
        "it has had all the help that it may have, it asks no more. You can type:"
    )
    judging = (
        "The learner is stuck, shows you each move that it makes, and asks how it is. While it is stuck it repeats what was good "
        "and avoids what was bad; what it learns that its moves are worth stays its own. You can type:"
    )

    def __init__(self, console: Console, plain: bool) -> None:
        self._console, self._plain = console, plain
        self.known: StateWords | None = None  # describes the learner's state in words
        self.marks = request_text.WORDS_ONLY if plain else Marks.of(console)

    def subject(self, request: AdviceRequest) -> object:
        """The subject of the question: what is learned."""
        return request.mdp

    def asked(self, request: AdviceRequest) -> str:
        """The prompt before the cursor."""
        return question(request, self.marks, room(self._console)[0])

    def shown(self, request: AdviceRequest) -> list[RenderableType]:
        """The learner's state, its own choice, and its progress."""
        width, height = room(self._console)
        if self._plain:
            return [Text(), *folded(request_text.sentences(request, self.known), width)]
        gap = [Text()] * (height >= ROOMY)
        left = height - len(gap) - 1 - len(self.asked(request)) // width
        return [*gap, *screen(request, self.marks, width, left, self.known)]

    def understood(self, line: str, request: AdviceRequest) -> Understood | Judgement:
        """The meaning of a line; see `judged` and `understand`."""
        typed = () if request.judgement == "only" else request.mdp.action_labels
        if request.judgement != "no" and (said := judged(line, typed)) is not None:
            return said
        meant = understand(line, request.mdp)
        if request.judgement != "only":
            return meant
        return "skip" if meant == "own" else meant if meant in ANSWERS else JUDGE_HINT

    def warned(self, request: AdviceRequest, action: int) -> str:
        """The warning about an action that leads nowhere, "" for any other."""
        if request_text.outcome(request, action) not in (
            request_text.NOWHERE,
            request_text.OBSTACLE,
            request_text.DEAD_END,
        ):
            return ""
        return f"{self.named(request, action)}: that {request_text.leads(request, action)}: given all the same."

    def why(self, request: AdviceRequest, guided: int) -> list[str]:
        """The reason for the question with all its numbers; guided: the number of episodes with advice so far."""
        return request_text.reasons(request, self.marks, guided)

    def explained(self, request: AdviceRequest) -> list[tuple[str, str]]:
        """The possible inputs and their effects."""
        if request.judgement == "only":
            return [*PRAISES, ("enter", "no judgement"), *explained_words()[1:]]
        return explained(request.mdp) + ([*PRAISES] if request.judgement == "also" else [])

    def named(self, request: AdviceRequest, action: int) -> str:
        """An action in words."""
        return self.marks.named(request.mdp, action)

    def briefly(self, request: AdviceRequest, action: int) -> str:
        """An action in short, for a list of many."""
        return request.mdp.action_labels[action] if self._plain else self.named(request, action).split()[0]

    def where(self, request: AdviceRequest, state: int) -> str:
        """A state's position in short; a position that takes many words is left to the question."""
        return f"at {request.mdp.state_label(state)}" if self.known is None else "elsewhere"


# ---- the prompt -------------------------------------------------------------------------------------------------------


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
        self.on_heard: Callable[[Request, str, tuple[int, ...]], None] | None = (
            None  # what waits for agreement: text, path
        )

    def __call__(self, request: Request) -> Reply:
        """The person's answer, after showing the learner's state."""
        if self._done:
            raise AdvisorLeft
        self._meet(request)
        if self._path.goes_on(request):
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
                alone = answer == JUDGE_HINT and len(line.split()) == 1
                if isinstance(answer, str) and answer not in ANSWERS and is_sentence(line) and not alone:
                    turn = self._hear(line, answer, request, read_line)
                    if turn != ASKS:
                        return self._take(turn, request)
                    if self.on_heard is not None:
                        self.on_heard(request, "", ())
                    continue
            except EOFError:
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
