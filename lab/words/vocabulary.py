"""The words of the grammar, from `vocabulary.txt`, and the units of length.

Names of objects, parts and stations come from the scene, numbers and lengths from the reader (lab/words/reader.py).
"""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

# words without a meaning of their own, wherever they stand
SKIPPED = frozenset(
    ("the", "please", "pls", "plz", "just", "really", "very", "kindly", "exactly", "simply", "actually")
)
LENGTHS: Mapping[str, float] = {
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 0.1),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters", "cms", "centi"), 1.0),
    **dict.fromkeys(("dm", "decimetre", "decimetres", "decimeter", "decimeters"), 10.0),
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters", "mtr"), 100.0),
    **dict.fromkeys(("inch", "inches"), 2.54),
}  # in cm


@cache
def sections() -> Mapping[str, Mapping[str, tuple[str, ...]]]:
    """Section -> kind of word -> the words and phrases that stand for it, as they are written in the file."""
    found: dict[str, dict[str, tuple[str, ...]]] = {}
    rows: list[str] = []
    for line in files("lab.words").joinpath("vocabulary.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("  "):
            rows[-1] += f" {line.strip()}"
        elif line and not line.startswith("#"):
            rows.append(line)
    for row in rows:
        if row.startswith("["):
            section = found.setdefault(row.strip("[]"), {})
            continue
        kind, _, listed = row.partition(": ")
        section[kind] = tuple(phrase.strip() for phrase in listed.split(" | "))
    return found
