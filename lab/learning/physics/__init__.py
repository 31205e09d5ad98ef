"""Worlds of continuous states whose physics are a few lines: stepped in the session and in the compiled kernel alike.

They are Gymnasium's, by its names, and make its steps; a world's row in PHYSICS says the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

from lab.learning.physics import acrobot, cart_pole, mountain_car
from lab.learning.tiles import Bounds


@dataclass(frozen=True)
class Physics:
    """A world of continuous states.

    begin: turns uniform numbers into a start, step: makes a step, both in place; the latter says whether the episode is
    over. number: by which the kernel knows it. axes: what a state is made of; bounds: its cells; tilings: that fit them.
    limit: steps of an episode; threshold: a mean return that counts as solved; reward: of a step, last_reward: of one that
    ends the episode. longer_is_better: such an end is no goal, and an episode is the better the longer it lasts.
    """

    name: str
    number: int
    begin: Callable[[Any], None]
    step: Callable[[Any, int], bool]
    axes: tuple[str, ...]
    bounds: Bounds
    tilings: int
    actions: tuple[str, ...]
    limit: int
    threshold: float
    reward: float = -1.0
    last_reward: float = -1.0
    longer_is_better: bool = False


MOUNTAIN_CAR, ACROBOT, CART_POLE = 1, 2, 3

PHYSICS = {
    one.name: one
    for one in (
        Physics(
            "MountainCar-v0",
            MOUNTAIN_CAR,
            mountain_car.begin,
            mountain_car.step,
            ("position", "speed"),
            Bounds((mountain_car.LOW, -mountain_car.FASTEST), (mountain_car.HIGH, mountain_car.FASTEST), (64, 64)),
            8,
            ("left", "coast", "right"),
            limit=200,
            threshold=-110.0,
        ),
        Physics(
            "Acrobot-v1",
            ACROBOT,
            acrobot.begin,
            acrobot.step,
            ("angle", "bend", "speed", "bending"),
            Bounds(
                (-pi, -pi, -acrobot.FASTEST_1, -acrobot.FASTEST_2),
                (pi, pi, acrobot.FASTEST_1, acrobot.FASTEST_2),
                (24, 24, 24, 24),
            ),
            4,
            ("back", "none", "forward"),
            limit=500,
            threshold=-100.0,
            last_reward=0.0,
        ),
        Physics(
            "CartPole-v1",
            CART_POLE,
            cart_pole.begin,
            cart_pole.step,
            ("place", "speed", "angle", "turning"),
            Bounds((-2.4, -3.0, -cart_pole.STEEPEST, -3.5), (2.4, 3.0, cart_pole.STEEPEST, 3.5), (12, 12, 24, 24)),
            4,
            ("left", "right"),
            limit=500,
            threshold=475.0,
            reward=1.0,
            last_reward=1.0,
            longer_is_better=True,
        ),
    )
}
