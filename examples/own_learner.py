"""A learner of one's own: `lab teach world-1 --learner ./own_learner.py:ExpectedSarsa`."""

from lab.learning.selection import chances
from lab.learning.updates.update import OnTable, towards


class ExpectedSarsa(OnTable):
    """As sarsa, but judged by the mean of what comes next, at the first episode's temperature (van Seijen et al. 2009)."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Moves q(s_tm1, a_tm1) towards r_t + discount_t * sum_a pi(a | s_t) q(s_t, a)."""
        following = 0.0
        if discount_t:
            shares = chances("softmax", self.q[s_t], self._settings.exploration)
            following = sum(share * value for share, value in zip(shares, self.q[s_t], strict=True))
        row = self.q[s_tm1]
        row[a_tm1] = towards(row[a_tm1], r_t + discount_t * following, self._alpha)
