"""A track that several robots share: stretches between stations, each of which holds one robot at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import NamedTuple

from lab.errors import BadInput, unknown
from lab.sequencing.cell.stations import check_seconds


@dataclass(frozen=True)
class Stretch:
    """A piece of track between two stations, driven in either direction; seconds: at speed 1."""

    origin: str
    target: str
    seconds: float


class HeldStretch(NamedTuple):
    """A stretch (by number) on a path, and from when until when it is held after the start, at speed 1 [s]."""

    stretch: int
    from_s: float
    until_s: float


Way = tuple[HeldStretch, ...]


def check_track(track: Sequence[Stretch], names: Sequence[str]) -> None:
    """Raises BadInput for a stretch that does not join two stations, takes no time, or is listed twice."""
    seen = set[frozenset[str]]()
    for stretch in track:
        where = f"track '{stretch.origin}' - '{stretch.target}'"
        for name in (stretch.origin, stretch.target):
            if name not in names:
                raise unknown("station", name, names, where)
        check_seconds(where, stretch.seconds)
        if stretch.origin == stretch.target or stretch.seconds == 0.0:
            raise BadInput(f"{where} of {stretch.seconds:g} s: wanted two stations, and more than 0 s")
        ends = frozenset((stretch.origin, stretch.target))
        if ends in seen:
            raise BadInput(f"{where}: it is there twice")
        seen.add(ends)


def ways_on(track: Sequence[Stretch], names: Sequence[str]) -> Mapping[tuple[int, int], Way]:
    """The shortest path between every two stations that the track joins, by their indices.

    Ties go to the path with fewer stretches, then to the one whose stretches are listed first.
    """
    number = {name: n for n, name in enumerate(names)}
    beside: dict[int, list[tuple[int, int, float]]] = {}
    for n, stretch in enumerate(track):
        a, b = number[stretch.origin], number[stretch.target]
        beside.setdefault(a, []).append((b, n, stretch.seconds))
        beside.setdefault(b, []).append((a, n, stretch.seconds))
    paths: dict[tuple[int, int], Way] = {}
    for start in beside:
        ahead: list[tuple[float, int, tuple[int, ...], int, Way]] = [(0.0, 0, (), start, ())]
        reached = set[int]()
        while ahead:
            at_s, count, by, here, way = heappop(ahead)
            if here in reached:
                continue
            reached.add(here)
            paths[start, here] = way
            for there, n, seconds in beside[here]:
                if there not in reached:
                    held = HeldStretch(n, at_s, at_s + seconds)
                    heappush(ahead, (at_s + seconds, count + 1, (*by, n), there, (*way, held)))
    return paths


def travel_s(way: Way) -> float:
    """The duration of a path at speed 1 [s]."""
    return way[-1].until_s if way else 0.0
