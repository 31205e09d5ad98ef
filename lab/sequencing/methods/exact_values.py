"""What each decision still costs at best: exact values of a small cell, for an advisor who knows."""

from math import inf

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.cell.ways import TICKS_PER_S, Way
from lab.sequencing.simulate.merged import MergedCell, MergedKey, MergedState
from lab.sequencing.simulate.run import Run

MOST_STATES = 100_000
MOST_PARTS = 40  # each adds to the depth of the search


class ExactValues:
    """The least time [s] that a cell still needs after each decision, by all ways on, each state looked at once.

    Raises BadInput for more than MOST_PARTS parts or MOST_STATES states: fewer parts are wanted then.
    """

    def __init__(self, cell: Cell) -> None:
        if cell.parts > MOST_PARTS:
            raise BadInput(f"an advisor who knows exact values: {cell.parts} parts are too many, at most {MOST_PARTS}")
        self.cell, self._merged = cell, MergedCell(cell)
        self._left: dict[MergedKey, float] = {}

    def of(self, run: Run, allowed: tuple[int, ...]) -> list[float]:
        """The time from now to the end after each of the decisions; infinite where it ends in a deadlock."""
        state, parts = self._merged.of_run(run)._replace(who=None), self.cell.parts
        left_s = {at: self._after(state, way) / TICKS_PER_S for at, way in self._merged.choices(state).items()}
        return [left_s[run.locations[part_of(d, parts) - 1], choice_of(d, parts)] for d in allowed]

    def _after(self, state: MergedState, way: Way) -> float:
        ahead = self._merged.after(state, way)
        return ahead.now - state.now + self._least(ahead)

    def _least(self, state: MergedState) -> float:
        if self._merged.done(state):
            return 0.0
        key = self._merged.key(state)
        if key not in self._left:
            if len(self._left) >= MOST_STATES:
                what = f"{self.cell.parts} parts have more than {MOST_STATES} states"
                raise BadInput(f"an advisor who knows exact values: {what}; take fewer")
            ways = self._merged.choices(state).values()
            self._left[key] = min((self._after(state, way) for way in ways), default=inf)
        return self._left[key]
