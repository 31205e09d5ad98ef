"""The session that rivals of the speed benchmark learn, as plain arrays and numbers, and its measured results."""

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np

from lab.errors import BadInput, LabError
from lab.learning.selection import temperature
from lab.learning.settings import LearnerSettings
from lab.mdp import BoolArray, FloatArray, IntArray, TabularMDP, shortest_steps

MOVES = 6
MOST_STATES = 2**16


class Missing(LabError):
    """Raised when a rival cannot run on this computer; the message says why."""


@dataclass(frozen=True)
class Measured:
    """The moves of all sessions, the seconds that they took, and the share of sessions that ended on a shortest path [%]."""

    moves: int
    seconds: float
    success_percent: float = nan


Rival = Callable[[TabularMDP, LearnerSettings, int, int], Measured]  # (problem, settings, sessions, seed)


@dataclass(frozen=True, eq=False)
class Session:
    """Problem and settings as plain arrays and numbers; sharpness (episodes,): gamma / tau."""

    successor: IntArray
    terminal: BoolArray
    goal: BoolArray
    arrival: FloatArray
    start: int
    optimal: int
    loss: float
    alpha: float
    discount: float
    max_moves: int
    sharpness: FloatArray

    @property
    def states(self) -> int:
        """The number of states."""
        return len(self.successor)

    @property
    def episodes(self) -> int:
        """The number of episodes."""
        return len(self.sharpness)


def session_of(mdp: TabularMDP, settings: LearnerSettings, sessions: int) -> Session:
    """The session of a problem and settings. Raises BadInput for a problem that rivals do not learn, and for no sessions."""
    if mdp.n_actions != MOVES or mdp.n_states > MOST_STATES or mdp.starts:
        raise BadInput(
            f"a problem of {mdp.n_states} states, {mdp.n_actions} actions and {len(mdp.starts) or 1} starts: rivals learn "
            f"one with {MOVES} actions, one start and at most {MOST_STATES} states"
        )
    if sessions < 1:
        raise BadInput(f"sessions = {sessions}: allowed are whole numbers from 1")
    taus = [temperature(n, settings.beta, settings.exploration) for n in range(1, settings.episodes + 1)]
    return Session(
        mdp.successor,
        mdp.terminal,
        mdp.goal,
        mdp.arrival,
        mdp.start,
        shortest_steps(mdp),
        mdp.step_reward,
        settings.alpha,
        settings.discount,
        settings.max_steps - settings.count_start,
        settings.discount / np.array(taus),
    )


def batch_sizes(sessions: int, most: int) -> list[int]:
    """The sizes of the batches of so many sessions, at most `most` in each."""
    return [min(most, sessions - first) for first in range(0, sessions, most)]
