"""What sentences lead to at a question: a path, a move, or rules and commands after which the question still waits."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Final

from lab.learning.praise import Judgement
from lab.learning.requests import AdviceRequest, AdvisorLeft, Request
from lab.seat.spoken_answers import Kept, Rule, SpokenAnswers, decision_of
from lab.words.meaning import Intent, Own, Praise, Quiet, Stop, Why
from lab.words.meaning import Undo as TakeBack
from lab.words.ways import Motion, NoWay

ASKS: Final = "asks"  # instead of an answer: the person is asked again
# the moves of a path, one move, a judgement of what was done, ASKS, or None: the step is left to the learner
Turn = tuple[int, ...] | int | Judgement | str | None
NO_MORE = "No more advice in this run: from here on learners go on alone."


class SpokenTurns:
    """Carries out what was understood, at a terminal as on a page.

    say: shows a line with a tone ("", "bold", "yellow" or "dim"). command: carries out "why", "undo" or "quit" at a question.
    """

    def __init__(
        self,
        spoken: SpokenAnswers,
        say: Callable[[str, str], None],
        command: Callable[[str, Request], None],
    ) -> None:
        self._spoken, self._say, self._command = spoken, say, command
        self._ahead: deque[Intent] = deque()  # what was said for after the present path

    def before_asking(self, request: Request) -> Turn:
        """The answer of what was said before, ASKS if the person is to be asked."""
        if self._ahead:
            said, self._ahead = list(self._ahead), deque()
            if (turn := self.carry_out(said, request)) != ASKS:
                return turn
        kept = self._spoken.kept(request)
        return ASKS if kept is None else self._keep(kept)

    def moves(self, heard: Sequence[Intent], request: Request) -> tuple[int, ...]:
        """The moves for what was understood before anything is carried out, () if there is no path."""
        if not isinstance(request, AdviceRequest):
            return ()
        try:
            return self._spoken.moves(heard, request)
        except NoWay:
            return ()

    def carry_out(self, said: Sequence[Intent], request: Request) -> Turn:
        """Carry out what was said, up to a move, after which the rest waits."""
        rest = deque(said)
        while rest:
            intent = rest.popleft()
            if isinstance(intent, Praise) and request.judgement != "no":
                self._ahead = rest
                return Judgement(intent.sign)
            if request.judgement == "only" and isinstance(intent, Motion | Own):
                self._say("This question is about the move that it makes: say whether it is good or bad.", "yellow")
                return ASKS
            if isinstance(intent, Motion) and isinstance(request, AdviceRequest):
                motions: list[Intent] = [intent]
                while rest and isinstance(rest[0], Motion):
                    motions.append(rest.popleft())
                try:
                    moves = self._spoken.moves(motions, request)
                except NoWay as reason:
                    self._say(f"{reason}: not done.", "yellow")
                    return ASKS
                self._ahead = rest
                self._spoken.gave(request, moves)
                return moves
            decision = request.own if isinstance(intent, Own) else decision_of([intent])
            if decision is not None:
                self._ahead = rest
                self._spoken.gave(request, (decision,))
                return decision
            if isinstance(intent, Motion):
                self._say("The other way, or the same again, is not understood for an order: say the move.", "yellow")
                return ASKS
            if isinstance(intent, TakeBack) and request.undoable:
                self._ahead = rest  # for the question that is asked again
            if refusal := self._note(intent, request):
                self._say(f"{refusal}: not done.", "yellow")
                return ASKS
        if any(isinstance(intent, Quiet | Rule) for intent in said):
            kept = self._spoken.kept(request)
            return ASKS if kept is None else self._keep(kept)
        return ASKS

    def _note(self, intent: Intent, request: Request) -> str:
        """Carry out what gives no answer; returns why it cannot be, "" if it can."""
        match intent:
            case Why():
                self._command("why", request)
            case TakeBack():
                self._command("undo", request)
            case Stop():
                self._command("quit", request)
            case Praise():
                self._say("Noted; nothing was done yet that could be good or bad.", "dim")
            case _:
                return self._spoken.hold(intent, request)
        return ""

    def _keep(self, kept: Kept) -> int | None:
        """An answer by what holds; raises AdvisorLeft when no more questions are wanted at all."""
        if kept.action is None and kept.why:
            self._say(NO_MORE, "")
            raise AdvisorLeft
        if kept.why:
            self._say(kept.why, "dim")
        return kept.action


def counts_at_once(heard: Sequence[Any]) -> bool:
    """Whether nothing among intents has to be agreed to first."""
    return all(isinstance(intent, Why | Praise | Own) for intent in heard)
