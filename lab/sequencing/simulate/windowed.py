"""The merged states of a cell with time windows, in which the robot waits deliberately so that no part is picked too late."""

from collections.abc import Iterator
from itertools import chain

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, Way
from lab.sequencing.simulate.merged import MergedCell, MergedState, Row, Waits
from lab.sequencing.simulate.run import SLACK_S

_SLACK = round(SLACK_S / 2 * TICKS_PER_S)  # tolerance of circuits, for the rounding of sums of times


class WindowedCell(MergedCell):
    """A cell with time windows, and its states, each as early as the order of its moves and all windows allow (see `waits_of`).

    A part that would be picked too late is made ready later, by a later drop. The moments of a state and its rows are longest
    paths in a network of difference constraints: a pick adds an arc from the pick back to the moment when the part was ready,
    which delays all that follows from that moment. If this would delay the pick itself beyond the window, no waits help, and
    the state is discarded. A state dominates another one with equal counts if none of its moments and rows is later. Identical
    parts move on in the order in which they are ready: where one overtakes another, they may as well be swapped. windows: by
    position, how long after it is ready a part may be picked [ticks]; `latest` is empty, since no part is too late yet.
    Source: difference bound matrices, Dill 1989; simple temporal networks, Dechter, Meiri and Pearl 1991.
    """

    def __init__(self, cell: Cell) -> None:
        super().__init__(cell)
        self.latest = {}
        at_most = {n: place.at_most_s for n, place in enumerate(cell.positions) if place.at_most_s is not None}
        self.windows = {n: round(at_most_s * TICKS_PER_S) for n, at_most_s in at_most.items()}
        begins = zip(cell.begin_at, cell.starts, cell.begin_s, strict=True)
        # Positions that parts reach in another order than that in which they will be ready.
        self._unordered = {at for at, start, begin_s in begins if at != start and begin_s > 0}
        self._unordered |= {n for n, process in enumerate(self.process) if process is None}

    def start(self, *, named: bool = True) -> MergedState:
        """The initial state, with parts told apart; the times at which its parts are ready cannot be delayed."""
        state = super().start(named=True)
        rows: list[tuple[Row, ...]] = [()] * len(state.waits)
        for place in self.windows:
            slot = self.slots[place]
            rows[slot] = tuple([Row(state.now - at, _shifted(state.waits, -at), until=at) for at in state.waits[slot]])
        return state._replace(rows=tuple(rows))

    def successors(self, state: MergedState) -> Iterator[MergedState]:
        """The states after each option, taken by the first part that is ready, or by each where the first is not known."""
        for way in self.choices(state).values():
            for nth in range(len(state.waits[self.slots[way.place]]) if way.place in self._unordered else 1):
                put_off = self._picked(state, way, nth)
                ahead = self._kept(self._moved_on(put_off, way, nth)) if put_off else None
                if ahead is not None:
                    yield ahead

    def decisions(self, state: MergedState) -> tuple[int, ...]:
        """All decisions from the start to a state."""
        allowed = list[int]()
        while state.parent is not None:
            allowed.append(self.decision(state))
            state = state.parent
        return tuple(allowed[::-1])

    def _picked(self, state: MergedState, way: Way, nth: int) -> MergedState | None:
        """The state delayed so that a part is ready late enough to be picked next by an option; None: no waits help."""
        place, option, work = way
        if place not in self.windows or not option.waits:
            return state
        pick = self._empty[state.robot][option.origin] + work - self._loaded[option.origin][option.target]
        return _put_off(state, self.slots[place], nth, pick - self.windows[place])

    def _moved_on(self, state: MergedState, way: Way, nth: int) -> MergedState:
        """The state after an option, with its rows."""
        place, option, _ = way
        ahead = self.after(state, way, nth=nth)
        assert ahead.who is not None
        behind = ahead.who[option.to].index(ahead.part) if self._ways[option.to] else 0

        def moved(row: Row) -> Row:
            now, _, waits, _ = self.moments(state, row.now, row.waits, way, nth, behind)
            return row._replace(now=now, waits=waits)

        rows = [tuple([moved(row) for row in there]) for there in state.rows]
        own: Row | None = None
        if place in self.windows:
            slot = self.slots[place]
            own, rows[slot] = rows[slot][nth], rows[slot][:nth] + rows[slot][nth + 1 :]
        if option.to in self.windows:
            slot, process = self.slots[option.to], self.process[option.to]
            new = own if process is None and own is not None else self._row(ahead, slot, behind, process or 0)
            rows[slot] = (*rows[slot][:behind], new, *rows[slot][behind:])
        return ahead._replace(rows=tuple(rows))

    def _row(self, state: MergedState, slot: int, nth: int, process: int) -> Row:
        """The row of a part that was just dropped, on which no earlier moment depends."""
        past = chain(self._past, [0])  # the last entry is for arrivals, if any
        waits = [(least - process,) * len(there) for least, there in zip(past, state.waits, strict=False)]
        waits[slot] = (*waits[slot][:nth], 0, *waits[slot][nth + 1 :])
        return Row(-process, tuple(waits))

    def _kept(self, state: MergedState) -> MergedState | None:
        """The state delayed so that each part could be picked in time if the robot went there now; None: no waits help."""
        kept: MergedState | None = state
        for place, least in self._fetching.items():
            slot = self.slots[place]
            for nth in range(len(state.rows[slot])):
                kept = kept and _put_off(kept, slot, nth, least[state.robot] - self.windows[place])
        return kept


def _put_off(state: MergedState, slot: int, nth: int, gap: int) -> MergedState | None:
    """The state with one part ready at least `gap` after now (before now if negative); None: this would delay now as well."""
    own = state.rows[slot][nth]
    if own.now + gap > _SLACK or state.now + gap > own.until + _SLACK:
        return None
    if state.waits[slot][nth] < state.now + gap:
        now, waits = _latest(state, own, state.now + gap)
        state = state._replace(now=now, waits=waits)
    if not any(row.waits[slot][nth] < row.now + gap for row in chain.from_iterable(state.rows)):
        return state
    rows = [tuple([_follows(row, own, row.now + gap) for row in there]) for there in state.rows]
    return state._replace(rows=tuple(rows))


def _follows(row: Row, own: Row, by: int) -> Row:
    """A row after the constraint that the part of row `own` is ready at least `by` after this row's part."""
    now, waits = _latest(row, own, by)
    return Row(now, waits, min(row.until, own.until - by) if own.until < FAR else row.until)


def _shifted(waits: Waits, by: int) -> Waits:
    return tuple([tuple([at + by for at in there]) for there in waits])


def _latest(one: MergedState | Row, own: Row, by: int) -> tuple[int, Waits]:
    """The maximum of `now` and `waits` and of those of row `own`, shifted by `by`."""
    waits = [
        tuple([at if at > other + by else other + by for at, other in zip(*both, strict=False)]) if both[0] else ()
        for both in zip(one.waits, own.waits, strict=True)
    ]
    return max(one.now, own.now + by), tuple(waits)
