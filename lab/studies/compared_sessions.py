"""What the sessions of one setting of a comparison came to, as arrays and as JSON."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lab.mdp import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Sessions:
    """What N sessions of E episodes came to: curve (E,) the mean steps of each episode; the others (N,), one a session."""

    curve: FloatArray
    solved: BoolArray
    mean_steps: FloatArray
    last_steps: FloatArray
    helped_steps: FloatArray
    requests: FloatArray
    misleads: FloatArray
    rejected: BoolArray

    def to_json(self) -> dict[str, list[float]]:
        """Plain lists."""
        return {name: np.asarray(value, np.float64).tolist() for name, value in vars(self).items()}

    @classmethod
    def from_json(cls, record: Mapping[str, list[float]], sessions: int) -> "Sessions":
        """What `to_json` wrote of so many sessions. Raises KeyError, TypeError or ValueError for anything else."""
        kinds = {"solved": np.bool_, "rejected": np.bool_}
        found: dict[str, Any] = {
            name: np.array(record[name], kinds.get(name, np.float64)) for name in cls.__dataclass_fields__
        }
        if any(one.shape != (sessions,) for name, one in found.items() if name != "curve") or found["curve"].ndim != 1:
            raise ValueError("lists of other lengths")
        return cls(**found)
