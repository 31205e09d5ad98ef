"""Where a gripper takes a part."""

from dataclasses import dataclass
from math import pi

from lab.errors import BadInput
from lab.sim.gripper import Gripper
from lab.sim.part_shape import PartShape
from lab.tasks.part_fields import GripFields


@dataclass(frozen=True)
class Grip:
    """stand-in"""

    yaw: float
    up_m: float
    x: float
    y: float
    width_m: float
    period: float


def grip_of(shape: PartShape, gripper: Gripper, friction: float, given: GripFields | None = None) -> Grip:
    """stand-in"""
    x, y = shape.footprint
    width = min(x, y)
    if width > gripper.opening_m - 0.004:
        raise BadInput(
            f"part '{shape.name}': {x:.3f} x {y:.3f} m is too wide for the gripper's {gripper.opening_m:.3f} m"
        )
    up = shape.height_m - min(0.03, shape.height_m - 0.006)
    yaw = 0.0 if y <= x else pi / 2
    return Grip(
        yaw if given is None else given.yaw,
        up if given is None else given.up_m,
        0.0,
        0.0,
        width,
        0.0 if shape.solid == "cylinder" else pi,
    )
