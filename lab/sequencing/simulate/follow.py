"""The simulation of a whole list of decisions, with the deliberate waits that it needs."""

from collections.abc import Iterator, Sequence
from math import inf
from typing import NamedTuple

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import SERVER, Option, part_of
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.simulate.run import NO_WAIT, SLACK_S, Run, Wait, Windowless, branch

TINY_S = 1e-9  # tolerance within which sums of times are equal


class Arc(NamedTuple):
    """A difference constraint: begin[then] >= begin[one] + least_s - periods * period."""

    one: int
    then: int
    least_s: float
    periods: int


def earliest(arcs: Sequence[Arc], moves: int, first: int, period_s: float) -> tuple[list[float], list[Arc]]:
    """The earliest begins after the first move's, and a violated circuit of arcs, empty if there is none (Bellman and Ford)."""
    begin_s, by = [-inf] * moves, dict[int, Arc]()
    begin_s[first], late = 0.0, -1
    for _ in range(moves + 1):
        late = -1
        for arc in arcs:
            at_s = begin_s[arc.one] + arc.least_s - arc.periods * period_s
            if at_s > begin_s[arc.then] + TINY_S:
                begin_s[arc.then], by[arc.then], late = at_s, arc, arc.then
        if late < 0:
            return begin_s, []
    for _ in range(moves):  # after so many steps back the arc is on the circuit
        late = by[late].one
    broken = [by[late]]
    while broken[-1].one != late:
        broken.append(by[broken[-1].one])
    return begin_s, broken


# ---- The waits of a list of decisions ---------------------------------------------------------------------------------


def waits_of(start: Run, sequence: Sequence[int], beyond_s: float = 0.0) -> tuple[Wait, ...] | None:
    """The least waits, one for each decision, with which a list satisfies all time windows from a run's state; None: none do.

    The list is the order of use of each robot, server, room and stretch of track, and every move is made as early as that order
    and the windows allow. That is the least solution of difference constraints, so no other timing ends any move earlier.
    beyond_s: by how much the windows are widened, at most by their own length [s].
    Source: simple temporal networks, Dechter, Meiri and Pearl 1991; hoist scheduling, Che and Chu 2004.
    """
    if not start.cell.serial:
        return waits_of_several(start, sequence, beyond_s)
    run, network = Windowless(start.cell, start.times, start), _Network(start, beyond_s)
    for decision in sequence:
        option = run.option(decision)
        if option is None:
            return None
        network.add(part_of(decision, start.cell.parts), run, option)
        run.move(decision)
    return network.waits()


def _window_s(at_most_s: float, beyond_s: float) -> float:
    return at_most_s + min(max(at_most_s, SLACK_S), beyond_s)


def waits_of_several(start: Run, sequence: Sequence[int], beyond_s: float) -> tuple[Wait, ...] | None:
    """The least waits with several robots or servers; None: no waits help.

    A part that would be picked too late is made ready later, by a later drop or begin of work, and the list is simulated again,
    until no part is late. Each pass satisfies all constraints that point forward in the list; only windows point backward. So a
    wait that still grows after as many passes as there are decisions lies on a circuit and would grow for ever (Bellman and
    Ford). Parts are picked as early as possible, since that frees room for others.
    """
    cell, ready_s = start.cell, [0.0] * len(sequence)  # by decision: the earliest time at which its part becomes ready
    for _ in range(len(sequence) + 1):
        run, waits, last, late = Windowless(cell, start.times, start), list[Wait](), dict[int, int](), False
        for number, decision in enumerate(sequence):
            part, option = part_of(decision, cell.parts), run.option(decision)
            if option is None:
                return None
            pick_s, at_most_s = run.pick_s(part, option), cell.positions[run.locations[part - 1]].at_most_s
            begun_s = pick_s if option.robot == SERVER else run.drop_s(part, option)
            begins = cell.positions[option.to].processing_s is not None
            least_s = ready_s[number] - run.times.processing_s(part, option.to) if begins else 0.0
            wait_s = max(0.0, least_s - begun_s)
            waits.append(Wait(pick_s=wait_s) if option.robot == SERVER else Wait(drop_s=wait_s))
            if at_most_s is not None and option.waits:
                least_s = pick_s + waits[-1].pick_s - _window_s(at_most_s, beyond_s)
                if least_s > run.ready_s[part - 1] + SLACK_S / 2:
                    if part not in last:
                        return None
                    ready_s[last[part]], late = least_s, True
            if begins:
                last[part] = number
            run.move(decision, waits[-1])
        if not late:
            return tuple(waits)
    return None


