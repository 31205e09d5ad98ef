"""A cell: stations, a route through them, one transfer robot, and the rules that say which toast may move."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.errors import BadInput, unknown

MAX_TOASTS = 50
MAX_S = 1e9  # one time; far above any cell, far below where sums lose their nanoseconds
ROBOT = "robot"
STATION_KINDS = ("storage", "buffer", "machine")


@dataclass(frozen=True)
class Station:
    """A place for toasts. `capacity` in toasts; `processing_s` in seconds, above 0 only for machines."""

    name: str
    kind: Literal["storage", "buffer", "machine"]
    capacity: int
    processing_s: float = 0.0


@dataclass(frozen=True)
class Stage:
    """A step of the route: the station to reach, and the buffer before it for when it is full (None: no buffer)."""

    station: str
    buffer: str | None = None


@dataclass(frozen=True)
class Moves:
    """The (origin, target) station names between which the robot may have to travel empty, and carry a toast."""

    empty: tuple[tuple[str, str], ...]
    loaded: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Cell:
    """What is to be sequenced: `toasts` alike toasts along one route, moved by one robot.

    `empty_s` and `loaded_s`: (n, n) seconds from station row to station column, in the order of `stations`; NaN: no
    such move. Staying takes 0 s. All toasts start at the first stage and end at the last. Toasts are numbered from 1;
    a `locations` tuple holds a station index for each, toast 1 first.
    Raises BadInput for what cannot be a cell, and for a missing time that the route needs (see `needed_moves`).
    Source: thesis ch. 7 (rules), tables 7.1 and 7.2 (times).
    """

    stations: tuple[Station, ...]
    route: tuple[Stage, ...]
    empty_s: NDArray[np.float64]
    loaded_s: NDArray[np.float64]
    robot_start: str
    toasts: int

    def __post_init__(self) -> None:
        _check_stations(self.stations)
        _check_route(self.stations, self.route)
        if self.robot_start not in self.names:
            raise unknown("station", self.robot_start, self.names, "start of the robot")
        if not _is_count(self.toasts) or self.toasts > MAX_TOASTS:
            raise BadInput(f"toasts = {self.toasts!r}: allowed are 1 to {MAX_TOASTS}")
        for stage in (self.route[0], self.route[-1]):
            room = self.stations[self.index(stage.station)].capacity
            if room < self.toasts:
                raise BadInput(f"station '{stage.station}': capacity {room} cannot hold all {self.toasts} toasts")
        moves = needed_moves(self.stations, self.route, self.robot_start, self.toasts)
        for field, needed in (("empty_s", moves.empty), ("loaded_s", moves.loaded)):
            object.__setattr__(self, field, _checked_table(field, getattr(self, field), self.names, needed))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Station names, by index."""
        return tuple(station.name for station in self.stations)

    @cached_property
    def first(self) -> int:
        """Index of the station where all toasts start."""
        return self.index(self.route[0].station)

    @cached_property
    def last(self) -> int:
        """Index of the station where all toasts end."""
        return self.index(self.route[-1].station)

    @cached_property
    def capacities(self) -> tuple[int, ...]:
        """Room for toasts, by station index."""
        return tuple(station.capacity for station in self.stations)

    @cached_property
    def ahead(self) -> tuple[int | None, ...]:
        """The next stage's station, by station index; None where nothing lies ahead."""
        links = {origin: target for origin, target, _ in _links(self.route)}
        return tuple(self.index(links[name]) if name in links else None for name in self.names)

    @cached_property
    def fallback(self) -> tuple[int | None, ...]:
        """The buffer to use when the station ahead is full, by station index; None where there is none."""
        links = {origin: buffer for origin, _, buffer in _links(self.route) if buffer is not None}
        return tuple(self.index(links[name]) if name in links else None for name in self.names)

    def index(self, name: str) -> int:
        """Index of a station by its name; BadInput when unknown."""
        try:
            return self.names.index(name)
        except ValueError:
            raise unknown("station", name, self.names, "cell") from None

    def start_locations(self) -> tuple[int, ...]:
        """Every toast at the first stage."""
        return (self.first,) * self.toasts

    def counts(self, locations: Sequence[int]) -> list[int]:
        """Toasts at each station (n,)."""
        counts = [0] * len(self.stations)
        for station in locations:
            counts[station] += 1
        return counts

    def target(self, counts: Sequence[int], origin: int) -> int | None:
        """Where a toast at `origin` would be carried, given toasts per station; None: it cannot move now.

        The station ahead if it has room, else the buffer before that station if it has room. A toast in a buffer has no
        second choice.
        """
        for choice in (self.ahead[origin], self.fallback[origin]):
            if choice is not None and counts[choice] < self.capacities[choice]:
                return choice
        return None

    def destination(self, locations: Sequence[int], toast: int) -> int | None:
        """Station index to which toast (1..toasts) would be carried; None: it cannot move now."""
        return self.target(self.counts(locations), locations[toast - 1])

    def allowed(self, locations: Sequence[int]) -> tuple[int, ...]:
        """The toasts that may be picked, ascending; empty only when all are at the last stage.

        It cannot deadlock: ahead of the most advanced unfinished toast every station is empty, or is the last, which
        holds them all.
        """
        return self.movable(self.counts(locations), locations)

    def movable(self, counts: Sequence[int], locations: Sequence[int]) -> tuple[int, ...]:
        """`allowed` for a caller that keeps the counts itself."""
        can_leave = [self.target(counts, origin) is not None for origin in range(len(self.stations))]
        return tuple(toast for toast, origin in enumerate(locations, 1) if can_leave[origin])

    def refusal(self, locations: Sequence[int], toast: int) -> str | None:
        """Why the toast may not be picked now, in words; None when it may."""
        if not 1 <= toast <= self.toasts:
            return f"there is no toast {toast}, only 1 to {self.toasts}"
        origin = locations[toast - 1]
        if origin == self.last:
            return f"toast {toast} is already at '{self.names[origin]}'"
        counts = self.counts(locations)
        if self.target(counts, origin) is not None:
            return None
        tried = [self.names[choice] for choice in (self.ahead[origin], self.fallback[origin]) if choice is not None]
        full = " and ".join(f"'{name}'" for name in tried)
        return f"toast {toast} at '{self.names[origin]}' cannot move on: {full} full"


