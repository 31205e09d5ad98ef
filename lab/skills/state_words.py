"""The state of a skill in words: sizes of moves, and positions relative to a goal."""

from collections.abc import Sequence
from math import degrees

BESIDE = {
    "left": "left of",
    "right": "right of",
    "backward": "in front of",
    "forward": "behind",
    "down": "below",
    "up": "above",
    "lower": "below",
    "higher": "above",
    "in": "inside",
    "out": "out from",
}  # name of a move -> the direction in words
TURN = "turn "  # how the name of a move about the vertical begins; its step is an angle


def size_in_words(label: str, step: float) -> str:
    """The length of a move: "1.2 cm" for a step in metres, "3 degrees" for a turn in radians."""
    if label.startswith(TURN):
        return f"{degrees(step):.0f} degrees"
    return f"{100.0 * step:.1f}".removesuffix(".0") + " cm"


def away_in_words(what: str, goal: str, by: Sequence[int], labels: Sequence[str], steps: Sequence[float]) -> str:
    """A sentence such as "The fingers are 2.4 cm left of and 3 cm above the slice, turned 3 degrees to the left."

    what: the subject with its verb. by: cells from the goal along each axis. labels: the names of the moves down and up
    each axis, axis by axis. steps: size of a cell along each axis [m], about the vertical [rad].
    """
    places, turned = list[str](), ""
    for axis, cells in enumerate(by):
        label = labels[2 * axis + (cells > 0)]
        if not cells:
            continue
        size = size_in_words(label, abs(cells) * steps[axis])
        if label.startswith(TURN):
            turned = f", turned {size} to the {label.removeprefix(TURN)}"
        else:
            places.append(f"{size} {BESIDE.get(label, label)}")
    joined = f"{', '.join(places[:-1])} and {places[-1]}" if len(places) > 1 else "".join(places)
    return f"{what} {joined or 'at'} {goal}{turned}."


def plain(name: str) -> str:
    """The name of a station or a kind for a sentence: with an article, and spaces for underscores."""
    return f"the {name.replace('_', ' ')}"
