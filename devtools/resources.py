"""Part `resources`: commands that write, while something is missing: room, rights, a home, descriptors, memory, a reader.

A command exits with 0 if all was done, else with 1 or 2 and one clear line, with 2 only if nothing was written. No earlier
file is lost, all that the command says it kept is there, and once nothing is missing, repeating it gives the full result.
"""

import errno
import json
import os
import random
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Timer

from devtools.commands import LAB, Ended, lab
from devtools.forked import forked
from devtools.kills import ALONE, expected_result
from devtools.parts import Outcome, Part
from devtools.shim import KINDS, Strike, built_shim, shim_environment
from devtools.works import (
    LONGEST_S,
    WORKS,
    CarriedOut,
    Undisturbed,
    age,
    base,
    by_itself,
    environment_in,
    first_fault,
    first_leftover,
    first_loss,
    first_missing,
    fresh_home,
    home_state,
    kept_before,
    names,
    next_words,
)
from lab.toolbox.registry import Toolbox

COUNT = 400
NEEDS_ROOM = "owm"  # the kinds of calls that a full disk refuses
BARE = ("setpriv", "--bounding-set=-all", "--inh-caps=-all", "--ambient-caps=-all") if os.getuid() == 0 else ()
MB = 1 << 20
LATE = 12
_SESSION_OF = {"teach": "toolbox/sessions/*", "teach --out": "lesson"}
Before = Callable[[], None]
Make = Callable[["Case"], None]


@dataclass
class Case:
    """A command and what it lacks, which a function of FAULTS fills in.

    said: the fault in words; before: runs in the child; read_only: folders under the home; room_kb: the room on the home's own
    disk; loses: a folder that is removed after so many seconds; was_whole: the session had been written by then; unheard:
    nobody may see its output; must_do: it must succeed all the same.
    """

    name: str
    home: Path
    expected: Undisturbed
    chance: random.Random
    said: str = ""
    env: dict[str, str] | None = None
    strike: Strike | None = None
    before: Before | None = None
    read_only: tuple[str, ...] = ()
    room_kb: int = 0
    loses: tuple[str, float] = ("", 0.0)
    was_whole: bool = False
    unheard: bool = False
    must_do: bool = False


# ---- faults


def disk_full(case: Case) -> None:
    """The disk is full from a random call on."""
    _refused(case, NEEDS_ROOM, errno.ENOSPC, always=True)


def disk_full_once(case: Case) -> None:
    """The disk is full at one call, and has room again at the next."""
    _refused(case, NEEDS_ROOM + "s", errno.ENOSPC, always=False)


def disk_breaks(case: Case) -> None:
    """A call of any kind ends with an input/output error, once or from then on."""
    kinds = [letter for letter, many in case.expected.calls.items() if many]
    _refused(case, case.chance.choice(kinds), errno.EIO, always=case.chance.random() < 0.5)


def _refused(case: Case, kinds: str, number: int, always: bool) -> None:
    many = max(1, sum(case.expected.calls[kind] for kind in kinds))
    late = case.chance.random() < 0.5
    at = case.chance.randint(max(1, many - LATE) if late else 1, many)
    case.strike = Strike(kinds, at, str(number), always)
    case.said = f"{errno.errorcode[number]} at call {at} of {', '.join(n for n, k in KINDS.items() if k in kinds)}" + (
        " and then always" if always else ""
    )


def small_disk(case: Case) -> None:
    """The home is on a disk of its own that is nearly full."""
    case.room_kb = case.chance.choice((1, 4, 8, 16, 32, 64, 128, 256))
    case.said = f"a disk with {case.room_kb} KB of room"


def read_only(case: Case) -> None:
    """Some folders are read-only."""
    case.read_only = case.chance.choice(
        (
            ("toolbox",),
            (".",),
            ("toolbox", "."),
            ("toolbox/versions",),
            ("toolbox/log",),
            ("toolbox/sessions",),
        )
    )
    case.said = f"read-only: {', '.join(case.read_only)}"


def nothing_writable(case: Case) -> None:
    """All folders are read-only, for a command that need not write."""
    folders = (path for path in case.home.rglob("*") if path.is_dir())
    case.read_only = (".", *(path.relative_to(case.home).as_posix() for path in folders))
    case.said, case.must_do = "all folders read-only", True


def no_home(case: Case) -> None:
    """HOME is not set, does not exist, is no folder, or is read-only."""
    home = case.chance.choice(("", "/nonexistent", "/dev/null", "/proc"))
    case.env = {"HOME": home}
    case.said = f"HOME={home}" if home else "no HOME"


def few_descriptors(case: Case) -> None:
    """The number of open files is limited."""
    many = case.chance.choice((64, 64, 32, 16))
    case.before, case.said = _limited(resource.RLIMIT_NOFILE, many), f"{many} descriptors"


def little_memory(case: Case) -> None:
    """The address space or the data segment is limited."""
    kind, name = case.chance.choice(((resource.RLIMIT_AS, "address space"), (resource.RLIMIT_DATA, "data")))
    size = case.chance.choice((256, 512, 512, 1024, 2048))
    case.before, case.said = _limited(kind, size * MB), f"{size} MB of {name}"


