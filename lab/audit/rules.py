"""The rules of an audit: `findings` applies all of them, and each finding names the part, the station and the time.

After it come the rules of a part's route and end, of stations and capacities, of batches, and of the schedule.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise, permutations, zip_longest
from math import atan2, cos, hypot, sin
from typing import Any, NamedTuple

import numpy as np

from lab.audit.evidence import SLACK_S, Evidence, Finding, turned
from lab.audit.motion import TAKES_S, in_hand, in_one_another, lasting, one_gripper, stood
from lab.audit.stays import HIGH_M, LOW_M, PartStays, Stay, floor_of, pallet_of
from lab.audit.tracks import Array, Numbers
from lab.tasks.task_fields import Process, Stage

UPRIGHT = 0.985  # cosine of the largest tilt, ten degrees, of a part at the end of its route
ON_SPOT_M = 0.02  # largest distance from a spot at which a part counts as standing on it
RESTS_M = 0.001  # largest movement between frames of a head or a hand that rests
AT_POSE_M, AT_POSE_RAD = 0.002, 0.02  # largest deviation of a body from its pose in the task


def findings(evidence: Evidence) -> list[Finding]:
    """All findings against a run, by time."""
    all_findings: list[Finding] = []
    for seen in evidence.parts:
        if seen.name in evidence.claimed:
            all_findings += _route(evidence, seen)
            all_findings += _end(evidence, seen)
        if evidence.undisturbed(seen.name):
            all_findings += stood(evidence, seen)
            all_findings += told(evidence, seen)
            all_findings += in_hand(evidence, seen)
    all_findings += _stations(evidence)
    all_findings += _capacities(evidence)
    all_findings += batches(evidence)
    all_findings += one_gripper(evidence)
    all_findings += in_one_another(evidence)
    all_findings += one_story(evidence)
    return sorted(all_findings, key=lambda finding: finding.at_s)


# ---- the route of one part -------------------------------------------------------------------------------------------


def _route(evidence: Evidence, seen: PartStays) -> list[Finding]:
    """The findings on a part's stays, by the route that gives the fewest."""
    by_route = [list(_along(evidence, seen, route)) for route in evidence.task.part(seen.kind).routes]
    return min(by_route, key=len)


def _along(evidence: Evidence, seen: PartStays, route: Sequence[Stage]) -> Iterator[Finding]:
    """Findings where a part did not visit a route's stations in order, for long enough, and without any other."""
    stays, place, before = seen.stays, 0, ""
    for stage in route:
        work_s = evidence.work_s(seen.kind, stage)
        there = [n for n in range(place, len(stays)) if stays[n].station == stage.station]
        if not there:
            after = f" after '{before}'" if before else ""
            at_s = stays[place - 1].end_s if place else 0.0
            yield Finding("route", seen.name, stage.station, at_s, f"did not come to '{stage.station}'{after}")
            continue
        long = [n for n in there if work_s is None or stays[n].seconds >= work_s - SLACK_S]
        chosen = long[0] if long else max(there, key=lambda n: stays[n].seconds)
        if not evidence.undisturbed(seen.name):  # it may have been taken out of a machine and processed again
            chosen = min(long or [chosen], key=lambda n: len([*_covered_in(evidence, seen, stage, stays[n])]))
        between = [between_stay for between_stay in stays[place:chosen] if between_stay.station != stage.buffer]
        if between and evidence.undisturbed(seen.name) and not _repeated(between, before, stage):
            words = f"came to '{between[0].station}', which is not on its route from '{before}' to '{stage.station}'"
            yield Finding("route", seen.name, between[0].station, between[0].start_s, words)
        stay, place, before = stays[chosen], chosen + 1, stage.station
        if work_s is not None:
            yield from _times(evidence, seen, stage, stay, work_s)
        yield from _covered_in(evidence, seen, stage, stay)
    if stays[place:] and evidence.undisturbed(seen.name) and not _repeated(stays[place:], before, route[-1]):
        words = f"went on to '{stays[place].station}' after the end of its route, '{before}'"
        yield Finding("route", seen.name, stays[place].station, stays[place].start_s, words)


def _repeated(between: Sequence[Stay], before: str, stage: Stage) -> bool:
    """Whether the stays in between are only repeated ones, at the station before or at the stage's own."""
    return all(stay.station in (before, stage.station) for stay in between)