def needed_moves(stations: Sequence[Station], route: Sequence[Stage], robot_start: str, toasts: int) -> Moves:
    """Every move that some allowed sequence of this cell may contain: what must be measured before a Cell can be built.

    Loaded: along the route, directly and through the buffers. Empty: from the start to the first stage, and from where
    a toast was dropped to where another may be picked. Left out are a return to a one-toast station that has just been
    emptied and a trip to the buffer of a machine that has just been filled. Staying is never listed. For few toasts the
    list may be longer than strictly needed. Raises BadInput as Cell does for stations and route.
    """
    _check_stations(stations)
    _check_route(stations, route)
    capacity = {station.name: station.capacity for station in stations}
    loaded: list[tuple[str, str]] = []
    for origin, target, buffer in _links(route):
        loaded += [(origin, target)] + ([(origin, buffer)] if buffer is not None else [])
    buffer_of = {stage.station: stage.buffer for stage in route}
    pick_places = dict.fromkeys(origin for origin, _ in loaded)
    empty = dict.fromkeys([(robot_start, route[0].station)])
    for left, dropped in loaded if toasts > 1 else ():
        for pick in pick_places:
            just_emptied = pick == left and capacity[pick] == 1
            just_filled = pick == buffer_of.get(dropped) and capacity[dropped] == 1
            if not just_emptied and not just_filled:
                empty[dropped, pick] = None
    return Moves(tuple(pair for pair in empty if pair[0] != pair[1]), tuple(loaded))


