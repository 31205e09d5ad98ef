"""Kills teaching sessions at random moments, goes on with them, and compares: killing.py MAZE FOLDER KILLS."""

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np

from lab.advice.entries import FILE, read_journal
from lab.learning.requests import AdviceRequest
from lab.teaching.kept_session import KeptSession
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.teacher import Teacher
from lab.teaching.world_subject import WorldSubject
from lab.toolbox.names import SESSIONS
from lab.toolbox.registry import Toolbox


def person(request: AdviceRequest) -> int:
    """Somebody who is often right, decided by state and episode alone."""
    towards = (1, 3)[(request.state + request.episode) % 2]
    return towards if (request.state * 7 + request.episode) % 5 else 2


def lesson_in(folder: Path) -> Path:
    """Where the session is kept: in the toolbox, without pictures."""
    return folder / "toolbox" / SESSIONS / "maze-1"


def held(folder: Path, maze: Path, *, goes_on: bool = False) -> tuple[Any, ...]:
    """A session, or one gone on with: all that it comes to, wherever it was held."""
    box = Toolbox(folder / "toolbox")
    kept = KeptSession(lesson_in(folder), "--resume") if goes_on else None
    new = LessonOptions(str(maze), advisors=("terminal",), seed=3, episodes=60)
    options = new if kept is None else kept.options
    teacher = Teacher(box, options.advising({"terminal": person}), seed=3)
    document = teach(WorldSubject.of(options), options, teacher, None, kept)
    (row,) = box.list()
    policy = box.find("world", row["signature"])
    assert policy is not None
    told = {name: value for name, value in document.items() if name not in ("session", "files")}
    return policy.q.tobytes(), policy.visits.tobytes(), policy.curve, policy.guided, told


def killed(folder: Path, maze: Path, at_bytes: int) -> None:
    """A session in a process of its own, killed as soon as its journal has so many bytes."""
    pid = os.fork()
    if pid == 0:
        try:
            held(folder, maze)
        finally:
            os._exit(0)
    journal = lesson_in(folder) / FILE
    while os.waitpid(pid, os.WNOHANG) == (0, 0):
        if journal.exists() and journal.stat().st_size >= at_bytes:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return


def main(maze: Path, folder: Path, kills: int) -> dict[str, int]:
    """How many sessions were broken off, and how many were the same in the end, to the last byte of the journal."""
    whole = held(folder / "whole", maze)
    raw = (lesson_in(folder / "whole") / FILE).read_bytes()
    rng = np.random.default_rng(0)
    counts = {"broken off": 0, "same": 0}
    for number, at_bytes in enumerate(rng.integers(len(raw.split(b"\n")[0]) + 1, len(raw) - 200, kills).tolist()):
        place = folder / str(number)
        killed(place, maze, at_bytes)
        is_over = read_journal(lesson_in(place), "DIR").closed is not None
        counts["broken off"] += not is_over
        same = is_over or held(place, maze, goes_on=True) == whole
        counts["same"] += same and (lesson_in(place) / FILE).read_bytes() == raw
    return counts


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))) + "\n")
