"""The kinds of parts: how a gripper holds one, what room it takes, and pallets with what rides on them."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.sim.arms.arm_models import arm_named
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.grip import Grip
from lab.sim.parts.kinds import Kind, Spot, beside, comes_as, kinds_of, on_its_pallet
from lab.tasks.task import Task

GRIPPER = arm_named("up6").gripper
HALF, QUARTER = pi, pi / 2
places = st.floats(-2, 2)
angles = st.floats(-7, 7)
spots = st.builds(Spot, places, places, places, angles)


@pytest.fixture(scope="module")
def kinds(fms: Task) -> dict[str, Kind]:
    return kinds_of(fms, GRIPPER)


@pytest.fixture(scope="module")
def sign(kinds: dict[str, Kind]) -> Kind:
    """A box, 60 mm long, 18 mm wide and 44 mm high."""
    return kinds["sign"]


def gripped(kind: Kind, *, yaw: float = 0.0, x: float = 0.0, y: float = 0.0, period: float = HALF) -> Kind:
    """The kind held 20 mm above its foot in another way."""
    return replace(kind, grip=Grip(yaw, 0.020, x, y, 0.012, period))


def test_a_part_is_held_where_its_grip_says(sign: Kind) -> None:
    """Turned by a quarter on its spot, what lies 1 cm along its axis lies 1 cm to the world's left."""
    pose = gripped(sign, x=0.01).held_at(Spot(0.5, 0.1, 0.3, QUARTER))
    assert (pose.x, pose.y, pose.z, pose.yaw) == pytest.approx((0.5, 0.11, 0.32, QUARTER))
    assert gripped(sign, yaw=0.4).held_at(Spot(0.5, 0.1, 0.3, 0.3)).yaw == pytest.approx(0.7)


def test_the_radius_of_gyration_is_that_about_the_way_the_fingers_close(sign: Kind) -> None:
    """60 x 18 x 44 mm: across its width sqrt((60^2 + 44^2) / 12) = 21.5 mm, along its length sqrt((18^2 + 44^2) / 12) = 13.7."""
    assert gripped(sign).gyration_m == pytest.approx(0.0215, abs=1e-4)
    assert gripped(sign, yaw=QUARTER).gyration_m == pytest.approx(0.0137, abs=1e-4)


