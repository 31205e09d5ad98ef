"""The audit's rules of motion: parts stand upright and still, move only in the robot's hand, singly, and never overlap."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import hypot

import numpy as np

from lab.audit.evidence import Evidence, Finding
from lab.audit.stays import Mask, PartStays, Stay, gap_of, pallet_of
from lab.audit.tracks import Array, BodyTracks, Numbers, in_frame, on_grid

LEANS = 0.97  # cosine of the largest tilt, fourteen degrees, of a part at a station along its route
NEAR_SPOT_M = 0.03  # largest distance from a station's only spot, along the route
FLOATS_M = 0.002  # largest gap between a foot and what carries it; measured: 0.03 mm
SHIFTS_M = 0.005  # largest movement of a standing part; measured: 2 mm, while a stack is built
TAKES_S = 4.0  # longest time that the gripper is at a part after setting it down or before leaving with it
HELD_M = 0.025  # largest distance between the robot's hand and what it moves; measured: 14 mm, as the fingers open
SLIPS_M = 0.01  # largest movement in the hand from one frame to the next
MOVES_M = 0.002  # largest movement between frames of a part that is only settling
FASTER = 1.2  # factor of the robot's speed, plus SHIFTS_M, that no carried part exceeds
SEVERAL_FRAMES = 3  # consecutive frames required where a single frame may be a coincidence
BETWEEN_M = 0.002  # largest overlap of two parts, the resolution of the recording


def stood(evidence: Evidence, seen: PartStays) -> Iterator[Finding]:
    """Findings on how a part stood: upright, its foot supported, still between transfers, and on a station's only spot."""
    tracks, body = evidence.tracks, evidence.tracks.number(seen.name)
    for number, stay in enumerate(seen.stays):
        station, during = evidence.task.station(stay.station), stay.frames(tracks)
        if np.median(tracks.up(body)[during]) < LEANS:
            yield Finding("stood", seen.name, stay.station, stay.start_s, f"leans in '{stay.station}'")
        gap_m = float(np.median(gap_of(evidence.task, seen.kind, station, tracks, body)[during]))
        if abs(gap_m) > FLOATS_M:
            words = f"is {abs(gap_m):.3f} m {'above' if gap_m > 0 else 'below'} what it stands on in '{stay.station}'"
            yield Finding("stood", seen.name, stay.station, stay.start_s, words)
        places = tracks.inside(tracks.number(stay.station), tracks.poses[:, body, :3])
        yield from _shifted(evidence, seen, stay, places)
        if number and station.capacity == 1 and not station.own_places:
            off_m = hypot(*evidence.off_pose(stay.station, np.median(places[during], axis=0)))
            if off_m > NEAR_SPOT_M:
                words = f"stands {off_m:.3f} m off the spot of '{stay.station}'"
                yield Finding("stood", seen.name, stay.station, stay.start_s, words)


def _shifted(evidence: Evidence, seen: PartStays, stay: Stay, places: Array) -> Iterator[Finding]:
    """A finding if the part moved during a stay, other than while the gripper releases or grasps it."""
    tracks, last_s = evidence.tracks, float(evidence.tracks.times_s[-1])
    start_s = stay.start_s + (TAKES_S if stay.start_s > tracks.times_s[0] else 0.0)
    free = Stay("", start_s, stay.end_s - (TAKES_S if stay.end_s < last_s else 0.0)).frames(tracks)
    if not len(free):
        return
    off_m = np.linalg.norm(places[free] - places[free[0]], axis=1)
    shifted = free[off_m > SHIFTS_M]
    if len(shifted):
        at_s = float(tracks.times_s[shifted[0]])
        words = f"moves by {off_m.max():.3f} m in '{stay.station}' while it stands there, at {at_s:.1f} s"
        yield Finding("stood", seen.name, stay.station, at_s, words)


