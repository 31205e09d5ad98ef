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
    _lefts: list[float] = field(default_factory=list)  # the steps left before each step of the episode
    _alone: int = 0  # the step from which on the policy has acted alone
    _taken_at: int | None = None  # the first step of the takeover that is going on

    def begin(self) -> None:
        """An episode begins: a takeover that ended with the one before is not judged."""
        self._lefts, self._alone, self._taken_at = [], 0, None

    def saw(self, left: float, corrected: bool) -> None:
        """Hears how many steps are left before the next step, and whether a teacher gave the action of the one before."""
        if corrected and self._taken_at is None and self._lefts:
            self._taken_at = len(self._lefts) - 1
        elif not corrected and self._taken_at is not None:
            self._hand_back(self._taken_at, len(self._lefts) - 1)
            self._alone, self._taken_at = len(self._lefts) - 1, None
        self._lefts.append(left)

    def _hand_back(self, taken: int, back: int) -> None:
        """Judges the takeover of the steps from `taken` to before `back`."""
        steps = back - taken
        before = max(taken - steps, self._alone)
        alone = (self._lefts[before] - self._lefts[taken]) / (taken - before) if taken > before else 0.0
        self.helped += (self._lefts[taken] - self._lefts[back]) / steps > alone
        self.judged += 1
        self.rejects = bool(scipy.special.bdtr(self.helped, self.judged, 0.5) < _LEVEL)  # the binomial distribution
