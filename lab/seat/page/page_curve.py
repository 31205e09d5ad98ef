"""A learning curve that stays short however long a session is: a few hundred stretches of episodes."""

from dataclasses import dataclass, field
from typing import Any

MOST = 400  # stretches that a page draws


@dataclass
class Curve:
    """What episodes cost, in stretches of `per` episodes: the mean of each, and how many of them were guided."""

    per: int = 1
    count: int = 0
    sums: list[float] = field(default_factory=list)
    guided: list[int] = field(default_factory=list)

    def add(self, cost: float, guided: bool) -> None:
        """One more episode; stretches become twice as long when there would be too many."""
        if self.count == self.per * MOST:
            self.sums = [a + b for a, b in zip(self.sums[::2], self.sums[1::2], strict=True)]
            self.guided = [a + b for a, b in zip(self.guided[::2], self.guided[1::2], strict=True)]
            self.per *= 2
        if self.count == self.per * len(self.sums):
            self.sums.append(0.0)
            self.guided.append(0)
        self.sums[-1] += cost
        self.guided[-1] += guided
        self.count += 1

    def document(self) -> dict[str, Any]:
        """The curve as the page draws it."""
        last = self.count - self.per * (len(self.sums) - 1)
        sizes = [self.per] * (len(self.sums) - 1) + [last] * bool(self.sums)
        means = [float(f"{total / size:.5g}") for total, size in zip(self.sums, sizes, strict=True)]
        return {"per": self.per, "count": self.count, "means": means, "guided": self.guided.copy()}
