"""Policies hold what a session learned, and refuse what does not fit together."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from lab.errors import BadInput
from lab.learning.session import Session
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import TabularMDP, grid
from lab.toolbox.policy import Origin, Policy

LEARNER, GATE = LearnerSettings(episodes=12, max_steps=20), GateSettings("never")


def problem() -> TabularMDP:
    return grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2), action_labels=("up", "down", "left", "right"))


@pytest.fixture
def policy() -> Policy:
    mdp = problem()
    result = Session(mdp, LEARNER, GATE, None, np.random.default_rng(4)).run()
    return Policy.of(result, mdp, LEARNER, GATE, Origin("insert", "insert", "toast", "none", 4))


def test_it_keeps_what_was_learned_and_where(policy: Policy) -> None:
    mdp = problem()
    result = Session(mdp, LEARNER, GATE, None, np.random.default_rng(4)).run()
    np.testing.assert_array_equal(policy.q, result.q)
    np.testing.assert_array_equal(policy.visits, result.visits)
    assert (policy.signature, policy.shape, policy.start) == (mdp.signature, (2, 3), 0)
    assert policy.action_labels == ("up", "down", "left", "right")
    assert policy.curve == result.steps.tolist()
    assert policy.guided == [False] * 12
    assert (policy.learner["episodes"], policy.gate["gate"], policy.advisor, policy.seed) == (12, "never", "none", 4)
    assert (policy.optimal_steps, policy.final_steps, policy.solved) == (3, result.final_steps, result.solved)
    assert (datetime.now(UTC) - datetime.fromisoformat(policy.created)).total_seconds() < 3600
    assert set(policy.versions) == {"teaching-lab", "python", "numpy"}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"name": " "}, "1 to 100 printable"),
        ({"name": "a\nb"}, "1 to 100 printable"),
        ({"name": "n" * 101}, "1 to 100 printable"),
        ({"q": np.zeros(6)}, "table q has shape"),
        ({"q": np.zeros((6, 4), np.float32)}, "float32"),
        ({"q": np.full((6, 4), np.inf)}, "24 values of q are not finite"),
        ({"q": np.zeros((5, 4))}, "visits have shape"),
        ({"visits": np.zeros((6, 4), np.int32)}, "int32"),
        ({"visits": np.full((6, 4), -1)}, "negative"),
        ({"action_labels": ("up",)}, "1 action labels for 4 actions"),
        ({"shape": (2, 2)}, "does not hold 6 states"),
        ({"start": 6}, "start 6 is outside"),
        ({"signature": "../../etc/passwd"}, "not 16 hex digits"),
        ({"guided": []}, "12 episodes in the curve, 0 in guided"),
    ],
)
def test_parts_that_do_not_fit(policy: Policy, changed: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput, match="policy ") as caught:
        replace(policy, **changed)
    assert said in str(caught.value)