class _Timed(NamedTuple):
    """The constraints of a move: on its begin, from its begin to its drop, and its latest begin; None: it has no latest."""

    comes: Sequence[Arc]
    carried: Arc
    latest: Arc | None


class _Network:
    """The constraints between moves. Moment 0 is time 0; moments 2 n - 1 and 2 n are the begin of move n's work and its drop."""

    def __init__(self, start: Run, beyond_s: float) -> None:
        self._cell, self._begins_s, self._beyond_s = start.cell, start.now_s, beyond_s
        self._moves = list[_Timed]()
        self._ready = dict[int, tuple[int, float]]()  # by part: it is ready so long [s] after this moment
        self._next: tuple[int, float] | None = None  # where arrivals follow picks: the same for the next arrival

    def add(self, part: int, run: Run, option: Option) -> None:
        """Adds the next move of a run, before it is made."""
        cell, drop = self._cell, 2 * len(self._moves)
        begin, robot, place = drop + 1, cell.robots[option.robot], run.locations[part - 1]
        at, at_most_s = run.robots_at[option.robot], cell.positions[place].at_most_s
        empty_s = 0.0 if at == option.origin else float(cell.empty_s[at, option.origin]) / robot.speed
        comes = [Arc(drop, begin, empty_s if drop else self._begins_s + empty_s, 0)]
        after_pick = cell.arrivals is not None and cell.arrivals.after == "pick" and place == cell.starts[part - 1]
        latest = Arc(begin, begin, 0.0, 0) if after_pick else None
        since, later_s = 0, run.ready_s[part - 1]
        if part in self._ready:
            since, later_s = self._ready[part]
        elif after_pick and self._next is not None:
            since, later_s = self._next
        if option.waits:
            comes.append(Arc(since, begin, later_s, 0))
            if at_most_s is not None:
                latest_s = later_s + _window_s(at_most_s, self._beyond_s) - option.service_s
                latest = Arc(begin, since, -latest_s, 0)
        self._moves.append(_Timed(comes, Arc(begin, begin + 1, option.service_s + run.carry_s(option), 0), latest))
        if after_pick and run.fetched + 1 < len(cell.coming):
            interval_s = run.times.interval_s(cell.coming[run.fetched + 1])
            self._next = begin, option.service_s + interval_s
        there, does = cell.positions[option.to], {part: option.to}
        if there.processing_s is not None:
            if there.station in cell.batches:  # all parts in it begin together
                does |= {other: run.locations[other - 1] for other in run.inside(there.station)}
            longest_s = max(run.times.processing_s(*item) for item in does.items())
            self._ready |= dict.fromkeys(does, (begin + 1, longest_s))

    def waits(self) -> tuple[Wait, ...] | None:
        """The waits before the begin and the drop of each move; None: no waits satisfy all constraints.

        Where a drop must wait, its part is picked as late as possible: it rather stays where it is than is held by the gripper.
        """
        arcs = [
            arc for comes, carried, latest in self._moves for arc in (*comes, carried, *((latest,) if latest else ()))
        ]
        at_s, broken = earliest(arcs, 2 * len(self._moves) + 1, 0, 0.0)
        return None if broken else tuple(_wait(move, at_s) for move in self._moves)


