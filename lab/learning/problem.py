"""What there is to learn: a table's problem by its name, and the environment that its steps are made in."""

from dataclasses import dataclass

from lab.learning.environment import Environment
from lab.mdp import TabularMDP


@dataclass(frozen=True)
class Problem:
    """What one lesson teaches: its name, the sub-task, the table's problem; environment: where its steps are made.

    scene: where that is, in words, where the name does not tell; arm: which one carries it out, "": none.
    """

    name: str
    subtask: str
    mdp: TabularMDP
    environment: Environment | None = None
    scene: str = ""
    arm: str = ""