def short_files(case: Case) -> None:
    """The size of files is limited."""
    size = case.chance.choice((4096, 16384, 65536))
    case.before, case.said = _limited(resource.RLIMIT_FSIZE, size), f"files up to {size} bytes"


def nobody_reads(case: Case) -> None:
    """Stdout, stderr or stdin is closed, full, or read by nobody."""
    what: dict[str, Before] = {
        "stdout closed": lambda: os.close(1),
        "stderr closed": lambda: os.close(2),
        "stdin closed": lambda: os.close(0),
        "all three closed": lambda: os.closerange(0, 3),
        "stdout full": lambda: _to(1, "/dev/full"),
        "stderr full": lambda: _to(2, "/dev/full"),
        "stdout's reader gone": lambda: _to_nobody(1),
        "stderr's reader gone": lambda: _to_nobody(2),
    }
    case.said = case.chance.choice([*what])
    case.before, case.unheard = what[case.said], True


def out_removed(case: Case) -> None:
    """The folder that keeps the session is removed while the command runs."""
    folder, work = "lesson", WORKS[case.name]
    if "--out" not in work.words:
        folder = "toolbox" if case.chance.random() < 0.3 else "toolbox/sessions"
    after_s = case.expected.seconds * case.chance.uniform(0.3, 1.0)
    case.loses, case.said = (folder, after_s), f"{folder} removed after {after_s:.2f} s"


def _limited(kind: int, value: int) -> Before:
    return lambda: resource.setrlimit(kind, (value, value))


def _to(number: int, path: str) -> None:
    os.dup2(os.open(path, os.O_WRONLY), number)


def _to_nobody(number: int) -> None:
    reading, writing = os.pipe()
    os.dup2(writing, number)
    os.close(reading)
    os.close(writing)


FAULTS: dict[
    str, tuple[Make, int, tuple[str, ...]]
] = {  # what is missing, how many of 42 attempts, which commands (all: ())
    "disk full": (disk_full, 9, ()),
    "disk full once": (disk_full_once, 4, ()),
    "disk breaks": (disk_breaks, 7, ()),
    "a small disk": (small_disk, 4, ()),
    "read-only folders": (read_only, 4, ()),
    "read-only, nothing to write": (nothing_writable, 2, tuple(name for name, work in WORKS.items() if not work.share)),
    "no HOME": (no_home, 2, ()),
    "few descriptors": (few_descriptors, 2, ()),
    "little memory": (little_memory, 2, ()),
    "short files": (short_files, 1, ()),
    "nobody reads": (nobody_reads, 3, ()),
    "folder removed": (out_removed, 2, ("teach", "teach --out")),
}


# ---- an attempt


def prepare(room: Path, seed: int) -> None:
    """Build the shim, and the home that every command begins in."""
    built_shim(room)
    base(room)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Run one command that lacks something, and judge it."""
    chance = random.Random(f"{seed} {number}")
    kinds = [kind for kind, (_, share, _) in FAULTS.items() for _ in range(share)]
    random.Random(seed).shuffle(kinds)
    kind = kinds[number % len(kinds)]
    make, _, works = FAULTS[kind]
    name = chance.choice(works or [*names()])
    case = Case(name, room / f"resource-{number}" / "home", expected_result(name, room), chance)
    fresh_home(case.home.parent, room, WORKS[name])
    make(case)
    told = f"{number}, seed {seed}: {name}: {case.said}"
    if case.room_kb and not BARE:
        return Outcome(kind, f"{told}: only root can make one", tries=0)
    quickly = by_itself if "study" in name else forked(built_shim(room), room)
    with _disk(case, room):
        ended = carried_out(case, room, quickly if case.strike is not None and number % ALONE else None)
        broke = fault_of(case, ended, room, quickly)
    if not broke:
        shutil.rmtree(case.home.parent)
    return Outcome(kind, told, broke, figures={"seconds": ended.seconds})


@contextmanager
def _disk(case: Case, room: Path) -> Iterator[None]:
    """Keep the command's home on a small disk of its own if the case asks for one."""
    if not case.room_kb:
        yield
        return
    aside = case.home.rename(case.home.with_name("aside"))
    case.home.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1g", "tmpfs", case.home], check=True)
    try:
        shutil.copytree(aside, case.home, symlinks=True, dirs_exist_ok=True)
        used = shutil.disk_usage(case.home).used
        _resize(case.home, used + 1024 * case.room_kb)
        yield
    finally:
        subprocess.run(["umount", "-l", case.home], check=True)


def _resize(home: Path, size: int) -> None:
    subprocess.run(["mount", "-o", f"remount,size={size}", home], check=True)


