"""What all gates have in common, and the two that look at nothing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from lab.learning.gates.gate_rules import Steps
from lab.learning.reasons import Reason
from lab.learning.selection import Draw
from lab.learning.session_events import Verdict
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates.update import Update

Values = Sequence[float]


@dataclass(frozen=True)
class Surroundings:
    """What a gate may be built with beside its settings.

    draw: uniform numbers; learners: so many tables that learn as the learner does, each with start values of its own;
    several_starts: episodes may begin in different states; values: what the learner knows of a state now
    (`Update.gauge`); size: (S, A); learner: its settings.
    """

    draw: Draw
    learners: Callable[[int], Sequence[Update]]
    several_starts: bool = False
    values: Callable[[int], Values] = lambda state: ()
    size: tuple[int, int] = (0, 0)
    learner: LearnerSettings = field(default_factory=LearnerSettings)


class Gate:
    """The base of all gates, and the gate "always": every step of every episode asks, and nothing is ever rejected.

    A session calls `opens` before each episode, `begins` where it begins, `asks` before each step of an open one, `takes`
    with what was answered, `saw` after each step (if `watches`), and `judges` after the episode. `steps` holds the step
    counts of the finished episodes, a failed one as max_steps + 1. `why`: the reason of the last question; `verdict`: what
    the gate makes of the episode that ended last, see `Verdict`. weighs: it is asked and given to take also where the
    budget is spent.
    """

    watches = weighs = False

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        self.settings, self.episodes, self.max_steps, self.around = settings, episodes, max_steps, around
        self.misleads = 0
        self.rejected = False
        self.converged = False
        self.why = Reason()
        self.verdict: Verdict = ""

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether episode n (from 1) may ask for advice."""
        return True

    def begins(self, state: int) -> None:
        """Hears in which state the episode begins."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner asks in a state; `values` is what it knows there (`Update.gauge`)."""
        return True

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The action of a step of an open episode; own: the learner's choice; said: the answer, None where nothing was said.

        Called in each of its steps, whether it was asked about or not, also when the budget is spent.
        """
        return own if said is None else said

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Hears of a step that was made, as the learner does (`Update.learn`)."""

    def judges(self, steps: Steps, opened: bool) -> None:
        """Assesses the episode that ended last, which was open for advice or not; may set `rejected`."""


class Never(Gate):
    """Never asks."""

    def opens(self, episode: int, steps: Steps) -> bool:
        """No episode asks."""
        return False


GateClass = Callable[[GateSettings, int, int, Surroundings | None], Gate]
