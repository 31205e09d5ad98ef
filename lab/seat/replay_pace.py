"""How fast a replay goes from one answer to the next, and whether it waits: told by keys and buttons, from any thread."""

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
}  # a pause that is under way ends by a space, too
FASTEST, SLOWEST = 16.0, 1 / 8  # times the pace that was asked for
LISTEN_S = 0.2  # the longest stretch of waiting, so that Ctrl-C is heard


class ReplayPace:
    """`wait` between two answers: `pause_s` over the speed, or while it is paused until it goes on, or makes a step.

    on_change: called in whatever thread changes it, with what pages are told of it.
    """

    def __init__(self, pause_s: float, on_change: Callable[[dict[str, Any]], object] = lambda now: None) -> None:
        self.pause_s, self.on_change = pause_s, on_change
        self._lock = threading.Condition()
        self._paused, self._steps, self._speed = False, 0, 1.0

    def now(self) -> dict[str, Any]:
        """Whether it is paused, and its speed."""
        return {"paused": self._paused, "speed": self._speed}

    def do(self, word: str) -> None:
        """What a key or a button says: one of WORDS; "pause" of a paused replay goes on."""
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
        """Until the next answer is to be shown."""
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