def carried_out(case: Case, room: Path, quickly: CarriedOut | None) -> Ended:
    """Run the command with what it lacks, and return how it ended; afterwards nothing is missing any more."""
    said = environment_in(case.home, room) | (case.env or {})
    if case.env is not None:
        said = {name: value for name, value in said.items() if value and name not in ("MPLCONFIGDIR", "XDG_CACHE_HOME")}
    if case.strike is not None:
        said |= shim_environment(built_shim(room), case.home, case.home.parent / "counts", case.strike)
    if quickly is not None:
        return quickly(WORKS[case.name].words, case.home, said, LONGEST_S)
    folder, after_s = case.loses
    timer = Timer(after_s, _lose, (case, _receipts(case)))
    for name in case.read_only:
        (case.home / name).chmod(0o555)
    if folder:
        timer.start()
    bare = BARE if case.read_only else ()
    try:
        return lab(
            *WORKS[case.name].words,
            cwd=case.home,
            env=said,
            timeout_s=LONGEST_S,
            before=case.before,
            command=(*bare, *LAB),
        )
    finally:
        if folder:
            timer.join()
        for name in case.read_only:
            (case.home / name).chmod(0o755)
        if case.room_kb:
            _resize(case.home, 1 << 30)


def _lose(case: Case, receipts: int) -> None:
    """Remove the case's folder; receipts: the number of sessions with a receipt before the command."""
    case.was_whole = _receipts(case) > receipts
    shutil.rmtree(case.home / case.loses[0], ignore_errors=True)


def _receipts(case: Case) -> int:
    return len([*case.home.glob(f"{_SESSION_OF[case.name]}/receipt.json")])


def fault_of(case: Case, ended: Ended, room: Path, carried_out: CarriedOut = by_itself) -> str:
    """What is wrong with how a command ended, what it left, or what it does once nothing is missing; "" if nothing is."""
    wrong = ended.fault((0, 1, 2)) or _noise(ended)
    if case.unheard and not ended.late and ended.code in (0, 1, 2) and "Traceback" not in ended.stderr:
        wrong = _noise(ended)  # its error message may be lost
    if case.must_do and ended.code != case.expected.code:
        wrong = f"exit {ended.code}: {ended.stderr[-200:]}"
    if wrong:
        return wrong
    changes = (*WORKS[case.name].changes, *((f"{case.loses[0]}/*",) if case.loses[0] else ()))
    if wrong := first_loss(kept_before(room), case.home, changes) or first_fault(case.home):
        return f"exit {ended.code}: {wrong}"
    if case.loses[0] and ended.code == 0 and not case.was_whole and not _receipts(case):
        return "exit 0 without its session"
    if (
        ended.code == 0
        and not case.unheard
        and not case.loses[0]
        and (wrong := first_missing(case.expected, case.home))
    ):
        return f"exit 0: {wrong}"
    if ended.code == 2 and (more := _kept(home_state(case.home)) - _kept(home_state(base(room)))):
        return f"exit 2, but it has kept {min(more)}: {ended.stderr[-160:]}"
    if not case.loses[0] and (wrong := _said_kept(ended, case.home)):
        return f"exit {ended.code}: {wrong}"
    if case.loses[0]:
        return "" if case.loses[0] == "lesson" else _goes_on(case, room, carried_out, same=False)
    return _goes_on(case, room, carried_out, same=True)


def _kept(there: dict[str, str]) -> set[str]:
    return {what for what in there if not what.startswith("session's")}


def _noise(ended: Ended) -> str:
    """What Python itself printed to stderr, such as a warning; "" if nothing."""
    for words in ("Exception ignored", "Error in sys", "Fatal Python error", "Warning:", "lost sys.stderr"):
        if words in ended.stderr:
            return f"stderr says {ended.stderr[ended.stderr.index(words) :][:200]!r}"
    return ""


def _said_kept(ended: Ended, home: Path) -> str:
    """What is missing of all that a lesson's document says was kept; "" if nothing is."""
    try:
        document = json.loads(ended.stdout or "{}")
    except ValueError:
        return f"stdout is no JSON document: {ended.stdout[:80]!r}"
    kept = {row["name"] for row in Toolbox(home / "toolbox").list()}
    name, files = document.get("saved_as"), document.get("files")
    files = files if isinstance(files, dict) else {}
    if name and name not in kept:
        return f"it says that it kept the policy '{name}', which is not there"
    gone = [file for file in (files).values() if isinstance(file, str) and not (home / file).exists()]
    return f"it names the file {gone[0]}, which is not there" if gone else ""


def _goes_on(case: Case, room: Path, carried_out: CarriedOut, same: bool) -> str:
    """What is wrong with the next command once nothing is missing; same: its result must be the undisturbed one."""
    age(case.home)
    words = next_words(case.name, case.expected, case.home)
    then = carried_out(words, case.home, environment_in(case.home, room), LONGEST_S)
    said = f"then lab {' '.join(words)}"
    if fault := then.fault((0, case.expected.code)):
        return f"{said}: {fault}"
    is_over = words[:2] == ("toolbox", "verify") and WORKS[case.name].session
    wrong = first_fault(case.home) or first_leftover(case.home)
    if same and not wrong and not is_over:
        wrong = first_missing(case.expected, case.home)
    return f"{said}: {wrong}" if wrong else ""


PART = Part(
    "commands where room, rights, a home, descriptors, memory or a reader is missing",
    "one clear line, right exit code, nothing lost",
    COUNT,
    prepare,
    attempt,
)
