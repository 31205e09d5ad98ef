"""The worlds drawn in lines of text, for whoever is asked at a terminal."""

from collections.abc import Sequence
from math import sin

from lab.learning.physics import mountain_car

WIDTH, HEIGHT = 61, 9


def drawn(name: str, point: Sequence[float]) -> str:
    """The world of that name at a point; "" for one that has no picture."""
    return _mountain_car(*point) if name == "MountainCar-v0" else ""


def _mountain_car(position: float, speed: float) -> str:
    """The hill with the car and the flag, and which way it rolls how fast."""
    span = mountain_car.HIGH - mountain_car.LOW
    lines = [[" "] * WIDTH for _ in range(HEIGHT)]
    for column in range(WIDTH):
        lines[_row(mountain_car.LOW + span * column / (WIDTH - 1))][column] = "."
    for mark, place in (("F", mountain_car.FLAG), ("O", position)):
        lines[max(_row(place) - 1, 0)][round((place - mountain_car.LOW) / span * (WIDTH - 1))] = mark
    way = "stands" if speed == 0.0 else f"rolls {'right' if speed > 0.0 else 'left'}, {abs(speed):.3f} a step"
    said = f"O car at {position:+.2f}, {way}; F flag at {mountain_car.FLAG:+.2f}"
    return "\n".join([*("".join(line).rstrip() for line in lines), said])


def _row(position: float) -> int:
    """The line of the ground, from above."""
    return round((1.0 - sin(3 * position)) / 2.0 * (HEIGHT - 2)) + 1
