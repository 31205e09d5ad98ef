"""How many wrong codes an address may try before it has to wait."""

import time
from collections import deque

WRONG, WRONG_S = 20, 60.0  # wrong codes that an address may try in so many seconds
MOST_ADDRESSES = 1000


class WrongCodes:
    """The wrong codes that addresses have tried lately."""

    def __init__(self) -> None:
        self._tried: dict[str, deque[float]] = {}

    def note(self, address: str) -> None:
        """An address has tried a wrong code."""
        self._of(address).append(time.monotonic())

    def has_to_wait(self, address: str) -> bool:
        """Whether an address has tried WRONG wrong codes in the last WRONG_S."""
        return len(self._of(address)) >= WRONG

    def _of(self, address: str) -> deque[float]:
        """The times of the wrong codes from an address in the last WRONG_S."""
        if len(self._tried) > MOST_ADDRESSES:
            self._tried.clear()
        tried = self._tried.setdefault(address, deque(maxlen=WRONG))
        while tried and tried[0] < time.monotonic() - WRONG_S:
            tried.popleft()
        return tried
