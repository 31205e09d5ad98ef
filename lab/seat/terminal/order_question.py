"""A question about the order of the transfers at a terminal: which part to move next."""

from difflib import get_close_matches

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from lab.seat import order_text
from lab.seat.terminal.screen import folded, room
from lab.seat.terminal.typed_answer import COMMANDS, Understood, explained_words
from lab.sequencing.request import SequenceRequest

WORDS = ("why", "undo", "skip", "auto", "quit")
TABLE = 56  # columns of a terminal; below, each move is a line of words


class OrderQuestion:
    """How a `SequenceRequest` is shown, and what may be typed; plain: sentences instead of a table."""

    introduction = (
        "The learner is stuck and asks you which part to move next. It does what you say, and learns from it as if the "
        "move were its own. When episodes with your advice are no better than those before, it counts that, and after a "
        "few of them it asks no more. You can type:"
    )

    def __init__(self, console: Console, plain: bool) -> None:
        self._console, self._plain = console, plain
        self._episode = 0

    def subject(self, request: SequenceRequest) -> object:
        """What is learned."""
        return request.run.cell

    def asked(self, request: SequenceRequest) -> str:
        """The words before the cursor."""
        wide = room(self._console)[0] >= TABLE
        return f"Which move? [enter = {request.own}, ? explains] " if wide else f"Which move? [{request.own}] "

    def shown(self, request: SequenceRequest) -> list[RenderableType]:
        """Where the work stands, and what may be moved; in the first question of an episode, why it asks."""
        width = room(self._console)[0]
        lines: list[RenderableType] = [Text(), *folded([f"{order_text.title(request)}."], width, "bold")]
        if request.episode != self._episode:
            self._episode = request.episode
            lines += folded([order_text.progress(request)], width, "dim")
        moves = [order_text.move_of(request, decision) for decision in request.allowed]
        if self._plain or width < TABLE:
            own = ", its own choice"
            return [*lines, *folded([f"{one}{own * (one.decision == request.own)}." for one in moves], width)]
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in ("move", "part", "from", "to", "ready in", ""):
            table.add_column(column, justify="right" if column in ("move", "ready in") else "left")
        for one in moves:
            is_own = one.decision == request.own
            cells = (str(one.decision), one.name, one.origin, one.target, one.ready, "its own choice" * is_own)
            table.add_row(*map(Text, cells), style="green" if is_own else None)
        return [*lines, table]

    def understood(self, line: str, request: SequenceRequest) -> Understood:
        """The decision that a number means, one of ANSWERS, or else a hint of one line."""
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
        """An empty string: every decision that is allowed leads on."""
        return ""

    def why(self, request: SequenceRequest, guided: int) -> list[str]:
        """Why it asks."""
        return order_text.reasons(request)

    def explained(self, request: SequenceRequest) -> list[tuple[str, str]]:
        """What can be typed, and what it does."""
        return [("a number", "of the list: that move is made next"), *explained_words()]

    def named(self, request: SequenceRequest, decision: int) -> str:
        """A decision in words."""
        return f"move {decision}"

    def briefly(self, request: SequenceRequest, decision: int) -> str:
        """A decision as one of many."""
        return str(decision)

    def where(self, request: SequenceRequest, state: int) -> str:
        """Where the robot is."""
        return f"at {request.run.cell.names[request.run.robot]}"
