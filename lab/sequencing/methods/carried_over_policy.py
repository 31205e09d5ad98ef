"""The carried-over policy: the names of a decision's features, a weight for each, and the weights that ship with the lab."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from lab.errors import BadInput, unknown
from lab.sequencing.cell.objectives import BUILT_IN, MAKESPAN
from lab.sequencing.simulate.cell_arrays import Floats

FEATURES: Mapping[str, str] = {
    "delay": "how much later it begins than the decision that may begin first",
    "empty-way": "how long the robot drives to the pick",
    "idle": "how long the robot waits at the pick, or the machine's server for the part",
    "part-waited": "how long the part is ready by then, at most ten moves; 0 at the start of its route",
    "duration": "how long robot or server then work",
    "tail": "the part's end if nothing stops it any more, less the latest of such ends",
    "work-left": "work left of the part, less the mean of the parts that are not finished",
    "load-ahead": "load of the machine that works on the part next, as a share of the highest, less 1",
    "starves": "how long that machine is through with all it has before the part is brought",
    "queue": "how long the part waits there until the machine is through with what it has",
    "load-behind": "load of the full machine that the part leaves, as a share of the highest",
    "server": "1 where a machine's server takes the part, 0 where a robot does",
    "room": "1 over the room that is left where it goes",
    "moves-left": "the part's moves to its end",
    "slack": "due time less the part's end if nothing stops it any more; 0 where no due times count",
    "way-on": "how long until the robot can pick another part after the drop",
    "other-way": "how much later it ends than the same part by its best option",
    "enters": "1 where the part is at the start of its route",
    "load-after": "load of the machine after the next, as a share of the highest, less 1",
    "queued-tail": "tail, with the wait in the queue",
}
MOST = 1e6  # the largest absolute value of a weight


@dataclass(frozen=True)
class CarriedPolicy:
    """The weight of each feature by its name in FEATURES; a feature that is left out has weight 0.

    objective: the objective that it was learned for. learned_on: the training cells, in words. Raises BadInput for weights out
    of range and for unknown names.
    """

    weights: Mapping[str, float]
    objective: str = MAKESPAN
    learned_on: str = ""
    vector: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, weight in self.weights.items():
            if name not in FEATURES:
                raise unknown("feature", name, FEATURES, "policy")
            if not (isfinite(weight) and abs(weight) <= MOST):
                raise BadInput(f"weight of '{name}' = {weight}: allowed are finite numbers from -{MOST:g} to {MOST:g}")
        if self.objective not in BUILT_IN:
            raise unknown("objective", self.objective, BUILT_IN, "policy")
        vector = np.array([self.weights.get(name, 0.0) for name in FEATURES])
        object.__setattr__(self, "vector", vector)


# ---- The weights that ship with the lab -------------------------------------------------------------------------------


DEFAULT = CarriedPolicy(
    {
        "delay": -0.3958,
        "empty-way": -0.0699,
        "idle": -0.0452,
        "part-waited": 0.1204,
        "duration": -0.0708,
        "tail": 0.0617,
        "work-left": 0.3307,
        "load-ahead": -0.0223,
        "starves": 0.0506,
        "queue": 0.2505,
        "load-behind": 0.4261,
        "server": -0.3727,
        "room": 0.0855,
        "moves-left": 0.0424,
        "way-on": -0.3058,
        "other-way": -0.3118,
        "enters": -0.0319,
        "load-after": 0.0176,
        "queued-tail": -0.3235,
    },
    learned_on="240 small cells: all families; lab study run carried-over --sessions 240 --seed 0",
)
