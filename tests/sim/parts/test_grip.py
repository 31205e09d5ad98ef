"""Grips from a part's shape: where it is narrow and flat, within the opening; and what cannot be gripped, with its widths."""

import re
from dataclasses import astuple
from math import cos, pi, radians, sin
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import trimesh
from hypothesis import example, settings
from hypothesis import given as drawn
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.files import assets_folder
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.fingers import Gripper
from lab.sim.parts.grip import BESIDE_M, HOLD_M, OVER_FLOOR_M, UNDER_PALM_M, Grip, grip_of
from lab.sim.parts.part_shape import PartShape, shape_of
from lab.tasks.part_fields import GripFields, PartFields

GRIPPER = Gripper(opening_m=0.044, depth_m=0.074, width_m=0.03, thick_m=0.012)  # about that of the lab's own arm
MOST = GRIPPER.opening_m - 2 * BESIDE_M
FRICTION = 0.8
QUARTER = pi / 2


def shaped(folder: Path | None = None, **fields: Any) -> PartShape:
    return shape_of(PartFields.model_validate({"name": "thing", "mass_kg": 0.1, **fields}), folder or assets_folder())


def box(x: float, y: float, z: float) -> PartShape:
    return shaped(shape="box", size_m=[x, y, z])


def meshed(mesh: trimesh.Trimesh, folder: Path) -> PartShape:
    mesh.export(folder / "thing.stl")
    return shaped(folder, shape="mesh", file="thing.stl")


def taken(shape: PartShape, **given: Any) -> Grip:
    return grip_of(shape, GRIPPER, FRICTION, GripFields.model_validate(given) if given else None)


def refusal(shape: PartShape, friction: float = FRICTION, **given: Any) -> str:
    with pytest.raises(BadInput) as refused:
        grip_of(shape, GRIPPER, friction, GripFields.model_validate(given) if given else None)
    return str(refused.value)


# ---- what can be gripped ------------------------------------------------------------------------------------------


def test_a_slice_of_bread_is_gripped_as_ever() -> None:
    """12 x 1.5 x 12 cm: across its thickness, the tips 3 cm below its top."""
    found = grip_of(box(0.12, 0.015, 0.12), arm_named("up6").gripper, FRICTION)
    assert astuple(found) == pytest.approx((0.0, 0.09, 0.0, 0.0, 0.015, pi), abs=1e-6)


def test_a_box_is_gripped_across_its_narrow_side() -> None:
    found = taken(box(0.02, 0.06, 0.05))
    assert (found.yaw, found.up_m, found.width_m) == pytest.approx((QUARTER, 0.02, 0.02))
    assert (found.x, found.y) == pytest.approx((0, 0), abs=1e-9)


def test_a_can_that_stands_is_alike_from_all_sides_and_one_that_lies_is_not() -> None:
    standing = taken(shaped(shape="cylinder", size_m=[0.034, 0.07]))
    assert (standing.period, standing.width_m) == pytest.approx((0.0, 0.034), abs=1e-4)
    lying = taken(shaped(shape="cylinder", size_m=[0.03, 0.07], stands=[QUARTER, 0.0]))
    assert (lying.period, lying.yaw, lying.width_m) == pytest.approx((pi, QUARTER, 0.03), abs=4e-4)


def test_a_ball_is_gripped_where_it_is_widest(tmp_path: Path) -> None:
    """24 mm high: its middle, 12 mm above the foot, lies between the tips and the end of the pads, 24 mm above them."""
    shape = meshed(trimesh.creation.icosphere(subdivisions=3, radius=0.012), tmp_path)
    found = taken(shape)
    assert found.width_m == pytest.approx(0.024, abs=2e-4)
    assert found.up_m < shape.foot_m < found.up_m + 0.024


@pytest.mark.parametrize(("turned", "gripped"), [(40, 40), (170, -10)])
def test_a_part_that_stands_turned_in_its_file_is_gripped_turned(turned: int, gripped: int, tmp_path: Path) -> None:
    """A bar of 60 x 20 x 40 mm, its length 40 degrees off the file's x axis: so is the tool's, by a quarter turn at most."""
    c, s = cos(radians(turned)), sin(radians(turned))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    bar = trimesh.creation.box((0.06, 0.02, 0.04))
    bar.apply_transform(np.block([[turn, np.zeros((3, 1))], [0, 0, 0, 1]]))
    found = taken(meshed(bar, tmp_path))
    assert (found.yaw, found.width_m) == pytest.approx((radians(gripped), 0.02), abs=1e-4)


