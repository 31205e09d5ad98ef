"""The states of a cell with identical parts merged: how many parts are in each position, not which. Searches and learners
use them."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate, chain
from typing import NamedTuple

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.precedence import allows
from lab.sequencing.cell.routes import entry
from lab.sequencing.cell.ways import FAR, TICKS_PER_S, Way, distances, empty_ticks, loaded_ticks, ticks, ways_of
from lab.sequencing.simulate.run import SLACK_S, Run

_BITS = 8  # bits of one count in the code of all counts, enough for MAX_PARTS
_LOW = (1 << _BITS) - 1
Choices = Mapping[tuple[int, int], Way]  # by position and choice, in their order
MergedKey = tuple[int, int, tuple[int, ...]]
Who = tuple[tuple[int, ...], ...]
Waits = tuple[tuple[int, ...], ...]


class Row(NamedTuple):
    """The least times from when a part is ready to `now` and to each of `waits`, however late the part is ready [ticks].

    until: how late the part may become ready, given what was picked since; FAR: without limit.
    """

    now: int
    waits: Waits
    until: int = FAR


class MergedState(NamedTuple):
    """A state between two moves, in ticks: the counts of parts by position, the robot's station, and the times waited for.

    Of the parts of one product in one position, the first that is ready, and not too late, moves first. waits: by slot (see
    `MergedCell`), when each part there is ready, ascending, and never before `now` unless it has a latest pick; where parts
    arrive, the last slot holds the arrivals of parts that were not fetched yet. who: by position, the unfinished parts in the
    order of their waits; None: parts are not named. rows: by slot, a row for each part there with a latest pick; only in a
    `WindowedCell`. way, part (0: not named) and nth (which of its position's parts, from 0): the move from `parent` to here.
    """

    now: int
    counts: int
    robot: int
    waits: Waits
    who: Who | None = None
    way: Way | None = None
    part: int = 0
    parent: "MergedState | None" = None
    nth: int = 0
    rows: tuple[tuple[Row, ...], ...] = ()


class MergedCell:
    """The cell in ticks, and the transitions between its states.

    slots: the index in `waits` of each position where parts are waited for. process: the processing that begins in each position
    [ticks]; None: none begins. starts, ends: the positions where parts begin and finish. one_by_one: whether each part sets out
    when the one before is picked. latest: by position, how long after a part is ready it may be picked [ticks].
    """

    def __init__(self, cell: Cell) -> None:
        if not cell.serial:
            raise BadInput(
                "the search of states is for cells of one robot, and machines without servers: --method cp-sat is for all"
            )
        self.cell, self._empty = cell, empty_ticks(cell)
        self._loaded = loaded_ticks(cell)
        process = [place.processing_s for place in cell.positions]
        self.process = [None if seconds is None else round(seconds * TICKS_PER_S) for seconds in process]
        later = {cell.begin_at[part - 1] for part in cell.unfinished if cell.begin_s[part - 1] > 0}
        limits = {n: place.at_most_s for n, place in enumerate(cell.positions) if place.at_most_s is not None}
        self.latest = {n: round((at_most_s + SLACK_S) * TICKS_PER_S) for n, at_most_s in limits.items()}
        later |= set(self.latest)
        later |= {n for n, place in enumerate(cell.positions) if cell.batches.intersection(place.holds)}
        timed = [n for n, seconds in enumerate(process) if seconds is None or seconds > 0 or n in later]
        self._past = [
            -1 - self.latest[n] if n in self.latest else 0 for n in timed
        ]  # all times beyond it are equally late
        self.slots = {place: slot for slot, place in enumerate(timed)}
        intervals_s = [cell.arrivals.interval_s[part - 1] for part in cell.coming] if cell.arrivals is not None else []
        self._intervals = ticks(intervals_s)
        self.one_by_one = bool(self._intervals) and cell.arrivals is not None and cell.arrivals.after == "pick"
        self.starts = frozenset(cell.starts[part - 1] for part in cell.coming)
        self.ends = [place for place, at in enumerate(cell.positions) if not at.options]
        # For each machine with batches, a bit of the code above all counts: a part was taken out and it is not empty yet.
        self._closed = {station: 1 << _BITS * len(process) + n for n, station in enumerate(sorted(cell.batches))}
        self._inside = {
            station: [n for n, place in enumerate(cell.positions) if station in place.holds] for station in cell.batches
        }
        self._ways: list[list[Way]] = [[] for _ in cell.positions]
        for way in ways_of(cell):
            self._ways[way.place].append(way)
        self._known: dict[int, Choices] = {}
        self._fetching = self._times_to_fetch() if self.latest else {}

    def start(self, *, named: bool = False) -> MergedState:
        """The initial state; named: whether parts are told apart."""
        begin = self.of_run(Run(self.cell))
        waits = list(begin.waits)
        if self._intervals and not self.one_by_one:  # arrivals are sums of integer ticks, not of seconds
            waits[-1] = tuple(accumulate(self._intervals))
        return begin._replace(waits=tuple(waits), who=begin.who if named else None)

    def of_run(self, run: Run) -> MergedState:
        """The state of a run, with parts told apart, to continue from by the cell's own times."""
        now, ready = round(run.now_s * TICKS_PER_S), [round(ready_s * TICKS_PER_S) for ready_s in run.ready_s]
        who: list[list[int]] = [[] for _ in self._ways]
        for part, place in enumerate(run.locations, 1):
            if self._ways[place]:
                who[place].append(part)
        for place, parts in enumerate(who):
            if not (self._intervals and place in self.starts):  # parts that arrive stay in their order
                parts.sort(key=lambda part: ready[part - 1])
        past = zip(self.slots, self._past, strict=True)
        waits = [tuple([max(ready[part - 1], now + least) for part in who[place]]) for place, least in past]
        if self._intervals:
            waits.append(tuple(ready[part - 1] for part in sorted(n for place in self.starts for n in who[place])))
        counts = self._code_of(run.locations)
        for station, closed in self._closed.items():
            counts |= closed if run.occupied[station] > len(run.inside(station)) else 0
        return MergedState(now, counts, run.robot, tuple(waits), tuple(map(tuple, who)))

    def code(self, counts: Sequence[int]) -> int:
        """The counts of parts by position as one number."""
        return sum(count << _BITS * place for place, count in enumerate(counts))

    def counted(self, counts: int) -> list[int]:
        """The counts of parts by position from their code."""
        return [counts >> _BITS * place & _LOW for place in range(len(self._ways))]

    def finished(self, state: MergedState) -> int:
        """The number of parts at an end of their routes."""
        return sum([state.counts >> _BITS * place & _LOW for place in self.ends])

    def done(self, state: MergedState) -> bool:
        """Whether all parts are finished."""
        return self.finished(state) == self.cell.parts  # which includes parts that make no move

    def fetched(self, state: MergedState) -> int:
        """The number of parts that have left the start of their routes."""
        return len(self.cell.coming) - sum([state.counts >> _BITS * place & _LOW for place in self.starts])

    def key(self, state: MergedState) -> MergedKey:
        """The key of a state when parts are identical: counts, robot, and the waits counted from now."""
        now = state.now
        if not self.latest:
            return state.counts, state.robot, tuple([max(at - now, 0) for row in state.waits for at in row])
        rows = zip(state.waits, chain(self._past, [0]), strict=False)  # the last entry is for arrivals, if any
        return state.counts, state.robot, tuple([max(at - now, least) for row, least in rows for at in row])

    def choices(self, state: MergedState) -> Choices:
        """The options that are allowed now, one for each option of a position, since its parts are identical."""
        known = self._known.get(state.counts)
        if known is None:
            known = self._known[state.counts] = self._allowed(state.counts)
        if self.latest:
            return {at: way for at, way in known.items() if self._in_time(state, way)}
        return known

    def successors(self, state: MergedState) -> Iterator[MergedState]:
        """The states after each allowed option; in a cell with time windows, after each part that is not too late, since the
        first one is not always the best."""
        for way in self.choices(state).values():
            for nth in self._in_time(state, way) if self.latest else (0,):
                yield self.after(state, way, nth=nth)

    def after(self, state: MergedState, way: Way, part: int = 0, nth: int = -1) -> MergedState:
        """The state after an allowed option, taken by the first part that is ready and not too late.

        part: the part that takes it, where parts are named; nth: the index of that part (from 0) among those in its position.
        """
        place, option, _ = way
        who, first = state.who, nth
        if nth < 0:
            first = self._in_time(state, way)[0] if self.latest else 0
        if who is not None:
            first = who[place].index(part) if part else first
            part = who[place][first]
        now, counts, rows, behind = self.moments(state, state.now, state.waits, way, first)
        named = None if who is None else self._moved(who, way, first, behind)
        return MergedState(now, counts, option.target, rows, named, way, part, state, first)

    def moments(
        self, state: MergedState, now: int, waits: Waits, way: Way, first: int, behind: int | None = None
    ) -> tuple[int, int, Waits, int | None]:
        """The counts, `now` and `waits` after an option taken by the part of index `first` in its position, and `behind`.

        behind: how many of the parts that wait in the new position stay before it; None: those that are ready no later. Each
        moment is a maximum of earlier moments plus times, so the function applies to differences of moments, too.
        """
        (place, option, work), there = way, list(waits)
        ready, slot, starts = now, self.slots.get(place), bool(self._intervals) and place in self.starts
        if slot is not None:
            ready, there[slot] = waits[slot][first], waits[slot][:first] + waits[slot][first + 1 :]
        elif starts:
            ready = waits[-1][0]
        now += self._empty[state.robot][option.origin]
        now = (max(now, ready) if option.waits else now) + work
        slot = self.slots.get(option.to)
        if slot is not None:
            process, row = self.process[option.to], there[slot]
            at = ready if process is None else now + process
            behind = bisect_right(row, at) if behind is None else behind
            there[slot] = (*row[:behind], at, *row[behind:])
        counts = state.counts + (1 << _BITS * option.to) - (1 << _BITS * place)
        if self._closed:
            counts = self._batches(counts, way, now, there)
        coming = there.pop() if self._intervals else None
        # A part that was ready before counts as ready now, so that more states are equal.
        past = zip(there, self._past, strict=True)
        rows = [tuple([max(tick, now + least) for tick in row]) if row else () for row, least in past]
        if coming is not None:
            pick = now - self._loaded[option.origin][option.target]
            rows.append(self._left_to_come(coming, self.fetched(state), pick) if starts else coming)
        return now, counts, tuple(rows), behind

    def _batches(self, counts: int, way: Way, now: int, waits: list[tuple[int, ...]]) -> int:
        """The code of counts after an option, with batches: a machine that a part was taken from is closed, and all parts in a
        machine that a part was brought to begin together, which is written into `waits`."""
        counted = self.counted(counts)
        for station, closed in self._closed.items():
            inside = [n for n in self._inside[station] if counted[n]]
            if way.place in self._inside[station]:
                counts = counts | closed if inside else counts & ~closed
            elif way.option.to in inside:
                at = now + max(self.process[n] or 0 for n in inside)
                for n in inside:
                    waits[self.slots[n]] = (at,) * counted[n]
        return counts

    def waited(self, state: MergedState, ahead: MergedState) -> int:
        """The robot's wait in the move from a state to its successor `ahead` [ticks]."""
        assert ahead.way is not None
        return ahead.now - state.now - ahead.way.work - self._empty[state.robot][ahead.way.option.origin]

    def decision(self, state: MergedState) -> int:
        """The decision that led to a state in which parts are named."""
        assert state.way is not None
        return entry(state.part, state.way.option.choice, self.cell.parts)

    def decisions(self, state: MergedState) -> tuple[int, ...]:
        """All decisions from the start to a state, whose parts need not be named."""
        steps, named = list[tuple[Way, int]](), self.start(named=True)
        while state.way is not None and state.parent is not None:
            steps.append((state.way, state.nth))
            state = state.parent
        allowed = []
        for way, nth in reversed(steps):
            named = self.after(named, way, nth=nth)
            allowed.append(self.decision(named))
        return tuple(allowed)

    def too_late(self, state: MergedState) -> bool:
        """Whether some part can no longer be picked in time, whatever the robot does."""
        for place, least in self._fetching.items():
            there = state.waits[self.slots[place]]
            if there and state.now + least[state.robot] > there[0] + self.latest[place]:
                return True
        return False

    def in_time(self, state: MergedState, way: Way, nth: int) -> bool:
        """Whether the part of index `nth` (from 0) in an option's position would be picked in time."""
        place, option, work = way
        if place not in self.latest or not option.waits:
            return True
        ready, service = state.waits[self.slots[place]][nth], work - self._loaded[option.origin][option.target]
        return max(state.now + self._empty[state.robot][option.origin], ready) + service <= ready + self.latest[place]

    def _in_time(self, state: MergedState, way: Way) -> list[int]:
        """The indices (from 0) of the parts in an option's position that would be picked in time, one of identical states."""
        there = state.waits[self.slots[way.place]] if way.place in self.slots else (0,)
        differ = [nth for nth, ready in enumerate(there) if nth == 0 or ready != there[nth - 1]]
        return [nth for nth in differ if self.in_time(state, way, nth)]

    def _code_of(self, locations: Sequence[int]) -> int:
        return self.code([locations.count(place) for place in range(len(self._ways))])

    def _allowed(self, counts: int) -> Choices:
        cell, counted, occupied = self.cell, self.counted(counts), [0] * len(self.cell.stations)
        for count, place in zip(counted, cell.positions, strict=True):
            for station in place.holds:
                occupied[station] += count
        for station, closed in self._closed.items():
            occupied[station] = cell.capacities[station] if counts & closed else occupied[station]
        full = [taken >= most for taken, most in zip(occupied, cell.capacities, strict=True)]
        waiting = sum(counted[place] for place in self.starts)
        in_turn = cell.starts[cell.coming[-waiting] - 1] if waiting and self._intervals else None
        return {
            (place, way.option.choice): way
            for place, count in enumerate(counted)
            if count and (in_turn in (None, place) or place not in self.starts)
            for way in self._ways[place]
            if way.option.possible(full) and allows(cell.rules, counted, place, way.option)
        }

    def _times_to_fetch(self) -> dict[int, list[int]]:
        """By position with a latest pick and by the robot's station, the least time until a part is picked there [ticks]."""
        far, times = distances(self.cell), dict[int, list[int]]()
        for place in self.latest:
            out = [way for way in self._ways[place] if way.option.waits]
            service = [way.work - self._loaded[way.option.origin][way.option.target] for way in out]
            pairs = list(zip(out, service, strict=True))
            if pairs:
                times[place] = [min(row[way.option.origin] + more for way, more in pairs) for row in far]
        return times

    def _left_to_come(self, coming: tuple[int, ...], fetched: int, pick: int) -> tuple[int, ...]:
        """The arrivals left once the first part is picked, when the next one sets out where arrivals follow picks."""
        coming, following = coming[1:], fetched + 1
        if not self.one_by_one or following == len(self.cell.coming):
            return coming
        return (pick + self._intervals[following], *coming[1:])

    def _moved(self, who: Who, way: Way, first: int, behind: int | None) -> Who:
        """The named parts by position after a move: the part of index `first` goes behind `behind` others; None: behind all."""
        rows, (place, option, _) = list(who), way
        part, rows[place] = who[place][first], who[place][:first] + who[place][first + 1 :]
        if self._ways[option.to]:
            there = rows[option.to]
            rows[option.to] = (*there[:behind], part, *(() if behind is None else there[behind:]))
        return tuple(rows)
