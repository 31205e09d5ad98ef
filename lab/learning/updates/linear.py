"""Learners with tile coding: Q-learning and SARSA, with replacing or accumulating traces.

The step size is divided by the number of tilings. Source: Sutton and Barto 2018, section 12.7 and example 10.1.
"""

import numpy as np

from lab.learning.selection import Draw
from lab.learning.settings import LearnerSettings
from lab.learning.tiles import TileCoding
from lab.learning.updates.tabular import is_greedy, q_target, sarsa_target
from lab.learning.updates.update import ComputedRows, Row, Update
from lab.mdp import FloatArray, TabularMDP

FAINT = 0.01  # lower eligibilities are dropped, which limits the number of traces


class TileRows(ComputedRows):
    """Action values, summed from the weights on lookup; weights: (tiles * A,), the actions of a tile side by side."""

    def __init__(self, coding: TileCoding, actions: int, weights: Row):
        self.coding, self.weights, self._actions = coding, weights, actions
        self._states = int(np.prod(coding.shape))
        self._places: dict[int, list[int]] = {}  # cache of `places`

    def __len__(self) -> int:
        return self._states

    def places(self, state: int) -> list[int]:
        """The indices at which the weights of a state's tiles begin."""
        places = self._places.get(state)
        if places is None:
            places = self._places[state] = [tile * self._actions for tile in self.coding.tiles_of(state)]
        return places

    def row(self, state: int) -> Row:
        """The action values (A,) of a state."""
        weights, row = self.weights, []
        for action in range(self._actions):
            total = 0.0  # added one by one, as in the kernel; `sum` of newer Pythons rounds differently
            for place in self.places(state):
                total += weights[place + action]
            row.append(total)
        return row


class OnTiles(Update):
    """The base class of learners with tile coding: an error changes each weight in proportion to its eligibility.

    Source: Sutton and Barto 2018, section 12.7 (binary features, replacing or accumulating traces).
    """

    decays = False

    def __init__(self, q: FloatArray, settings: LearnerSettings, mdp: TabularMDP):
        coding = TileCoding(mdp.cells, settings.tilings)
        self._rows = TileRows(coding, mdp.n_actions, coding.weights(q).ravel().tolist())
        self.q = self._rows
        self._alpha = settings.alpha / settings.tilings
        self._decay = settings.discount * settings.trace if self.decays else 0.0
        self._growing = not settings.replacing
        self._traces: dict[int, float] = {}

    def begin(self) -> None:
        """Forgets the traces of the last episode."""
        self._traces.clear()

    def table(self) -> FloatArray:
        """The values of all cells."""
        rows = self._rows
        return rows.coding.values(np.array(rows.weights).reshape(rows.coding.count, -1))

    def scatter(self, draw: Draw) -> None:
        """Draws every weight, so that the values of a state lie within +-0.5, as in a table."""
        weights, tilings = self._rows.weights, self._rows.coding.tilings
        weights[:] = [(draw() - 0.5) / tilings for _ in weights]

    def _spread(self, s_tm1: int, a_tm1: int, error: float, follow: bool) -> None:
        """Changes every weight by its eligibility, then decays the traces (`follow`) or cuts them."""
        weights, traces, decay = self._rows.weights, self._traces, self._decay
        for place in self._rows.places(s_tm1):
            traces[place + a_tm1] = traces.get(place + a_tm1, 0.0) + 1.0 if self._growing else 1.0
        step = self._alpha * error
        for place, eligibility in traces.items():
            weights[place] += step * eligibility
        if follow and decay > 0.0:
            self._traces = {
                place: eligibility * decay for place, eligibility in traces.items() if eligibility * decay > FAINT
            }
        else:
            traces.clear()


class TileQLearning(OnTiles):
    """Q-learning, one step at a time."""

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates the weights of the tiles of s."""
        error = q_target(r_t, discount_t, self.q[s_t]) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, False)


class TileSarsa(OnTiles):
    """SARSA, one step at a time."""

    lookahead = True

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates the weights of the tiles of s."""
        error = sarsa_target(r_t, discount_t, self.q[s_t], a_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0)


class TileQLambda(OnTiles):
    """Watkins's Q(lambda): traces are cut when the next action is not greedy."""

    lookahead = chained = decays = True

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """Updates every weight with a trace."""
        q_t = self.q[s_t]
        error = q_target(r_t, discount_t, q_t) - self.q[s_tm1][a_tm1]
        self._spread(s_tm1, a_tm1, error, discount_t > 0.0 and is_greedy(q_t, a_t))


class TileSarsaLambda(TileSarsa):
    """SARSA(lambda): traces decay whatever the next action is."""

    chained = decays = True


LINEAR: dict[str, type[OnTiles]] = {  # by the learner of a table
    "q": TileQLearning,
    "sarsa": TileSarsa,
    "q-lambda": TileQLambda,
    "sarsa-lambda": TileSarsaLambda,
}
