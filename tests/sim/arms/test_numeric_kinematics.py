"""Newton's method against the closed form, against the URDF's own chain, and what arms it is not for."""

from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.files import assets_folder
from lab.sim.arms.arm_models import ARMS, arm_named
from lab.sim.arms.chain import Chain
from lab.sim.arms.foreign_urdf import settled
from lab.sim.arms.kinematics import TOOL, ClosedForm
from lab.sim.arms.numeric_kinematics import NumericKinematics

TIP = np.eye(4)
TIP[0, 3] = TOOL
UP6 = NumericKinematics(Chain.of(settled(assets_folder() / "robot.urdf", assets_folder()), "tool", TIP), "up6")


@given(st.floats(0.36, 1.2), st.floats(0.0, 0.6))
def test_newton_finds_what_the_closed_form_says(out: float, up: float) -> None:
    exact, found = (how.bent(np.array([out]), np.array([up])) for how in (ClosedForm(), UP6))
    assert found == pytest.approx(exact, abs=1e-7, nan_ok=True)


def test_the_home_of_the_closed_form_is_the_chains_own() -> None:
    home = ClosedForm.home[None]
    assert UP6.tools(home) == pytest.approx(ClosedForm().tools(home), abs=1e-9)
    assert UP6.spins == ClosedForm.spins


@pytest.mark.parametrize("name", sorted(set(ARMS) - {"up6"}))
def test_a_redundant_arm_stays_in_its_plane(name: str) -> None:
    """Seen from above, elbow and wrist are on the line to the tool: all that is symmetric about it stays so."""
    arm = arm_named(name)
    joints = arm.kinematics.bent(np.linspace(0.45, 0.6, 30), np.full(30, 0.3))
    assert np.isfinite(joints).all()
    aside = {"panda": [0, 2, 4], "iiwa": [0, 2, 4], "xarm6": [0, 3]}[name]
    assert np.abs(joints[:, aside]).max() < 1e-6


def test_the_xarm6_goes_straight_on_where_its_wrist_is_straight() -> None:
    """30 cm out its fifth joint passes 0, where the fourth and the last turn about one line: neither moves for that."""
    joints = arm_named("xarm6").kinematics.bent(np.full(400, 0.2976), np.linspace(-0.2, 0.0, 400))
    assert joints[:, 4].min() < 0.0 < joints[:, 4].max()
    assert np.abs(joints[:, [3, 5]]).max() < 1e-6


@pytest.mark.parametrize("name", sorted(set(ARMS) - {"up6"}))
def test_what_it_answers_is_checked_by_the_chain(name: str) -> None:
    how = arm_named(name).kinematics
    assert isinstance(how, NumericKinematics)
    out, up = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 1.4, 60), np.linspace(-0.6, 1.4, 60)))
    joints = how.bent(out, up)
    found = ~np.isnan(joints[:, 0])
    assert 0.05 < found.mean() < 0.9
    far, angle = how.misses(joints[found], np.column_stack([out, 0 * out, up, 0 * out])[found])
    assert far.max() < 5e-4
    assert angle.max() < 0.0087
    assert np.all(joints[found] >= how.chain.lower - 1e-9)
    assert np.all(joints[found] <= how.chain.upper + 1e-9)


def tilted(folder: Path, first: str = "0 0 1", last: str = "0 0 1", joints: int = 4) -> Chain:
    """A tower of joints, a foot apart each, that turn about `first`, x, ..., x, `last`."""
    axes = [first, *["1 0 0"] * (joints - 2), last]
    body = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    links = "".join(f'<link name="l{k}">{body}</link>' for k in range(joints + 1))
    turning = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="0 0 0.3"/>'
        f'<axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="1"/></joint>'
        for k, axis in enumerate(axes)
    )
    path = folder / "tower.urdf"
    path.write_text(f'<robot name="tower">{links}{turning}</robot>')
    end = np.eye(4)
    end[:3, :3] = [[0, 0, 1], [0, -1, 0], [1, 0, 0]]
    return Chain.of(settled(path, folder), f"l{joints}", end)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"first": "0 1 0"}, "its first joint 'j0' does not turn it about the vertical"),
        ({"last": "1 0 0"}, "its last joint 'j3' does not turn the tool about the tool's own axis"),
        ({"joints": 3}, "3 joints lead to its tool, wanted 4 or more"),
    ],
)
def test_an_arm_that_it_is_not_for_is_refused(tmp_path: Path, how: dict[str, str], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        NumericKinematics(tilted(tmp_path, **how), "tower")  # type: ignore[arg-type]


def test_a_tower_by_hand(tmp_path: Path) -> None:
    """Two links of 0.3 m and a tool of 0: a square corner reaches 0.3 m out, on the second joint's height + 0.3 - 0.3."""
    how = NumericKinematics(tilted(tmp_path, joints=5), "tower")
    joints = how.bent(np.array([0.3]), np.array([0.3 + 0.3 + 0.3 - 0.3 - 0.3]))
    at, axes = how.chain.ends(joints)
    assert at[0] == pytest.approx([0.3, 0.0, 0.3], abs=1e-6)
    assert axes[0, :, 0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
    assert abs(joints[0, 0]) == pytest.approx(pi / 2, abs=1e-6)  # its joints bend about x: it works sideways
