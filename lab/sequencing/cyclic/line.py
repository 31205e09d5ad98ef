"""The moves of one cycle: the paths of the parts that enter in it, and the constraints on their times."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement, islice, product
from math import comb, inf, prod

import numpy as np
import scipy

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, Position, from_the_ends
from lab.sequencing.cell.ways import distances

MOST_LINES = 2000  # combinations of the paths of a cycle's parts
MOST_MOVES = 120  # moves in a cycle; the model grows with their square
Path = tuple[tuple[int, Option], ...]  # the positions that a part leaves, each with the option that it takes


@dataclass(frozen=True)
class CycleMove:
    """One move of a cycle: its part `slot` (from 0) leaves position `place` by `option`; work_s: service and carrying."""

    slot: int
    place: int
    option: Option
    work_s: float


@dataclass(frozen=True)
class LineSpan:
    """The time from the drop of one move to the begin of a later move of the same part, both by number.

    least_s, most_s: the limits of that time, with all periods in between counted [s].
    """

    drop: int
    pick: int
    least_s: float = 0.0
    most_s: float = inf


@dataclass(frozen=True)
class Line:
    """A cycle without its times: the parts that enter in it, each with its path.

    moves: slot by slot, each along its path. stays: every two consecutive moves of a part. needs: processing times and latest
    picks. holds: the stays that take room at each station.
    """

    cell: Cell
    paths: tuple[Path, ...]

    @cached_property
    def moves(self) -> tuple[CycleMove, ...]:
        """The moves, slot by slot."""
        carried_s = self.cell.loaded_s
        return tuple(
            CycleMove(slot, place, way, way.service_s + float(carried_s[way.origin, way.target]))
            for slot, path in enumerate(self.paths)
            for place, way in path
        )

    @cached_property
    def stays(self) -> tuple[LineSpan, ...]:
        """The stays of parts between two consecutive moves, each of 0 s or more."""
        ends = zip(self.moves[:-1], self.moves[1:], strict=True)
        return tuple(LineSpan(n, n + 1) for n, (one, then) in enumerate(ends) if one.slot == then.slot)

    @cached_property
    def needs(self) -> tuple[LineSpan, ...]:
        """The processing times before picks, and the latest picks after them."""
        spans = list[LineSpan]()
        begun: tuple[int, float] | None = None
        for number, move in enumerate(self.moves):
            at = self.cell.positions[move.place]
            if number and self.moves[number - 1].slot == move.slot:
                if at.processing_s is not None:
                    begun = number - 1, at.processing_s
            else:
                begun = None
            if begun is not None and move.option.waits:
                drop, least_s = begun
                most_s = inf if at.at_most_s is None else least_s + at.at_most_s - move.option.service_s
                spans.append(LineSpan(drop, number, least_s, most_s))
        return tuple(spans)

    @cached_property
    def holds(self) -> dict[int, tuple[int, ...]]:
        """The stays (by number) that take room at each station (by index)."""
        by_station: dict[int, list[int]] = {}
        for number, stay in enumerate(self.stays):
            for station in self.cell.positions[self.moves[stay.pick].place].holds:
                by_station.setdefault(station, []).append(number)
        return {station: tuple(numbers) for station, numbers in by_station.items()}

    def after_s(self, one: int, then: int) -> float:
        """The empty time from a move's drop to another move's begin [s]; NaN: the two never follow each other."""
        left, begun = self.moves[one].option.target, self.moves[then].option.origin
        return 0.0 if left == begun else float(self.cell.empty_s[left, begun])

    @cached_property
    def longest_s(self) -> float:
        """A period that is long enough for every order that can be repeated at all [s].

        A shortest period is determined by a circuit of constraints that visits each move at most once.
        """
        numbers = range(len(self.moves))
        least_s = {span.drop: span.least_s for span in self.needs}
        empty_s = [
            max((s for to in numbers if (s := self.after_s(number, to)) < inf), default=0.0) for number in numbers
        ]
        return sum(self.moves[number].work_s + max(least_s.get(number, 0.0), empty_s[number]) for number in numbers)

    def bound_s(self, away_s: Sequence[Sequence[float]]) -> float:
        """A lower bound of the period [s]: the robot's moves with the cheapest drives between them, and each station's needs.

        away_s: see the function `away_s`.
        """
        gaps = np.array(
            [[away_s[m.option.target][other.option.origin] for other in self.moves] for m in self.moves], float
        )
        if len(gaps) > 1:
            np.fill_diagonal(gaps, 1e12)
        rows, columns = scipy.optimize.linear_sum_assignment(gaps)
        least_s = float(gaps[rows, columns].sum()) + sum(move.work_s for move in self.moves)
        ready_s = {(span.drop, span.pick): span.least_s for span in self.needs}
        for station, numbers in self.holds.items():
            spans = [self.stays[number] for number in numbers]
            picks = {span.pick for span in spans}
            drops = {span.drop for span in spans}
            into, out = drops - picks, picks - drops  # a pallet that moves on may keep the same room
            inside_s = sum(ready_s.get((span.drop, span.pick), 0.0) for span in spans)
            between_s = sum(
                min(
                    away_s[self.moves[pick].option.target][self.moves[drop].option.origin] + self.moves[drop].work_s
                    for drop in into
                )
                + self.moves[pick].work_s
                for pick in out
            )
            least_s = max(least_s, (inside_s + between_s) / self.cell.capacities[station])
        return least_s


def lines(cell: Cell, mix: Sequence[str]) -> Iterator[Line]:
    """Every combination of paths of a cycle's parts, those of one product being identical; raises BadInput for too many."""
    counts = {name: mix.count(name) for name in dict.fromkeys(mix)}
    ways = {name: _paths(cell, name, counts[name], len(mix)) for name in counts}
    many = prod(comb(len(ways[name]) + count - 1, count) for name, count in counts.items())
    most = sum(count * max(len(path) for path in ways[name]) for name, count in counts.items())
    if many > MOST_LINES:
        allowed = f"allowed are {MOST_LINES}; fewer parts a cycle have fewer"
        raise BadInput(
            f"--cyclic: the {counted(len(mix), 'part')} of a cycle can take {many} combinations of routes; {allowed}"
        )
    if most > MOST_MOVES:
        raise BadInput(f"--cyclic: a cycle of {counted(len(mix), 'part')} has {most} moves; allowed are {MOST_MOVES}")
    choices = [combinations_with_replacement(ways[name], count) for name, count in counts.items()]
    for chosen in product(*choices):
        given = {name: iter(own) for name, own in zip(counts, chosen, strict=True)}
        yield Line(cell, tuple(next(given[name]) for name in mix))


