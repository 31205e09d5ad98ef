"""Parts that others made: what a model becomes, where it is carried, what a study says of it; two of them in physics."""

from math import hypot
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.grip import Grip
from lab.sim.parts.part_shape import shape_of
from lab.sim.urdf_reader import rotation
from lab.studies import STUDIES
from lab.studies.findings import those
from lab.studies.runner import Job
from lab_studies.comparisons import grips as study
from lab_studies.comparisons.grip_models import GRASPABLE_M, MODELS, Model, part_of_model, roll_and_pitch
from lab_studies.comparisons.grip_trials import ARM, CARRY_M, OVER_M, Outcome, Setting, model_outcome, random_places
from lab_studies.comparisons.grips import grips, in_short, rows_of

GRIP = Grip(0.5, 0.02, 0.0, 0.0, 0.03, np.pi)
WIDTHS = tuple(np.linspace(0.03, 0.05, 72))
HALF_WELL = Outcome("", ("", "it fell over"), (0.002, 0.03), (0.03, 0.05, 0.04), WIDTHS, GRIP)
REFUSED = Outcome("part 'plate' is 0.0050 m high", (), (), (0.03, 0.05, 0.005), WIDTHS, None)


def test_the_rows_of_a_part_that_is_gripped_and_of_one_that_is_not() -> None:
    graspable, arrived, off = rows_of("mug", HALF_WELL)
    assert (graspable["measure"], graspable["value"], graspable["failures"]) == ("graspable", 1, "it fell over")
    assert (graspable["narrowest_m"], graspable["widest_m"], graspable["high_m"]) == (0.03, 0.05, 0.04)
    assert (arrived["measure"], arrived["value"]) == ("arrived_percent", 50)
    assert (off["measure"], off["value"]) == ("largest_off_m", 0.002), "of those that arrived"
    (refused,) = rows_of("plate", REFUSED)
    assert (refused["value"], refused["refused"]) == (0, "part 'plate' is 0.0050 m high")


def test_in_short() -> None:
    assert in_short({"mug": HALF_WELL, "plate": REFUSED}) == {
        "parts": 2,
        "graspable": 1,
        "poses": 2,
        "arrived": 1,
        "arrived_percent": 50.0,
        "refused": "plate",
        "not always": "mug",
    }


@given(st.integers(0, 2**32))
def test_a_part_is_carried_half_a_metre_between_places_that_the_arm_reaches(seed: int) -> None:
    begin, end = random_places(np.random.default_rng(seed))
    assert hypot(end[0] - begin[0], end[1] - begin[1]) == pytest.approx(CARRY_M)
    arm = arm_of(ARM)
    for x, y, yaw in (begin, end):
        assert all(arm.inverse(ToolPose(x, y, up, yaw)) is not None for up in (0.01, 0.1 + OVER_M))


@given(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3))
def test_roll_and_pitch_of_a_turn_are_those_it_was_made_of(roll: float, pitch: float, yaw: float) -> None:
    quaternion = np.array([0.0, 0.0, 0.0, 1.0])
    for axis, angle in ((0, roll), (1, pitch), (2, yaw)):
        by = np.zeros(4)
        by[axis], by[3] = np.sin(angle / 2), np.cos(angle / 2)
        quaternion = _product(by, quaternion)
    assert roll_and_pitch(rotation(quaternion)) == pytest.approx((roll, pitch), abs=2e-6)


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton's product of quaternions xyzw."""
    v, w = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3]), p[3] * q[3] - p[:3] @ q[:3]
    return np.array([*v, w])


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_every_model_is_a_part_of_graspable_size(model: Model, tmp_path: Path) -> None:
    shape = shape_of(part_of_model(model, tmp_path), tmp_path)
    low, middle, high = sorted(shape.high - shape.low)
    assert 0.004 < low <= middle < 1.5 * GRASPABLE_M
    assert high < 0.12


def test_a_prism_arrives_and_a_domino_on_its_side_is_refused_with_its_height() -> None:
    found = model_outcome(Setting("prism", 1, 0))
    assert (found.refused, found.failures) == ("", ("",))
    assert found.off_m[0] < 0.015
    assert model_outcome(Setting("prism", 1, 0)) == found, "the same seed, the same result"
    domino = model_outcome(Setting("domino", 1, 0))
    assert "part 'domino' is 0.0064 m high as it stands, too flat for the fingers" in domino.refused
    assert (domino.failures, domino.grip) == ((), None)


def test_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "MODELS", tuple(one for one in MODELS if one.name in ("prism", "domino")))
    found = grips(Job(1), {})
    assert found.summary | {"parts": 2, "graspable": 1, "poses": 1, "arrived": 1, "refused": "domino"} == found.summary
    (every,) = those(found.rows, part="all that can be gripped")
    assert every["value"] == 100
    assert any("domino" in note for note in found.notes)
    (picture,) = found.figures.values()
    assert all(words in picture.decode() for words in ("prism", "1 of 1 arrived", "refused, 6 mm high"))
    assert "grips" in STUDIES
