"""The keys of a replay at the terminal: space pauses and continues, n makes a step, + and - change the speed, q ends it."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from prompt_toolkit.input import create_input

from lab.seat.replay_pace import KEYS, ReplayPace

HELP = "space: pause and go on, n: one step, + and -: faster and slower, q: end"
LOOK_S = 0.05  # interval of polling for keys
ENDS = ("q", "c-c")  # Ctrl-C is an ordinary key here


@contextmanager
def replay_keys(pace: ReplayPace) -> Iterator[bool]:
    """A context that reads keys of the terminal, and yields whether stdin is one. The terminal is restored at its end."""
    if not sys.stdin.isatty():
        yield False
        return
    keys, over = create_input(sys.stdin), threading.Event()

    def read() -> None:
        try:
            while not over.wait(LOOK_S) and not keys.closed:
                for pressed in keys.read_keys():
                    key = pressed.key.lower()
                    if key in ENDS:
                        signal.raise_signal(signal.SIGINT)
                        return
                    if key in KEYS:
                        pace.do(KEYS[key])
        except Exception:  # in raw mode Ctrl-C is an ordinary key, and would be lost
            signal.raise_signal(signal.SIGINT)
            raise

    reader = threading.Thread(target=read, daemon=True)
    with keys.raw_mode():
        reader.start()
        try:
            yield True
        finally:
            over.set()
            reader.join()
