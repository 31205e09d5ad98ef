"""The parts of the harness: each makes numbered attempts to break the lab, with an outcome each."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Outcome:
    """How one attempt ended.

    group: the row of the scoreboard that counts it; case: what was done, so that a reader can repeat it; broke: what went
    wrong, empty if the lab held; tries: the number of trials in it; figures: anything measured.
    """

    group: str
    case: str
    broke: str = ""
    tries: int = 1
    figures: dict[str, float] | None = None


@dataclass(frozen=True)
class Part:
    """One way of breaking the lab.

    what: one line about it; target: what should hold; count: how many attempts a long run makes (None: the number that
    `prepare` returns); prepare(room, seed): makes what all attempts start from in an empty folder, once; attempt(number, seed,
    room): makes one attempt, the same for the same number and seed, in folders of its own under `room`, and leaves nothing
    running.
    """

    what: str
    target: str
    count: int | None
    prepare: Callable[[Path, int], int | None]
    attempt: Callable[[int, int, Path], Outcome]