def in_hand(evidence: Evidence, seen: PartStays) -> Iterator[Finding]:
    """Findings on a moving or lifted part: the robot's hand holds it, moves with it, and is no faster than the robot."""
    tracks, body = evidence.tracks, evidence.tracks.number(seen.name)
    steps_m, spans_s = np.linalg.norm(np.diff(tracks.poses[:, body, :3], axis=0), axis=1), np.diff(tracks.times_s)
    moves = steps_m > MOVES_M
    asked = seen.carried.copy()
    asked[1:] |= moves
    asked[:-1] |= moves
    carrier = tracks.number(pallet_of(seen.name))
    frames = np.flatnonzero(asked)
    off_m = _apart(tracks, body, tracks.robot, frames)
    if carrier >= 0:  # the hand has the pallet, and the part stands on it
        on_it = np.maximum(_apart(tracks, carrier, tracks.robot, frames), _apart(tracks, body, [carrier], frames))
        off_m = np.minimum(off_m, on_it)
    away = np.zeros(len(asked), dtype=bool)
    away[frames[off_m > HELD_M]] = True
    places = _in_links(tracks, body)
    jumps_m = np.linalg.norm(np.diff(places, axis=1), axis=2).min(axis=0, initial=np.inf)
    apart = (away[1:] | away[:-1] | (jumps_m > SLIPS_M)) & moves
    first = [*lasting(seen.carried & away)[:1], *np.flatnonzero(apart)[:1].tolist(), *_creeps(seen.carried, places)[:1]]
    if first:
        at_s = float(tracks.times_s[min(first)])
        words = f"is moved or held in the air at {at_s:.1f} s, and not by the robot's hand"
        yield Finding("gripper", seen.name, "", at_s, words)
    fast = np.flatnonzero(steps_m > FASTER * evidence.task.robot.speed_m_s * spans_s + SHIFTS_M)
    if len(fast):
        at_s = float(tracks.times_s[fast[0]])
        words = f"moves {steps_m[fast[0]]:.2f} m within {spans_s[fast[0]]:.2f} s"
        yield Finding("gripper", seen.name, "", at_s, words)


def _in_links(tracks: BodyTracks, body: int) -> Array:
    """The position of a body's middle in the frame of each of the robot's links (links, n, 3) [m]."""
    own = tracks.poses[:, body]
    return np.array([in_frame(own, tracks.poses[:, link], np.zeros((1, 3)))[0] for link in tracks.robot]).reshape(
        -1, len(own), 3
    )


def _creeps(carried: Mask, places: Array) -> list[int]:
    """The first frames of the transports in which a part moves within the hand (the link that it moves with)."""
    starts = []
    for first, after in runs(carried):
        flight = places[:, first:after]
        off_m = np.linalg.norm(flight - np.median(flight, axis=1, keepdims=True), axis=2)
        if off_m.max(axis=1).min(initial=np.inf) > HELD_M:
            starts.append(first)
    return starts


def _apart(tracks: BodyTracks, body: int, others: Sequence[int], frames: Numbers) -> Array:
    """The distance (n,) [m] from a body's box to the nearest box of others in some frames, by a grid of points each."""
    least = np.full(len(frames), np.inf)
    for one, other in [pair for link in others for pair in ((body, link), (link, body))]:
        points = on_grid(tracks.low[one], tracks.high[one])
        off = in_frame(tracks.poses[frames, one], tracks.poses[frames, other], points)
        beyond = np.maximum(np.maximum(tracks.low[other] - off, off - tracks.high[other]), 0.0)
        least = np.minimum(least, np.linalg.norm(beyond, axis=2).min(axis=0))
    return least


def one_gripper(evidence: Evidence) -> Iterator[Finding]:
    """Findings where the gripper carries more than one part at a time."""
    own = [seen for seen in evidence.parts if evidence.undisturbed(seen.name)]
    carried = np.array([seen.carried for seen in own])
    if not len(own):
        return
    for first in lasting(carried.sum(axis=0) > 1):
        names = [seen.name for seen, at in zip(own, carried[:, first], strict=True) if at]
        at_s = float(evidence.tracks.times_s[first])
        for name in names:
            words = f"{' and '.join(names)} are carried at once at {at_s:.1f} s, by one gripper"
            yield Finding("gripper", name, "", at_s, words)


def in_one_another(evidence: Evidence) -> Iterator[Finding]:
    """Findings where two parts overlap: the circles inside their feet and their heights intersect."""
    tracks = evidence.tracks
    own = [(seen, tracks.number(seen.name)) for seen in evidence.parts if tracks.number(seen.name) >= 0]
    middles = {body: tracks.middle(body) for _, body in own}  # a mesh's frame is where its mass is, and that may be low
    for (one, a), (other, b) in combinations(own, 2):
        off = np.abs(middles[a] - middles[b])
        sizes = [tracks.high[body] - tracks.low[body] for body in (a, b)]
        within = sum(min(size[:2]) / 2 for size in sizes) - BETWEEN_M
        level = off[:, 2] < sum(size[2] / 2 for size in sizes) - BETWEEN_M
        for first in lasting(level & (np.hypot(off[:, 0], off[:, 1]) < within)):
            at_s = float(tracks.times_s[first])
            for seen in (one, other):
                words = f"{one.name} and {other.name} are in one place at {at_s:.1f} s"
                yield Finding("overlap", seen.name, "", at_s, words)


def lasting(mask: Mask) -> list[int]:
    """The first frame of each run of at least SEVERAL_FRAMES frames in which `mask` holds."""
    return [first for first, after in runs(mask) if after - first >= SEVERAL_FRAMES]


def runs(mask: Mask) -> list[tuple[int, int]]:
    """The first frame, and the one after the last, of each run of frames in which `mask` holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(after)) for first, after in zip(edges[::2], edges[1::2], strict=True)]
