"""When a learner asks for advice: per episode (CCRL), per step (introspection), both, always or never."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lab.learning.settings import GateSettings


@dataclass(frozen=True)
class Improvement:
    """The last K episodes beside the K before them: rate = (previous - current) / previous (thesis eq. 6.1)."""

    rate: float
    current_mean: float
    previous_mean: float


def improvement(steps: Sequence[int], window: int) -> Improvement | None:
    """The improvement of the step counts so far; None while fewer than two windows have ended."""
    if len(steps) < 2 * window:
        return None
    current = sum(steps[-window:]) / window
    previous = sum(steps[-2 * window : -window]) / window
    return Improvement(1.0 - current / previous, current, previous)


class Gate:
    """The base of all gates, and the gate "always": every step of every episode asks, and nothing is ever rejected.

    A session calls `opens` before each episode, `asks` before each step of an open one, and `judges` after it.
    `steps` holds the step counts of the finished episodes, a failed one as max_steps + 1.
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int):
        self.settings, self.episodes, self.max_steps = settings, episodes, max_steps
        self.misleads = 0
        self.rejected = False
        self.converged = False

    def opens(self, episode: int, steps: Sequence[int]) -> bool:
        """Whether episode n (from 1) may ask for advice."""
        return True

    def asks(self, values: Sequence[float]) -> bool:
        """Whether the learner asks in a state with these action values."""
        return True

    def judges(self, steps: Sequence[int], helped: bool) -> None:
        """Assesses the advice of the episode that ended last; may set `rejected`."""


class Never(Gate):
    """Never asks."""

    def opens(self, episode: int, steps: Sequence[int]) -> bool:
        """No episode asks."""
        return False


class Introspection(Gate):
    """From episode X on asks in each state whose action values span less than Psi (Clouse 1996; thesis eq. 9.3)."""

    def opens(self, episode: int, steps: Sequence[int]) -> bool:
        """Every episode from X on may ask."""
        return episode >= self.settings.first_episode

    def asks(self, values: Sequence[float]) -> bool:
        """Whether the learner is unsure of its choice."""
        return max(values) - min(values) < self.settings.psi


class Ccrl(Gate):
    """Asks for whole episodes while improvement is too slow, and rejects an advisor that misleads (thesis fig. 6.2).

    From episode X on it asks when current/previous mean > 1 - Lambda. It stops for good after more than 2K equal
    results below the step limit, and never asks in the last episode, which shows what was learned. A helped episode
    that is not better than the mean of the K before it is a mislead; more than Omega of them reject the advisor.
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int):
        super().__init__(settings, episodes, max_steps)
        self._last_result = 0
        self._equal_results = 0

    def opens(self, episode: int, steps: Sequence[int]) -> bool:
        """Whether the improvement rate is below Lambda."""
        improved = improvement(steps, self.settings.window)
        if self.rejected or episode < self.settings.first_episode or improved is None:
            return False
        self._watch_convergence(steps[-1])
        too_slow = improved.current_mean / improved.previous_mean > 1.0 - self.settings.lambda_threshold
        return too_slow and not self.converged and episode < self.episodes

    def _watch_convergence(self, result: int) -> None:
        if result == self._last_result and result < self.max_steps:
            self._equal_results += 1
            self.converged = self.converged or self._equal_results > 2 * self.settings.window
        else:
            self._last_result, self._equal_results = result, 0

    def judges(self, steps: Sequence[int], helped: bool) -> None:
        """Counts a mislead and rejects the advisor after more than Omega (eqs. 6.3 and 6.4)."""
        window = self.settings.window
        if helped and not self.rejected and len(steps) > window:
            self.misleads += steps[-1] >= sum(steps[-1 - window : -1]) / window
            self.rejected = self.misleads > self.settings.omega


class Combined(Ccrl):
    """Asks only when both CCRL and introspection would, and rejects as CCRL does (thesis, section 9.6)."""

    def asks(self, values: Sequence[float]) -> bool:
        """Whether the learner is unsure of its choice."""
        return max(values) - min(values) < self.settings.psi


GATES: dict[str, Callable[[GateSettings, int, int], Gate]] = {
    "ccrl": Ccrl,
    "ia": Introspection,
    "combined": Combined,
    "always": Gate,
    "never": Never,
}
