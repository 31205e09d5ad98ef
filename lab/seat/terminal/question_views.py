"""Questions at a terminal, for moves in a table and for the order of transfers: how they are shown, and what may be typed."""

from difflib import get_close_matches

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest
from lab.seat import order_text, request_text
from lab.seat.grid_text import Marks, StateWords
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
    judged,
    understand,
)
from lab.sequencing.search import SequenceRequest

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
