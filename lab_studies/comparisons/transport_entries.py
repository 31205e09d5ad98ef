"""One entry of the board: a method on an instance for some seconds, its improvements by time, and its schedule as plain rows."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from time import perf_counter
from typing import Any

from lab.errors import BadInput, WorkFailed
from lab.sequencing import SEQUENCERS, find_sequence
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN
from lab.sequencing.cell.schedule import Schedule, rows_of
from lab.sequencing.search import EpisodeSequenced, Search
from lab.sequencing.simulate.follow import follow, simulate
from lab.studies.runner import record_of
from lab_studies.comparisons.transport_instances import Instance, cell_of

CYCLIC = "cyclic"
FIRST = 50  # episodes of the first session
GROWS, SHARE = (
    10.0,
    0.9,
)  # a session may be so many times longer than the one before, and take this share of the time left
CP_SAT_WORKERS = 6  # threads with different searches, also on two cores
CYCLES_SHOWN = 12  # parts of a cyclic order in its schedule
KEPT = ("part", "operation", "station", "target", "robot", "start_s", "end_s")  # the fields of a schedule's rows

Proof = tuple[tuple[int, ...], str, float, str]  # a sequence and who found it; a bound and who proved it


@dataclass(frozen=True)
class Entry:
    """A method on an instance, its time [s], and its seed."""

    instance: Instance
    method: str
    seconds: float
    seed: int


@dataclass(frozen=True)
class EntryResult:
    """The result of an entry, in the instance's unit of time. trace: (seconds, cost) of each improvement.

    refused: why the method does not take the cell or found nothing, else "". schedule: rows with the fields KEPT of an order
    that ends at `ends_s`; a cyclic order's cost is its period, and its schedule has CYCLES_SHOWN parts.
    """

    cost: float | None = None
    found_by: str = ""
    bound: float = 0.0
    bound_by: str = ""
    trace: tuple[tuple[float, float], ...] = ()
    wall_s: float = 0.0
    refused: str = ""
    schedule: tuple[tuple[Any, ...], ...] = ()
    ends_s: float = 0.0
    parts: int = field(default=0)

    @classmethod
    def of_json(cls, kept: Mapping[str, Any]) -> "EntryResult":
        """The result that was kept as JSON. Raises ValueError for anything else."""
        return record_of(cls, kept)


def methods_for(instance: Instance) -> tuple[str, ...]:
    """The methods that are tried on an instance: all but those that need due times."""
    return (CYCLIC,) if instance.is_cyclic else tuple(name for name in SEQUENCERS if name != "earliest-due")


def entry_result(entry: Entry) -> EntryResult:
    """The result of one entry; if its method does not take the cell, `refused` says why."""
    try:
        cell = cell_of(entry.instance)
        if entry.method == CYCLIC:
            return _cyclic(entry, cell)
        if prove := PROVERS.get(entry.method):
            return _proven(entry, cell, prove)
        return _by_episodes(entry, cell)
    except (BadInput, WorkFailed) as error:
        return EntryResult(refused=str(error))


class _Over(Exception):
    """Raised when the time is over."""


@dataclass
class _Watch:
    """A listener that records improvements, and raises _Over after so many seconds."""

    seconds: float
    began_s: float = field(default_factory=perf_counter)
    best: tuple[int, ...] = ()
    cost: float = inf
    trace: list[tuple[float, float]] = field(default_factory=list)

    @property
    def past_s(self) -> float:
        return perf_counter() - self.began_s

    def hear(self, event: EpisodeSequenced) -> None:
        now_s = self.past_s
        if event.best and event.best_cost < self.cost:
            self.best, self.cost = event.best, event.best_cost
            self.trace.append((now_s, event.best_cost))
        if now_s > self.seconds:
            raise _Over


def _by_episodes(entry: Entry, cell: Cell) -> EntryResult:
    """The result of ever longer sessions until the time is over; compiling, in a first episode, does not count."""
    find_sequence(cell, entry.method, Search(1), entry.seed)
    watch, episodes, session = _Watch(entry.seconds), FIRST, 1
    try:
        while True:
            began_s = watch.past_s
            search = Search(episodes, on_episode=watch.hear)
            sequenced = find_sequence(cell, entry.method, search, entry.seed, session)
            if len(sequenced.episode_costs) < episodes:
                break  # a rule has one sequence
            left, took_s = entry.seconds - watch.past_s, max(watch.past_s - began_s, 1e-6)
            episodes, session = int(episodes * min(GROWS, SHARE * left / took_s)), session + 1
            if episodes < 1:
                break
    except _Over:
        pass
    return _measured(
        cell, watch.best, EntryResult(found_by=entry.method, trace=tuple(watch.trace), wall_s=watch.past_s)
    )


def _proven(entry: Entry, cell: Cell, prove: "Callable[[Entry, Cell], Proof]") -> EntryResult:
    began_s = perf_counter()
    sequence, found_by, bound, bound_by = prove(entry, cell)
    wall_s = perf_counter() - began_s
    result = EntryResult(found_by=found_by, bound=bound, bound_by=bound_by, wall_s=wall_s)
    done = _measured(cell, sequence, result)
    return replace(done, trace=() if done.cost is None else ((wall_s, done.cost),))


def _measured(cell: Cell, sequence: tuple[int, ...], result: EntryResult) -> EntryResult:
    """The result with the cost of the sequence and its schedule."""
    if not sequence:
        return replace(result, refused=result.refused or "no order was found in its time")
    return replace(_with_schedule(cell, simulate(cell, sequence), result), cost=follow(cell, sequence).end_s)


def _with_schedule(cell: Cell, schedule: Schedule, result: EntryResult) -> EntryResult:
    rows = tuple(tuple(row[name] for name in KEPT) for row in rows_of(schedule, cell, "planned"))
    return replace(result, schedule=rows, ends_s=schedule.makespan_s, parts=cell.parts)


def _cyclic(entry: Entry, cell: Cell) -> EntryResult:
    from lab.sequencing.cyclic.cycle import best_cycle
    from lab.sequencing.cyclic.unrolled import of_parts, unrolled

    began_s = perf_counter()
    mix = tuple(dict.fromkeys(cell.order))
    cycle = best_cycle(cell, mix, entry.seconds, entry.seed)
    wall_s = perf_counter() - began_s
    shown = unrolled(cycle, of_parts(cell, mix, CYCLES_SHOWN))
    result = EntryResult(cycle.period_s, CYCLIC, cycle.bound_s, CYCLIC, ((wall_s, cycle.period_s),), wall_s)
    return _with_schedule(shown.cell, shown.schedule, result)


def _exact(entry: Entry, cell: Cell) -> Proof:
    from lab.sequencing.methods.exact import optimum
    from lab.sequencing.methods.one_robot import one_robot, why_not

    if cell.serial:
        state = optimum(cell)
        return state.sequence, "A*", state.bound_s, "A*"
    if why := why_not(cell):
        raise BadInput(f"neither by states nor by tours: {why}")
    tour = one_robot(cell, entry.seconds)
    return tour.sequence, "tours", tour.bound, "tours"


def _cp_sat(entry: Entry, cell: Cell) -> Proof:
    from lab.sequencing.methods.cp_sat import cp_sat

    solved = cp_sat(cell, MAKESPAN, entry.seconds, entry.seed, None, CP_SAT_WORKERS)
    return solved.sequence, "CP-SAT", solved.bound, "CP-SAT"


def _portfolio(entry: Entry, cell: Cell) -> Proof:
    from lab.sequencing.methods.portfolio import best_known

    solved = best_known(cell, MAKESPAN, entry.seconds, entry.seed, CP_SAT_WORKERS)
    return solved.sequence, solved.found_by, solved.bound, solved.bound_by


PROVERS: dict[str, Callable[[Entry, Cell], Proof]] = {"exact": _exact, "cp-sat": _cp_sat, "portfolio": _portfolio}
