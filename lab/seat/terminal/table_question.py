"""A question about a table's step at a terminal: where the learner is, and which way to go."""

from rich.console import Console, RenderableType
from rich.text import Text

from lab.learning.requests import AdviceRequest
from lab.seat import request_text
from lab.seat.grid_text import Marks
from lab.seat.grid_views import StateWords
from lab.seat.terminal.screen import folded, question, room, screen
from lab.seat.terminal.typed_answer import Understood, explained, understand

ROOMY = 18  # lines of a terminal; below, no empty line parts the questions


class TableQuestion:
    """How an `AdviceRequest` is shown, and what may be typed; plain: sentences instead of a picture."""

    introduction = (
        "The learner is stuck and asks you where to go. It does what you say, and learns from it as if the move were its "
        "own. When episodes with your advice are no shorter than those before, it counts that, and after a few of them, or when "
        "it has had all the help that it may have, it asks no more. You can type:"
    )

    def __init__(self, console: Console, plain: bool) -> None:
        self._console, self._plain = console, plain
        self.known: StateWords | None = None  # what says in words where the learner is
        self.marks = request_text.WORDS_ONLY if plain else Marks.of(console)

    def subject(self, request: AdviceRequest) -> object:
        """What is learned."""
        return request.mdp

    def asked(self, request: AdviceRequest) -> str:
        """The words before the cursor."""
        return question(request, self.marks, room(self._console)[0])

    def shown(self, request: AdviceRequest) -> list[RenderableType]:
        """Where the learner is, what it would do, and how it has been doing."""
        width, height = room(self._console)
        if self._plain:
            return [Text(), *folded(request_text.sentences(request, self.known), width)]
        gap = [Text()] * (height >= ROOMY)
        left = height - len(gap) - 1 - len(self.asked(request)) // width
        return [*gap, *screen(request, self.marks, width, left, self.known)]

    def understood(self, line: str, request: AdviceRequest) -> Understood:
        """What a line means; see `understand`."""
        return understand(line, request.mdp)

    def warned(self, request: AdviceRequest, action: int) -> str:
        """What is said of an action that leads nowhere, "" for any other."""
        if request_text.outcome(request, action) not in (
            request_text.NOWHERE,
            request_text.OBSTACLE,
            request_text.DEAD_END,
        ):
            return ""
        return f"{self.named(request, action)}: that {request_text.leads(request, action)}: given all the same."

    def why(self, request: AdviceRequest, guided: int) -> list[str]:
        """Why it asks, with all its numbers; guided: the episodes that were given advice until now."""
        return request_text.reasons(request, self.marks, guided)

    def explained(self, request: AdviceRequest) -> list[tuple[str, str]]:
        """What can be typed, and what it does."""
        return explained(request.mdp)

    def named(self, request: AdviceRequest, action: int) -> str:
        """An action in words."""
        return self.marks.named(request.mdp, action)

    def briefly(self, request: AdviceRequest, action: int) -> str:
        """An action as one of many."""
        return request.mdp.action_labels[action] if self._plain else self.named(request, action).split()[0]

    def where(self, request: AdviceRequest, state: int) -> str:
        """Where a state is, shortly; where that takes many words, the question has them."""
        return f"at {request.mdp.state_label(state)}" if self.known is None else "elsewhere"
