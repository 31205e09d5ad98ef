"""CCRL, the thesis's gate, which compares moving averages and rejects misleading advisors; CCRL with introspection."""

from collections.abc import Sequence
from math import inf

from lab.learning.gates.gate import (
    ENOUGH_EVIDENCE,
    Gate,
    Steps,
    Surroundings,
    Values,
    evidence,
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

    With `settings.by_evidence`, also beyond the thesis, an episode with advice is compared with the last K without any, and the
    advisor is rejected when the `evidence` against it exceeds ENOUGH_EVIDENCE; a mislead is an episode that adds to it.

    Where episodes are scored by return, equal results do not show that a goal was reached: then they never stop it for good.
    """

    def __init__(self, settings: GateSettings, episodes: int, max_steps: int, around: Surroundings | None = None):
        super().__init__(settings, episodes, max_steps, around)
        self._by_return = around is not None and around.by_return
        self.several_starts = around is not None and around.several_starts
        self.watches = self.several_starts or settings.by_evidence
        self._slow = Reason()
        self._last_result: float = 0
        self._equal_results = 0
        self._starts: dict[int, int] = {}  # the first state of each episode
        self._start = 0
        self._walk = [0]  # the states of this episode; only the first one if all episodes begin in one state
        self._fewest: dict[int, float] = {}  # the fewest known steps to the goal, by state
        self.evidence = 0.0  # against the advisor
        self._own: list[int] = []  # the indices of the episodes without advice
        self._moves = self._helped = 0  # of this episode

    def begins(self, state: int) -> None:
        """Starts recording the states of an episode."""
        self._start, self._walk = (state, []) if self.several_starts else (0, [0])
        self._moves = self._helped = 0

    def saw(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Records the state that was left."""
        self._moves += 1
        if self.several_starts:
            self._walk.append(s_tm1)

    def takes(self, state: int, own: int, said: int | None) -> int:
        """The answer if there is one; counts it."""
        self._helped += said is not None
        return own if said is None else said

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
        """Counts a mislead and rejects the advisor after more than Omega (eqs. 6.3 and 6.4), or by the evidence."""
        n, window, result = len(steps), self.settings.window, steps[-1]
        self._starts[n - 1] = self._start
        self._knows(result)
        self.verdict = ""
        if self.settings.by_evidence:
            self._weighs(steps, opened)
        elif opened and not self.rejected and n > window:
            if not misled(result, window_mean(self._alike(steps, range(n - 1 - window, n - 1)), window, window)):
                self.verdict = "better"
            elif self.settings.spare_best and result <= min(self._fewest[self._start], self.max_steps):
                self.verdict = "best"
            else:
                self.verdict = "misled"
                self.misleads += 1
            self.rejected = self.misleads > self.settings.omega

    def _weighs(self, steps: Steps, opened: bool) -> None:
        """Adds the last episode to the evidence if it was advised, otherwise to the learner's own ones."""
        n, window, result = len(steps), self.settings.window, steps[-1]
        if not opened:
            self._own.append(n - 1)
        elif not self.rejected and n > window:
            own: float = 0.0
            reached = 0
            latest = self._own[: -window - 1 : -1]
            for i, value in zip(latest, self._alike(steps, latest), strict=True):
                own += value
                reached += steps[i] <= self.max_steps
            before, throughout = self.evidence, self._helped >= self._moves
            self.evidence = evidence(before, result, own, reached, result > self.max_steps, throughout)
            self.verdict = "misled" if self.evidence > before else "better"
            self.misleads += self.evidence > before
            self.rejected = self.evidence > ENOUGH_EVIDENCE

    def _knows(self, result: float) -> None:
        """Updates the distance to the goal of each state of the episode."""
        left = result - len(self._walk) if result <= self.max_steps else inf
        for state in reversed(self._walk):
            left = self._fewest[state] = min(left + 1, self._fewest.get(state, inf))

    def _alike(self, steps: Steps, episodes: Sequence[int]) -> Steps:
        """The step counts of some episodes, corrected as if they had begun in the start of the last one."""
        corrected, here = [], self._fewest[self._start]
        for i in episodes:
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