def _wait(move: _Timed, at_s: Sequence[float]) -> Wait:
    """The waits of a move, from the times of all moments."""
    begin_s = at_s[move.carried.one]
    earliest_s = max(at_s[arc.one] + arc.least_s for arc in move.comes)
    held_s = at_s[move.carried.then] - begin_s - move.carried.least_s
    later_s = held_s if move.latest is None else at_s[move.latest.then] - move.latest.least_s - begin_s
    later_s = min(held_s, max(0.0, later_s))
    return Wait(begin_s + later_s - earliest_s, held_s - later_s)


# ---- sequences carried out, and their waits ---------------------------------------------------------------------------


def waits_in(start: Run, sequence: Sequence[int]) -> tuple[Wait, ...]:
    """The deliberate waits with which a list satisfies all time windows from the state of a run; empty where no waits are
    needed, or none would help."""
    if not start.cell.has_windows:
        return ()
    run = branch(start)
    for decision in sequence:
        if run.option(decision) is None:
            # Rounded times may make a circuit infeasible; then the windows are widened by the rounding error.
            waits = run.spoils(decision) and (waits_of(start, sequence) or waits_of(start, sequence, SLACK_S / 2))
            return waits or ()
        run.move(decision)
    return ()


def steps(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Iterator[tuple[Run, int, Wait]]:
    """The run before each decision of a list, the decision, and its deliberate wait; the caller must make the move."""
    run, waits = Run(cell, times), waits_in(Run(cell), sequence)
    for number, decision in enumerate(sequence):
        yield run, decision, waits[number] if waits else NO_WAIT


def spoils(cell: Cell, sequence: Sequence[int]) -> bool:
    """Whether a list of decisions picks a part too late, whatever the deliberate waits."""
    for run, decision, wait in steps(cell, sequence) if cell.has_windows else ():
        if run.spoils(decision):
            return True
        run.move(decision, wait)
    return False


def follow(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Run:
    """The run after a list of decisions; raises BadInput when one of them is not allowed."""
    run = Run(cell, times)
    for run, decision, wait in steps(cell, sequence, times):
        run.move(decision, wait)
    return run


def simulate(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Schedule:
    """The schedule of a sequence of decisions (see `Run`; one entry per move), with the cell's times or an episode's.

    Robots and servers wait deliberately where a part would otherwise be picked too late (see `waits_of`).
    Raises BadInput, with the position, for a decision that is not allowed there and for a sequence that ends too early.
    Source: thesis ch. 7.4, 7.5; makespan to the last arrival at the end of a route.
    """
    run = Run(cell, times)
    came_s: list[float] = [0.0] * cell.parts
    for run, decision, wait in steps(cell, sequence, times):
        reason = run.refusal(decision)
        if reason:
            allowed = ", ".join(str(other) for other in run.allowed()) or (
                "none, all are done" if run.done else "none, it is a deadlock"
            )
            raise BadInput(f"position {len(run.moves) + 1} of the sequence: {reason}; allowed here: {allowed}")
        part = part_of(decision, cell.parts)
        if run.locations[part - 1] == cell.starts[part - 1]:
            came_s[part - 1] = run.ready_s[part - 1]
        run.move(decision, wait)
    if not run.done:
        left = run.finished_s.index(None) + 1
        where = cell.names[cell.positions[run.locations[left - 1]].station]
        raise BadInput(
            f"the sequence ends after {counted(len(run.moves), 'move')}, but {cell.part_name(left)} is still at '{where}'"
        )
    return Schedule.from_moves(cell, run.moves, sequence, came_s)


def closes(run: Run, station: int, following: Sequence[int]) -> bool:
    """Whether the following decisions take a part out of a machine with batches before they bring another one in."""
    ahead = Windowless(run.cell, run.times, run)
    for decision in following:
        option = ahead.option(decision)
        if option is None or option.origin == station:
            return True
        if option.target == station:
            return False
        ahead.move(decision)
    return True
