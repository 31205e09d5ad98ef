"""Advice on the order of the transfers: a person at a terminal says which part to move next."""

from difflib import get_close_matches

from rich.console import Console
from rich.table import Table
from rich.text import Text

from lab.errors import counted
from lab.learning.requests import AdvisorLeft
from lab.seat.terminal.line_reader import Outside, ReadLine, default_reader
from lab.seat.terminal.screen import folded, room
from lab.sequencing.cell.routes import part_of
from lab.sequencing.methods.srl_advised import SequenceRequest
from lab.sequencing.simulate.run import Run

HELP = (
    "Type a number of the list: that move is made next. Enter: what the learner would do. why: why it asks, with the "
    "numbers. skip: leave this step to the learner. auto: it goes on alone from here. quit, q or Ctrl-C ends the session "
    "and shows the best order so far."
)
NO_UNDO = "An order cannot be taken back here: the episode goes on, and the next one begins anew."
WORDS = ("why", "skip", "auto", "quit")
TABLE = 56  # columns of a terminal; below, each move is a line of words


class OrderPrompt:
    """Asks a person which part to move next: it is the `ask` of `sequence_advisor`.

    plain: sentences instead of a table. Returns the decision, None for "skip". Raises AdvisorLeft for "auto" and at the
    end of the input, KeyboardInterrupt for "quit" and Ctrl-C.
    """

    def __init__(self, console: Console, read_line: ReadLine | None = None, plain: bool = False) -> None:
        self._console, self._read_line, self._plain = console, read_line, plain
        self._outside: Outside = getattr(read_line, "outside", None) or Outside()
        self._episode = 0

    def __call__(self, request: SequenceRequest) -> int | None:
        """Shows where the work stands and returns what the person says."""
        with self._outside.question():
            if self._read_line is None:
                self._read_line = default_reader(self._console, plain=self._plain, outside=self._outside)
            if request.episode != self._episode:
                self._episode = request.episode
                self._console.print()
                self._say(f"Episode {request.episode}: the learner asks which part to move next.", "bold")
                self._say(_progress(request), "dim")
            self._show(request)
            return self._answer(request, self._read_line)

    def answer_from_outside(self, word: str) -> None:
        """Ends the question that waits with a word as if it were typed, from any thread; no effect when nothing waits."""
        self._outside.answer(word)

    def _answer(self, request: SequenceRequest, read_line: ReadLine) -> int | None:
        while True:
            try:
                word = read_line(self._question(request)).strip().lower()
            except EOFError:
                self._say("No more answers: the learner goes on alone.")
                raise AdvisorLeft from None
            match word:
                case "auto" | "done":
                    raise AdvisorLeft
                case "quit" | "q":
                    raise KeyboardInterrupt
                case "skip":
                    return None
                case "":
                    return request.own
                case "why":
                    self._why(request)
                case "undo":
                    self._say(NO_UNDO, "yellow")
                case "?" | "help":
                    self._say(HELP)
                case _ if word in map(str, request.allowed):
                    return int(word)
                case _:
                    self._say(_unknown(word, request), "yellow")

    def _question(self, request: SequenceRequest) -> str:
        wide = room(self._console)[0] >= TABLE
        return f"Which move? [enter = {request.own}, ? explains] " if wide else f"Which move? [{request.own}] "

    def _show(self, request: SequenceRequest) -> None:
        run = request.run
        self._say(f"{run.now_s:.0f} s: the robot is at {run.cell.names[run.robot]}.", "bold")
        rows = {decision: _row(run, decision) for decision in request.allowed}
        if self._plain or room(self._console)[0] < TABLE:
            for decision, (_, name, origin, target, ready) in rows.items():
                mark = ", its own choice" if decision == request.own else ""
                self._say(f"Move {decision}: {name} from {origin} to {target}, {_when(ready)}{mark}.")
            return
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in ("move", "part", "from", "to", "ready in", ""):
            table.add_column(column, justify="right" if column in ("move", "ready in") else "left")
        for decision, row in rows.items():
            own = decision == request.own
            cells = (*row, "its own choice" if own else "")
            table.add_row(*map(Text, cells), style="green" if own else None)
        self._console.print(table)

    def _why(self, request: SequenceRequest) -> None:
        self._say(_progress(request))
        run = request.run
        name, target = _row(run, request.own)[1], _row(run, request.own)[3]
        self._say(
            f"It would move {name} to {target} itself ({request.own}), one of {counted(len(request.allowed), 'move')}."
        )
        self._say("After the episode it compares its cost with the mean of those before it.")

    def _say(self, text: str, style: str = "") -> None:
        clean = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
        for line in folded([clean], room(self._console)[0], style):
            self._console.print(line, no_wrap=True, crop=False, overflow="ignore")


def _row(run: Run, decision: int) -> tuple[str, str, str, str, str]:
    option, part = run.option(decision), part_of(decision, run.cell.parts)
    assert option is not None  # it is allowed
    name = run.cell.part_name(part) + ("'s pallet" if option.carries == "pallet" else "")
    wait_s = max(0.0, run.ready_s[part - 1] - run.now_s) if option.waits else 0.0
    ready = "now" if wait_s == 0.0 else f"{wait_s:.0f} s"
    return str(decision), name, run.cell.names[option.origin], run.cell.names[option.target], ready


def _when(ready: str) -> str:
    return "ready now" if ready == "now" else f"ready in {ready}"


def _unknown(word: str, request: SequenceRequest) -> str:
    near = get_close_matches(word, WORDS, n=1, cutoff=0.7)
    hint = f"did you mean '{near[0]}'? " if near else ""
    known = f"{', '.join(map(str, request.allowed))}, enter, {', '.join(WORDS)} or ?"
    return f"'{word[:20]}' is none of the moves: {hint}type {known}"


def _progress(request: SequenceRequest) -> str:
    if request.improvement_rate is None or request.current_mean is None or request.previous_mean is None:
        return f"It asks because {request.why}."
    means = f"the last episodes cost {request.current_mean:.0f} on average, those before {request.previous_mean:.0f}"
    return f"It asks because {request.why}: {means}."
