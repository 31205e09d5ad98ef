"""Part `mutations`: damaged files of every kind that the lab reads, given to the lab's own readers.

An attempt is a batch of one kind in a process of its own. Each file must be read or rejected with the lab's own error in one
line, within 5 s of CPU time and 1 GB.
"""

import json
from collections import Counter
from itertools import count as numbers_from
from pathlib import Path
from typing import Any

from devtools.commands import environment, lab, module
from devtools.parts import Outcome, Part
from devtools.read_files import KINDS
from devtools.sound_files import make_sound

FILES = 100_000
BATCH_S = 3600.0
MOST_DEATHS = 20  # the most processes of a batch that files may kill
MOST_TOLD = 4  # the most kinds of faults that a batch reports


def prepare(room: Path, seed: int) -> None:
    """Make the sound files that only runs of the lab leave, once."""
    if not (room / "sound").exists():
        make_sound(room)
        (room / "sound").touch()


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Read one batch; the kinds take turns, and no two batches of a kind have the same files."""
    name = [*KINDS][number % len(KINDS)]
    tries = KINDS[name].tries
    return read_batch(room, name, seed, number // len(KINDS) * tries, tries, str(number))


def read_batch(room: Path, name: str, seed: int, first: int, tries: int, folder: str) -> Outcome:
    """The outcome of `tries` damaged files of a kind; where a file kills the process, another one continues."""
    home = room / folder
    home.mkdir(exist_ok=True)
    counts: Counter[str] = Counter()
    broke: list[dict[str, str]] = []
    figures = {"s": 0.0, "MB": 0.0}
    at, end = first, first + tries
    for death in numbers_from():
        told = home / f"told-{death}"
        words = (str(room), name, str(seed), str(at), str(end - at), str(told))
        env = environment(home, OPENBLAS_NUM_THREADS="1")
        ended = lab(*words, cwd=home, env=env, timeout_s=BATCH_S, command=module("read_damaged"))
        lines = told.read_text().splitlines() if told.exists() else []
        if lines and lines[-1].startswith("{"):
            last: dict[str, Any] = json.loads(lines[-1])
            broke += last.pop("broke")
            figures = {"s": max(figures["s"], last.pop("slowest_s")), "MB": max(figures["MB"], last.pop("most_mb"))}
            counts.update(last)
            break
        if not lines or death == MOST_DEATHS:
            raise RuntimeError(f"{name}: no batch: exit {ended.code}: {ended.stderr[-600:]}")
        killer = int(lines[-1])
        broke.append(
            {"case": f"{name} {killer}", "why": f"the process ended with {ended.code}: {ended.stderr[-200:]!r}"}
        )
        counts.update(tries=killer + 1 - at)
        at = killer + 1
        if at == end:
            break
    case = f"{name}, {tries} files from {first}, seed {seed}"
    shares = {f"{what} %": round(100 * counts[what] / tries) for what in ("read", "refused")}
    return Outcome(name, case, faults_in_words(broke, tries), counts["tries"], {**figures, **shares})


def faults_in_words(broke: list[dict[str, str]], tries: int) -> str:
    """The faults in words, each kind with its number and its first case; "" if there are none."""
    sorts: dict[str, list[dict[str, str]]] = {}
    for fault in broke:
        sorts.setdefault(fault["why"].partition(" (")[2] or fault["why"][:60], []).append(fault)
    told = [f"{len(same)} x {same[0]['case']}: {same[0]['why']}" for same in sorts.values()]
    return f"{len(broke)} of {tries}: {'; '.join(told[:MOST_TOLD])}" if broke else ""


ROUNDS = -(-FILES // sum(kind.tries for kind in KINDS.values()))
PART = Part(
    "damaged files of every kind",
    "read, or rejected in a line, under 5 s, under 1 GB",
    ROUNDS * len(KINDS),
    prepare,
    attempt,
)