def _covered_in(evidence: Evidence, seen: PartStays, stage: Stage, stay: Stay) -> Iterator[Finding]:
    """Findings where, during a stay, head or hand did not cover what the stage asks for."""
    if evidence.work_s(seen.kind, stage) is not None:
        yield from _covered(evidence, seen, stage.station, stay)
    yield from _served(evidence, seen, stage, stay)


def _times(evidence: Evidence, seen: PartStays, stage: Stage, stay: Stay, work_s: float) -> Iterator[Finding]:
    """Findings where a stay is shorter than the processing time, or exceeds the window after it."""
    where, rows = stage.station, evidence.own_rows(seen.name, "process")
    own = [
        row for row in rows if row["station"] == where and row["start_s"] < stay.end_s and row["end_s"] > stay.start_s
    ]
    worked_s = min([stay.seconds, *(row["end_s"] - row["start_s"] for row in own)])
    if worked_s < work_s - SLACK_S:
        words = f"stood in '{where}' for {worked_s:.1f} s of {work_s:g}"
        yield Finding("processing", seen.name, where, stay.start_s + worked_s, words)
    at_most_s = evidence.at_most_s(stage)
    if at_most_s is None:
        return
    slow = any(fault.what.startswith("machine") and fault.station == where for fault in evidence.struck)
    learned = evidence.task.station(where).process is not None
    begun_s = max([stay.start_s, *(row["start_s"] for row in own if row["start_s"] < stay.start_s + TAKES_S)])
    done_s = own[-1]["end_s"] if (slow or learned) and own else begun_s + work_s
    taken = [_overlap(row, stay) for row in evidence.own_rows(seen.name, "carry") if row["start_s"] >= done_s - SLACK_S]
    late_s = stay.end_s - done_s - min(sum(taken), TAKES_S)
    if late_s > at_most_s + SLACK_S:
        words = f"stayed in '{where}' for {late_s:.1f} s after it was done, allowed are {at_most_s:g}"
        yield Finding("window", seen.name, where, done_s + at_most_s, words)


def _covered(evidence: Evidence, seen: PartStays, where: str, stay: Stay) -> Iterator[Finding]:
    """Findings where the head did not rest in front of each cell of the part's side for the process's time."""
    tracks, name = evidence.tracks, evidence.task.station(where).process
    head, body = tracks.number(f"{where} head"), tracks.number(seen.name)
    if name is None or head < 0:
        return
    process, during = evidence.task.processes[name], stay.frames(evidence.tracks)
    at = tracks.inside(body, tracks.poses[:, head, :3])[:, [2, 0]]  # height and sideways distance from the part
    low, size = tracks.low[body, [2, 0]], (tracks.high[body] - tracks.low[body])[[2, 0]]
    grid = _Grid(process, low, size, at[during], during)
    yield from _missed(evidence, seen, "process", where, grid)


def _served(evidence: Evidence, seen: PartStays, stage: Stage, stay: Stay) -> Iterator[Finding]:
    """Findings where the hand did not rest over each cell of a service's area for its time, while the part was there."""
    task, tracks, where = evidence.task, evidence.tracks, stage.station
    process = None if stage.service is None else task.processes[stage.service]
    if process is None or process.area_m is None or task.robot.tool == "level" or not tracks.fingers:
        return
    during = stay.frames(evidence.tracks)
    hand = np.mean([tracks.middle(finger) for finger in tracks.fingers], axis=0)
    off = tracks.inside(tracks.number(where), hand)[during]
    across, along = np.array([evidence.off_pose(where, place) for place in off]).T
    size = np.array([process.area_m[1], process.area_m[0]])
    middle = np.array([-process.off_m[1], process.off_m[0]])  # the first row is the farthest
    grid = _Grid(process, middle - size / 2, size, np.stack([-along, across], axis=1), during)
    yield from _missed(evidence, seen, "service", where, grid)


class _Grid(NamedTuple):
    """An area from `low` with `size` (2,) [m], divided into a process's cells; and a point's path (n, 2) [m] at frames (n,)."""

    process: Process
    low: Array
    size: Array
    at: Array
    frames: Numbers


