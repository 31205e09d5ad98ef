"""What each decision still costs at best: exact values of a small cell, for an advisor who knows."""

from math import inf

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import choice_of, part_of
from lab.sequencing.methods.robot_bound import TICKS_PER_S
from lab.sequencing.simulate.merged import Action, Flow, Layout, State
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
        self.cell, self.layout = cell, Layout.of(cell)
        self._left: dict[State, float] = {}

    def of(self, run: Run, allowed: tuple[int, ...]) -> list[float]:
        """The time from now to the end after each of the decisions; infinite where it ends in a deadlock."""
        flow, parts = Flow.from_run(self.layout, run), self.cell.parts
        known: dict[tuple[int, int], float] = {}
        for decision in allowed:
            at = run.locations[part_of(decision, parts) - 1], choice_of(decision, parts)
            if at not in known:
                known[at] = self._after(flow, (*at, 0)) / TICKS_PER_S
        return [known[run.locations[part_of(d, parts) - 1], choice_of(d, parts)] for d in allowed]

    def _after(self, flow: Flow, action: Action) -> float:
        ahead = flow.branch()
        ahead.take(action)
        return ahead.now - flow.now + self._least(ahead)

    def _least(self, flow: Flow) -> float:
        if flow.done:
            return 0.0
        state = flow.state()
        if state not in self._left:
            if len(self._left) >= MOST_STATES:
                what = f"{self.cell.parts} parts have more than {MOST_STATES} states"
                raise BadInput(f"an advisor who knows exact values: {what}; take fewer")
            self._left[state] = min((self._after(flow, action) for action in flow.actions()), default=inf)
        return self._left[state]
