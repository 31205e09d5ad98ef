"""Advice on the order of the transfers: a person at a terminal says which part to move next."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from lab.advice.advisors import AdvisorLeft
from lab.sequencing.advised import SequenceRequest
from lab.sequencing.positions import part_of
from lab.sequencing.run import Run
from lab.view.terminal import ReadLine, default_reader

HELP = (
    "Type a number of the list: that move is made next. Enter: what the learner would do. skip: leave this step to the "
    "learner. auto: it goes on alone from here. Ctrl-C ends the session and shows the best order so far."
)


class OrderPrompt:
    """Asks a person which part to move next: it is the `ask` of `sequence_advisor`.

    Returns the decision, None for "skip". Raises AdvisorLeft for "auto" and at the end of the input.
    """

    def __init__(self, console: Console, read_line: ReadLine | None = None) -> None:
        self._console, self._read_line = console, read_line
        self._episode = 0

    def __call__(self, request: SequenceRequest) -> int | None:
        """Shows where the work stands and returns what the person says."""
        self._read_line = self._read_line or default_reader(self._console)
        if request.episode != self._episode:
            self._episode = request.episode
            self._say(f"\nEpisode {request.episode}: the learner asks which part to move next.", "bold")
            self._say(_progress(request), "dim")
        self._show(request)
        while True:
            try:
                word = self._read_line(f"Which move? [enter = {request.own}, ? explains] ").strip().lower()
            except EOFError:
                self._say("No more answers: the learner goes on alone.")
                raise AdvisorLeft from None
            if word in ("auto", "done"):
                raise AdvisorLeft
            if word == "skip":
                return None
            if not word:
                return request.own
            if word.isdecimal() and int(word) in request.allowed:
                return int(word)
            known = f"{', '.join(map(str, request.allowed))}, enter, skip, auto, ?"
            self._say(HELP if word == "?" else f"'{word[:20]}' is none of the moves: type {known}", "yellow")

    def _show(self, request: SequenceRequest) -> None:
        run = request.run
        self._say(f"{run.now_s:.0f} s: the robot is at {run.cell.names[run.robot]}.", "bold")
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in ("move", "part", "from", "to", "ready in"):
            table.add_column(column, justify="right" if column in ("move", "ready in") else "left")
        for decision in request.allowed:
            table.add_row(*_row(run, decision), style="green" if decision == request.own else None)
        self._console.print(table)

    def _say(self, text: str, style: str = "") -> None:
        self._console.print(Text(text, style))


def _row(run: Run, decision: int) -> tuple[str, str, str, str, str]:
    option, part = run.option(decision), part_of(decision, run.cell.parts)
    assert option is not None  # it is allowed
    name = run.cell.part_name(part) + ("'s pallet" if option.carries == "pallet" else "")
    wait_s = max(0.0, run.ready_s[part - 1] - run.now_s) if option.waits else 0.0
    ready = "now" if wait_s == 0.0 else f"{wait_s:.0f} s"
    return str(decision), name, run.cell.names[option.origin], run.cell.names[option.target], ready


def _progress(request: SequenceRequest) -> str:
    if request.improvement_rate is None or request.current_mean is None or request.previous_mean is None:
        return f"It asks because {request.why}."
    means = f"the last episodes cost {request.current_mean:.0f} on average, those before {request.previous_mean:.0f}"
    return f"It asks because {request.why}: {means}."
