"""Commands of the lab that write, the home that they begin from, and their results when nothing disturbs them."""

import fnmatch
import json
import os
import re
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from devtools.commands import Ended, environment, lab
from devtools.shim import Strike, built_shim, shim_counts, shim_environment
from lab.advice.entries import read_journal
from lab.errors import BadInput
from lab.production.run_journal import RunEnded, read_run
from lab.toolbox.archive import pack
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode
from lab.toolbox.registry import Toolbox

STOPPED = "toolbox/sessions/world-1-1"  # the killed session in the base
AGED_S = 3600  # the age of all files when a command begins
REPAIR = ("toolbox", "verify", "--repair")
LONGEST_S = 300.0
_LEFT = (".*.tmp", ".run-*")
_OF_TIME = {"wall_s", "seconds", "session_s"}
Files = dict[str, bytes]


@dataclass(frozen=True)
class Work:
    """A command.

    share: how many of a thousand kills it gets; changes: patterns of files in the base that it may change; session: the command
    that resumes its session, "teach" or "run"; left: files that other commands have left before it.
    """

    words: tuple[str, ...]
    share: int
    changes: tuple[str, ...] = ()
    session: str = ""
    left: tuple[str, ...] = ()


_TEACH = ("teach", "world-1", "--advisor", "expert", "--episodes", "120", "--json")
_COMPARE = ("study", "compare", "world-1", "--gate", "ccrl", "--advisor", "expert", "--sessions", "10", "--json")
_TABLE = ("study", "run", "table-7.4", "--sessions", "10", "--json", "--workers")
_BOX = ("bakery", "--part", "box:0.12x0.015x0.12:2", "--machine", "oven:60", "--json")
_MACHINE = ("toolbox/doubled*", "toolbox/trash/*")
_DRAFTS = ("toolbox/.doubled.safetensors.0123abcd.tmp", "toolbox/versions/doubled/.x.safetensors.0123abcd.tmp")
WORKS: dict[str, Work] = {
    "teach": Work(_TEACH, 110, session="teach"),
    "teach --out": Work((*_TEACH, "--out", "lesson"), 90, session="teach"),
    "teach --resume": Work(("teach", "--resume", STOPPED, "--json"), 90, (f"{STOPPED}/*",), session="teach"),
    "run": Work(("run", "toast", "--toasts", "1", "--json"), 12, session="run"),
    "study compare": Work(_COMPARE, 24),
    "study run": Work((*_TABLE, "1"), 4),
    "study run, 2 workers": Work((*_TABLE, "2"), 4),
    "sequence": Work(("sequence", "toast-case-1", "--toasts", "2", "--gantt", "order.svg", "--json"), 30),
    "task random": Work(("task", "random", "8x8x8", "--out", "world.toml", "--json"), 40),
    "new": Work(("new", *_BOX), 30),
    "toolbox remove": Work(("toolbox", "remove", "doubled", "--json"), 80, _MACHINE),
    "toolbox restore": Work(("toolbox", "restore", "gone", "--json"), 70, ("toolbox/trash/gone*",)),
    "toolbox promote": Work(("toolbox", "promote", "doubled", "1", "--json"), 84, _MACHINE),
    "toolbox rollback": Work(("toolbox", "rollback", "doubled", "--json"), 82, _MACHINE),
    "toolbox import": Work(("toolbox", "import", "others.zip", "--replace", "--json"), 140, _MACHINE),
    "toolbox export": Work(("toolbox", "export", "--out", "mine.zip", "--json"), 50),
    "toolbox verify --repair": Work((*REPAIR, "--json"), 60, left=_DRAFTS),
    "toolbox list": Work(("toolbox", "list", "--json"), 0),
    "toolbox show": Work(("toolbox", "show", "doubled", "--json"), 0),
    "toolbox verify": Work(("toolbox", "verify", "--json"), 0),
    "replay": Work(("replay", STOPPED, "--json"), 0),
    "replay, all": Work(("replay", "--json"), 0),
    "sequence, no picture": Work(("sequence", "toast-case-1", "--toasts", "2", "--json"), 0),
}


@dataclass(frozen=True)
class Undisturbed:
    """The result of an undisturbed command: its exit code, the `home_state` of its home, its calls by kind, and its time [s]."""

    code: int
    state: dict[str, str]
    calls: dict[str, int]
    seconds: float


# ---- the home that commands begin from


