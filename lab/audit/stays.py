"""The stays of an order's parts, each at a station from start to end, from the bodies' tracks and the task file alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.audit.tracks import Array, BodyTracks, Numbers
from lab.sim.parts.part_shape import shape_of
from lab.tasks.task import Order, Task, part_name
from lab.tasks.task_fields import Station

LOW_M, HIGH_M = -0.005, 0.01  # range of a foot's height above its support at which a part counts as standing
TILTED = 0.94  # cosine of the largest tilt of a part that counts as standing
LEAST_S = 0.5  # shortest stay; anything shorter is a passage
GAP_S = 0.5  # a shorter interruption, as by a nudge, does not end a stay
FLIES_M = 0.02  # height above its lowest support from which a part counts as carried

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Stay:
    """A part's stay at a station from `start_s` to `end_s` [s]."""

    station: str
    start_s: float
    end_s: float

    @property
    def seconds(self) -> float:
        """The duration of the stay [s]."""
        return self.end_s - self.start_s

    def frames(self, tracks: BodyTracks) -> Numbers:
        """The numbers (n,) of the frames within the stay."""
        return np.flatnonzero((tracks.times_s >= self.start_s) & (tracks.times_s <= self.end_s))


@dataclass(frozen=True, eq=False)
class PartStays:
    """One part as the frames show it, with its stays in order.

    at (n,): the number of the station at which it stands at each frame, -1 for none. occupies (n,): the same for the part
    or its pallet. carried (n,): whether it is in the air.
    """

    name: str
    kind: str
    stays: tuple[Stay, ...]
    at: NDArray[np.int64]
    occupies: NDArray[np.int64]
    carried: Mask


def parts_seen(task: Task, order: Order, tracks: BodyTracks) -> list[PartStays]:
    """Each part of an order as the frames show it, part 1 first; a part that was not recorded has no stays."""
    return [_seen(task, part_name(order, number), kind, tracks) for number, kind in enumerate(order, start=1)]


def pallet_of(name: str) -> str:
    """The name of a part's pallet in the frames."""
    return f"{name}'s pallet"


def _seen(task: Task, name: str, kind: str, tracks: BodyTracks) -> PartStays:
    body, part = tracks.number(name), task.part(kind)
    nowhere = np.full(len(tracks.times_s), -1)
    if body < 0:
        return PartStays(name, kind, (), nowhere, nowhere, np.zeros(len(tracks.times_s), dtype=bool))
    foot_m = shape_of(part, task.folder).foot_m
    heights = [0.0]
    if part.pallet is not None:
        pallet = shape_of(task.part(part.pallet), task.folder)
        heights.append(pallet.height_m)
    at = _stands_at(task, tracks, body, foot_m, heights)
    occupies, carrier = at, tracks.number(pallet_of(name))
    if part.pallet is not None and carrier >= 0:
        occupies = np.where(at >= 0, at, _stands_at(task, tracks, carrier, pallet.foot_m, [0.0]))
    return PartStays(name, kind, _stays(task, tracks, at), at, occupies, _carried(tracks, body, at))


def _stands_at(task: Task, tracks: BodyTracks, body: int, foot_m: float, heights: Sequence[float]) -> NDArray[np.int64]:
    """The number of the station on which a body stands at each frame (n,), -1 for none.

    It may stand on the station's floor or a layer, or higher by one of `heights` [m].
    """
    at, up = np.full(len(tracks.times_s), -1), tracks.up(body) >= TILTED
    point = tracks.poses[:, body, :3]
    for number, station in enumerate(task.stations):
        own = tracks.number(station.name)
        if own < 0:
            continue
        low, high, off = tracks.low[own], tracks.high[own], tracks.inside(own, point)
        within = (off[:, :2] >= low[:2]).all(axis=1) & (off[:, :2] <= high[:2]).all(axis=1)
        foot = point[:, 2] - foot_m - floor_of(station, tracks)
        above = [foot - level - height for level in levels_of(station) for height in heights]
        on = np.logical_or.reduce([(gap >= LOW_M) & (gap <= HIGH_M) for gap in above])
        at[within & on & up] = number
    return at


def gap_of(task: Task, kind: str, station: Station, tracks: BodyTracks, body: int) -> Array:
    """The height (n,) [m] of a part's foot above the nearest support at a station: floor, layer, or its pallet there."""
    part = task.part(kind)
    foot = tracks.poses[:, body, 2] - shape_of(part, task.folder).foot_m - floor_of(station, tracks)
    heights = [0.0] if part.pallet is None else [0.0, shape_of(task.part(part.pallet), task.folder).height_m]
    gaps = np.array([foot - level - height for level in levels_of(station) for height in heights])
    return np.asarray(np.take_along_axis(gaps, np.abs(gaps).argmin(axis=0)[None], axis=0)[0])


def levels_of(station: Station) -> set[float]:
    """The heights above a station's floor [m] at which parts may stand."""
    return {0.0} if station.places is None else {place.height_m for place in station.places}


def floor_of(station: Station, tracks: BodyTracks) -> Array:
    """The height (n,) [m] of a recorded station's floor at each frame: from the file, else the top of its body."""
    own = tracks.number(station.name)
    if station.floor_m is not None:
        return np.full(len(tracks.times_s), station.floor_m)
    return np.asarray(tracks.poses[:, own, 2] + tracks.high[own, 2])


def _stays(task: Task, tracks: BodyTracks, at: NDArray[np.int64]) -> tuple[Stay, ...]:
    edges = np.flatnonzero(np.diff(at)) + 1
    stays: list[Stay] = []
    for first, after in zip([0, *edges], [*edges, len(at)], strict=True):
        if at[first] < 0:
            continue
        stay = Stay(task.stations[at[first]].name, float(tracks.times_s[first]), float(tracks.times_s[after - 1]))
        last = stays[-1] if stays else None
        if last is not None and last.station == stay.station and stay.start_s - last.end_s < GAP_S:
            stays[-1] = Stay(stay.station, last.start_s, stay.end_s)
        else:
            stays.append(stay)
    return tuple(stay for stay in stays if stay.seconds >= LEAST_S)


def _carried(tracks: BodyTracks, body: int, at: NDArray[np.int64]) -> Mask:
    """Whether a body stands nowhere and is more than FLIES_M above the lowest place where it stood, at each frame."""
    height = tracks.poses[:, body, 2]
    return np.asarray((at < 0) & (height > height.min() + FLIES_M))
