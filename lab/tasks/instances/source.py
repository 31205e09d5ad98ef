"""The text of an instance file, the options that go with it, and its errors: file, line, and what was expected."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from lab.errors import BadInput
from lab.lazy import yaml
from lab.sequencing.cell.cell import MAX_PARTS

MOST_MACHINES = 98  # a cell has up to 100 stations, two of which are for input and output
MOST_TIME = 1e6  # as in cell files
MOST_OPERATIONS = 99  # of a job, since a route has up to 100 stages
_SHOWN = 60  # characters of a bad value that an error shows
_WHOLE = re.compile(r"[0-9]{1,9}")
_TIME = re.compile(r"[0-9]{1,9}(\.[0-9]{0,9})?")


@dataclass(frozen=True)
class InstanceRequest:
    """The options that go with an instance file; None: not given.

    layout: the file of travel times. robots: the number of identical robots. case: the name of one of the file's instances.
    """

    layout: Path | None = None
    robots: int | None = None
    case: str | None = None


@dataclass(frozen=True)
class Source:
    """A file's path and text, with checks of its values and their errors."""

    path: Path
    text: str

    @property
    def name(self) -> str:
        """The cell's name: the file's name without its ending and without characters that names may not have."""
        return re.sub(r"[^A-Za-z0-9 _-]", "-", self.path.stem).lstrip(" _-")[:40] or "cell"

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """The words of each non-empty line with the line's number; a # begins a comment."""
        for number, line in enumerate(self.text.splitlines(), 1):
            if words := line.partition("#")[0].split():
                yield number, words

    def refusal(self, line: int | None, wanted: str, got: object = None) -> BadInput:
        """The error for a value that is not as expected; got: the value; None: there is none to show."""
        shown = str(got) if got is not None else ""
        shown = shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]} ..."
        where = f"{self.path}: " + ("" if line is None else f"line {line}: ")
        return BadInput(f"{where}wanted {wanted}" + (f", not '{shown}'" if got is not None else ""))

    def whole(self, word: str, line: int, what: str, least: int, most: int) -> int:
        """A word as an integer from `least` to `most`; raises BadInput, naming `what`, for anything else."""
        if _WHOLE.fullmatch(word) and least <= int(word) <= most:
            return int(word)
        raise self.refusal(line, f"{what}, a whole number from {least} to {most}", word)

    def time(self, word: str, line: int, what: str) -> float:
        """A word as a time from 0 on; raises BadInput, naming `what`, for anything else."""
        if _TIME.fullmatch(word) and float(word) <= MOST_TIME:
            return float(word)
        raise self.refusal(line, f"{what}, a number from 0 to {MOST_TIME:g}", word)

    def shape(self, row: tuple[int, list[str]]) -> tuple[int, int]:
        """The numbers of jobs and machines at the start of a row, checked before anything is allocated for them."""
        line, words = row
        if len(words) < 2:
            raise self.refusal(line, "how many jobs and how many machines", " ".join(words))
        jobs = self.whole(words[0], line, "how many jobs", 1, MAX_PARTS)
        return jobs, self.whole(words[1], line, "how many machines", 1, MOST_MACHINES)


def json_line(text: str, way: Sequence[str | int]) -> int:
    """The line of the value at a path in a JSON text, or of the nearest value around it; the YAML reader knows lines."""
    try:
        node = yaml.compose(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.YAMLError:  # for example a tab, which YAML does not accept as a space
        return 1
    for step in way:
        if isinstance(step, int) and isinstance(node, yaml.SequenceNode) and step < len(node.value):
            node = node.value[step]
        elif isinstance(node, yaml.MappingNode):
            node = next((value for name, value in node.value if name.value == step), node)
    return int(node.start_mark.line) + 1 if node is not None else 1
