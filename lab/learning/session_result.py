"""The result of a session; checks of its settings and of its start values."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.learning.environment import Judged
from lab.learning.gates import GATES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import LINEAR, UPDATES
from lab.mdp import BoolArray, FloatArray, TabularMDP
from lab.plugins.code_file import from_file

CountArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SessionResult:
    """The result of a session.

    q: (S, A) float64, the action values; visits: (S, A) int64.
    steps: (episodes,) int64, a failed episode counts as max_steps + 1; guided: (episodes,) bool, episodes with an advised step.
    returns: (episodes,) float64, the sum of each episode's rewards.
    requests: episodes in which the learner asked; helped_steps: advised steps that were carried out.
    misleads, rejected_at_episode: see lab/learning/gates.
    optimal_steps: the fewest possible, None if unknown; final_steps: those of the greedy path from the start, None if it misses
    the goal; both are counted as in `steps`. solved: see `Environment.judge`.
    interrupted: whether Ctrl-C stopped the session; then only finished episodes count.
    In a problem that is scored by return (see `environment.highest_reward`) no episode fails, and there are also: returns:
    (episodes,) float64, the sum of the rewards of each, NaN where it is not known; final_return, best_return: see `Judged`.
    """

    q: FloatArray
    visits: CountArray
    steps: CountArray
    guided: BoolArray
    requests: int
    helped_steps: int
    misleads: int
    rejected_at_episode: int | None
    optimal_steps: int | None
    final_steps: int | None
    solved: bool
    interrupted: bool
    returns: FloatArray
    final_return: float | None = None
    best_return: float | None = None

    @classmethod
    def of_table(cls, q: FloatArray, visits: CountArray, judged: Judged) -> Self:
        """The result of no episode at all: a table that was made otherwise, and is judged."""
        nothing = np.zeros(0, np.int64)
        return cls(
            q=q,
            visits=visits,
            steps=nothing,
            guided=nothing.astype(np.bool_),
            requests=0,
            helped_steps=0,
            misleads=0,
            rejected_at_episode=None,
            optimal_steps=judged.optimal_steps,
            final_steps=judged.final_steps,
            solved=judged.solved,
            interrupted=False,
            returns=nothing.astype(np.float64),
        )

    @property
    def by_return(self) -> bool:
        """Whether the problem has no goal, so that an episode's score is its return."""
        return self.best_return is not None


def check_members(
    learner: LearnerSettings, gate: GateSettings, where: tuple[str, str] = ("learner settings", "gate settings")
) -> None:
    """Raises BadInput for an unknown learner, selection or gate; where: the sources of learner and gate, for the message."""
    for kind, name, table, source in (
        ("learner", learner.learner, UPDATES, where[0]),
        ("selection", learner.selection, SELECTIONS, where[0]),
        ("gate", gate.gate, GATES, where[1]),
    ):
        if name not in table:
            raise from_file(kind, name, source) or unknown(kind, name, table, source)
    if learner.tilings > 1 and learner.learner not in LINEAR:
        known = ", ".join(LINEAR)
        raise BadInput(
            f"learner '{learner.learner}' ({where[0]}) with tilings = {learner.tilings}: allowed are {known}"
        )


def start_values(mdp: TabularMDP, q0: FloatArray | None, learner: LearnerSettings) -> FloatArray:
    """The action values (S, A) that a session begins with: `q0`, or the learner's start value; 0 in terminal states.

    Raises BadInput for a `q0` of another shape, or with values that are not finite.
    """
    start = np.full(mdp.successor.shape, learner.start_value) if q0 is None else np.array(q0, np.float64)
    if start.shape != mdp.successor.shape or not np.isfinite(start).all():
        raise BadInput(f"start values: shape {start.shape}, allowed {mdp.successor.shape} with finite values")
    if learner.tilings == 1:  # with tile coding, zeros in terminal states would lower their neighbours
        start[mdp.terminal] = 0.0
    return start