def _missed(evidence: Evidence, seen: PartStays, rule: str, where: str, grid: _Grid) -> Iterator[Finding]:
    """A finding on the cells over which the point did not rest for the process's time."""
    shape, times_s = grid.process.grid, evidence.tracks.times_s[grid.frames]
    rests_s = np.where(np.linalg.norm(np.diff(grid.at, axis=0), axis=1) < RESTS_M, np.diff(times_s), 0.0)
    numbers = np.floor((grid.at[1:] - grid.low) / (grid.size / shape)).astype(int)
    cells = list(np.ndindex(*shape))
    missed = [cell for cell in cells if rests_s[(numbers == cell).all(axis=1)].sum() < grid.process.dwell_s - SLACK_S]
    if missed:
        words = f"{len(missed)} of {len(cells)} cells were not covered in '{where}'"
        yield Finding(rule, seen.name, where, float(times_s[-1]), words)


def _overlap(row: dict[str, Any], stay: Stay) -> float:
    """The time [s] that a row and a stay overlap, in which the gripper releases or grasps."""
    return float(max(0.0, min(row["end_s"], stay.end_s) - max(row["start_s"], stay.start_s)))


def _end(evidence: Evidence, seen: PartStays) -> Iterator[Finding]:
    """Findings where a part does not finally stand at the end of a route: upright, on a spot of the file, on its pallet."""
    task, tracks, end_s = evidence.task, evidence.tracks, float(evidence.tracks.times_s[-1])
    ends = [route[-1].station for route in task.part(seen.kind).routes]
    body = tracks.number(seen.name)
    last = task.stations[seen.at[-1]].name if seen.at[-1] >= 0 else ""
    if last not in ends:
        where = f"'{last}'" if last else "no station"
        yield Finding("end", seen.name, ends[0], end_s, f"stands at {where} in the end, not at '{ends[0]}'")
        return
    if tracks.up(body)[-1] < UPRIGHT:
        yield Finding("end", seen.name, last, end_s, f"is tilted in the end at '{last}'")
    x, y, _ = tracks.poses[-1, body, :3]
    carrier = tracks.number(pallet_of(seen.name))
    for words in _place(evidence, seen, last, body if carrier < 0 else carrier):
        yield Finding("end", seen.name, last, end_s, words)
    if carrier >= 0:
        under = tracks.poses[-1, carrier, :2]
        if hypot(x - under[0], y - under[1]) > ON_SPOT_M:
            yield Finding("end", seen.name, last, end_s, f"does not stand on its pallet in the end at '{last}'")


def _place(evidence: Evidence, seen: PartStays, last: str, body: int) -> Iterator[str]:
    """What is wrong with the final place of a part, or of its pallet `body`, at a station whose places the file gives."""
    station, tracks = evidence.task.station(last), evidence.tracks
    x, y = evidence.off_pose(last, tracks.inside(tracks.number(last), tracks.poses[:, body, :3])[-1])
    foot_m = tracks.poses[-1, body, 2] + tracks.low[body, 2] - floor_of(station, tracks)[-1]
    level = [place for place in station.own_places if LOW_M <= foot_m - place.height_m <= HIGH_M]
    if not level:
        return
    near = min(level, key=lambda place: hypot(x - place.at[0], y - place.at[1]))
    off_m = hypot(x - near.at[0], y - near.at[1])
    here = [place for place in level if hypot(x - place.at[0], y - place.at[1]) <= ON_SPOT_M]
    if off_m > ON_SPOT_M:
        yield f"stands {off_m:.3f} m off the spots of '{last}' in the end"
    elif all(place.kind != station.nests(seen.kind) for place in here):
        whose = "no kind of its own" if near.kind is None else f"a {near.kind}"
        yield f"stands on a place of '{last}' in the end that is for {whose}"
    if near.height_m and station.stands_on in ("slab", "box") and not _is_carried(evidence, body):
        yield f"stands {near.height_m:g} m above '{last}' in the end, and on nothing"


def _is_carried(evidence: Evidence, body: int) -> bool:
    """Whether another part or a pallet carries a body in the last frame."""
    tracks, shares = evidence.tracks, np.linspace(-0.45, 0.45, 5)
    low, high, (x, y, z, *turn) = tracks.low[body], tracks.high[body], tracks.poses[-1, body]
    middle, size, yaw = (low + high) / 2, high - low, 2.0 * atan2(turn[2], turn[3])
    under = [(middle[0] + a * size[0], middle[1] + b * size[1]) for a in shares for b in shares]
    parts = {name for seen in evidence.parts for name in (seen.name, pallet_of(seen.name))}
    for other in (n for n, name in enumerate(tracks.names) if n != body and name in parts):
        gap = z + low[2] - tracks.poses[-1, other, 2] - tracks.high[other, 2]
        if not LOW_M <= gap <= HIGH_M:
            continue
        for along, across in under:
            dx, dy = turned(along, across, yaw)
            point = np.array([[x + dx, y + dy, z]])
            off = tracks.inside(other, np.repeat(point, len(tracks.times_s), axis=0))[-1]
            if (off[:2] >= tracks.low[other, :2]).all() and (off[:2] <= tracks.high[other, :2]).all():
                return True
    return False


