"""Whether a cell can be finished at all: a search over where parts stand, without times.

Parts of one product in one position are alike here, so a state is how many parts stand in each position. From the start
of a cell whose routes are sound the answer is always yes: a part alone in the cell finds room everywhere, so one part
after the other gets through. It may be no from where a run has got to, and in a cell whose rules ask for more.
"""

from collections.abc import Iterator, Sequence
from copy import copy

from lab.errors import WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option
from lab.sequencing.simulate.run import Run

MOST_STATES = 200_000

_State = tuple[int, ...]  # parts in each position
_Step = tuple[int, Option]  # a part leaves this position, that way


def forced(cell: Cell, most: int = MOST_STATES) -> str | None:
    """Who waits for whom, in words, when no sequence whatsoever can finish the cell's order; else None.

    None, too, when `most` states did not suffice to tell. Where every part gets through alone, one after the other is
    such a sequence; only else are states searched with all parts in them.
    """
    run = Run(cell)
    try:
        if _one_by_one(cell, most) or completion(run, most) is not None:
            return None
    except WorkFailed:
        return None
    while decisions := run.allowed():  # every move brings a part further, so this ends
        run.move(decisions[0])
    return run.deadlock()


def completion(run: Run, most: int = MOST_STATES) -> tuple[int, ...] | None:
    """Decisions that finish every part from where the run is; None when there are none: it is in a deadlock, or bound for one.

    The run itself is left as it is. Raises WorkFailed when `most` states did not suffice to tell.
    """
    cell = run.cell
    order = [cell.positions[position].product for position in cell.starts]
    steps = _Search(cell, order).steps_to_the_end(_state(cell, run.locations), most)
    if steps is None:
        return None
    ahead = _copy_of(run)
    decisions: list[int] = []
    for position, way in steps:
        decisions.append(next(d for d in ahead.allowed() if _leaves(ahead, d, position, way)))
        ahead.move(decisions[-1])
    return tuple(decisions)


def _one_by_one(cell: Cell, most: int) -> bool:
    """Whether a part of each product that is ordered gets to its end with no other part in the cell."""
    for start in dict.fromkeys(cell.starts):
        alone = _Search(cell, [cell.positions[start].product])
        if alone.steps_to_the_end(_state(cell, [start]), most) is None:
            return False
    return True


def _state(cell: Cell, locations: Sequence[int]) -> _State:
    return tuple(locations.count(position) for position in range(len(cell.positions)))


class _Search:
    """Depth first over the states of a cell with an order of products, those parts first that are nearest to their ends."""

    def __init__(self, cell: Cell, order: Sequence[int]) -> None:
        self.cell, self.order = cell, order
        self.product = [place.product for place in cell.positions]
        self.starts = set(cell.starts)
        self.ways = _by_nearness(cell)

    def steps_to_the_end(self, start: _State, most: int) -> list[_Step] | None:
        """The steps from a state to where every part is finished; None when no steps lead there."""
        seen, path = {start}, [(start, self.nexts(start))]
        steps: list[_Step] = []
        while path:
            state, nexts = path[-1]
            if all(not count or not self.cell.positions[place].options for place, count in enumerate(state)):
                return steps
            for step, reached in nexts:
                if reached not in seen:
                    if len(seen) >= most:
                        raise WorkFailed(f"{most} states did not suffice to tell whether the cell can be finished")
                    seen.add(reached)
                    steps.append(step)
                    path.append((reached, self.nexts(reached)))
                    break
            else:
                path.pop()
                if steps:
                    steps.pop()
        return None

    def nexts(self, state: _State) -> Iterator[tuple[_Step, _State]]:
        """The steps that the cell allows in a state, as `Run` has it, and the states they lead to."""
        taken = [0] * len(self.cell.stations)
        for place, count in zip(self.cell.positions, state, strict=True):
            for station in place.holds if count else ():
                taken[station] += count
        room = [capacity > used for capacity, used in zip(self.cell.capacities, taken, strict=True)]
        for position, way in self.ways:
            if not (state[position] and self._in_turn(position, state)):
                continue
            if not all(room[station] for station in way.needs) or (way.if_full is not None and room[way.if_full]):
                continue
            reached = list(state)
            reached[position] -= 1
            reached[way.to] += 1
            yield (position, way), tuple(reached)

    def _in_turn(self, position: int, state: _State) -> bool:
        """Whether a part may leave: where parts arrive, only the next one in the order may leave its start."""
        if self.cell.arrivals is None or position not in self.starts:
            return True
        fetched = len(self.order) - sum(state[start] for start in self.starts)
        return self.order[fetched] == self.product[position]


def _by_nearness(cell: Cell) -> list[_Step]:
    """All ways on, those first whose part has the fewest moves to go."""
    moves = [0 if not place.options else len(cell.positions) for place in cell.positions]
    before: list[int] = []
    while moves != before:
        before = list(moves)
        for position, place in enumerate(cell.positions):
            moves[position] = min([moves[position], *(1 + moves[way.to] for way in place.options)])
    ways = [(position, way) for position, place in enumerate(cell.positions) for way in place.options]
    return sorted(ways, key=lambda step: (moves[step[0]], moves[step[1].to]))


def _leaves(run: Run, decision: int, position: int, way: Option) -> bool:
    part = (decision - 1) % run.cell.parts
    return run.locations[part] == position and run.option(decision) is way


def _copy_of(run: Run) -> Run:
    other = copy(run)
    for name, value in vars(run).items():
        if isinstance(value, list):
            setattr(other, name, list(value))
    return other
