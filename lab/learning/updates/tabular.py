"""Learners on a table: Q-learning, SARSA, Monte Carlo, Dyna-Q, afterstates, and Q(lambda) and SARSA(lambda) with traces."""

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.updates.update import ComputedRows, OnTable, Row, Update, towards
from lab.mdp import TabularMDP


def q_target(r_t: float, discount_t: float, q_t: Row) -> float:
    """r + gamma max_a Q(s', a); discount_t is 0 when s' is terminal. Source: Watkins 1989, thesis fig. 2.2."""
    return r_t + discount_t * max(q_t)


def sarsa_target(r_t: float, discount_t: float, q_t: Row, a_t: int) -> float:
    """r + gamma Q(s', a'); discount_t is 0 when s' is terminal. Source: thesis fig. 2.1."""
    return r_t + discount_t * q_t[a_t]


class QLearning(OnTable):
    """One-step Q-learning: Q(s,a) += alpha (r + gamma max Q(s',.) - Q(s,a)). Source: thesis fig. 2.2."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates Q(s, a)."""
        row = self.q[s_tm1]
        row[a_tm1] = towards(row[a_tm1], q_target(r_t, discount_t, self.q[s_t]), self._alpha)


class Sarsa(OnTable):
    """One-step SARSA: Q(s,a) += alpha (r + gamma Q(s',a') - Q(s,a)). Source: thesis fig. 2.1."""

    lookahead = True

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates Q(s, a)."""
        row = self.q[s_tm1]
        row[a_tm1] = towards(row[a_tm1], sarsa_target(r_t, discount_t, self.q[s_t], a_t), self._alpha)


# ---- Monte Carlo: learning from whole episodes ----------------------------------------------------------------------


class MonteCarlo(OnTable):
    """First-visit Monte Carlo with a constant step: Q(s,a) += alpha (G - Q(s,a)) when the episode is over.

    A truncated episode is learned from as if the start value of the settings were its remaining return.
    Source: Sutton and Barto 1998, section 5.4.
    """

    chained = True

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._episode: list[tuple[int, int, float]] = []
        self._after = 0.0

    def begin(self) -> None:
        """Forgets the last episode."""
        self._episode.clear()

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Records the step."""
        self._after = self._settings.start_value if discount_t else 0.0
        self._episode.append((s_tm1, a_tm1, r_t))

    def end(self) -> None:
        """Learns from the returns that followed the first visits."""
        outcome, returns = self._after, dict[tuple[int, int], float]()
        for state, action, reward in reversed(self._episode):
            outcome = reward + self._settings.discount * outcome
            returns[state, action] = outcome  # the last assignment is that of the first visit
        for (state, action), outcome in returns.items():
            self.q[state][action] = towards(self.q[state][action], outcome, self._alpha)
        self._episode.clear()


# ---- Dyna-Q: planning in a learned model ----------------------------------------------------------------------------