def base(room: Path) -> Path:
    """The home that every command begins in: policies with versions, a removed one, an archive and a killed session."""
    home = room / "base"
    if home.exists():
        return home
    half = room / "base-half"
    shutil.rmtree(half, ignore_errors=True)
    half.mkdir()
    box = Toolbox(half / "toolbox")
    for name, value in (("bystander", 1.0), ("doubled", 2.0), ("doubled", 3.0), ("gone", 4.0)):
        box.save(policy(name, value))
    box.remove("gone")
    box.save_record("durations", "kept", {"seconds": 12.5})
    (half / "others.zip").write_bytes(pack([policy("doubled", 5.0), policy("other", 6.0), policy("third", 7.0)])[0])
    ended = disturbed(half, _TEACH, built_shim(room), Strike("w", 300, "after"), room)
    assert ended.code < 0, ended.stderr
    assert not read_journal(half / STOPPED, "the base").closed
    age(half)
    half.rename(home)
    return home


def policy(name: str, value: float) -> Policy:
    """A small policy of a solved problem."""
    q = np.full((4, 2), value)
    return Policy(
        name, "world", "drawn", q, np.ones((4, 2), np.int64), ("left", "right"), (4,), 0, "0123456789abcdef", {"learner": "q"},
        {"gate": "ccrl"}, "expert", 0, [3, 3], [False, False], 0, 0, 3, 3, True, f"2026-01-01T00:00:{int(value):02}+00:00", {},
        np.array([0, 0, 0, 1], np.uint8),
    )  # fmt: skip


def own_folder(room: Path, name: str) -> Path:
    """A new empty folder for this worker alone, as several may measure the same command at the same time."""
    return Path(mkdtemp(prefix=f"{name}-", dir=room))


def fresh_home(folder: Path, room: Path, work: Work) -> Path:
    """The home in a folder that is made anew for a command, a copy of the base."""
    home = folder / "home"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(base(room), home, symlinks=True)
    for left in work.left:
        (home / left).write_bytes(b"half")
    age(home)
    return home


def by_itself(words: tuple[str, ...], home: Path, env: Mapping[str, str], timeout_s: float) -> Ended:
    """The end of a command in a process of its own."""
    return lab(*words, cwd=home, env=env, timeout_s=timeout_s)


CarriedOut = Callable[[tuple[str, ...], Path, Mapping[str, str], float], Ended]


def disturbed(
    home: Path,
    words: tuple[str, ...],
    library: Path,
    strike: Strike | None,
    caches: Path,
    timeout_s: float = LONGEST_S,
    carried_out: CarriedOut = by_itself,
) -> Ended:
    """The end of a command in a home, under the shim, which counts calls in a file beside the home."""
    said = shim_environment(library, home, home.parent / f"{home.name}-counts", strike)
    return carried_out(words, home, environment_in(home, caches) | said, timeout_s)


def environment_in(home: Path, caches: Path) -> dict[str, str]:
    """The environment of a command in a home; caches, such as compiled code, are kept in `caches`."""
    return environment(home, MPLCONFIGDIR=str(caches / "matplotlib"), XDG_CACHE_HOME=str(caches / "cache"))


def age(home: Path) -> None:
    """Make everything in a home look an hour old."""
    then = time.time() - AGED_S
    for path in (home, *home.rglob("*")):
        os.utime(path, (then, then), follow_symlinks=False)


# ---- results


def undisturbed_result(name: str, room: Path) -> Undisturbed:
    """The result of an undisturbed command, measured once; its state has what two runs have in common."""
    file = room / f"{re.sub('[^a-z0-9]+', '-', name)}.json"
    if not file.exists():
        states, code, calls, took_s = list[dict[str, str]](), 0, dict[str, int](), 0.0
        for turn in ("to compile what it needs", "first", "second"):
            home = fresh_home(own_folder(room, f"{file.stem}-{turn.split()[0]}"), room, WORKS[name])
            ended = disturbed(home, WORKS[name].words, built_shim(room), None, room)
            assert not ended.fault((0, 1)), f"{name}: {ended.fault((0, 1))}"
            code, calls, took_s = ended.code, shim_counts(home.parent / "home-counts"), ended.seconds
            states.append(home_state(home))
            shutil.rmtree(home.parent)
        _, *states = states
        common = {what: value for what, value in states[0].items() if states[1].get(what) == value}
        half = own_folder(room, file.stem) / file.name
        half.write_text(json.dumps(asdict(Undisturbed(code, common, calls, took_s)), indent=1))
        half.replace(file)  # another worker that has measured the same command may read it
        half.parent.rmdir()
    return Undisturbed(**json.loads(file.read_text()))


