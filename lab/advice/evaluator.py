"""The evaluator: an advisor that judges the learner's moves by what another advisor would have said, or passes a person on."""

from lab.learning.praise import Judgement, Judging
from lab.learning.requests import AdviceRequest, Advisor
from lab.learning.selection import Draw
from lab.mdp import FloatArray

SAME = 1e-9  # values that differ by less are equally good


class Evaluator:
    """An advisor that praises the learner's move if another one names it, or one as good, and blames it if it names a worse one.

    advisor: that one; where it names no move there is no judgement, and a person behind it gives judgements at once.
    judging: if it is late, each judgement is of the question 0 to `late` before, drawn from `draw`.
    values: (S, A), by which moves are equally good; None: only the move that was named is.
    """

    def __init__(self, advisor: Advisor, judging: Judging, draw: Draw, values: FloatArray | None = None):
        self.judging = judging
        self._advisor, self._draw, self._values = advisor, draw, values
        self._episode, self._verdicts = 0, list[int | None]()  # on the questions of this episode

    def advise(self, request: AdviceRequest) -> Judgement | None:
        """The judgement of the learner's own move, or of an earlier one; None for none."""
        said = self._advisor.advise(request)
        if isinstance(said, Judgement):
            return said
        if request.episode != self._episode or request.step == 1:
            self._episode, self._verdicts = request.episode, []
        self._verdicts.append(None if said is None else 1 if self._is_as_good(request.state, request.own, said) else -1)
        late = int(self._draw() * (self.judging.late + 1)) if self.judging.late else 0
        verdict = self._verdicts[-1 - late] if late < len(self._verdicts) else None
        return None if verdict is None else Judgement(verdict)

    def _is_as_good(self, state: int, own: int, said: int) -> bool:
        if self._values is None:
            return own == said
        return bool(abs(self._values[state, own] - self._values[state, said]) <= SAME)
