"""How something is learned, said in Python: every setting of learner and gate by its name, classes of one's own too."""

from typing import TypedDict

from lab.learning.gates import Gate
from lab.learning.updates import Update


class Settings(TypedDict, total=False):
    """The settings of `LearnerSettings` and `GateSettings`; those that are not given stay as the problem's file has them.

    learner and gate: a name, or a class of one's own.
    """

    learner: str | type[Update]
    alpha: float
    discount: float
    trace: float
    replacing: bool
    tilings: int
    start_value: float
    planning: int
    selection: str
    exploration: float
    beta: float
    episodes: int
    max_steps: int
    count_start: bool
    gate: str | type[Gate]
    lambda_threshold: float
    omega: int
    first_episode: int
    window: int
    psi: float
    spread: float
    rate: float
    fading: float
    consistency: float
    enough_steps: float
    ensemble: int
    budget: int
    judge_unhelped: bool
    spare_best: bool
    memory: bool
