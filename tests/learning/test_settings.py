"""The ranges of learner and gate settings, checked on creation and by pydantic alike."""

from dataclasses import asdict
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from lab.errors import BadInput
from lab.learning.settings import GateSettings, LearnerSettings


def test_the_defaults_are_those_of_the_thesis() -> None:
    assert asdict(LearnerSettings()) == {
        "learner": "q-lambda",
        "alpha": 0.95,
        "discount": 0.99,
        "trace": 0.5,
        "replacing": False,
        "tilings": 1,
        "start_value": 0.0,
        "planning": 5,
        "selection": "softmax",
        "exploration": 1.0,
        "beta": 1.3,
        "episodes": 200,
        "max_steps": 200,
        "count_start": False,
    }
    assert asdict(GateSettings()) == {
        "gate": "ccrl",
        "lambda_threshold": 0.05,
        "omega": 7,
        "first_episode": 30,
        "window": 5,
        "psi": 1.0,
        "spread": 0.1,
        "rate": 0.1,
        "fading": 0.97,
        "reuse": 0.95,
        "bonus": 1.0,
        "consistency": 0.9,
        "warming": 0.05,
        "exploring": 0.8,
        "trust": 0.25,
        "wandering": 0.05,
        "retry": 4.0,
        "strikes": 4.0,
        "agreement": 1.0,
        "margin": 0.3,
        "enough_steps": 50.0,
        "ensemble": 5,
        "budget": 1_000_000_000,
        "judge_unhelped": True,
        "spare_best": False,
        "by_evidence": False,
        "memory": False,
    }


BAD = [
    (LearnerSettings, "alpha", 0.0),
    (LearnerSettings, "alpha", 1.01),
    (LearnerSettings, "alpha", float("nan")),
    (LearnerSettings, "discount", 0.0),
    (LearnerSettings, "trace", -0.1),
    (LearnerSettings, "beta", float("inf")),
    (LearnerSettings, "episodes", 0),
    (LearnerSettings, "episodes", 2.5),
    (LearnerSettings, "max_steps", -1),
    (LearnerSettings, "learner", 3),
    (LearnerSettings, "exploration", 0.0),
    (GateSettings, "lambda_threshold", 1.5),
    (GateSettings, "omega", -1),
    (GateSettings, "first_episode", 0),
    (GateSettings, "window", 0),
    (GateSettings, "psi", -0.5),
    (GateSettings, "rate", 1.1),
    (GateSettings, "spread", -0.1),
    (GateSettings, "enough_steps", 0.0),
    (GateSettings, "ensemble", 1),
    (GateSettings, "budget", -1),
]


@pytest.mark.parametrize(("kind", "field", "value"), BAD)
def test_a_value_out_of_range_is_refused(kind: type, field: str, value: Any) -> None:
    with pytest.raises(BadInput, match=rf"{kind.__name__}\.{field} = "):
        kind(**{field: value})
    with pytest.raises(ValidationError, match=field):
        TypeAdapter(kind).validate_python({field: value})


def test_integers_may_stand_for_numbers_and_truth_may_not() -> None:
    assert LearnerSettings(alpha=1, beta=0).alpha == 1
    with pytest.raises(BadInput, match="must be int"):
        LearnerSettings(episodes=True)
    with pytest.raises(BadInput, match=r"alpha = 2: allowed above 0 and at most 1"):
        LearnerSettings(alpha=2)
