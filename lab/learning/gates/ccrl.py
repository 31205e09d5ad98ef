"""CCRL, the thesis's gate, which compares moving averages and rejects misleading advisors; CCRL with introspection."""

from math import inf

from lab.learning.gates.gate import (
    Gate,
    Steps,
    Surroundings,
    Values,
    improvement,
    misled,
    too_slow,
    unsure,
    width_of,
    window_mean,
)
from lab.learning.requests import Both, Reason, TooSlow, ValuesAlike
from lab.learning.settings import GateSettings


class Ccrl(Gate):
    """Asks for whole episodes while improvement is too slow, and rejects an advisor that misleads (thesis fig. 6.2).

    From episode X on it asks if current/previous mean > 1 - Lambda. It stops for good after more than 2K equal results below the
    step limit, and never asks in the last episode, which shows what was learned. An episode that was open for advice and was no
    better than the mean of the K before it is a mislead, even if the advisor's limited view kept it from answering (listing);
    more than Omega misleads reject the advisor.

    Beyond the thesis, whose episodes all begin in one state: if episodes begin in different states, each earlier step count is
    corrected by the difference in distance to the goal between its start and that of the judged episode. The distance of a
    state is the fewest steps in which the learner has seen the goal reached from it, combined over all of its episodes; it is
    an upper bound at first and, if steps are stochastic, the luckiest outcome. The counts of failed episodes are not
    corrected, nor are the counts that decide when to ask. With `settings.spare_best`, an episode with the fewest known steps
    from its start is no mislead, because no advice could have improved it; the thesis counts it as one.

    Where episodes are scored by return, equal results do not show that a goal was reached: then they never stop it for good.
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._by_return = around is not None and around.by_return
        self.watches = around is not None and around.several_starts
        self._slow = Reason()
        self._last_result: float = 0
        self._equal_results = 0
        self._starts: dict[int, int] = {}  # the first state of each episode
        self._start = 0
        self._walk = [0]  # the states of this episode; only the first one if all episodes begin in one state
        self._fewest: dict[int, float] = {}  # the fewest known steps to the goal, by state

    def begins(self, state: int) -> None:
        """Starts recording the states of an episode."""
        self._start, self._walk = (state, []) if self.watches else (0, [0])

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Records the state that was left."""
        self._walk.append(s_tm1)

    def opens(self, episode: int, steps: Steps) -> bool:
        """Whether the improvement rate is below Lambda."""
        improved = improvement(steps, self.settings.window)
        if self.rejected or episode < self.settings.first_episode or improved is None:
            return False
        self._watch_convergence(steps[-1])
        slow = too_slow(improved.current_mean, improved.previous_mean, self.settings.lambda_threshold)
        self.why = self._slow = TooSlow(improved.rate, self.settings.lambda_threshold)
        return slow and not self.converged and episode < self.episodes

    def _watch_convergence(self, result: float) -> None:
        if result == self._last_result and result < self.max_steps and not self._by_return:
            self._equal_results += 1
            self.converged = self.converged or self._equal_results > 2 * self.settings.window
        else:
            self._last_result, self._equal_results = result, 0

    def judges(self, steps: Steps, opened: bool) -> None:
        """Counts a mislead and rejects the advisor after more than Omega (eqs. 6.3 and 6.4)."""
        n, window, result = len(steps), self.settings.window, steps[-1]
        self._starts[n - 1] = self._start
        self._knows(result)
        self.verdict = ""
        if opened and not self.rejected and n > window:
            if not misled(result, window_mean(self._alike(steps), window, window)):
                self.verdict = "better"
            elif self.settings.spare_best and result <= min(self._fewest[self._start], self.max_steps):
                self.verdict = "best"
            else:
                self.verdict = "misled"
                self.misleads += 1
            self.rejected = self.misleads > self.settings.omega

    def _knows(self, result: float) -> None:
        """Updates the distance to the goal of each state of the episode."""
        left = result - len(self._walk) if result <= self.max_steps else inf
        for state in reversed(self._walk):
            left = self._fewest[state] = min(left + 1, self._fewest.get(state, inf))

    def _alike(self, steps: Steps) -> Steps:
        """The K step counts before the last one, corrected as if they had begun in its start."""
        corrected, here = [], self._fewest[self._start]
        for i in range(len(steps) - 1 - self.settings.window, len(steps) - 1):
            start = self._starts.get(i, self._start)
            moved = start != self._start and here < inf and steps[i] <= self.max_steps
            corrected.append(steps[i] - self._fewest[start] + here if moved else steps[i])
        return corrected


class Combined(Ccrl):
    """Asks only when both CCRL and introspection would, and rejects as CCRL does (thesis, section 9.6)."""

    def asks(self, state: int, values: Values) -> bool:
        """Whether the learner is unsure of its choice."""
        self.why = Both(self._slow, ValuesAlike(width_of(values), self.settings.psi))
        return unsure(width_of(values), self.settings.psi)
