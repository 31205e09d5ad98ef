"""The least time a part of cycles with more and more parts: a mix of products enters once in a cycle, twice, and so on."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from lab.errors import BadInput, WorkFailed, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cyclic.cycle import TIME_LIMIT_S, Cycle, check_cyclic, shortest
from lab.sequencing.cyclic.fluid import least_s
from lab.sequencing.cyclic.line import at_speed, away_s, lines

MOST_PARTS, MOST_MOVES, MOST_LINES = 4, 30, 100  # of a cycle, where nobody says how many parts may enter in it
WORTH = 0.01  # and more are not tried where so small a share of the time is all that could be gained
NEAR_S = 3e-6  # longer than the bound, a mix takes as long: the bound is less by what its solver may be wrong by
EVERY_CYCLE = "all cycles"


@dataclass(frozen=True)
class Tried:
    """What was found with so many parts a cycle: its period; None: none that needs less time a part than fewer parts do.

    bound_s: no period that needs less is shorter. proven: there is none that needs less than the period, or than fewer parts.
    """

    parts: int
    period_s: float | None
    bound_s: float
    proven: bool


@dataclass(frozen=True)
class Rhythm:
    """The cycle that needs the least time a part, of those that were tried: with a mix of products once, twice, and so on.

    least_part_s: no cycle needs less time a part, however many parts enter in it. why_no_more: why more parts a cycle were not
    tried; "": those that were wanted were, or none can need less.
    """

    cycle: Cycle
    mix: tuple[str, ...]
    tried: tuple[Tried, ...]
    least_part_s: float
    why_no_more: str
    wall_s: float

    @property
    def per_part_s(self) -> float:
        """How long a part takes [s]."""
        return self.cycle.period_s / self.cycle.parts

    @property
    def most_parts(self) -> int:
        """The most parts a cycle that were tried."""
        return self.tried[-1].parts

    @property
    def bound_part_s(self) -> float:
        """No cycle of those in `proven_of` needs less time a part [s]."""
        if self._is_least:
            return self.per_part_s
        return min(self.per_part_s, max(self.least_part_s, min(one.bound_s / one.parts for one in self.tried)))

    @property
    def proven(self) -> bool:
        """Whether no cycle of those in `proven_of` needs less time a part, to some microseconds."""
        return self.bound_part_s == self.per_part_s

    @property
    def proven_of(self) -> str:
        """Of which cycles something is proven: all that there are, or those that were tried."""
        if self._is_least:
            return EVERY_CYCLE
        if self.most_parts > len(self.mix):
            return f"cycles of up to {self.most_parts} parts"
        return f"cycles of {mix_in_words(self.mix)}"

    @property
    def _is_least(self) -> bool:
        return (self.per_part_s - self.least_part_s) * len(self.mix) <= NEAR_S


def best_rhythm(
    cell: Cell, mix: Sequence[str], most_parts: int | None = None, seed: int = 0, time_limit_s: float = TIME_LIMIT_S
) -> Rhythm:
    """The cycle of a mix (products) that needs the least time a part: with one mix, then two, up to so many parts a cycle.

    most_parts: None: `usual_parts`, and no more once less than `WORTH` could be gained. More are never tried once it is proven
    that no cycle needs less. Raises BadInput and WorkFailed as `best_cycle` does.
    """
    began, mix = time.perf_counter(), tuple(mix)
    check_cyclic(cell, mix)
    cell = at_speed(cell)
    worth, most_parts = (WORTH, usual_parts(cell, mix)) if most_parts is None else (0.0, most_parts)
    least_mix_s = least_s(cell, mix, away_s(cell))
    best: Cycle | None = None
    tried, why, mix_s = list[Tried](), "", inf
    for times in range(1, max(1, most_parts // len(mix)) + 1):
        left_s = time_limit_s - (time.perf_counter() - began)
        if mix_s - least_mix_s <= NEAR_S:
            break
        if 1.0 - least_mix_s / mix_s < worth:
            why = f"less than {worth:.0%} of the time could be gained"
            break
        if tried and left_s <= 0:
            why = f"the {time_limit_s:g} s were over"
            break
        try:
            found = shortest(cell, mix * times, left_s, seed, times * least_mix_s, times * mix_s)
        except BadInput as error:
            if not tried:
                raise
            why = str(error)
            break
        bound_s = times * mix_s if found.proven and found.cycle is None else found.above_s
        tried.append(
            Tried(len(mix) * times, None if found.cycle is None else found.cycle.period_s, bound_s, found.proven)
        )
        if found.cycle is not None:
            best, mix_s = found.cycle, found.cycle.period_s / times
    if best is None:
        none = all(one.bound_s == inf for one in tried)
        parts = counted(tried[-1].parts, "part") if len(tried) == 1 else f"up to {tried[-1].parts} parts"
        why = "it is proven that there is none" if none else f"none was found in {time_limit_s:g} s"
        raise WorkFailed(f"no order of {parts} a cycle can be repeated for ever: {why}")
    return Rhythm(best, mix, tuple(tried), least_mix_s / len(mix), why, time.perf_counter() - began)


def usual_parts(cell: Cell, mix: Sequence[str]) -> int:
    """How many parts a cycle has at the most where nobody says: few, of few moves and choices of ways, and no more than the cell
    has; a mix at the least."""
    most = len(mix)
    while most + len(mix) <= min(MOST_PARTS, cell.parts):
        try:
            ahead = [*lines(cell, [*mix] * (most // len(mix) + 1))]
        except BadInput:
            break
        if len(ahead) > MOST_LINES or max(len(line.moves) for line in ahead) > MOST_MOVES:
            break
        most += len(mix)
    return most


def mix_in_words(mix: Sequence[str]) -> str:
    """What enters, such as "2 slices, 1 cup"."""
    return ", ".join(counted(count, name) for name, count in Counter(mix).items())