def _links(route: Sequence[Stage]) -> Iterator[tuple[str, str, str | None]]:
    """(origin, station ahead, buffer to use when that is full) for every place that a toast can leave."""
    for here, following in pairwise(route):
        yield here.station, following.station, following.buffer
        if following.buffer is not None:
            yield following.buffer, following.station, None


def _check_stations(stations: Sequence[Station]) -> None:
    seen: set[str] = set()
    for station in stations:
        where = f"station '{station.name}'"
        if station.name in seen:
            raise BadInput(f"{where}: the name is used twice; every station needs its own")
        seen.add(station.name)
        if station.name == ROBOT or station.name.startswith("toast "):
            raise BadInput(f"{where}: 'robot' and 'toast ...' name other rows of a schedule; call it something else")
        if station.kind not in STATION_KINDS:
            raise unknown("kind", station.kind, STATION_KINDS, where)
        if not _is_count(station.capacity):
            raise BadInput(f"{where}: capacity = {station.capacity!r}; allowed are whole numbers from 1")
        if not 0 <= station.processing_s <= MAX_S:
            raise BadInput(f"{where}: processing_s = {station.processing_s}; allowed are 0 to {MAX_S:g} s")
        if station.kind != "machine" and station.processing_s > 0:
            raise BadInput(f"{where}: processing_s = {station.processing_s}, but only a machine processes")


def _check_route(stations: Sequence[Station], route: Sequence[Stage]) -> None:
    kinds = {station.name: station.kind for station in stations}
    if len(route) < 2:
        raise BadInput(f"the route has {len(route)} stages; it needs at least 2, a start and an end")
    if route[0].buffer is not None:
        raise BadInput(f"stage 1 of the route ('{route[0].station}'): buffer '{route[0].buffer}' before the start")
    visited: set[str] = set()
    for number, stage in enumerate(route, 1):
        where = f"stage {number} of the route"
        for name, is_buffer in ((stage.station, False), (stage.buffer, True)):
            if name is None:
                continue
            if name not in kinds:
                raise unknown("station", name, kinds, where)
            if name in visited:
                raise BadInput(f"{where}: station '{name}' is on the route twice; once is allowed")
            visited.add(name)
            if (kinds[name] == "buffer") != is_buffer:
                raise BadInput(f"{where}: '{name}' is a {kinds[name]}; {'a buffer' if is_buffer else 'no buffer'} fits")
        if number in (1, len(route)) and kinds[stage.station] != "storage":
            raise BadInput(
                f"{where}: '{stage.station}' is a {kinds[stage.station]}; a route starts and ends in storage"
            )


def _checked_table(
    field: str, given: ArrayLike, names: tuple[str, ...], needed: tuple[tuple[str, str], ...]
) -> NDArray[np.float64]:
    """The table as a read-only copy (n, n), once every value is a time or NaN and no needed one is NaN."""
    table = np.array(given, dtype=np.float64)
    size = len(names)
    if table.shape != (size, size):
        raise BadInput(f"{field} has shape {table.shape}; {size} stations need ({size}, {size})")
    for row, column in np.argwhere((table > MAX_S) | (table < 0)):
        pair = f"'{names[row]}' -> '{names[column]}'"
        raise BadInput(f"{field} {pair} = {table[row, column]}; allowed are 0 to {MAX_S:g} s")
    for name, stay in zip(names, np.diag(table), strict=True):
        if not (np.isnan(stay) or stay == 0):
            raise BadInput(f"{field} '{name}' -> '{name}' = {stay}; staying takes 0 s")
    for origin, target in needed:
        if np.isnan(table[names.index(origin), names.index(target)]):
            raise BadInput(f"{field} '{origin}' -> '{target}' is missing, but the route needs it")
    table.setflags(write=False)
    return table


def _is_count(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and int(value) >= 1
