"""What rivals of the speed benchmark learn: one kind of session as plain arrays and numbers, and what it came to."""

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
    """The rival cannot run on this computer; the message says why."""


@dataclass(frozen=True)
class Measured:
    """All moves of the sessions, the seconds that learning them took, and the sessions that ended on a shortest way."""

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
        return len(self.successor)

    @property
    def episodes(self) -> int:
        return len(self.sharpness)


def session_of(mdp: TabularMDP, settings: LearnerSettings, sessions: int) -> Session:
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


def shared_out(sessions: int, most: int) -> list[int]:
    """So many sessions shared out, at most so many at once."""
    return [min(most, sessions - first) for first in range(0, sessions, most)]
