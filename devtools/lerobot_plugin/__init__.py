"""A plug-in for LeRobot with an arm, a leader and a policy that need no hardware: they stir along a circle."""

from .arm import CircleArm, CircleLeader
from .configuration_circle import CircleConfig

__all__ = ["CircleArm", "CircleConfig", "CircleLeader"]  # where LeRobot looks for them
