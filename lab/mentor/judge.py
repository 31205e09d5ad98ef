"""The judge of takeovers: whether those who were asked bring the end nearer than the policy had done alone."""

from dataclasses import dataclass, field

from lab.lazy import scipy

_LEVEL = 0.02  # of the test by which a teacher is rejected


@dataclass
class Judge:
    """Counts the takeovers that helped: the end came nearer, a step, than in as many of the policy's own steps before.

    How many steps are left is the estimate of the demonstrations. A teacher who helps in every second takeover does no better
    than chance; one with so few helpful takeovers that chance would have fewer in 2 % of the cases is rejected (the binomial
    test, made anew after each takeover). This is the thesis's rule for advice that misleads, for actions without a table.
    """

    helped: int = 0
    judged: int = 0
    rejects: bool = False  # whether takeovers mislead
    _alone: list[float] = field(default_factory=list)  # the steps left, before each of the policy's own steps
    _taken: list[float] = field(default_factory=list)  # and before each of the teacher's

    def begin(self) -> None:
        """An episode begins: a takeover that ended with the one before is not judged."""
        self._alone, self._taken = [], []

    def saw(self, left: float, corrected: bool) -> None:
        """Hears of the next step: how many steps are left before it, and whether a teacher gives its action."""
        if corrected:
            self._taken.append(left)
            return
        if self._taken:
            self._hand_back(left)
        self._alone.append(left)

    def _hand_back(self, left: float) -> None:
        start, steps = self._taken[0], len(self._taken)
        before = self._alone[-steps:]
        alone = (before[0] - start) / len(before) if before else 0.0
        self.helped += (start - left) / steps > alone
        self.judged += 1
        self.rejects = bool(scipy.special.bdtr(self.helped, self.judged, 0.5) < _LEVEL)  # the binomial distribution
        self._alone, self._taken = [], []
