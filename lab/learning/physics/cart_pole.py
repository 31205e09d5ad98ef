"""Cart-pole: a cart balances a pole. Source: Barto, Sutton and Anderson 1983; Gymnasium's CartPole-v1."""

from math import cos, pi, sin
from typing import Any

FARTHEST, STEEPEST, STEP_S = 2.4, 12 * 2 * pi / 360, 0.02


def begin(x: Any) -> None:
    """Turns uniform numbers into a start, nearly upright, in place; x: place [m], speed [m/s], angle [rad], its speed [rad/s]."""
    for i in range(4):
        x[i] = -0.05 + 0.1 * x[i]


def step(x: Any, action: int) -> bool:
    """Makes one Euler step with 10 N to the left (0) or right (1), in place; returns whether the pole fell or the cart left."""
    place, speed, angle, turning = x[0], x[1], x[2], x[3]
    push = 10.0 if action == 1 else -10.0
    cosine, sine = cos(angle), sin(angle)
    share = (push + 0.05 * turning * turning * sine) / 1.1
    twist = (9.8 * sine - cosine * share) / (0.5 * (4.0 / 3.0 - 0.1 * cosine * cosine / 1.1))
    x[0], x[1] = place + STEP_S * speed, speed + STEP_S * (share - 0.05 * twist * cosine / 1.1)
    x[2], x[3] = angle + STEP_S * turning, turning + STEP_S * twist
    return bool(x[0] < -FARTHEST or x[0] > FARTHEST or x[2] < -STEEPEST or x[2] > STEEPEST)
