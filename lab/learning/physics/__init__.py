"""Worlds with continuous states and simple physics, stepped both in sessions and in the compiled kernel.

They have the names and the dynamics of Gymnasium's environments; PHYSICS is their table.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

from lab.learning.physics import acrobot, cart_pole, mountain_car
from lab.learning.tiles import Bounds


@dataclass(frozen=True)
class Physics:
    """A world with continuous states.

    name: Gymnasium's; number: the kernel's.
    begin: turns uniform numbers into a start, in place; step: makes a step in place and returns whether the episode has ended.
    axes: the names of the state's components; bounds: their ranges and cells; tilings: the number of tilings that suits them.
    limit: the most steps of an episode; threshold: the mean return from which the world counts as solved.
    reward: of a step; last_reward: of a step that ends the episode.
    longer_is_better: the end of an episode is a failure, and longer episodes are better.
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
    world.name: world
    for world in (
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
