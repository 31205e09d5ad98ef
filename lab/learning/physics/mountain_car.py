"""Mountain car: a car too weak for its hill has to swing up. Source: Moore 1990; Gymnasium's MountainCar-v0."""

from math import cos
from typing import Any

LOW, HIGH, FASTEST, FLAG = -1.2, 0.6, 0.07, 0.5


def begin(x: Any) -> None:
    """Turns uniform numbers into a start, in place: the car stands in the valley; x: position, speed."""
    x[0], x[1] = -0.6 + 0.2 * x[0], 0.0


def step(x: Any, action: int) -> bool:
    """Makes one step, accelerating left (0), not (1) or right (2), in place; returns whether the car is at the flag."""
    speed = x[1] + ((action - 1) * 0.001 + cos(3 * x[0]) * (-0.0025))
    speed = min(max(speed, -FASTEST), FASTEST)
    position = min(max(x[0] + speed, LOW), HIGH)
    if position == LOW and speed < 0.0:
        speed = 0.0
    x[0], x[1] = position, speed
    return bool(position >= FLAG and speed >= 0.0)


def energy_rule(x: Any) -> int:
    """The action that accelerates the car in its direction of motion, so that each swing is higher."""
    return 2 if x[1] >= 0.0 else 0
