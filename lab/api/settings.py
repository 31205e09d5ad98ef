"""How something is learned, said in Python: every setting of learner and gate by its name, classes of one's own too."""

from collections.abc import Mapping
from typing import Any, TypedDict

from lab.learning.gates import GATES, Gate
from lab.learning.members import Member
from lab.learning.updates import UPDATES


class Settings(TypedDict, total=False):
    """The settings of `LearnerSettings` and `GateSettings`; those that are not given stay as the problem's file has them.

    learner and gate: a name, or a class of one's own.
    """

    learner: str | type[Any]
    alpha: float
    discount: float
    trace: float
    replacing: bool
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
    enough_steps: float
    ensemble: int
    budget: int
    judge_unhelped: bool
    spare_best: bool
    memory: bool


def named(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The settings with classes by their names, under which they are in their family from now on."""
    changed = dict(settings)
    for kind, family in (("learner", UPDATES), ("gate", GATES)):
        own = changed.get(kind)
        if isinstance(own, type):
            changed[kind] = own.__name__
            family[own.__name__] = Member(own, (own.__doc__ or own.__name__).splitlines()[0])
    return changed
