"""The ways of a part through a cell, step by step: what robots carry and servers work on, and which rooms it takes meanwhile."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, NamedTuple

from oracle.cell import Cell, Stage


@dataclass(frozen=True)
class Step:
    """What happens to a part next: a robot carries it, or its pallet, or a server of `target` works on it.

    ready: the step after which its processing began, -1: it is there from its release on, None: no matter; it is picked, or
    its service begins, at the earliest when that processing is done, and at most_s after it at the latest. processing_s:
    what begins when it is put down, or how long a server works. only_full: this station has to be full when it is picked.
    """

    kind: Literal["carry", "work"]
    origin: str
    target: str
    ready: int | None
    service_s: float = 0.0
    at_most_s: float | None = None
    processing_s: float = 0.0
    pallet: bool = False
    only_full: str | None = None


class Room(NamedTuple):
    """A part, or its pallet, takes room at a station from the end of one step until another begins; at_end: until it ends."""

    station: str
    since: int
    until: int
    at_end: bool = False


@dataclass(frozen=True)
class Way:
    """The steps, in their order, and the rooms."""

    steps: tuple[Step, ...]
    rooms: tuple[Room, ...]


def ways_of(cell: Cell, name: str) -> tuple[Way, ...]:
    """Every way of a product: its routes, and on each which of its buffers are used."""
    found = dict[Way, None]()
    for route in cell.routes[name]:
        choices = [(False, True) if stage.buffer and cell.robots else (False,) for stage in route[1:]]
        for used in product(*choices):
            found[_way(cell, route, used)] = None
    return tuple(found)


class _Walk:
    """A part on its way: the steps and rooms so far, where it is, and what is to be kept to when it is taken from there."""

    def __init__(self, start: str) -> None:
        self.steps, self.rooms = list[Step](), list[Room]()
        self.here, self.left, self.ready = start, Stage(start), -1
        self.since = -1  # the step that brought it, or its pallet, into the room where it is; -1: it takes none

    def leave(self, target: str, only_full: str | None = None) -> int:
        """It is carried on; the step's number."""
        left = self.left
        self.steps.append(
            Step("carry", self.here, target, self.ready, left.service_s, left.at_most_s, only_full=only_full)
        )
        self.here = target
        self.ready = len(self.steps) - 1
        return self.ready

    def frees(self, station: str, until: int) -> None:
        """The room where it is, is free from when a step begins."""
        if self.since >= 0:
            self.rooms.append(Room(station, self.since, until))


def _way(cell: Cell, route: tuple[Stage, ...], used: tuple[bool, ...]) -> Way:
    walk = _Walk(route[0].station)
    for number, (stage, by_buffer) in enumerate(zip(route[1:], used, strict=True), 1):
        last, served = number == len(route) - 1, cell.station(stage.station).servers is not None
        if cell.robots:
            if by_buffer and stage.buffer is not None:
                before = walk.here
                brought = walk.leave(stage.buffer, stage.station if cell.only_when_full else None)
                walk.frees(before, brought)
                walk.since, walk.left = brought, Stage(stage.buffer)
            _carry_to(walk, route, number, served)
        if served:
            at_most_s = None if cell.robots else walk.left.at_most_s
            walk.steps.append(Step("work", walk.here, stage.station, walk.ready, 0.0, at_most_s, stage.processing_s))
            walk.here, walk.ready = stage.station, len(walk.steps) - 1
            if last and cell.robots:
                walk.rooms.append(Room(walk.here, walk.since, walk.ready, True))
        walk.left = stage
    return Way(tuple(walk.steps), tuple(walk.rooms))


def _carry_to(walk: _Walk, route: tuple[Stage, ...], number: int, served: bool) -> None:
    """A part is carried to a stop of its route; where it stands without its pallet, that is carried ahead then."""
    stage, before, since = route[number], walk.here, walk.since
    brought = walk.leave(stage.station)
    if not served:
        walk.steps[brought] = replace(walk.steps[brought], processing_s=stage.processing_s)
    if not stage.pallet:  # else the pallet stays, and keeps the room
        walk.frees(before, brought)
    if route[number - 1].pallet:
        walk.since = next(n for n, step in enumerate(walk.steps) if step.pallet and step.target == stage.station)
    else:
        walk.since = brought
    if stage.pallet:
        walk.steps.append(Step("carry", before, route[number + 1].station, None, pallet=True))
        walk.rooms.append(Room(before, since, len(walk.steps) - 1))


def stretches(cell: Cell, origin: str, target: str) -> Iterator[tuple[int, float, float]]:
    """The shortest way on the track: each stretch by its number, from when until when it is driven on, at speed 1 [s].

    Of ways that take equally long that with the fewest stretches, then the one whose stretches were named first.
    """
    best: dict[str, tuple[float, int, tuple[int, ...]]] = {origin: (0.0, 0, ())}
    for _ in cell.stations:
        for number, (a, b, seconds) in enumerate(cell.track):
            for one, other in ((a, b), (b, a)):
                if one in best:
                    so_far_s, count, by = best[one]
                    there = (so_far_s + seconds, count + 1, (*by, number))
                    best[other] = min(best.get(other, there), there)
    at_s = 0.0
    for number in best[target][2]:
        yield number, at_s, at_s + cell.track[number][2]
        at_s += cell.track[number][2]
