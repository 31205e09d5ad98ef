"""Waits on purpose: how long a robot stays before it picks and before it drops, so that no part of a list is picked too late."""

from collections.abc import Sequence

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, part_of
from lab.sequencing.simulate.constraints import Arc, earliest
from lab.sequencing.simulate.run import Run, Wait


def waits_of(cell: Cell, sequence: Sequence[int], spare_s: float = 0.0) -> tuple[Wait, ...] | None:
    """The least waits with which a list of decisions keeps to all windows, one a decision; None: no waits do.

    Of one robot that does all the work: the list says in which order it makes its moves, and everything is done as early as that
    order and the windows allow. That is the least solution of difference constraints, and no other way of timing the moves ends
    any of them earlier. spare_s: how much of each window is left.
    Source: simple temporal networks, Dechter, Meiri and Pearl 1991; hoist scheduling, Che and Chu 2004.
    """
    run, network = _Windowless(cell), _Network(cell, spare_s)
    for decision in sequence:
        option = run.option(decision)
        if option is None:
            return None
        network.add(part_of(decision, cell.parts), run, option)
        run.move(decision)
    return network.waits()


class _Windowless(Run):
    """A run in which no part is ever picked too late."""

    def too_late(self, part: int, option: Option) -> bool:
        return False


class _Network:
    """What the moves demand of one another. Moment 0 is time 0; of move n, 2 n - 1 begins its work where it picks, 2 n drops."""

    def __init__(self, cell: Cell, spare_s: float) -> None:
        self._cell, self._spare_s = cell, spare_s
        self._arcs, self._least = (
            list[Arc](),
            list[tuple[list[Arc], Arc]](),
        )  # by move: what leads to its begin, and to its drop
        self._ready = dict[int, tuple[int, float]]()  # by part: since which moment it is ready, and how much later [s]
        self._next: tuple[int, float] | None = None  # where parts come after a pick: when the next one does

    def add(self, part: int, run: Run, option: Option) -> None:
        """The next move of a run, before it is made."""
        cell, drop = self._cell, 2 * len(self._least)
        begin, robot, place = drop + 1, cell.robots[option.robot], run.locations[part - 1]
        at, at_most_s = run.robots_at[option.robot], cell.positions[place].at_most_s
        empty_s = 0.0 if at == option.origin else float(cell.empty_s[at, option.origin]) / robot.speed
        comes = [Arc(drop, begin, empty_s, 0)]
        after_pick = cell.arrivals is not None and cell.arrivals.after == "pick" and place == cell.starts[part - 1]
        since, later_s = 0, run.ready_s[part - 1]
        if part in self._ready:
            since, later_s = self._ready[part]
        elif after_pick and self._next is not None:
            since, later_s = self._next
        if option.waits:
            comes.append(Arc(since, begin, later_s, 0))
            if at_most_s is not None:
                latest_s = later_s + max(0.0, at_most_s - self._spare_s) - option.service_s
                self._arcs.append(Arc(begin, since, -latest_s, 0))
        carried = Arc(begin, begin + 1, option.service_s + run.carry_s(option), 0)
        self._arcs += [*comes, carried]
        self._least.append((comes, carried))
        if after_pick and run.fetched + 1 < len(cell.coming):
            interval_s = run.times.interval_s(cell.coming[run.fetched + 1])
            self._next = begin, option.service_s + interval_s
        there, does = cell.positions[option.to], {part: option.to}
        if there.processing_s is not None:
            if there.station in cell.batches:  # all that stand in it begin together
                does |= {other: run.locations[other - 1] for other in run.inside(there.station)}
            longest_s = max(run.times.processing_s(*one) for one in does.items())
            self._ready |= dict.fromkeys(does, (begin + 1, longest_s))

    def waits(self) -> tuple[Wait, ...] | None:
        """How much later than they could be begins and drops have to be; None: there is no way."""
        at_s, broken = earliest(self._arcs, 2 * len(self._least) + 1, 0, 0.0)
        if broken:
            return None
        return tuple(
            Wait(
                at_s[carried.one] - max(at_s[arc.one] + arc.least_s for arc in comes),
                at_s[carried.then] - at_s[carried.one] - carried.least_s,
            )
            for comes, carried in self._least
        )
