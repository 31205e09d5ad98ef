"""The keys of a replay at the terminal: space pauses and goes on, n makes a step, + and - change the speed, q ends it."""

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from lab.seat.replay_pace import KEYS, ReplayPace

HELP = "space: pause and go on, n: one step, + and -: faster and slower, q: end"
LOOK_S = 0.1  # how often it is looked whether the replay is over


@contextmanager
def replay_keys(pace: ReplayPace) -> Iterator[bool]:
    """Reads keys of the terminal, if stdin is one, until it is left; whether it is. The terminal is then as it was."""
    if not sys.stdin.isatty():
        yield False
        return
    import termios
    import tty

    file, over = sys.stdin.fileno(), threading.Event()
    before = termios.tcgetattr(file)

    def read() -> None:
        while not over.is_set():
            if not select.select([file], [], [], LOOK_S)[0]:
                continue
            key = os.read(file, 1).decode("ascii", "replace").lower()
            if key in ("q", ""):
                signal.raise_signal(signal.SIGINT) if key else over.set()
            elif key in KEYS:
                pace.do(KEYS[key])

    reader = threading.Thread(target=read, daemon=True)
    tty.setcbreak(file)
    reader.start()
    try:
        yield True
    finally:
        over.set()
        reader.join(2 * LOOK_S)
        termios.tcsetattr(file, termios.TCSADRAIN, before)
