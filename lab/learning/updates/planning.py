"""The learner that also learns from what it remembers: Dyna-Q."""

from lab.learning.settings import LearnerSettings
from lab.learning.updates.one_step import QLearning
from lab.learning.updates.update import Row
from lab.mdp import TabularMDP


class DynaQ(QLearning):
    """Q-learning that learns from `planning` of the moves that it has seen again after each one.

    Its model of the world holds what each move last led to, and is gone through in turn, the newest first; where steps are
    left to chance, that is only the last outcome. Source: Sutton 1990, who draws these moves by chance; Sutton and Barto
    1998, fig. 9.4.
    """

    def __init__(self, q: list[Row], settings: LearnerSettings, mdp: TabularMDP):
        super().__init__(q, settings, mdp)
        self._outcomes: dict[tuple[int, int], tuple[float, float, int]] = {}
        self._moves: list[tuple[int, int]] = []
        self._turn = 0

    def learn(self, s_tm1: int, a_tm1: int, r_t: float, discount_t: float, s_t: int, a_t: int) -> None:
        """One update of Q(s, a), and of the values of earlier moves."""
        learn, outcomes, moves = super().learn, self._outcomes, self._moves
        learn(s_tm1, a_tm1, r_t, discount_t, s_t, a_t)
        if (s_tm1, a_tm1) not in outcomes:
            moves.append((s_tm1, a_tm1))
        outcomes[s_tm1, a_tm1] = r_t, discount_t, s_t
        for _ in range(min(self._settings.planning, len(moves))):
            self._turn = (self._turn or len(moves)) - 1
            state, action = moves[self._turn]
            learn(state, action, *outcomes[state, action], a_t)
