"""A person's command for one takeover: how far the tool goes in its own axes, how it turns, and whether the fingers close."""

import re
from dataclasses import dataclass
from math import radians

import numpy as np

from lab.errors import BadInput, shortened, unknown
from lab.mentor.demonstrated import Array

STEP_CM, TURN_DEG = 3.0, 10.0  # without a number
MOST_CM, MOST_DEG = 30.0, 90.0
AHEAD = {"ahead": (0, 1), "back": (0, -1), "left": (1, 1), "right": (1, -1), "up": (2, 1), "down": (2, -1)}
TURNS = {"turn-left": 1, "turn-right": -1}
FINGERS = {"open": False, "close": True}
WAIT, TEACHER = "wait", "teacher"
WORDS = (*AHEAD, *TURNS, *FINGERS, WAIT, TEACHER)
HELP = (
    f"ahead, back, left, right, up, down: so many cm ({STEP_CM:g} if you give no number); turn-left, turn-right: degrees "
    f"({TURN_DEG:g}); open, close; wait; teacher: the scripted teacher does it. Several in a line: ahead 4 down 2 close"
)


@dataclass(frozen=True)
class TakeoverCommand:
    """moved (4,): ahead, left, up [m] in the tool's axes, and turned to the left [rad]; close: the fingers; None: as they are.

    by_teacher: the scripted teacher acts in this takeover instead.
    """

    moved: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    close: bool | None = None
    by_teacher: bool = False

    def velocity(self, yaw: float, seconds: float) -> Array:
        """The tool's velocity (4,), x, y, z [m/s] and yaw [rad/s] in the world, that goes so far in `seconds`."""
        ahead, left, up, turn = self.moved
        c, s = np.cos(yaw), np.sin(yaw)
        return np.array([c * ahead - s * left, s * ahead + c * left, up, turn]) / seconds


def command_of(text: str) -> TakeoverCommand:
    """The command in a line; an empty line waits. Raises BadInput for other words, and for numbers out of range."""
    moved, close = [0.0] * 4, None
    tokens = re.findall(r"[^\s,;]+", text.lower())
    if tokens == [TEACHER]:
        return TakeoverCommand(by_teacher=True)
    place = 0
    while place < len(tokens):
        word, place = tokens[place], place + 1
        if word not in WORDS or word == TEACHER:
            raise unknown("word", shortened(word, 40), WORDS, "takeover")
        by = None
        if word in AHEAD or word in TURNS:
            by, place = _number(tokens, place)
        if word in AHEAD:
            axis, sign = AHEAD[word]
            moved[axis] += sign * _within(STEP_CM if by is None else by, MOST_CM, "cm", word) / 100.0
        elif word in TURNS:
            moved[3] += TURNS[word] * radians(_within(TURN_DEG if by is None else by, MOST_DEG, "degrees", word))
        elif word in FINGERS:
            close = FINGERS[word]
    return TakeoverCommand((moved[0], moved[1], moved[2], moved[3]), close)


def _number(tokens: list[str], place: int) -> tuple[float | None, int]:
    """The number at a place, if there is one, and the place after it."""
    if place < len(tokens) and re.fullmatch(r"\d{1,3}(\.\d{1,3})?", tokens[place]):
        return float(tokens[place]), place + 1
    return None, place


def _within(value: float, most: float, unit: str, word: str) -> float:
    if value > most:
        raise BadInput(f"'{word} {value:g}' (takeover): wanted 0 to {most:g} {unit}")
    return value
