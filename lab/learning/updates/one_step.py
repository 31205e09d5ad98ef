"""Learners that correct one move at a time: Q-learning and SARSA."""

from lab.learning.updates.update import OnTable, Row, towards


def q_target(r_t: float, discount_t: float, q_t: Row) -> float:
    """r + gamma max_a Q(s', a); discount_t is 0 when s' is terminal. Source: Watkins 1989, thesis fig. 2.2."""
    return r_t + discount_t * max(q_t)


def sarsa_target(r_t: float, discount_t: float, q_t: Row, a_t: int) -> float:
    """r + gamma Q(s', a'); discount_t is 0 when s' is terminal. Source: thesis fig. 2.1."""
    return r_t + discount_t * q_t[a_t]


class QLearning(OnTable):
    """One-step Q-learning: Q(s,a) += alpha (r + gamma max Q(s',.) - Q(s,a)). Source: thesis fig. 2.2."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of Q(s, a)."""
        row = self.q[s_tm1]
        row[a_tm1] = towards(row[a_tm1], q_target(r_t, discount_t, self.q[s_t]), self._alpha)


class Sarsa(OnTable):
    """One-step SARSA: Q(s,a) += alpha (r + gamma Q(s',a') - Q(s,a)). Source: thesis fig. 2.1."""

    lookahead = True

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of Q(s, a)."""
        row = self.q[s_tm1]
        row[a_tm1] = towards(row[a_tm1], sarsa_target(r_t, discount_t, self.q[s_t], a_t), self._alpha)
