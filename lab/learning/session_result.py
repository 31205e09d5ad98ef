"""What a session learned, and what it can be begun with."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, unknown
from lab.learning.gates import GATES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import LINEAR, UPDATES
from lab.mdp import BoolArray, FloatArray, TabularMDP
from lab.plugins.code_file import from_file

CountArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SessionResult:
    """What a session learned and how it went.

    q (S, A) float64, visits (S, A) int64; steps (episodes,) int64, a failed episode as max_steps + 1; guided
    (episodes,) bool: at least one advised step; requests: episodes in which the learner asked; helped_steps:
    advised steps that were carried out; misleads and rejected_at_episode: see lab/learning/gates; final_steps:
    those of the greedy path from the start, None if it does not reach the goal, optimal_steps: the fewest, None where
    nobody knows them, both counted as in `steps`; solved: see `Environment.judge`; interrupted: stopped by Ctrl-C, only
    finished episodes count.
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


def check_members(
    learner: LearnerSettings, gate: GateSettings, where: tuple[str, str] = ("learner settings", "gate settings")
) -> None:
    """Raises BadInput for an unknown learner, selection or gate; `where`: where the learner and the gate came from."""
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
    """The action values (S, A) that a session begins with: `q0`, or the learner's start value in each; 0 in terminal states.

    Raises BadInput for a `q0` of another shape, or with values that are not finite.
    """
    start = np.full(mdp.successor.shape, learner.start_value) if q0 is None else np.array(q0, np.float64)
    if start.shape != mdp.successor.shape or not np.isfinite(start).all():
        raise BadInput(f"start values: shape {start.shape}, allowed {mdp.successor.shape} with finite values")
    if learner.tilings == 1:  # on tiles, what is worth nothing would take from what lies beside it
        start[mdp.terminal] = 0.0
    return start