def _stations(evidence: Evidence) -> Iterator[Finding]:
    """Findings where robot or stations are not where the task places them, or a part is there that was not ordered."""
    tracks, ordered = evidence.tracks, {seen.name for seen in evidence.parts}
    for name in tracks.names:
        kind, _, number = name.rpartition(" ")
        if number.isdigit() and kind in [part.name for part in evidence.task.made] and name not in ordered:
            yield Finding("order", name, "", 0.0, f"{name} is in the frames, but not in the order")
    if tracks.robot and not _at(tracks.poses[0, tracks.robot[0]], (0.0, 0.0, 0.0)):
        yield Finding("station", "", "", 0.0, "the robot does not stand where the task places it")
    for station in evidence.task.stations:
        own = tracks.number(station.name)
        if own < 0:
            yield Finding("station", "", station.name, 0.0, f"'{station.name}' is not in the frames")
            continue
        at = np.array([[*station.pose[:2], 0.0]])
        off = tracks.inside(own, np.repeat(at, len(tracks.times_s), axis=0))[0, :2]
        outside = (off < tracks.low[own, :2]).any() or (off > tracks.high[own, :2]).any()
        fitted = station.stands_on == "slab" and station.size_m is None  # a slab that is laid out around its parts
        if outside if fitted else not _at(tracks.poses[0, own], station.pose):
            yield Finding("station", "", station.name, 0.0, f"'{station.name}' does not stand where the task places it")


def _at(pose: Array, place: Sequence[float]) -> bool:
    """Whether a body's frame is at `place`: x, y [m] and yaw [rad]."""
    turn = 2.0 * atan2(pose[5], pose[6]) - place[2]
    off_rad = abs(atan2(sin(turn), cos(turn)))
    return bool(hypot(pose[0] - place[0], pose[1] - place[1]) <= AT_POSE_M and off_rad <= AT_POSE_RAD)


# ---- capacities -------------------------------------------------------------------------------------------------------


def _capacities(evidence: Evidence) -> Iterator[Finding]:
    """Findings where a station holds more parts, or pallets of parts, than its capacity."""
    for number, station in enumerate(evidence.task.stations):
        there = np.array([seen.occupies == number for seen in evidence.parts])
        for first in lasting(there.sum(axis=0) > station.capacity):
            names = [seen.name for seen, at in zip(evidence.parts, there[:, first], strict=True) if at]
            at_s = float(evidence.tracks.times_s[first])
            words = f"'{station.name}' holds {' and '.join(names)} at {at_s:.1f} s, its capacity is {station.capacity}"
            for name in names:
                yield Finding("capacity", name, station.name, at_s, words)


# ---- batches --------------------------------------------------------------------------------------------------------------


def batches(evidence: Evidence) -> Iterator[Finding]:
    """Findings on machines with batches: no part enters or leaves while a batch is processed, and its rows have equal times."""
    own = [seen for seen in evidence.parts if evidence.undisturbed(seen.name)]
    for name in [station.name for station in evidence.task.stations if station.batch]:
        rows = {
            seen.name: [row for row in evidence.own_rows(seen.name, "process") if row["station"] == name]
            for seen in own
        }
        for seen, other in permutations(own, 2):
            for begin_s, end_s in [(row["start_s"], row["end_s"]) for row in rows[seen.name]]:
                there = [s for s in other.stays if s.station == name and s.end_s > begin_s + SLACK_S]
                stay = next((s for s in there if s.start_s < end_s - SLACK_S), None)
                if stay is None:
                    continue
                comes, goes = stay.start_s > begin_s + SLACK_S, stay.end_s < end_s - SLACK_S
                alike = any(
                    max(abs(row["start_s"] - begin_s), abs(row["end_s"] - end_s)) <= SLACK_S for row in rows[other.name]
                )
                if comes or goes:
                    at_s, verb = (stay.start_s, "came to") if comes else (stay.end_s, "left")
                    words = f"{verb} '{name}' at {at_s:.1f} s, while the batch with {seen.name} was worked on"
                    yield Finding("batch", other.name, name, at_s, words)
                elif not alike:
                    words = f"stood in '{name}' with {seen.name}, and was not worked on together with it"
                    yield Finding("batch", other.name, name, begin_s, words)


