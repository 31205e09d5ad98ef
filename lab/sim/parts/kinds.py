"""The kinds of a task's parts in physics: their shapes, their grips, and the parts that ride on pallets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import cos, sin
from pathlib import Path

import numpy as np

from lab.errors import BadInput
from lab.sim.arms.fingers import Gripper
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.grip import Grip, grip_of
from lab.sim.parts.part_shape import PartShape, shape_of
from lab.sim.urdf_reader import rotation
from lab.tasks.task import Task
from lab.tasks.task_fields import Part

PALM_M = 0.002  # [m] clearance between the palm and what stands between the fingers


@dataclass(frozen=True)
class Spot:
    """Where one part stands: the middle of its foot at x, y, z [m], turned by yaw [rad]."""

    x: float
    y: float
    z: float
    yaw: float

    def raised(self, by_m: float) -> "Spot":
        """The spot `by_m` [m] higher."""
        return replace(self, z=self.z + by_m)


@dataclass(frozen=True)
class Kind:
    """A kind of part, or a pallet with a part (`rider`) on it; the gripper then holds the pallet."""

    name: str
    part: Part
    shape: PartShape
    grip: Grip
    gripper: Gripper
    rider: "Kind | None" = None

    @property
    def height_m(self) -> float:
        """The height from the foot to the top [m]."""
        return sum(kind.shape.height_m for kind in self.stack())

    @property
    def finger_m(self) -> float:
        """The distance that an open finger reaches beyond the part's side [m]."""
        return (self.gripper.opening_m - self.grip.width_m) / 2 + self.gripper.thick_m

    @property
    def palm_up_m(self) -> float:
        """The height of a hanging tool's palm above the foot of the part that it holds [m]."""
        return self.grip.up_m + self.gripper.depth_m

    @property
    def gyration_m(self) -> float:
        """The radius of gyration [m] about the axis along which the fingers close, without its rider."""
        across = np.array([-sin(self.grip.yaw), cos(self.grip.yaw), 0.0]) @ rotation(self.shape.turn)
        return float(np.sqrt(across**2 @ self.shape.inertia_m2))

    def stack(self) -> "list[Kind]":
        """The stack from the foot upwards: the part itself, or its pallet and the part."""
        return [self] if self.rider is None else [replace(self, name=self.part.name, rider=None), self.rider]

    def held_at(self, spot: Spot) -> ToolPose:
        """The tool pose that holds a part which stands on a spot."""
        x, y = beside((spot.x, spot.y), spot.yaw, (self.grip.x, self.grip.y))
        return ToolPose(x, y, spot.z + self.grip.up_m, spot.yaw + self.grip.yaw)

    def foot_at(self, pose: ToolPose) -> Spot:
        """The spot of the foot of a part that the tool at `pose` holds."""
        yaw = pose.yaw - self.grip.yaw
        x, y = beside((pose.x, pose.y), yaw, (-self.grip.x, -self.grip.y))
        return Spot(x, y, pose.z - self.grip.up_m, yaw)

    def turned_like(self, yaw: float, like: float) -> float:
        """The equivalent yaw of the tool that is nearest to `like` [rad]."""
        if not self.grip.period:
            return like
        half = self.grip.period / 2
        return like + (yaw - like + half) % self.grip.period - half

    def carried_half_m(self) -> tuple[float, float]:
        """How far a carried part reaches from the tool's axis at most, along the tool's x and y axes [m]."""
        reach = np.zeros(2)
        for kind in self.stack():
            points = kind.shape.hull[:, :2] - (self.grip.x, self.grip.y)
            c, s = cos(self.grip.yaw), sin(self.grip.yaw)
            reach = np.maximum(reach, np.abs(points @ np.array([[c, -s], [s, c]])).max(axis=0))
        return float(reach[0]), float(reach[1])

    def footprint_m(self) -> tuple[float, float]:
        """How far a standing part reaches from its spot at most, along its own axes [m]."""
        reach = [np.maximum(-kind.shape.low[:2], kind.shape.high[:2]) for kind in self.stack()]
        x, y = np.max(reach, axis=0)
        return float(x), float(y)

    def hand_half_m(self) -> tuple[float, float]:
        """How far the hand that holds a standing part reaches from the part's spot at most, along the part's axes [m]."""
        (wide, thick), c, s = self.gripper.hand_m, abs(cos(self.grip.yaw)), abs(sin(self.grip.yaw))
        return abs(self.grip.x) + c * wide + s * thick, abs(self.grip.y) + s * wide + c * thick

    def margins_m(self, beside: float, closing: float) -> tuple[float, float]:
        """Margins [m] along the part's axes: `beside` on both, plus `closing` along the direction in which the fingers close."""
        return beside + closing * abs(sin(self.grip.yaw)), beside + closing * abs(cos(self.grip.yaw))


def beside(at: Sequence[float], yaw: float, off: Sequence[float]) -> tuple[float, float]:
    """The point (x, y) [m] at `at` plus the offset `off` along axes that are turned by `yaw` [rad]."""
    c, s = cos(yaw), sin(yaw)
    return at[0] + c * off[0] - s * off[1], at[1] + s * off[0] + c * off[1]


def comes_as(part: Part) -> str:
    """The name of the kind in which a part arrives and leaves: itself, or on its pallet."""
    return part.name if part.pallet is None else f"{part.name} on {part.pallet}"


def on_its_pallet(task: Task, kind: str, station: str) -> bool:
    """Whether a part of this kind, taken up or set down alone at a station, stands on its pallet there."""
    alone = next((part for part in task.made if part.name == kind), None)
    return alone is not None and alone.pallet is not None and task.station(station).kind != "machine"


def kinds_of(task: Task, gripper: Gripper) -> dict[str, Kind]:
    """The kinds that the gripper may hold, by name: parts, pallets, and pallets with their parts.

    Raises BadInput for an impossible shape, and, with its widths, for a part that the gripper cannot take.
    """
    kinds = {part.name: _kind(part, task.folder, gripper) for part in task.parts}
    for part in task.made:
        if part.pallet is not None:
            if gripper.level:
                raise BadInput(
                    f"part '{part.name}' comes on '{part.pallet}': only a tool that hangs carries pallets; here it is level, by "
                    "robot.tool or an approach = 'side'"
                )
            name = comes_as(part)
            kinds[name] = replace(kinds[part.pallet], name=name, rider=kinds[part.name])
            _check_rider(kinds[name], gripper)
    return kinds


@cache
def _kind(part: Part, folder: Path, gripper: Gripper) -> Kind:
    shape = shape_of(part, folder)
    grip = grip_of(shape, gripper, part.friction, part.grip)
    return Kind(part.name, part, shape, grip, gripper)


def _check_rider(loaded: Kind, gripper: Gripper) -> None:
    """BadInput when the palm or the fingers would hit what stands on a pallet that is gripped."""
    assert loaded.rider is not None
    reach = loaded.shape.height_m + loaded.rider.shape.height_m - loaded.grip.up_m
    across = 2 * replace(loaded, rider=None, shape=loaded.rider.shape).carried_half_m()[1]
    what, room = f"part '{loaded.rider.name}' cannot be carried on '{loaded.part.name}'", gripper.depth_m - PALM_M
    if across > loaded.grip.width_m:
        raise BadInput(
            f"{what}: it is {across:.3f} m wide where the fingers that hold the pallet are {loaded.grip.width_m:.3f} m apart"
        )
    if reach > room:
        raise BadInput(
            f"{what}: its top would be {reach:.3f} m above the finger tips, and there is room for {room:.3f} m"
        )
