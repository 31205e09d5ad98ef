"""Damaged files of one kind, read in a process of its own: `python -m devtools.read_damaged ROOM KIND SEED FIRST COUNT TOLD`.

A line of JSON about each file that breaks the lab, and at the end one about all of them, is added to the file TOLD; a line with
the number alone says which file is being read, so that who waits knows it when this process dies.
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
MOST_S = 5.0  # CPU time of a file
HANGS_S = 120.0  # wall time of a file, after which this process ends
MOST_MB = 1000.0
ADDRESSES = 6 << 30  # bytes of memory that this process may ask for


class TooLong(BaseException):
    """A file took more than twice what it may."""


@dataclass
class Told:
    """What came of a batch: files tried, read and refused, the longest and the most memory, what broke."""

    tries: int = 0
    read: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    most_mb: float = 0.0
    broke: list[dict[str, str]] = field(default_factory=list)


def sound_files(folder: Path, room: Path, kind: Kind) -> list[Path]:
    """The kind's sound files in a folder of their own, those that are to be damaged."""
    folder.mkdir(parents=True, exist_ok=True)
    kind.made(folder, room)
    files = sorted(path for path in folder.glob(kind.which) if path.is_file())
    assert files, f"no file {kind.which}"
    return files


def verdict(kind: Kind, path: Path) -> tuple[str, str]:
    """ "read" or "refused" and what was said; or "" and what is wrong with how the lab took the file."""
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
    """The last line of the lab's own code that an exception came through."""
    from lab.files import PACKAGE

    frames = [(Path(frame.filename), frame.lineno) for frame in traceback.extract_tb(sys.exc_info()[2])]
    own = [(path.relative_to(PACKAGE), line) for path, line in frames if path.is_relative_to(PACKAGE)]
    return "{}:{}".format(*own[-1]) if own else "outside the lab"


def batch(room: Path, name: str, seed: int, numbers: range, say: Any, folder: Path) -> Told:
    """Damages and reads so many files; `say` is called with the number before each."""
    kind, told = KINDS[name], Told()
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
        peak_begins()
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


def peak_begins() -> None:
    """The process's peak of memory counts from here."""
    Path("/proc/self/clear_refs").write_text("5")


def peak_mb() -> float:
    """The process's peak of memory since then."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith("VmHWM"))) / 1000


def main(room: str, name: str, seed: str, first: str, count: str, told: str) -> None:
    """A batch, told line by line."""
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