def test_the_tool_goes_to_the_middle_of_what_it_grips_not_to_the_centre_of_mass(tmp_path: Path) -> None:
    """Plates 5 mm thick, y = -10 to -5 mm, and 2 mm thick, 8 to 10 mm: mass at (5 x -7.5 + 2 x 9) / 7 = -2.786 mm."""
    thick = trimesh.creation.box(bounds=[[-0.025, -0.010, 0], [0.025, -0.005, 0.03]])
    thin = trimesh.creation.box(bounds=[[-0.025, 0.008, 0], [0.025, 0.010, 0.03]])
    found = taken(meshed(cast(trimesh.Trimesh, trimesh.util.concatenate([thick, thin])), tmp_path))
    assert (found.yaw, found.x, found.y, found.width_m) == pytest.approx((0, 0, 0.002786, 0.02), abs=2e-6)


@settings(deadline=None, max_examples=60)
@drawn(st.floats(0.004, 0.08), st.floats(0.004, 0.08), st.floats(0.004, 0.15))
@example(0.0625, 0.03125, OVER_FLOOR_M + HOLD_M)
def test_a_box_of_any_size_is_gripped_within_the_opening_or_refused_with_its_widths(
    x: float, y: float, z: float
) -> None:
    shape = box(x, y, z)
    if z < OVER_FLOOR_M + HOLD_M:
        assert f"is {z:.4f} m high as it stands, too flat" in refusal(shape)
        return
    if min(x, y) > MOST:
        (narrowest,) = re.findall(r"it is ([\d.]+) m wide where it is narrowest", refusal(shape))
        assert float(narrowest) == pytest.approx(min(x, y), abs=6e-4)
        return
    found = taken(shape)
    assert min(x, y) - 1e-6 <= found.width_m <= MOST
    assert OVER_FLOOR_M <= found.up_m <= z - HOLD_M + 1e-9
    assert z - found.up_m <= GRIPPER.depth_m - UNDER_PALM_M + 1e-9
    assert abs(sin(2 * found.yaw)) < 1e-9 or found.width_m > min(x, y), "flat on its sides"


# ---- what cannot ----------------------------------------------------------------------------------------------------


def test_a_part_that_is_too_wide_is_refused_with_its_widths_and_what_would_do() -> None:
    assert refusal(box(0.06, 0.05, 0.05)) == (
        "part 'thing' cannot be gripped: it is 0.050 m wide where it is narrowest (at yaw 0.00) and 0.078 m where it is "
        "widest; the gripper takes up to 0.036 m"
    )


def test_a_flat_part_is_refused() -> None:
    assert refusal(box(0.02, 0.02, 0.0064)) == (
        "part 'thing' is 0.0064 m high as it stands, too flat for the fingers: at least 0.011 m needed"
    )


def test_sides_that_slope_are_refused_by_how_much_friction_holds(tmp_path: Path) -> None:
    """A pyramid of 60 mm and 60 mm high slopes by atan(30 / 60) = 27 degrees: 0.8 x 0.8 holds 33, 0.8 x 0.4 holds 18."""
    corners = [(x, y, 0.0) for x in (-0.03, 0.03) for y in (-0.03, 0.03)]
    shape = meshed(trimesh.Trimesh([*corners, (0.0, 0.0, 0.06)]).convex_hull, tmp_path)
    assert taken(shape).width_m <= MOST
    says = refusal(shape, friction=0.4)
    assert "it is 0.060 m wide where it is narrowest" in says
    assert says.endswith("and where it is no wider its sides slope by 27 degrees: friction 0.4 holds 18")


# ---- grips that a file gives --------------------------------------------------------------------------------------


def test_a_given_grip_is_taken_as_it_is() -> None:
    found = taken(box(0.12, 0.015, 0.12), yaw=0.0, up_m=0.08, at_m=[0.02, 0.0])
    assert astuple(found) == pytest.approx((0.0, 0.08, 0.02, 0.0, 0.015, pi), abs=1e-6)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"yaw": QUARTER, "up_m": 0.09}, "it is 0.120 m wide there; the gripper takes up to 0.036 m"),
        ({"up_m": 0.13}, "between the fingers is nothing; the part is 0.120 m high"),
        ({"up_m": 0.04}, "the part's top would be in the palm; at least 0.048 m needed"),
    ],
)
def test_a_given_grip_that_cannot_be_is_refused(given: dict[str, Any], says: str) -> None:
    found = refusal(box(0.12, 0.015, 0.12), **given)
    assert found.startswith("part 'thing': grip.yaw ")
    assert found.endswith(says)
