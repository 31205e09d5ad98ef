"""The problem of one lesson: its name, its table, and the environment in which steps are made."""

from dataclasses import dataclass

from lab.learning.environment import Environment
from lab.mdp import TabularMDP


@dataclass(frozen=True)
class Problem:
    """The problem of one lesson.

    name: of the problem; subtask: of the skill that it belongs to; mdp: its table.
    environment: where steps are made, an object with the methods of `Environment`; None for the table itself.
    scene: the place in words, if the name does not say it; arm: the arm that carries the sub-task out, "" for none.

        >>> import lab
        >>> lab.Problem("board", "push", lab.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2))).mdp.n_states
        3
    """

    name: str
    subtask: str
    mdp: TabularMDP
    environment: Environment | None = None
    scene: str = ""
    arm: str = ""
