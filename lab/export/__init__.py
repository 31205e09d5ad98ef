"""Export of a run for a real robot: job files and trajectories, which are read back and played in physics as a check."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lab.export import jbi, trajectory_csv, trajectory_json, urscript
from lab.export.commands import Command
from lab.export.program import Options, Program
from lab.export.timed import TimedPoints
from lab.sim.arms.arm import Arm

__all__ = ["FORMATS", "Format"]


def _nothing(program: Program) -> list[str]:
    return []


@dataclass(frozen=True)
class Format:
    """A file format: how a program is written to files (texts by name), and read back to something that can be played.

    warnings: what a person must know before such a program runs on a robot.
    """

    help: str
    write: Callable[[Program, Options], dict[str, str]]
    read: Callable[[Mapping[str, str], Arm], list[Command] | TimedPoints]
    warnings: Callable[[Program], list[str]] = _nothing


FORMATS = {
    "jbi": Format(
        "INFORM II job files, a transfer each and a master that calls them", jbi.write, jbi.read, jbi.warnings
    ),
    "csv": Format("a table of points in time", trajectory_csv.write, trajectory_csv.read),
    "json": Format("points in time as one document", trajectory_json.write, trajectory_json.read),
    "urscript": Format("one URScript program", urscript.write, urscript.read, urscript.warnings),
}
