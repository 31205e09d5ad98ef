"""Dispatching rules, the sequences that they give, and the work left and loads that they compare.

A rule picks the allowed decision with the least or highest value of one number; ties go to the lowest decision. It looks at the
present state of a run only, so the same rule plans (by a cell's own times) and reacts (see `simulate.execution`). Every rule may
end in a deadlock where the cell has one.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from types import MappingProxyType

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.cell.routes import SERVER, Option, from_the_ends, part_of
from lab.sequencing.search import Search, SequenceResult, only_one
from lab.sequencing.simulate.run import Run

Rule = Callable[[Run, tuple[int, ...]], int]


def shortest_move(run: Run, allowed: tuple[int, ...]) -> int:
    """The shortest move: travel to the pick, service there, and the way to the drop; waiting does not count.

    Source: shortest travel time, STT/D, of Egbelu and Tanchoco 1984, with the loaded part of the way.
    """

    def seconds(option: Option) -> float:
        if option.robot == SERVER:
            return 0.0
        return run.reach_s(option) - run.robots_s[option.robot] + option.service_s + run.carry_s(option)

    return min(allowed, key=lambda decision: (seconds(_option(run, decision)), *_soonest(run, decision)))


def longest_remaining_work(run: Run, allowed: tuple[int, ...]) -> int:
    """The part with the most work left: the rest of its processing, then processing, moves and services to its end.

    Where a part has several routes left, the shortest one counts. Source: MWKR in Panwalkar and Iskander 1977.
    """
    left_s = work_left_s(run.cell)

    def seconds(decision: int) -> float:
        index = part_of(decision, run.cell.parts) - 1
        return max(0.0, run.ready_s[index] - run.now_s) + left_s[run.locations[index]]

    return min(allowed, key=lambda decision: (-seconds(decision), *_soonest(run, decision)))


def most_urgent_machine(run: Run, allowed: tuple[int, ...]) -> int:
    """The decision that feeds or empties the machine most behind; of several the one that drops soonest.

    Most behind is the machine that would end last if it never stood idle from now on: the end of its present work plus all
    processing still to come (divided by its capacity; parts that may choose between routes count in equal shares). A machine
    with no work to come is never behind. A decision feeds the first machine that the part comes to, and empties the one that it
    leaves. Source: bottleneck starvation avoidance, Glassey and Resende 1988.
    """
    ends_s = _machine_ends_s(run)
    feeds = _feeds(run.cell)

    def key(decision: int) -> tuple[float, float, int]:
        option = _option(run, decision)
        here = run.cell.positions[run.locations[part_of(decision, run.cell.parts) - 1]]
        served = {option.target} if option.robot == SERVER else {*feeds[option.to], *here.holds}
        return (
            -max((ends_s.get(station, 0.0) for station in served), default=0.0),
            run.drop_s(part_of(decision, run.cell.parts), option),
            decision,
        )

    return min(allowed, key=key)


def earliest_due(run: Run, allowed: tuple[int, ...]) -> int:
    """The part that is due first; BadInput when the cell has no due times. Source: EDD, Jackson 1955."""
    due_s = run.cell.due_s
    if due_s is None:
        raise BadInput("rule 'earliest-due': the cell has no due times (due_s)")
    return min(allowed, key=lambda decision: (due_s[part_of(decision, run.cell.parts) - 1], *_soonest(run, decision)))


def nearest_ready(run: Run, allowed: tuple[int, ...]) -> int:
    """The decision whose pick, or service before it, can begin soonest: when both robot and part are there and ready.

    Source: earliest start first, as non-delay schedules are generated (Baker 1974), with the robot as the resource.
    """

    def begin_s(decision: int) -> float:
        option = _option(run, decision)
        return run.pick_s(part_of(decision, run.cell.parts), option) - option.service_s

    return min(allowed, key=lambda decision: (begin_s(decision), decision))


# name -> function(run, allowed decisions) -> one of them
RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "shortest-move": shortest_move,
        "longest-remaining-work": longest_remaining_work,
        "most-urgent-machine": most_urgent_machine,
        "earliest-due": earliest_due,
        "nearest-ready": nearest_ready,
    }
)


def usable(cell: Cell) -> dict[str, Rule]:
    """The rules that this cell has the data for."""
    return {name: rule for name, rule in RULES.items() if cell.due_s is not None or rule is not earliest_due}


def dispatch(run: Run, rule: Rule) -> tuple[int, ...]:
    """The decisions by which a rule continues a run, until all parts are finished or none can move."""
    sequence = []
    while allowed := run.allowed():
        sequence.append(rule(run, allowed))
        run.move(sequence[-1])
    return tuple(sequence)


def dispatched(cell: Cell, rule: Rule, search: Search) -> SequenceResult:
    """A rule's sequence by the cell's own times.

    Raises BadInput for an objective or a rule that the cell has no data for, WorkFailed when it ends in a deadlock.
    """
    search.check(cell)
    run = Run(cell)
    sequence = dispatch(run, rule)
    return only_one(cell, search, sequence, cost(run, search.objective), run.done)


def first_come(cell: Cell) -> tuple[int, ...]:
    """A complete sequence: the part that is ready first goes first or, when that ends in a deadlock, one part after the other.

    A single part never meets a full station from the start, since every station has room for one. Where work begins in the
    middle, both may fail: then the sequence is empty.
    """
    run = Run(cell)
    ready_first = dispatch(
        run, lambda run, allowed: min(allowed, key=lambda d: run.ready_s[part_of(d, cell.parts) - 1])
    )
    if run.done:
        return ready_first
    run, sequence = Run(cell), list[int]()
    for part in range(1, cell.parts + 1):
        while run.finished_s[part - 1] is None:
            own = [decision for decision in run.allowed() if part_of(decision, cell.parts) == part]
            if not own:
                return ()
            sequence.append(own[0])
            run.move(own[0])
    return tuple(sequence)


def any_order(cell: Cell) -> tuple[int, ...]:
    """A complete sequence from the first quick method that finds one; empty when none does, since rules never look ahead."""
    if order := first_come(cell):
        return order
    for rule in usable(cell).values():
        order = dispatch(run := Run(cell), rule)
        if run.done:
            return order
    return ()


@lru_cache(maxsize=16)
def work_left_s(cell: Cell) -> tuple[float, ...]:
    """The work left from each position to the end by the shortest route [s], (positions,): moves, services and processing,
    without the processing in the position itself."""

    least_s = cell.loaded_s / max([robot.speed for robot in cell.robots], default=1.0)

    def left_s(place: int, ahead: list[float]) -> float:
        ways = [
            option.service_s
            + (0.0 if option.robot == SERVER else least_s[option.origin, option.target])
            + (cell.positions[option.to].processing_s or 0.0)
            + then
            for option, then in zip(cell.positions[place].options, ahead, strict=True)
        ]
        return min(ways, default=0.0)

    return tuple(from_the_ends(cell.positions, left_s))


@lru_cache(maxsize=16)
def loads_s(cell: Cell, least: bool = False) -> tuple[dict[int, float], ...]:
    """For each position, the processing still to come by station index [s]: the mean over the options, or with `least` the
    minimum."""

    def loads_s(place: int, ahead: list[dict[int, float]]) -> dict[int, float]:
        each = list[dict[int, float]]()
        for option, then in zip(cell.positions[place].options, ahead, strict=True):
            there, own = cell.positions[option.to], dict(then)
            machine = option.target if option.robot == SERVER else machine_of(cell, option.to)
            if there.processing_s and machine is not None:
                own[machine] = own.get(machine, 0.0) + there.processing_s
            each.append(own)
        stations = dict.fromkeys(station for own in each for station in own)
        ways = {station: [own.get(station, 0.0) for own in each] for station in stations}
        return {at: min(own) if least else sum(load / len(own) for load in own) for at, own in ways.items()}

    return tuple(from_the_ends(cell.positions, loads_s))


@lru_cache(maxsize=16)
def _feeds(cell: Cell) -> tuple[frozenset[int], ...]:
    """For each position, the machine that holds the part or, if none does, the machines that it may come to first."""

    def feeds(place: int, ahead: list[frozenset[int]]) -> frozenset[int]:
        ways = cell.positions[place].options
        machine = ways[0].target if ways and ways[0].robot == SERVER else machine_of(cell, place)
        return frozenset().union(*ahead) if machine is None else frozenset({machine})

    return tuple(from_the_ends(cell.positions, feeds))


def machine_of(cell: Cell, position: int) -> int | None:
    """The index of the machine in which a part at the position takes room; None: it is in none."""
    holds = cell.positions[position].holds
    return next((station for station in holds if cell.stations[station].kind == "machine"), None)


def _machine_ends_s(run: Run) -> dict[int, float]:
    """By station index, when the machine would end if it never stood idle [s]; only machines with work to come."""
    cell, by_position = run.cell, loads_s(run.cell)
    to_come_s: dict[int, float] = {}
    through_s: dict[int, list[float]] = {}
    for index, position in enumerate(run.locations):
        for station, seconds in by_position[position].items():
            places = cell.stations[station].servers or cell.capacities[station]
            to_come_s[station] = to_come_s.get(station, 0.0) + seconds / places
        machine = machine_of(cell, position)
        if machine is not None and cell.stations[machine].servers is None:
            through_s.setdefault(machine, []).append(run.ready_s[index])
    ends_s = {}
    for station, seconds in to_come_s.items():
        busy_s = through_s.get(station, [])
        # When all places are taken, the one whose part is finished first counts.
        free_s = min(busy_s) if len(busy_s) == cell.capacities[station] else run.free_s(station)
        ends_s[station] = max(run.now_s, free_s) + seconds
    return ends_s


def _soonest(run: Run, decision: int) -> tuple[float, int]:
    """The sort key of equally urgent decisions: with several robots or servers the soonest, then the lowest decision."""
    if run.cell.serial:
        return 0.0, decision
    return run.pick_s(part_of(decision, run.cell.parts), _option(run, decision)), decision


def _option(run: Run, decision: int) -> Option:
    option = run.option(decision)
    if option is None:
        raise BadInput(run.refusal(decision))
    return option