def home_state(home: Path) -> dict[str, str]:
    """The number of each file in a home, by a name that depends neither on the home nor on the time."""
    counts: Counter[str] = Counter()
    for path in sorted(home.rglob("*")):
        inside = path.relative_to(home).as_posix()
        if (
            path.is_dir()
            or inside.startswith(("toolbox/log/", "cache/", "matplotlib/", ".cache/", ".config/"))
            or path.is_symlink()
        ):
            continue
        content = path.read_bytes().replace(os.fsencode(home), b"HOME")
        if path.suffix == ".safetensors":
            folder = inside.rpartition("/")[0]
            try:
                held = decode(path.read_bytes(), inside)
                counts[f"{folder}: policy {held.name}: {_fingerprint(held)}"] += 1
            except BadInput:
                counts[f"{inside}: damaged"] += 1
        elif inside.startswith("toolbox/sessions/") or path.name == "events.jsonl":
            counts[f"session's {path.name}: {_digest(content)}"] += 1
        else:
            content = _timeless(content) if path.suffix == ".json" else content
            counts[f"{inside}: {_digest(content)}"] += 1
    return {what: str(many) for what, many in counts.items()}


def _fingerprint(held: Policy) -> str:
    """A hash of a policy without its time of creation."""
    facts = asdict(replace(held, created="", parent=held.parent.rpartition("@")[0]))
    tables = b"".join(np.ascontiguousarray(facts.pop(name)).tobytes() for name in ("q", "visits", "ends"))
    return _digest(tables + json.dumps(facts, sort_keys=True).encode())


def _timeless(content: bytes) -> bytes:
    def without(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: without(inner) for name, inner in value.items() if name not in _OF_TIME}
        return [without(inner) for inner in value] if isinstance(value, list) else value

    try:
        return json.dumps(without(json.loads(content))).encode()
    except ValueError:
        return content


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()[:16]


def first_missing(expected: Undisturbed, home: Path) -> str:
    """What an undisturbed command leaves and is missing in a home; "" if nothing is."""
    there = home_state(home)
    missing = [what for what in expected.state if what not in there]
    return f"not as undisturbed: {len(missing)} missing: {missing[0]}" if missing else ""


def next_words(name: str, expected: Undisturbed, home: Path) -> tuple[str, ...]:
    """The command that a person types after a kill: a repair if all was done, --resume, or the same again."""
    work = WORKS[name]
    if not first_missing(expected, home):
        return REPAIR
    if work.session == "run":
        try:
            _, entries, _ = read_run(home / "toast-run", "--resume")
            return (
                REPAIR if isinstance(entries[-1] if entries else None, RunEnded) else ("run", "--resume", "toast-run")
            )
        except BadInput:
            return work.words
    for folder in _sessions(work, home) if work.session == "teach" else ():
        with suppress(BadInput):
            over = read_journal(folder, "--resume").closed is not None
            return REPAIR if over else ("teach", "--resume", str(folder.relative_to(home)), "--json")
    return work.words


def _sessions(work: Work, home: Path) -> list[Path]:
    """The folders in which the session of a `lab teach` can be."""
    if "--out" in work.words:
        return [home / "lesson"]
    if "--resume" in work.words:
        return [home / STOPPED]
    return sorted(set(home.glob("toolbox/sessions/*")) - {home / STOPPED})


# ---- losses


def kept_before(room: Path) -> Files:
    """The files of the base, by name."""
    home = base(room)
    return {path.relative_to(home).as_posix(): path.read_bytes() for path in home.rglob("*") if path.is_file()}


def first_loss(before: Files, home: Path, changes: tuple[str, ...]) -> str:
    """The first file of the base that is missing or changed, apart from `changes` and logs that grew; "" if none is."""
    for name, content in before.items():
        if any(fnmatch.fnmatch(name, pattern) for pattern in changes):
            continue
        path = home / name
        if not path.is_file():
            return f"lost: {name}"
        now = path.read_bytes()
        if now != content and not (name.endswith(".jsonl") and now.startswith(content)):
            return f"changed: {name}"
    return ""


def first_fault(home: Path) -> str:
    """The first fault that `toolbox verify` finds; "" if all is sound."""
    wrong = [reason for _, ok, reason in Toolbox(home / "toolbox").verify() if not ok]
    return f"toolbox verify: {wrong[0]}" if wrong else ""


def first_leftover(home: Path) -> str:
    """The first draft, or session folder without a session, that commands should have removed; "" if there is none."""
    remains = [path for pattern in _LEFT for path in home.rglob(pattern)]
    remains += [folder for folder in home.glob("toolbox/sessions/*") if not _is_session(folder)]
    return f"left over: {remains[0].relative_to(home)}" if remains else ""


def _is_session(folder: Path) -> bool:
    file = folder / "events.jsonl"
    return file.is_file() and b"\n" in file.read_bytes()


def names() -> Iterator[str]:
    """The commands, each as often as its share."""
    for name, work in WORKS.items():
        yield from [name] * work.share
