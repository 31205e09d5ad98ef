"""The text of an instance file, what is asked for beside it, and how a fault in one is said: file, line, what was expected."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from lab.errors import BadInput
from lab.sequencing.cell.cell import MAX_PARTS

MOST_MACHINES = 98  # of a cell's 100 stations two are left for where parts come from and go to
MOST_TIME = 1e6  # as in cell files
MOST_OPERATIONS = 99  # of a job: a route has up to 100 stages
_SHOWN = 60  # characters of a bad value
_LONGEST = 300  # characters of what is wanted
_WHOLE = re.compile(r"[0-9]{1,9}")
_TIME = re.compile(r"[0-9]{1,9}(\.[0-9]{0,9})?")


@dataclass(frozen=True)
class Asked:
    """What is asked for beside an instance file; None: nothing.

    layout: the file of travel times. robots: how many carry parts, all alike. case: which of the instances that a file holds.
    """

    layout: Path | None = None
    robots: int | None = None
    case: str | None = None


@dataclass(frozen=True)
class Source:
    """A file's text, and the refusals of what stands in it."""

    path: Path
    text: str

    @property
    def name(self) -> str:
        """What the cell is called: the file's name without its ending, as far as names may have its characters."""
        return re.sub(r"[^A-Za-z0-9 _-]", "-", self.path.stem).lstrip(" _-")[:40] or "cell"

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """The words of each line that holds some, after the line's number; from a # on it is a comment."""
        for number, line in enumerate(self.text.splitlines(), 1):
            if words := line.partition("#")[0].split():
                yield number, words

    def refusal(self, line: int | None, wanted: str, got: object = None) -> BadInput:
        """The error for what is not as it is expected to be; got None: nothing stands there that could be shown."""
        found = str(got) if got is not None else ""
        found = found if len(found) <= _SHOWN else f"{found[:_SHOWN]} ..."
        wanted = wanted if len(wanted) <= _LONGEST else f"{wanted[:_LONGEST]} ..."  # it may name what the file names
        where = f"{self.path}: " + ("" if line is None else f"line {line}: ")
        return BadInput(f"{where}wanted {wanted}" + (f", not '{found}'" if got is not None else ""))

    def whole(self, word: str, line: int, what: str, least: int, most: int) -> int:
        """A whole number from `least` to `most`; BadInput, with `what` it is, for anything else."""
        if _WHOLE.fullmatch(word) and least <= int(word) <= most:
            return int(word)
        raise self.refusal(line, f"{what}, a whole number from {least} to {most}", word)

    def time(self, word: str, line: int, what: str) -> float:
        """A time from 0 on; BadInput, with `what` it is, for anything else."""
        if _TIME.fullmatch(word) and float(word) <= MOST_TIME:
            return float(word)
        raise self.refusal(line, f"{what}, a number from 0 to {MOST_TIME:g}", word)

    def shape(self, row: tuple[int, list[str]]) -> tuple[int, int]:
        """How many jobs and machines the first two numbers of a row announce, looked at before anything is made for them."""
        line, words = row
        if len(words) < 2:
            raise self.refusal(line, "how many jobs and how many machines", " ".join(words))
        jobs = self.whole(words[0], line, "how many jobs", 1, MAX_PARTS)
        return jobs, self.whole(words[1], line, "how many machines", 1, MOST_MACHINES)


def json_line(text: str, way: Sequence[str | int]) -> int:
    """The line of a value of a JSON text; of what has none, of what is around it. JSON is YAML, which knows its lines."""
    import yaml  # here, for it takes its time, and only a refusal needs it

    try:
        node = yaml.compose(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.YAMLError:  # a tab, which YAML does not take for a space
        return 1
    for step in way:
        if isinstance(step, int) and isinstance(node, yaml.SequenceNode) and step < len(node.value):
            node = node.value[step]
        elif isinstance(node, yaml.MappingNode):
            node = next((value for name, value in node.value if name.value == step), node)
    return int(node.start_mark.line) + 1 if node is not None else 1
