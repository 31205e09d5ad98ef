"""Faults drawn for a run: one or two, of kinds that can strike in its task, at any time of it."""

import numpy as np

from lab.production.faults import FAULTS
from lab.tasks.fault_fields import FaultFields
from lab.tasks.task import Order, Task

MOST = 2  # faults of one run
BETWEEN = (0.02, 0.85)  # of the predicted time, when a fault is due
_SALT = 14  # keeps these draws apart from others of the same seed


def draw(task: Task, order: Order, seed: int, predicted_makespan_s: float) -> tuple[FaultFields, ...]:
    """One or two faults, each of a kind that makes sense in a task; the same for the same seed."""
    rng = np.random.default_rng([seed, _SALT])
    found: list[FaultFields] = []
    wanted = int(rng.integers(1, MOST + 1))
    while len(found) < wanted:
        kinds = list(FAULTS.values())
        kind = kinds[int(rng.integers(len(kinds)))]
        at_s = round(float(rng.uniform(*BETWEEN)) * predicted_makespan_s, 1)
        fields = kind.drawn(task, order, rng)
        if fields is not None and kind.what not in [one.what for one in found]:
            found.append(FaultFields.model_validate({"what": kind.what, "at_s": at_s, **fields}))
    return tuple(sorted(found, key=lambda one: one.at_s))