# ---- the schedule against the frames ------------------------------------------------------------------------------------


MOVES = ("carry", "pallet")


def told(evidence: Evidence, seen: PartStays) -> Iterator[Finding]:
    """Findings where a part's measured rows and its stays differ, or it was carried without a row."""
    carries = evidence.own_rows(seen.name, "carry")
    for row in carries:
        for place, at_s in ((row["station"], row["start_s"]), (row["target"], row["end_s"])):
            if not _stood_at(seen, place, at_s):
                words = f"is not at '{place}' at {at_s:.1f} s, where the schedule has it"
                yield Finding("schedule", seen.name, place, at_s, words)
    for row in evidence.own_rows(seen.name, "process"):
        inside = [s for s in seen.stays if s.station == row["station"] and s.start_s <= row["start_s"] + SLACK_S]
        if not any(stay.end_s >= row["end_s"] - SLACK_S for stay in inside):
            when = f"from {row['start_s']:.1f} to {row['end_s']:.1f} s"
            words = f"did not stand in '{row['station']}' {when}, where the schedule has it"
            yield Finding("schedule", seen.name, row["station"], row["start_s"], words)
    for stay in seen.stays if evidence.rows else ():
        works = evidence.task.station(stay.station).kind == "machine" and stay is not seen.stays[0]
        rows = [row for row in evidence.own_rows(seen.name, "process") if row["station"] == stay.station]
        if works and stay is not seen.stays[-1] and not rows:
            words = f"stood in '{stay.station}', for which the schedule has no row"
            yield Finding("schedule", seen.name, stay.station, stay.start_s, words)
    for before, after in zip(seen.stays, seen.stays[1:], strict=False):
        if before.station != after.station and not any(
            row["start_s"] - SLACK_S <= before.end_s and after.start_s <= row["end_s"] + SLACK_S for row in carries
        ):
            words = f"went from '{before.station}' to '{after.station}' at {before.end_s:.1f} s, without a row of the schedule"
            yield Finding("schedule", seen.name, after.station, before.end_s, words)


def _stood_at(seen: PartStays, station: str, at_s: float) -> bool:
    return any(
        stay.station == station and stay.start_s - SLACK_S <= at_s <= stay.end_s + SLACK_S for stay in seen.stays
    )


def one_story(evidence: Evidence) -> Iterator[Finding]:
    """Findings where the robot's rows, planned or measured, leave a gap in time or place, or where their transfers differ.

    Runs with faults are not judged; a run that ended early is compared with the plan's first transfers.
    """
    if evidence.struck:
        return
    for rows in (evidence.rows, evidence.planned):
        yield from _chained(rows)
    if not evidence.planned:
        return
    planned, measured = _moves(evidence.planned), _moves(evidence.rows)
    early = len(evidence.claimed) < len(evidence.parts)
    for number, (plan, done) in enumerate(zip_longest(planned, measured)):
        if plan == done or (done is None and early):
            continue
        part, station, _ = done or plan
        words = f"transfer {number + 1} is {_words(done)}; the plan has {_words(plan)}"
        yield Finding("schedule", part, station, 0.0, words)
        return


def _words(move: tuple[str, str, str] | None) -> str:
    return "none" if move is None else f"{move[0]} from '{move[1]}' to '{move[2]}'"


def _moves(rows: Sequence[dict[str, Any]]) -> list[tuple[str, str, str]]:
    own = sorted((row for row in rows if row["operation"] in MOVES), key=lambda row: row["start_s"])
    return [(row["part"], row["station"], row["target"]) for row in own]


def _chained(rows: Sequence[dict[str, Any]]) -> Iterator[Finding]:
    """Findings where a row of the robot does not begin when and where the row before ended."""
    own = sorted((row for row in rows if row["robot"]), key=lambda row: (row["start_s"], row["end_s"]))
    for before, after in pairwise(own):
        if abs(after["start_s"] - before["end_s"]) > SLACK_S:
            words = f"from {after['start_s']:.1f} s, and the one before ends at {before['end_s']:.1f} s"
        elif after["station"] != before["target"]:
            words = f"from '{after['station']}', and it was at '{before['target']}'"
        else:
            continue
        words = f"'{after['operation']}' of the robot is {after['when']} {words}"
        yield Finding("schedule", after["part"] or before["part"] or "", after["station"], after["start_s"], words)