@given(spots, angles, st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_where_a_part_is_held_and_where_its_foot_is_then_are_inverses(
    sign: Kind, spot: Spot, yaw: float, x: float, y: float
) -> None:
    kind = gripped(sign, yaw=yaw, x=x, y=y)
    pose = kind.held_at(spot)
    back = kind.foot_at(pose)
    assert (back.x, back.y, back.z, back.yaw) == pytest.approx((spot.x, spot.y, spot.z, spot.yaw), abs=1e-9)
    assert np.hypot(pose.x - spot.x, pose.y - spot.y) == pytest.approx(np.hypot(x, y), abs=1e-9)
    again = kind.held_at(kind.foot_at(ToolPose(spot.x, spot.y, spot.z, spot.yaw)))
    assert (again.x, again.y, again.z, again.yaw) == pytest.approx((spot.x, spot.y, spot.z, spot.yaw), abs=1e-9)


def test_a_box_looks_the_same_after_half_a_turn_and_a_cylinder_always(sign: Kind, kinds: dict[str, Kind]) -> None:
    assert sign.turned_like(3.0, 0.1) == pytest.approx(3.0 - pi)
    assert sign.turned_like(3.0, 2.9) == pytest.approx(3.0)
    assert sign.turned_like(1.6, 0.0) == pytest.approx(1.6 - pi)
    rook = kinds["rook"]
    assert (rook.grip.period, rook.turned_like(3.0, 0.1)) == (0.0, 0.1)


@given(angles, angles, st.sampled_from([HALF, QUARTER, 2 * pi]))
def test_a_tool_turned_like_another_holds_the_part_as_before_and_is_as_near_as_can_be(
    sign: Kind, yaw: float, like: float, period: float
) -> None:
    found = gripped(sign, period=period).turned_like(yaw, like)
    turns = (found - yaw) / period
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert abs(found - like) <= period / 2 + 1e-9


def test_how_far_a_carried_part_reaches_from_the_tool(sign: Kind, kinds: dict[str, Kind]) -> None:
    """60 x 18 mm: 30 and 9 mm from the middle, 40 mm when the tool is 10 mm off it; across when it is turned."""
    assert gripped(sign).carried_half_m() == pytest.approx((0.030, 0.009))
    assert gripped(sign, x=0.01).carried_half_m() == pytest.approx((0.040, 0.009))
    assert gripped(sign, yaw=QUARTER, x=0.01).carried_half_m() == pytest.approx((0.009, 0.040))
    eighth = 0.030 * cos(pi / 4) + 0.009 * sin(pi / 4)
    assert gripped(sign, yaw=pi / 4).carried_half_m() == pytest.approx((eighth, eighth))
    assert kinds["sign on pallet"].carried_half_m() == pytest.approx((0.060, 0.017))  # the pallet is the larger


def test_how_far_a_standing_part_reaches_from_its_spot(sign: Kind, kinds: dict[str, Kind]) -> None:
    assert sign.footprint_m() == pytest.approx((0.030, 0.009))
    assert kinds["sign on pallet"].footprint_m() == kinds["pallet"].footprint_m() == pytest.approx((0.060, 0.017))


def test_room_for_the_fingers_is_where_they_close(sign: Kind) -> None:
    assert gripped(sign).margins_m(0.01, 0.03) == pytest.approx((0.01, 0.04))
    assert gripped(sign, yaw=QUARTER).margins_m(0.01, 0.03) == pytest.approx((0.04, 0.01))


def test_pallets_are_kinds_of_their_own_and_with_what_rides_on_them(kinds: dict[str, Kind]) -> None:
    assert set(kinds) == {"rook", "sign", "pallet", "rook on pallet", "sign on pallet"}
    loaded = kinds["sign on pallet"]
    assert [kind.name for kind in loaded.stack()] == ["pallet", "sign"]
    assert loaded.stack()[0].rider is None
    assert loaded.grip == kinds["pallet"].grip  # the gripper holds the pallet
    assert loaded.height_m == pytest.approx(0.020 + 0.044)
    assert [kind.name for kind in kinds["sign"].stack()] == ["sign"]


def test_what_comes_on_a_pallet_stands_on_it_everywhere_but_in_machines(fms: Task, task: Task) -> None:
    assert [comes_as(part) for part in fms.made] == ["rook on pallet", "sign on pallet"]
    assert [comes_as(part) for part in task.made] == ["slice"]
    assert on_its_pallet(fms, "sign", "mill-in")
    assert on_its_pallet(fms, "sign", "outgoing")
    assert not on_its_pallet(fms, "sign", "mill")
    assert not on_its_pallet(fms, "sign on pallet", "mill-in")
    assert not on_its_pallet(fms, "pallet", "mill-in")
    assert not on_its_pallet(task, "slice", "plate")


def with_sign(fms: Task, *size_m: float) -> Task:
    parts = tuple(p.model_copy(update={"size_m": size_m}) if p.name == "sign" else p for p in fms.parts)
    return fms.changed(parts=parts)


def test_what_the_palm_would_hit_is_not_carried_on_a_pallet(fms: Task) -> None:
    """Tips 5 mm above the pallet's foot: its top is at 15 mm above them, and the palm at the fingers' depth."""
    room = GRIPPER.depth_m - 0.002 - 0.015
    kinds_of(with_sign(fms, 0.06, 0.012, room - 0.001), GRIPPER)
    with pytest.raises(
        BadInput, match=r"part 'sign' cannot be carried on 'pallet': its top would be 0\.073 m above the"
    ):
        kinds_of(with_sign(fms, 0.06, 0.012, room + 0.001), GRIPPER)


def test_what_is_wider_than_its_pallet_is_not_carried_on_it(fms: Task) -> None:
    kinds_of(with_sign(fms, 0.06, 0.033, 0.05), GRIPPER)
    with pytest.raises(
        BadInput, match=r"'sign' cannot be carried on 'pallet': it is 0\.036 m wide where the fingers .* are 0\.034 m"
    ):
        kinds_of(with_sign(fms, 0.06, 0.036, 0.05), GRIPPER)


@given(places, places, angles, places, places)
def test_beside_turns_and_comes_back(x: float, y: float, yaw: float, along: float, across: float) -> None:
    there = beside((x, y), yaw, (along, across))
    off = there[0] - x, there[1] - y
    assert beside((0.0, 0.0), -yaw, off) == pytest.approx((along, across), abs=1e-9)


def test_beside_by_hand() -> None:
    assert beside((1.0, 2.0), QUARTER, (0.1, 0.0)) == pytest.approx((1.0, 2.1))
    assert beside((1.0, 2.0), QUARTER, (0.0, 0.1)) == pytest.approx((0.9, 2.0))
    assert Spot(1.0, 2.0, 3.0, 4.0).raised(0.5) == Spot(1.0, 2.0, 3.5, 4.0)
