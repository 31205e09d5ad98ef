"""The pace of a replay: its speed from one answer to the next, and pauses; set by keys and buttons, from any thread."""

import threading
import time
from collections.abc import Callable
from typing import Any

WORDS = ("pause", "go", "step", "faster", "slower")
KEYS = {
    " ": "pause",
    "n": "step",
    "+": "faster",
    "=": "faster",
    "-": "slower",
}  # the space bar also ends a pause
FASTEST, SLOWEST = 16.0, 1 / 8  # times the requested pace
LISTEN_S = 0.2  # longest uninterrupted wait, so that Ctrl-C is noticed


class ReplayPace:
    """The pace: `wait` takes `pause_s` / speed [s] between two answers, or until a paused replay continues or makes a step.

    on_change: called with `now()` after each change, in the thread that made it.
    """

    def __init__(self, pause_s: float, on_change: Callable[[dict[str, Any]], object] = lambda now: None) -> None:
        self.pause_s, self.on_change = pause_s, on_change
        self._lock = threading.Condition()
        self._paused, self._steps, self._speed = False, 0, 1.0

    def now(self) -> dict[str, Any]:
        """Whether it is paused, and its speed."""
        return {"paused": self._paused, "speed": self._speed}

    def do(self, word: str) -> None:
        """Carry out a key or a button: one of WORDS; "pause" continues a paused replay."""
        with self._lock:
            match word:
                case "pause":
                    self._paused = not self._paused
                case "go":
                    self._paused = False
                case "step":
                    self._paused, self._steps = True, self._steps + 1
                case "faster":
                    self._speed = min(2 * self._speed, FASTEST)
                case "slower":
                    self._speed = max(self._speed / 2, SLOWEST)
            self._lock.notify_all()
        self.on_change(self.now())

    def wait(self) -> None:
        """Wait until the next answer is to be shown."""
        began_s = time.monotonic()
        with self._lock:
            while True:
                if self._steps:
                    self._steps -= 1
                    return
                left_s = LISTEN_S if self._paused else began_s + self.pause_s / self._speed - time.monotonic()
                if left_s <= 0:
                    return
                self._lock.wait(min(left_s, LISTEN_S))
