"""A learning curve that stays short however long a session is: a few hundred stretches of episodes."""

from dataclasses import dataclass, field
from itertools import accumulate
from math import inf
from typing import Any

MOST = 400  # stretches that a page draws


@dataclass
class Curve:
    """What episodes cost, in stretches of `per` episodes: the mean of each, its least, and how many of them were guided.

    best: the least cost of all, and the episode that first had it, from 1; None before the first.
    """

    per: int = 1
    count: int = 0
    sums: list[float] = field(default_factory=list)
    lows: list[float] = field(default_factory=list)
    guided: list[int] = field(default_factory=list)
    best: tuple[float, int] | None = None

    def add(self, cost: float, guided: bool) -> None:
        """One more episode; stretches become twice as long when there would be too many."""
        if self.count == self.per * MOST:
            self.sums = [a + b for a, b in zip(self.sums[::2], self.sums[1::2], strict=True)]
            self.lows = [*map(min, self.lows[::2], self.lows[1::2])]
            self.guided = [a + b for a, b in zip(self.guided[::2], self.guided[1::2], strict=True)]
            self.per *= 2
        if self.count == self.per * len(self.sums):
            self.sums.append(0.0)
            self.lows.append(inf)
            self.guided.append(0)
        self.sums[-1] += cost
        self.lows[-1] = min(self.lows[-1], cost)
        self.guided[-1] += guided
        self.count += 1
        if self.best is None or cost < self.best[0]:
            self.best = cost, self.count

    def document(self) -> dict[str, Any]:
        """The curve as the page draws it."""
        last = self.count - self.per * (len(self.sums) - 1)
        sizes = [self.per] * (len(self.sums) - 1) + [last] * bool(self.sums)
        means = [float(f"{total / size:.5g}") for total, size in zip(self.sums, sizes, strict=True)]
        bests = [float(f"{low:.5g}") for low in accumulate(self.lows, min)]
        known = {"per": self.per, "count": self.count, "means": means, "guided": self.guided.copy()}
        return known | {"bests": bests, "best": None if self.best is None else [*self.best]}
