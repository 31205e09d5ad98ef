"""The study of a mentor's promises: shares counted in rollouts of a cart whose doubts are known."""

import numpy as np
import pytest

from lab.cloning.rounds import CloningOptions
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.studies.findings import those
from lab_studies.comparisons.promises import RULES, kept_by_rules, rows_of, shares_of
from tests.cloning.conftest import rolled_out, straight_on

pytestmark = pytest.mark.studies


def cart(far: float, success: bool) -> Episode:
    """The doubt by distance is largest in its second step, and grows with `far`."""
    states = np.array([0.0, 1.0 + far, 0.5], np.float32)[:, None]
    return Episode("go", states, np.ones_like(states), np.zeros(3, bool), success)


def test_the_promised_shares_are_kept_over_all_draws() -> None:
    line = np.linspace(0.0, 1.0, 11, dtype=np.float32)[:, None]
    shown = Recording(
        10, "cart", ("x",), ("dx",), [Episode("go", line, np.ones_like(line), np.zeros(11, bool), True)] * 2
    )
    rng = np.random.default_rng(0)
    episodes = [cart(far, True) for far in rng.random(119)] + [cart(2.0 + far, False) for far in rng.random(119)]
    found = shares_of(Mentor.learn(shown, "distance"), episodes, seed=1)
    assert found[0.1, "false_alarms_percent"] == pytest.approx(10.0, abs=1.5)  # (n + 1) / 10 is whole for 19
    assert found[0.2, "false_alarms_percent"] == pytest.approx(20.0, abs=2.0)
    assert found[0.9, "caught_percent"] == pytest.approx(90.0, abs=1.5)
    assert found[0.1, "caught_at_percent"] == 100.0  # each failure is farther off than any success
    assert found[0.1, "lead_s"] == pytest.approx(0.2)


def test_every_rule_is_measured_in_rollouts_of_a_student() -> None:
    options = CloningOptions(epochs=30)
    shown = Recording(10, "point", ("x",), ("speed",), [rolled_out(straight_on, seed) for seed in (1, 2)])
    found = kept_by_rules(rolled_out, shown, options, rollouts=50)
    assert {rule for rule, _, _ in found} >= {*RULES} - {"failure"}  # which needs a rollout that failed
    assert kept_by_rules(rolled_out, shown, options, rollouts=50) == found
    (row,) = those(rows_of("point", [found, found]), rule="distance", promised=0.1, measure="false_alarms_percent")
    assert 0.0 <= row["value"] <= 100.0
