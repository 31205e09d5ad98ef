"""What a two-finger gripper can take between its fingers."""

from dataclasses import dataclass

PAD_M = 0.011  # how far from the middle of a finger's pad, of 3 x 3 cm, friction resists turning


@dataclass(frozen=True)
class Gripper:
    """Two parallel fingers, which close along the tool's y axis [m].

    opening_m: between the open fingers' pads. depth_m: from the finger tips up to the palm. width_m, thick_m: of a
    finger, across the way it closes and along it. level: the tool is held level, not hanging. hand_m: how far what is above
    the palm reaches from the tool's axis, across the way the fingers close and along it.
    """

    opening_m: float
    depth_m: float
    width_m: float
    thick_m: float
    level: bool = False
    hand_m: tuple[float, float] = (0.0, 0.0)
