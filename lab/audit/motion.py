"""What an audit asks of how parts stand and move: straight, still, in the robot's hand, one at a time, none in another."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from math import hypot

import numpy as np

from lab.audit.evidence import Evidence, Finding
from lab.audit.stays import Mask, PartSeen, Stay, gap_of, pallet_of
from lab.audit.tracks import Array, BodyTracks, Numbers, in_frame, on_grid

LEANS = 0.97  # cosine of the tilt, fourteen degrees, from which on a part does not stand in a station on its way
NEAR_SPOT_M = 0.03  # a part this near to a station's only spot stands on it on its way
FLOATS_M = 0.002  # its foot may be so far from what it stands on; measured are 0.03 mm
SHIFTS_M = 0.005  # a part that stands may move so far; measured are 2 mm, in a stack that is built
TAKES_S = 4.0  # the gripper may be so long at a part before it stands free, and before it leaves
HELD_M = 0.025  # the robot's hand may be so far from what it moves; measured are 14 mm, as the fingers open
SLIPS_M = 0.01  # from one frame to the next it may move so far in the hand
MOVES_M = 0.002  # a part that moves less from one frame to the next may settle
FASTER = 1.2  # times the robot's speed no part is carried, and SHIFTS_M beside
SEVERAL_FRAMES = 3  # in a row, for what a single frame may show by chance
BETWEEN_M = 0.002  # by so much two parts may stand in one another: what is recorded is not finer


def stood(evidence: Evidence, seen: PartSeen) -> Iterator[Finding]:
    """It stood straight, its foot on what carries it, still between its two transfers, on the spot where there is only one."""
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


def _shifted(evidence: Evidence, seen: PartSeen, stay: Stay, places: Array) -> Iterator[Finding]:
    """It did not move in a stay, the time aside in which a gripper lets go of it or takes hold."""
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


def in_hand(evidence: Evidence, seen: PartSeen) -> Iterator[Finding]:
    """Where it moves, and in the air, it is in the robot's hand and moves with it, no faster than the robot carries."""
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
    """Where a body's middle is in the frame of each of the robot's links (links, n, 3) [m]."""
    own = tracks.poses[:, body]
    return np.array([in_frame(own, tracks.poses[:, link], np.zeros((1, 3)))[0] for link in tracks.robot]).reshape(
        -1, len(own), 3
    )


def _creeps(carried: Mask, places: Array) -> list[int]:
    """The frames at which a flight begins in which a part leaves its place in the hand, which is the link that it moves with."""
    found = []
    for first, after in runs(carried):
        flight = places[:, first:after]
        off_m = np.linalg.norm(flight - np.median(flight, axis=1, keepdims=True), axis=2)
        if off_m.max(axis=1).min(initial=np.inf) > HELD_M:
            found.append(first)
    return found


def _apart(tracks: BodyTracks, body: int, others: Sequence[int], frames: Numbers) -> Array:
    """How far a body's box is from the nearest box of others in some frames (n,) [m], each box by a grid of points."""
    least = np.full(len(frames), np.inf)
    for one, other in [pair for link in others for pair in ((body, link), (link, body))]:
        points = on_grid(tracks.low[one], tracks.high[one])
        off = in_frame(tracks.poses[frames, one], tracks.poses[frames, other], points)
        beyond = np.maximum(np.maximum(tracks.low[other] - off, off - tracks.high[other]), 0.0)
        least = np.minimum(least, np.linalg.norm(beyond, axis=2).min(axis=0))
    return least


def one_gripper(evidence: Evidence) -> Iterator[Finding]:
    """The gripper carries one part at a time."""
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
    """No two parts are in one place: the circles within their feet, and their heights, do not overlap."""
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
    """The first frame of each run of frames in which something holds, where it lasts."""
    return [first for first, after in runs(mask) if after - first >= SEVERAL_FRAMES]


def runs(mask: Mask) -> list[tuple[int, int]]:
    """The first frame of each run of frames in which something holds, and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(after)) for first, after in zip(edges[::2], edges[1::2], strict=True)]
