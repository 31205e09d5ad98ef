"""Writes to a toolbox as several processes do: writing.py save FOLDER SEED COUNT NAMES, or writing.py kill FOLDER KILLS.

"save" saves COUNT policies under NAMES names and tells what it saved; "kill" kills such writers at random moments, and
counts what is lost or damaged then.
"""

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

NAMES = 5  # that killed writers use
LONGEST_S = 0.03  # that a writer lives after its first save


def made(name: str, rng: np.random.Generator) -> Policy:
    """Some policy of that name, solved or not."""
    return Policy(
        name=name,
        subtask="insert",
        task="toast",
        q=rng.random((4, 2)),
        visits=np.zeros((4, 2), dtype=np.int64),
        action_labels=("left", "right"),
        shape=(4,),
        start=0,
        signature="0123456789abcdef",
        learner={"learner": "q"},
        gate={"gate": "never"},
        advisor="none",
        seed=0,
        curve=[3],
        guided=[False],
        helped_steps=0,
        requests=0,
        optimal_steps=3,
        final_steps=int(rng.integers(3, 9)),
        solved=bool(rng.random() < 0.5),
        created="2026-05-01T12:00:00+00:00",
        versions={"numpy": "2"},
        ends=np.array([0, 0, 0, 1], np.uint8),
    )


def saved(box: Toolbox, seed: int, names: int) -> Iterator[tuple[str, str]]:
    """Saves one policy after the other, and says each time under which name, and its hash."""
    rng = np.random.default_rng(seed)
    while True:
        policy = made(f"skill {rng.integers(names)}", rng)
        yield policy.name, box.put(policy).hash


def writer(folder: Path, seed: int, tell: int) -> None:
    """Saves, promotes and rolls back until it is killed, and tells of each save when it is done."""
    box = Toolbox(folder)
    for number, (name, made_hash) in enumerate(saved(box, seed, NAMES)):
        os.write(tell, f"{name}@{made_hash}\n".encode())
        if number % 3 == 1:
            box.promote(name, made_hash)
        if number % 3 == 2:
            with suppress(BadInput):  # nothing was in use before
                box.rollback(name)


def killed(folder: Path, seed: int) -> set[str]:
    """What a writer had saved, for all that it knew, when it was killed."""
    heard, tell = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            writer(folder, seed, tell)
        finally:
            os._exit(1)
    os.close(tell)
    told = os.read(heard, 64)
    time.sleep(LONGEST_S * np.random.default_rng(seed).random())
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    while part := os.read(heard, 1 << 16):
        told += part
    os.close(heard)
    return set(told.decode().split("\n")[:-1])


def kill(folder: Path, kills: int) -> dict[str, Any]:
    """Kills writers, and counts: saves, those lost, names not in use any more, files that are damaged or left behind."""
    told: set[str] = set()
    counts = {"kills": kills, "saves": 0, "lost": 0, "not in use": 0, "damaged": 0, "left behind": 0}
    for number in range(kills):
        told |= killed(folder, number)
    box = Toolbox(folder)
    counts["saves"] = len(told)
    names = {entry.partition("@")[0] for entry in told}
    for name in names:
        kept = box.versions(name).kept()
        counts["lost"] += sum(entry.partition("@")[2] not in kept for entry in told if entry.startswith(f"{name}@"))
    counts["not in use"] = len(names - {row["name"] for row in box.list()})
    counts["damaged"] = sum(not ok for _, ok, _ in box.verify())
    rng = np.random.default_rng(kills)
    for name in names:
        box.put(made(name, rng))
    counts["left behind"] = len(list(folder.rglob("*.tmp")))
    return counts


if __name__ == "__main__":
    box_folder = Path(sys.argv[2])
    if sys.argv[1] == "kill":
        done: Any = kill(box_folder, int(sys.argv[3]))
    else:
        one_by_one = saved(Toolbox(box_folder), int(sys.argv[3]), int(sys.argv[5]))
        done = [f"{name}@{digits}" for _, (name, digits) in zip(range(int(sys.argv[4])), one_by_one, strict=False)]
    sys.stdout.write(json.dumps(done) + "\n")
