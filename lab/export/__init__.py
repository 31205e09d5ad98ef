"""Export of a run: job files and trajectories for a real robot, played in physics as a check, and datasets for learning."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from lab.export import jbi, lerobot, trajectory_csv, trajectory_json, urscript
from lab.export.commands import Command
from lab.export.lerobot import DatasetCheck, RunRecord
from lab.export.program import Options, Program
from lab.export.timed import TimedPoints
from lab.sim.arms.arm import Arm

__all__ = ["FORMATS", "DatasetFormat", "Format", "program_formats"]


def _nothing(program: Program) -> list[str]:
    return []


@dataclass(frozen=True)
class Format:
    """A format of programs: how one is written to files (texts by name), and read back to something that can be played.

    warnings: what a person must know before such a program runs on a robot.
    """

    help: str
    write: Callable[[Program, Options], dict[str, str]]
    read: Callable[[Mapping[str, str], Arm], list[Command] | TimedPoints]
    warnings: Callable[[Program], list[str]] = _nothing


@dataclass(frozen=True)
class DatasetFormat:
    """A format of datasets, from which policies are learned: how a run is written to a new folder, and compared with it."""

    help: str
    write: Callable[[Program, Options, RunRecord, Path], None]
    check: Callable[[Program, Options, RunRecord, Path], DatasetCheck]


FORMATS: dict[str, Format | DatasetFormat] = {
    "jbi": Format(
        "INFORM II job files, a transfer each and a master that calls them", jbi.write, jbi.read, jbi.warnings
    ),
    "csv": Format("a table of points in time", trajectory_csv.write, trajectory_csv.read),
    "json": Format("points in time as one document", trajectory_json.write, trajectory_json.read),
    "lerobot": DatasetFormat(
        "a LeRobot dataset with camera pictures, an episode a transfer", lerobot.write, lerobot.check
    ),
    "urscript": Format("one URScript program", urscript.write, urscript.read, urscript.warnings),
}


def program_formats() -> dict[str, Format]:
    """The formats of programs alone, by name."""
    return {name: form for name, form in FORMATS.items() if isinstance(form, Format)}