class DynaQ(QLearning):
    """Q-learning that replays `planning` known moves from a learned model after each step.

    The model holds the last outcome of each move, also if steps are stochastic; moves are replayed in turn, the newest first.
    Source: Sutton 1990, who draws the moves at random; Sutton and Barto 1998, fig. 9.4.
    """

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._outcomes: dict[tuple[int, int], tuple[float, float, int]] = {}
        self._moves: list[tuple[int, int]] = []
        self._turn = 0

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates Q(s, a), then the values of replayed moves."""
        learn, outcomes, moves = super().learn, self._outcomes, self._moves
        learn(s_tm1, a_tm1, r_t, discount_t, s_t, a_t)
        if (s_tm1, a_tm1) not in outcomes:
            moves.append((s_tm1, a_tm1))
        outcomes[s_tm1, a_tm1] = r_t, discount_t, s_t
        for _ in range(min(self._settings.planning, len(moves))):
            self._turn = (self._turn or len(moves)) - 1
            state, action = moves[self._turn]
            learn(state, action, *outcomes[state, action], a_t)

    def replay(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int) -> None:
        """Learns again from a known step, and from no other."""
        super().learn(s_tm1, a_tm1, r_t, discount_t, s_t, 0)


# ---- afterstates: values of the states that moves lead to -----------------------------------------------------------


def afterstate_value(step_reward: float, discount: float, v_t: float) -> float:
    """r + gamma V(s'), the value of a move by that of the state after it. Source: thesis App. VII; Sutton and Barto, 6.8."""
    return step_reward + discount * v_t


class AfterstateRows(ComputedRows):
    """Action values computed from state values: row s is r + gamma V(s') for each action, zeros in terminal states."""

    def __init__(self, mdp: TabularMDP, discount: float, values: Row):
        self.values = values
        self._step_reward, self._discount = mdp.step_reward, discount
        self.successor: list[list[int]] = mdp.successor.tolist()
        self._over: list[bool] = mdp.terminal.tolist()

    def __len__(self) -> int:
        return len(self.successor)

    def row(self, state: int) -> Row:
        """The action values (A,) of a state."""
        if self._over[state]:
            return [0.0] * len(self.successor[state])
        reward, discount, values = self._step_reward, self._discount, self.values
        return [afterstate_value(reward, discount, values[entered]) for entered in self.successor[state]]

    def after(self, state: int) -> Row:
        """The values of the states that the actions lead to."""
        return [self.values[entered] for entered in self.successor[state]]


class Afterstate(Update):
    """TD(0) on afterstates: V(s) += alpha (r + gamma V(s') - V(s)), where s' is the state that the chosen action led to.

    The value of a terminal state is 0 until it is first entered, then its reward. Raises BadInput unless all moves into
    nonterminal states have the same reward, and all moves into a terminal state have the same reward, too.
    Source: thesis App. VII (the text speaks of Q(s,a), the listing keeps a value per state).
    """

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        self._alpha, self._discount = settings.alpha, settings.discount
        self._step_reward = mdp.step_reward
        self._arrival: Row = mdp.arrival.tolist()
        self._values = _values_behind(q, mdp, settings.discount)
        self._rows = AfterstateRows(mdp, settings.discount, self._values)
        self.q = self._rows

    def gauge(self, state: int) -> Row:
        """The values of the states that the actions lead to, as the listing compares them."""
        return self._rows.after(state)

    def leads_to(self, state: int, action: int) -> int:
        """The state that a move leads to."""
        return self._rows.successor[state][action]

    def prefer(self, state: int, action: int, margin: float) -> None:
        """Lowers the values of the states that other actions lead to."""
        successor, values = self._rows.successor[state], self._values
        most = values[successor[action]] - margin
        for entered in successor:
            if entered != successor[action]:
                values[entered] = min(values[entered], most)

    def scatter(self, draw: Draw) -> None:
        """Draws every state's value within +-0.5."""
        self._values[:] = [draw() - 0.5 for _ in self._values]

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates V(s); entering a terminal state sets its value to the reward."""
        values = self._values
        target = afterstate_value(self._step_reward, self._discount, values[s_t])
        values[s_tm1] = towards(values[s_tm1], target, self._alpha)
        if not discount_t:
            values[s_t] = self._arrival[s_t]


def _values_behind(q: list[Row], mdp: TabularMDP, discount: float) -> Row:
    """The state values from which a table of action values was computed; zeros for a table of zeros."""
    values = [0.0] * mdp.n_states
    if any(map(any, q)):
        for row, entered, over in zip(q, mdp.successor.tolist(), mdp.terminal.tolist(), strict=True):
            if not over:
                for value, state in zip(row, entered, strict=True):
                    values[state] = (value - mdp.step_reward) / discount
    return values


# ---- eligibility traces ---------------------------------------------------------------------------------------------


TRACE_FLOOR = 1e-6  # lower eligibilities are dropped: they hardly change a value, and cost time


def is_greedy(q_t: Row, a_t: int) -> bool:
    """Whether a' is a best action of s', ties included. Source: thesis fig. 2.3."""
    return q_t[a_t] == max(q_t)


class Traced(OnTable):
    """The base class of learners with eligibility traces: accumulating ones grow by 1 on a visit, replacing ones are set to 1.

    Source: Singh and Sutton 1996; thesis fig. 2.3.
    """

    lookahead = chained = True

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._decay = settings.discount * settings.trace
        self._growing = not settings.replacing
        self._traces: dict[int, tuple[Row, int, float]] = {}

    def begin(self) -> None:
        """Forgets the traces of the last episode."""
        self._traces.clear()

    def _spread(self, s_tm1: int, a_tm1: int, error: float, follow: bool) -> None:
        """Changes every value by its eligibility, then decays the traces (`follow`) or cuts them."""
        row, traces, decay = self.q[s_tm1], self._traces, self._decay
        step = self._alpha * error
        key = s_tm1 * len(row) + a_tm1
        earlier = traces.pop(key, None)  # appended again, so that the oldest traces come first
        traces[key] = (row, a_tm1, earlier[2] + 1.0 if earlier and self._growing else 1.0)
        for trace_row, action, eligibility in traces.values():
            trace_row[action] += step * eligibility
        if follow and decay > 0.0:
            self._traces = {
                k: (trace_row, action, eligibility * decay)
                for k, (trace_row, action, eligibility) in traces.items()
                if eligibility > TRACE_FLOOR
            }
        else:
            traces.clear()


class WatkinsQLambda(Traced):
    """Watkins's Q(lambda): traces are cut when the next action is not greedy. Source: thesis fig. 2.3."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates every value with a trace, by its eligibility."""
        q_t = self.q[s_t]
        error = q_target(r_t, discount_t, q_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0 and is_greedy(q_t, a_t))


class SarsaLambda(Traced):
    """SARSA(lambda): traces decay whatever the next action is. Source: Sutton and Barto 1998, fig. 7.11."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates every value with a trace, by its eligibility."""
        error = sarsa_target(r_t, discount_t, self.q[s_t], a_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0)
