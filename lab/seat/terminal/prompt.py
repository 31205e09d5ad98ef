"""Teaching at a terminal: what the learner sees as text, and the person's answer as an action."""

from collections.abc import Iterable
from itertools import groupby

from rich.console import Console
from rich.table import Table
from rich.text import Text

from lab.advice.journal import Undo
from lab.errors import counted
from lab.learning.events import EpisodeEnded
from lab.learning.requests import AdviceRequest, AdvisorLeft
from lab.mdp import TabularMDP
from lab.seat import request_text as facts
from lab.seat.event_text import SessionText
from lab.seat.grid_text import Marks, draw
from lab.seat.terminal.line_reader import Outside, ReadLine, default_reader
from lab.seat.terminal.screen import folded, question, room, screen
from lab.seat.terminal.typed_answer import explained, understand
from lab.teaching.events import Event, LessonEvent

__all__ = ["TeachingPrompt", "draw", "understand"]

STYLES = {"": "", "ask": "bold", "note": "yellow", "good": "green", "bad": "yellow", "lost": "bold red"}
ROOMY = 18  # lines of a terminal; below, no empty line parts the questions
MOST_DRAWN = 5  # equal moves of a path that are drawn one by one
INTRODUCTION = (
    "The learner is stuck and asks you where to go. It does what you say, and learns from it as if the move were its "
    "own. When episodes with your advice are no shorter than those before, it counts that, and after a few of them it "
    "asks no more. You can type:"
)


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
        self._marks = facts.WORDS_ONLY if plain else Marks.of(console)
        self._outside: Outside = getattr(read_line, "outside", None) or Outside()
        self._done = False
        self._path = _Path()
        self._wall: tuple[int, int, int] | None = None  # that was said of last: episode, state, action
        self._mdp: TabularMDP | None = None  # that was asked about last
        self._text = SessionText(self._marks.named)
        self._guided = self._misleads = 0

    def __call__(self, request: AdviceRequest) -> int | None:
        """Shows where the learner is and returns what the person says."""
        if self._done:
            raise AdvisorLeft
        self._meet(request)
        if self._path.goes_on(request):
            return self._give(request, self._path.step())
        self._drop_path(f"the learner is at {request.mdp.state_label(request.state)} now")
        with self._outside.question():
            if self._read_line is None:
                self._read_line = default_reader(self._console, plain=self._plain, outside=self._outside)
            self.show(request)
            return self._answer(request, self._read_line)

    def answer_from_outside(self, word: str) -> None:
        """Ends the question that waits with a word as if it were typed, from any thread; no effect when nothing waits."""
        self._outside.answer(word)

    def show(self, request: AdviceRequest) -> None:
        """Shows where the learner is, what it would do, and how it has been doing."""
        width, height = room(self._console)
        if self._plain:
            self._print([Text(), *folded(facts.sentences(request), width)])
            return
        asked = question(request, self._marks, width)
        gap = [Text()] * (height >= ROOMY)
        self._print([*gap, *screen(request, self._marks, width, height - len(gap) - 1 - len(asked) // width)])

    def told(self, request: AdviceRequest, action: int | None) -> None:
        """Says what was answered to a request, such as "Answer: right"; None: the step was left to the learner."""
        self._say(f"Answer: {'skip' if action is None else self._marks.named(request.mdp, action)}", "bold")

    # ---- what the person says ---------------------------------------------------------------------------------------

    def _answer(self, request: AdviceRequest, read_line: ReadLine) -> int | None:
        asked = question(request, self._marks, room(self._console)[0])
        while True:
            try:
                answer = understand(read_line(asked), request.mdp)
            except EOFError:
                self._say("No more answers: the learner goes on alone.")
                raise AdvisorLeft from None
            match answer:
                case int():
                    return self._give(request, answer)
                case tuple():
                    self._path = _Path(request, answer)
                    self._say(f"A path of {counted(len(answer), 'move')}: {self._drawn(request.mdp, answer)}", "dim")
                    return self._give(request, self._path.step())
                case "own":
                    return request.learner_action
                case "skip":
                    return None
                case _:
                    self._command(answer, request)

    def _command(self, word: str, request: AdviceRequest) -> None:
        """Does what a word asks for that gives no advice; what is no such word is a hint, and said."""
        match word:
            case "auto":
                raise AdvisorLeft
            case "done":
                self._say("No more advice in this run: from here on learners go on alone.")
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
                for line in facts.reasons(request, self._marks, self._guided):
                    self._say(line)
            case "help":
                self._help(request.mdp)
            case _:
                self._say(word, "yellow")

    def _give(self, request: AdviceRequest, action: int) -> int:
        """An action as the person said it; when it leads nowhere, that is said, and it counts all the same."""
        wall = (request.episode, request.state, action)
        if facts.outcome(request, action) in (facts.NOWHERE, facts.OBSTACLE, facts.DEAD_END):
            if wall != self._wall:  # said once, however often a path runs against it
                named = self._marks.named(request.mdp, action)
                self._say(f"{named}: that {facts.leads(request, action)}: given all the same.", "yellow")
            self._wall = wall if self._path.left else None
        return action

    def _drawn(self, mdp: TabularMDP, actions: Iterable[int]) -> str:
        """Moves one after the other, as arrows where they have one; many of one kind are counted."""
        parts = []
        for action, run in groupby(actions):
            word = mdp.action_labels[action] if self._plain else self._marks.named(mdp, action).split()[0]
            times = len(list(run))
            parts += [word] * times if times <= MOST_DRAWN else [f"{times} x {word}"]
        return " ".join(parts)

    def _drop_path(self, why: str) -> None:
        request, left = self._path.request, self._path.left
        self._path = _Path()
        if request is not None and left:
            self._say(f"The rest of your path is dropped ({self._drawn(request.mdp, left)}): {why}.", "yellow")

    def _meet(self, request: AdviceRequest) -> None:
        """Before a question: how advice stands, when an episode with it did not help."""
        now = request.standing
        if request.mdp is not self._mdp or now.misleads < self._misleads:  # another skill, or another session
            self._mdp, self._guided, self._misleads = request.mdp, min(self._guided, now.misleads), now.misleads
        if now.misleads > self._misleads:
            self._misleads = now.misleads
            self._say(f"{facts.misled(now.misleads, self._guided)}; it tolerates {now.omega}.", "yellow")

    def _help(self, mdp: TabularMDP) -> None:
        width = room(self._console)[0]
        if self._plain:
            self._print(folded([INTRODUCTION, *(f"{word}: {does}." for word, does in explained(mdp))], width))
            return
        rows = Table.grid(padding=(0, 2))
        for word, does in explained(mdp):
            rows.add_row(Text(f"  {word}", "bold"), Text(does))
        self._print(folded([INTRODUCTION], width))
        self._console.print(rows, width=width)

    # ---- what happens in the session --------------------------------------------------------------------------------

    def hear(self, event: Event) -> None:
        """Tells the person when a learner starts asking, what came of it, and why it stops."""
        if self._done or not isinstance(event, LessonEvent):
            return
        if isinstance(event.event, EpisodeEnded):
            self._drop_path(f"episode {event.event.episode} is over")
            self._guided += event.event.guided
        told = self._text.told(event.event, self._mdp, event.lesson)
        if told is not None:
            self._say(told.text, STYLES[told.tone])

    def _say(self, text: str, style: str = "") -> None:
        clean = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
        self._print(folded([clean], room(self._console)[0], style))

    def _print(self, lines: Iterable[Text]) -> None:
        for line in lines:
            line.rstrip()
            self._console.print(line, no_wrap=True, crop=False, overflow="ignore")


class _Path:
    """Moves that were typed at once, given one by one at the next questions of the episode, where they lead."""

    def __init__(self, request: AdviceRequest | None = None, moves: Iterable[int] = ()) -> None:
        self.request, self.left = request, list(moves)
        self._state, self._step = (-1, 0) if request is None else (request.state, request.step)

    def goes_on(self, request: AdviceRequest) -> bool:
        """Whether this question comes where the path leads; where no table says that, whether it is the next one."""
        begun = self.request
        if not self.left or begun is None or begun.mdp is not request.mdp or begun.episode != request.episode:
            return False
        return request.state == self._state if facts.is_known(request.mdp) else request.step == self._step

    def step(self) -> int:
        """The next move."""
        assert self.request is not None
        action = self.left.pop(0)
        self._state, self._step = int(self.request.mdp.successor[self._state, action]), self._step + 1
        return action
