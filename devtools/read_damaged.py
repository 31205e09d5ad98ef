"""Reads damaged files of one kind in a process of its own: `python -m devtools.read_damaged ROOM KIND SEED FIRST COUNT TOLD`.

Before each file its number is added as a line to the file TOLD, so that the waiting process knows it if this one dies. The
last line is a JSON document of the whole batch, with every file that broke the lab.
"""

import faulthandler
import json
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from devtools.mutate import mutated
from devtools.read_files import KINDS, Kind

LINE_CHARACTERS = 300
MOST_S = 5.0  # the most CPU time for a file
HANGS_S = 120.0  # the wall time for a file after which this process ends
MOST_MB = 1000.0
ADDRESSES = 6 << 30  # the limit of this process's address space [bytes]


class TooLong(BaseException):
    """Raised when a file takes twice the CPU time that it may."""


@dataclass
class BatchResults:
    """The results of a batch: files tried, read and rejected, the longest time, the most memory, and the faults."""

    tries: int = 0
    read: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    most_mb: float = 0.0
    broke: list[dict[str, str]] = field(default_factory=list)


def sound_files(folder: Path, room: Path, kind: Kind) -> list[Path]:
    """The sound files of a kind that are to be damaged, in order; all its sound files are written to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    kind.made(folder, room)
    files = sorted(path for path in folder.glob(kind.which) if path.is_file())
    assert files, f"no file {kind.which}"
    return files


def verdict(kind: Kind, path: Path) -> tuple[str, str]:
    """ "read" or "refused" with the lab's error; or "" and what is wrong with how the lab handled the file."""
    from lab.errors import LabError

    try:
        kind.read(path)
    except LabError as error:
        said = f"lab: {error}"
        if len(said) > LINE_CHARACTERS or not said.isprintable():
            return "", f"a line of {len(said)} characters: {said[:80]!r}"
        return "refused", said
    except TooLong:
        return "", f"over {2 * MOST_S:g} s: {_where()}"
    except KeyboardInterrupt:
        return "", "KeyboardInterrupt"
    except BaseException as error:
        return "", f"{type(error).__name__}: {' '.join(str(error).split())[:120]} ({_where()})"
    return "read", ""


def _where() -> str:
    """The last line of the lab's own code that the current exception has passed, as file:line."""
    from lab.files import PACKAGE

    frames = [(Path(frame.filename), frame.lineno) for frame in traceback.extract_tb(sys.exc_info()[2])]
    own = [(path.relative_to(PACKAGE), line) for path, line in frames if path.is_relative_to(PACKAGE)]
    return "{}:{}".format(*own[-1]) if own else "outside the lab"


def batch(room: Path, name: str, seed: int, numbers: range, say: Any, folder: Path) -> BatchResults:
    """Damage and read the files of these numbers, and return the results; `say` is called with each number first."""
    kind, told = KINDS[name], BatchResults()
    paths = sound_files(folder, room, kind)
    contents = [path.read_bytes() for path in paths]
    for path in paths[:40]:
        result, why = verdict(kind, path)
        assert result == "read", f"{name}: the sound file {path.name} is not read: {why}"
    previous = signal.signal(signal.SIGPROF, _too_long)
    for number in numbers:
        chance = Random(f"{seed} {name} {number}")
        which = chance.randrange(len(paths))
        content, how = mutated(contents[which], kind.content, chance)
        paths[which].write_bytes(content)
        say(number)
        reset_peak()
        before_mb = peak_mb()
        begun = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, 2 * MOST_S)
        result, why = verdict(kind, paths[which])
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        took_s, mb = time.process_time() - begun, peak_mb()
        told.tries += 1
        told.read += result == "read"
        told.refused += result == "refused"
        told.slowest_s, told.most_mb = max(told.slowest_s, took_s), max(told.most_mb, mb)
        if result and took_s > MOST_S:
            result, why = "", f"{took_s:.1f} s: {result} {why}"
        if result and mb - before_mb > MOST_MB:
            result, why = "", f"{mb - before_mb:.0f} MB: {result} {why}"
        if not result:
            told.broke.append({"case": f"{name} {number} ({how}) of {paths[which].name}", "why": why})
            kept = room / "broke" / f"{name.replace(' ', '-')}-{number}-{paths[which].name}"
            kept.parent.mkdir(exist_ok=True)
            kept.write_bytes(content)
        paths[which].parent.mkdir(parents=True, exist_ok=True)
        paths[which].write_bytes(contents[which])
    signal.signal(signal.SIGPROF, previous)
    return told


def _too_long(number: int, frame: object) -> None:
    raise TooLong


def reset_peak() -> None:
    """Reset the process's peak of memory."""
    Path("/proc/self/clear_refs").write_text("5")


def peak_mb() -> float:
    """The process's peak of memory [MB] since `reset_peak`."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith("VmHWM"))) / 1000


def main(room: str, name: str, seed: str, first: str, count: str, told: str) -> None:
    """Read a batch, and write its lines to the file TOLD."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    folder = Path(tempfile.mkdtemp(prefix="damaged-", dir=room))
    with Path(told).open("a", encoding="utf-8", buffering=1) as lines:

        def say(number: int) -> None:
            lines.write(f"{number}\n")
            faulthandler.dump_traceback_later(HANGS_S, exit=True)

        try:
            told_at_last = batch(Path(room), name, int(seed), range(int(first), int(first) + int(count)), say, folder)
            lines.write(json.dumps(asdict(told_at_last)) + "\n")
        finally:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
