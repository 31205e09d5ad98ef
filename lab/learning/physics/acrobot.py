"""Acrobot: two hanging links, driven at the joint between them, swing up. Source: Sutton 1996; Gymnasium's Acrobot-v1."""

from math import cos, pi, sin
from typing import Any

FASTEST_1, FASTEST_2, STEP_S = 4 * pi, 9 * pi, 0.2


def begin(x: Any) -> None:
    """Turns uniform numbers into a start, nearly hanging down, in place; x: both angles [rad], both speeds [rad/s]."""
    for i in range(4):
        x[i] = -0.1 + 0.2 * x[i]


def step(x: Any, action: int) -> bool:
    """Makes one step (Runge-Kutta 4) with a torque of -1, 0 or 1 N m, in place; returns whether the tip is above the line.

    The links have 1 m and 1 kg; the accelerations are those of Sutton and Barto's book.
    """
    ka, kb, kda, kdb = 0.0, 0.0, 0.0, 0.0
    sum_a, sum_b, sum_da, sum_db = 0.0, 0.0, 0.0, 0.0
    for stage in range(4):
        ahead = 0.0 if stage == 0 else STEP_S if stage == 3 else STEP_S / 2.0
        a, b, da, db = x[0] + ahead * ka, x[1] + ahead * kb, x[2] + ahead * kda, x[3] + ahead * kdb
        d1 = 0.25 + (1.0 + 0.25 + cos(b)) + 2.0
        d2 = 0.25 + 0.5 * cos(b) + 1.0
        phi2 = 0.5 * 9.8 * cos(a + b - pi / 2.0)
        phi1 = -0.5 * db * db * sin(b) - db * da * sin(b) + 1.5 * 9.8 * cos(a - pi / 2.0) + phi2
        kdb = ((action - 1.0) + d2 / d1 * phi1 - 0.5 * da * da * sin(b) - phi2) / (0.25 + 1.0 - d2 * d2 / d1)
        ka, kb, kda = da, db, -(d2 * kdb + phi1) / d1
        weight = 2.0 if stage == 1 or stage == 2 else 1.0
        sum_a, sum_b = sum_a + weight * ka, sum_b + weight * kb
        sum_da, sum_db = sum_da + weight * kda, sum_db + weight * kdb
    x[0], x[1] = x[0] + STEP_S / 6.0 * sum_a, x[1] + STEP_S / 6.0 * sum_b
    x[2] = min(max(x[2] + STEP_S / 6.0 * sum_da, -FASTEST_1), FASTEST_1)
    x[3] = min(max(x[3] + STEP_S / 6.0 * sum_db, -FASTEST_2), FASTEST_2)
    for i in range(2):
        while x[i] > pi:
            x[i] = x[i] - 2.0 * pi
        while x[i] < -pi:
            x[i] = x[i] + 2.0 * pi
    return bool(-cos(x[0]) - cos(x[1] + x[0]) > 1.0)