def _paths(cell: Cell, name: str, count: int, parts: int) -> list[Path]:
    """All paths of a product from its start to an end."""
    start = cell.starts[cell.order.index(name)]

    def longer(path: Path, at: Position, place: int) -> Iterator[Path]:
        if not at.options:
            yield path
        for way in at.options:
            yield from longer((*path, (place, way)), cell.positions[way.to], way.to)

    numbers = from_the_ends(cell.positions, lambda place, ahead: sum(ahead) or 1)
    if comb(numbers[start] + count - 1, count) > MOST_LINES:
        told = f"product '{name}' has {numbers[start]} paths through its routes and buffers"
        raise BadInput(f"--cyclic: {told}: too many for a cycle of {counted(parts, 'part')}")
    return list(islice(longer((), cell.positions[start], start), numbers[start]))


def at_speed(cell: Cell) -> Cell:
    """The cell with its tables divided by its one robot's speed."""
    robot, *_ = cell.robots
    if robot.speed == 1.0:
        return cell
    empty_s, loaded_s = cell.empty_s / robot.speed, cell.loaded_s / robot.speed
    return replace(cell, empty_s=empty_s, loaded_s=loaded_s, robots=(replace(robot, speed=1.0),))


def away_s(cell: Cell) -> list[list[float]]:
    """The least time in which the robot gets from a station (row) to another (column), empty or loaded, by any stations [s].

    Times are rounded down to nanoseconds; a station that cannot be reached gets a very large one.
    """
    return [[ticks / 1e9 for ticks in row] for row in distances(cell)]
