"""Where a skill's state is in words, for somebody who has never seen a table: how far it is from the goal, and which way."""

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
}  # what a move is called -> where it leads to
TURN = "turn "  # a move about the vertical; its step is an angle


def size_in_words(label: str, step: float) -> str:
    """How far a move goes: "1.2 cm" for a step in metres, "3 degrees" for a turn's in radians."""
    if label.startswith(TURN):
        return f"{degrees(step):.0f} degrees"
    return f"{100.0 * step:.1f}".removesuffix(".0") + " cm"


def away_in_words(what: str, goal: str, by: Sequence[int], labels: Sequence[str], steps: Sequence[float]) -> str:
    """ "The fingers are 2.4 cm left of and 3 cm above the slice, turned 3 degrees to the left."

    what: with its verb; by: cells from the goal along each axis; labels: the moves down and up each axis, one axis after the
    other; steps: [m], of a turn [rad].
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
    """A station's or a kind's name as it is read aloud."""
    return f"the {name.replace('_', ' ')}"
