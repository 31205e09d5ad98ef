"""What the tests of the toolbox stand on: small policies."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lab.toolbox.policy import Policy

MakePolicy = Callable[..., Policy]


@pytest.fixture(scope="session")
def make() -> MakePolicy:
    """Makes a policy: make(name="insert", solved=False); `fill` is what its table holds."""
    return _made


def _made(fill: float = 0.0, **changed: Any) -> Policy:
    base = Policy(
        name="insert",
        subtask="insert",
        task="toast",
        q=np.full((4, 2), fill),
        visits=np.zeros((4, 2), dtype=np.int64),
        action_labels=("left", "right"),
        shape=(4,),
        start=0,
        signature="0123456789abcdef",
        learner={"learner": "q", "alpha": 0.95},
        gate={"gate": "ccrl"},
        advisor="expert",
        seed=0,
        curve=[21, 3],
        guided=[False, True],
        helped_steps=3,
        requests=1,
        optimal_steps=3,
        final_steps=3,
        solved=True,
        created="2026-05-01T12:00:00+00:00",
        versions={"numpy": "2.0"},
    )
    return replace(base, **changed)
