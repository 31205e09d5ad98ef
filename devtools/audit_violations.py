"""Violations of a task that are inserted into the frames or the schedule of a recorded run, with numpy alone.

Each function of VIOLATIONS draws a part, a place and a time, and returns the changed evidence. It raises Impossible where the
run has nothing to which its violation applies. `audits` lets the audit judge what they return.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import hypot
from typing import Any

import numpy as np

from lab.audit.evidence import SLACK_S, Evidence
from lab.audit.stays import PartStays, Stay
from lab.audit.tracks import Array, Numbers

LEAST_CUT, MOST_CUT = 0.05, 0.95  # shares of the processing time that are cut out
HANDLING_S = 10.0  # the longest that a part stays in a machine before and after its processing
TILTS_RAD = (0.25, 1.5)
SHIFTS_S = (2.0, 30.0)

Rng = np.random.Generator


class Impossible(Exception):
    """Raised when a run has nothing to which this violation applies."""


@dataclass(frozen=True)
class Violated:
    """Evidence with a violation: the part ("": no single part), the rules that may find it, and the violation in words."""

    evidence: Evidence
    part: str
    rules: tuple[str, ...]
    words: str


def copied(evidence: Evidence) -> Evidence:
    """A copy whose frames and rows can be written to."""
    tracks = replace(evidence.tracks, poses=evidence.tracks.poses.copy(), times_s=evidence.tracks.times_s.copy())
    return replace(evidence, tracks=tracks, rows=[dict(row) for row in evidence.rows])


def worked(evidence: Evidence) -> list[tuple[PartStays, Stay, float]]:
    """The stays of claimed parts in machines with a processing time, and that time [s]."""
    worked_stays = []
    for seen in evidence.parts:
        for stage in (stage for route in evidence.task.part(seen.kind).routes[:1] for stage in route):
            work_s = evidence.work_s(seen.kind, stage)
            own = [stay for stay in seen.stays if stay.station == stage.station]
            has_time = evidence.task.station(stage.station).process is None
            if work_s and own and has_time and seen.name in evidence.claimed:
                worked_stays.append((seen, max(own, key=lambda stay: stay.seconds), work_s))
    return worked_stays


def drawn(rng: Rng, choices: list[Any]) -> Any:
    """A random element. Raises Impossible if there is none."""
    if not choices:
        raise Impossible
    return choices[int(rng.integers(len(choices)))]


def claimed_part(evidence: Evidence, rng: Rng) -> PartStays:
    """A random part of those that the run claims to have delivered. Raises Impossible if there is none."""
    part: PartStays = drawn(rng, [part for part in evidence.parts if part.name in evidence.claimed])
    return part


def direction(rng: Rng) -> Array:
    """A random unit vector (2,) in the plane."""
    angle = float(rng.uniform(0, 2 * np.pi))
    return np.array([np.cos(angle), np.sin(angle)])


def spells(frames: Numbers, longer_than: int) -> list[Numbers]:
    """The runs of consecutive numbers among ascending frames (n,), those with more than `longer_than` frames."""
    return [run for run in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1) if len(run) > longer_than]


def without(evidence: Evidence, from_s: float, to_s: float, rows: bool) -> Evidence:
    """The evidence with a span of time cut out of its frames and, if `rows` is set, out of its schedule."""
    by_s = to_s - from_s

    def moved(at_s: float) -> float:
        return at_s if at_s <= from_s else max(from_s, at_s - by_s)

    times_s = evidence.tracks.times_s
    kept = (times_s <= from_s) | (times_s >= to_s)
    tracks = replace(
        evidence.tracks,
        poses=evidence.tracks.poses[kept],
        times_s=np.array([moved(at_s) for at_s in times_s[kept].tolist()]),
    )
    own = [
        dict(row) | ({"start_s": moved(row["start_s"]), "end_s": moved(row["end_s"])} if rows else {})
        for row in evidence.rows
    ]
    return replace(evidence, tracks=tracks, rows=own)


def time_cut(evidence: Evidence, rng: Rng) -> Violated:
    """A machine releases a part too early, and the schedule says so."""
    seen, stay, work_s = drawn(rng, worked(evidence))
    cut_s = work_s * float(rng.uniform(LEAST_CUT, MOST_CUT))
    begin_s = float(rng.uniform(stay.end_s - work_s, stay.end_s - cut_s)) - HANDLING_S / 4
    begin_s = max(begin_s, stay.start_s + SLACK_S)
    cut = without(evidence, begin_s, begin_s + cut_s, rows=True)
    return Violated(
        cut, seen.name, ("processing",), f"{seen.name} has {cut_s:.1f} of {work_s:g} s less in {stay.station}"
    )


def time_hidden(evidence: Evidence, rng: Rng) -> Violated:
    """A machine releases a part too early, and the schedule hides it."""
    seen, stay, work_s = drawn(rng, worked(evidence))
    cut_s = work_s * float(rng.uniform(0.1, MOST_CUT))
    begin_s = max(float(rng.uniform(stay.end_s - work_s, stay.end_s - cut_s)) - HANDLING_S / 4, stay.start_s + SLACK_S)
    cut = without(evidence, begin_s, begin_s + cut_s, rows=False)
    words = f"{seen.name} has {cut_s:.1f} s less in {stay.station}, which the schedule hides"
    who = seen.name if cut_s > HANDLING_S else ""  # a shorter cut may only remove time of the gripper
    return Violated(cut, who, ("processing", "schedule"), words)


def station_swapped(evidence: Evidence, rng: Rng) -> Violated:
    """A part comes to two stations of its route in the wrong order."""
    pairs = [
        (seen, earlier, later)
        for seen in evidence.parts
        for n, earlier in enumerate(seen.stays)
        for later in seen.stays[n + 1 :]
        if earlier.station != later.station and _is_only(evidence, seen, earlier) and _is_only(evidence, seen, later)
    ]
    seen, earlier, later = drawn(rng, pairs)
    return _swapped(copied(evidence), seen, earlier, later)


def _is_only(evidence: Evidence, seen: PartStays, stay: Stay) -> bool:
    """Whether a stay is the part's only one at a station of its only route."""
    routes = evidence.task.part(seen.kind).routes
    visits = sum(each.station == stay.station for each in seen.stays)
    return len(routes) == 1 and visits == 1 and stay.station in [stage.station for stage in routes[0]]


def _swapped(evidence: Evidence, seen: PartStays, earlier: Stay, later: Stay) -> Violated:
    tracks, body = evidence.tracks, evidence.tracks.number(seen.name)
    here, there = (stay.frames(evidence.tracks) for stay in (earlier, later))
    at, elsewhere = tracks.poses[here, body][-1].copy(), tracks.poses[there, body][0].copy()
    tracks.poses[here, body], tracks.poses[there, body] = elsewhere, at
    names = {earlier.station: later.station, later.station: earlier.station}
    for row in evidence.rows:
        if row["part"] == seen.name:
            row["station"], row["target"] = (names.get(row[field], row[field]) for field in ("station", "target"))
    words = f"{seen.name} comes to {earlier.station} and {later.station} in the wrong order"
    return Violated(replace(evidence), seen.name, ("route", "end", "processing"), words)


def station_left_out(evidence: Evidence, rng: Rng) -> Violated:
    """A part never stands at a station of its route."""
    stays = [(seen, stay) for seen in evidence.parts for stay in seen.stays[1:-1] if _is_only(evidence, seen, stay)]
    seen, stay = drawn(rng, stays)
    own = copied(evidence)
    own.tracks.poses[stay.frames(evidence.tracks), own.tracks.number(seen.name), 2] += 0.2
    return Violated(replace(own), seen.name, ("route", "schedule"), f"{seen.name} hangs over {stay.station}")


def overfull(evidence: Evidence, rng: Rng) -> Violated:
    """A part stands in a station that others have filled."""
    guests = []
    for number, station in enumerate(evidence.task.stations):
        there = np.array([seen.occupies == number for seen in evidence.parts])
        full = np.flatnonzero(there.sum(axis=0) == station.capacity)
        for run in spells(full, 20):
            guests += [
                (station.name, run, seen) for seen, at in zip(evidence.parts, there, strict=True) if not at[run].any()
            ]
    station, run, seen = drawn(rng, guests)
    own = copied(evidence)
    tracks, place = own.tracks, next(n for n, s in enumerate(own.task.stations) if s.name == station)
    inside = [part for part in evidence.parts if (part.occupies[run] == place).all()]
    host = drawn(rng, inside)
    body = own.tracks.number(host.name if (host.at[run] == place).all() else f"{host.name}'s pallet")
    guest, first = tracks.number(seen.name), int(rng.integers(len(run) - 12))
    span = run[first : first + 12]
    tracks.poses[span, guest] = tracks.poses[span, body]
    tracks.poses[span, guest, 2] += tracks.low[body, 2] - tracks.low[guest, 2]  # both stand on the same surface
    return Violated(replace(own), seen.name, ("capacity",), f"{seen.name} stands in {station}, which is full")


def window_overrun(evidence: Evidence, rng: Rng) -> Violated:
    """A part stays in its machine for longer than the task allows."""
    seen, stay, work_s = drawn(rng, worked(evidence))
    over_s, allowed_s = float(rng.uniform(*SHIFTS_S)), stay.seconds - work_s + 1.0
    stations = [
        station.model_copy(update={"at_most_s": allowed_s}) if station.name == stay.station else station
        for station in evidence.task.stations
    ]
    task = evidence.task.model_copy(update={"stations": tuple(stations)})
    middle_s = stay.start_s + stay.seconds / 2
    over_s += allowed_s

    def moved(at_s: float) -> float:
        return at_s + over_s if at_s > middle_s else at_s

    times_s = np.array([moved(at_s) for at_s in evidence.tracks.times_s.tolist()])
    rows = [dict(row) | {"start_s": moved(row["start_s"]), "end_s": moved(row["end_s"])} for row in evidence.rows]
    for row in rows:
        if row["operation"] == "process" and row["part"] == seen.name and row["station"] == stay.station:
            row["end_s"] = row["start_s"] + work_s
    own = replace(evidence, task=task, tracks=replace(evidence.tracks, times_s=times_s), rows=rows)
    return Violated(own, seen.name, ("window",), f"{seen.name} stays in {stay.station} for {over_s:.1f} s too long")


def head_idle(evidence: Evidence, rng: Rng) -> Violated:
    """A machine's head stops before it has covered its whole area."""
    stays = [
        (seen, stay)
        for seen in evidence.parts
        for stay in seen.stays
        if seen.name in evidence.claimed and evidence.task.station(stay.station).process is not None
    ]
    seen, stay = drawn(rng, stays)
    own = copied(evidence)
    head, during = own.tracks.number(f"{stay.station} head"), stay.frames(evidence.tracks)
    first = int(rng.integers(len(during) // 10, len(during) * 2 // 3))
    own.tracks.poses[during[first:], head] = own.tracks.poses[during[0], head]
    return Violated(own, seen.name, ("process",), f"the head of {stay.station} stops over {seen.name}")


def tilted(evidence: Evidence, rng: Rng) -> Violated:
    """A part is tilted at the end."""
    seen = claimed_part(evidence, rng)
    own, angle = copied(evidence), float(rng.uniform(*TILTS_RAD))
    axis = np.sin(angle / 2) * direction(rng)
    own.tracks.poses[-1:, own.tracks.number(seen.name), 3:] = (*axis, 0.0, np.cos(angle / 2))
    return Violated(replace(own), seen.name, ("end",), f"{seen.name} leans by {angle:.2f} rad at the end")


def elsewhere(evidence: Evidence, rng: Rng) -> Violated:
    """A part is left beside its last station."""
    seen = claimed_part(evidence, rng)
    own, to = copied(evidence), direction(rng)
    last = own.tracks.number(seen.stays[-1].station)
    off_m = float(hypot(*(own.tracks.high[last] - own.tracks.low[last])[:2])) + float(rng.uniform(0.02, 0.3))
    own.tracks.poses[-4:, own.tracks.number(seen.name), :2] += off_m * to
    return Violated(replace(own), seen.name, ("end",), f"{seen.name} is left {off_m:.2f} m beside")


def two_in_hand(evidence: Evidence, rng: Rng) -> Violated:
    """The gripper carries two parts at once."""
    pairs = [(carried, other) for carried in evidence.parts for other in evidence.parts if carried is not other]
    carried, other = drawn(rng, pairs)
    way = np.flatnonzero(carried.carried)
    if len(way) < 20:
        raise Impossible
    first = int(rng.integers(len(way) - 10))
    span, own = way[first : first + 10], copied(evidence)
    own.tracks.poses[span, own.tracks.number(other.name), :3] = own.tracks.poses[
        span, own.tracks.number(carried.name), :3
    ] + (0.0, 0.0, 0.1)
    return Violated(
        replace(own), other.name, ("gripper", "schedule"), f"{carried.name} and {other.name} are carried at once"
    )


def row_moved(evidence: Evidence, rng: Rng) -> Violated:
    """The schedule gives another time for a carry."""
    own = copied(evidence)
    row = drawn(rng, [row for row in own.rows if row["operation"] == "carry"])
    by_s = float(rng.uniform(*SHIFTS_S)) + row["end_s"] - row["start_s"]
    row["start_s"], row["end_s"] = row["start_s"] + by_s, row["end_s"] + by_s
    return Violated(
        own, str(row["part"]), ("schedule",), f"the carry of {row['part']} is said to be {by_s:.1f} s later"
    )


def row_lost(evidence: Evidence, rng: Rng) -> Violated:
    """The schedule lacks a carry."""
    own = copied(evidence)
    row = drawn(rng, [row for row in own.rows if row["operation"] == "carry"])
    own.rows.remove(row)  # type: ignore[attr-defined]
    return Violated(own, str(row["part"]), ("schedule",), f"a carry of {row['part']} is not in the schedule")


def drifting(evidence: Evidence, rng: Rng) -> Violated:
    """A part drifts while it stands, in steps too small to be noticed one by one."""
    stays = [(seen, stay) for seen in evidence.parts for stay in seen.stays if stay.seconds > 3 * HANDLING_S]
    seen, stay = drawn(rng, stays)
    own = copied(evidence)
    during, by_m = stay.frames(evidence.tracks), float(rng.uniform(0.01, 0.04))
    times_s = own.tracks.times_s[during]
    share = np.clip((times_s - times_s[0] - HANDLING_S) / (stay.seconds - 2 * HANDLING_S), 0.0, 1.0)[:, None]
    own.tracks.poses[during, own.tracks.number(seen.name), :2] += share * by_m * direction(rng)
    return Violated(own, seen.name, ("stood", "gripper"), f"{seen.name} creeps by {by_m:.3f} m in {stay.station}")


def beside(evidence: Evidence, rng: Rng) -> Violated:
    """A part does not stand where the robot set it down."""
    seen, stay = drawn(rng, [(seen, stay) for seen in evidence.parts for stay in seen.stays[1:]])
    own = copied(evidence)
    by_m = float(rng.uniform(0.03, 0.06))
    own.tracks.poses[stay.frames(evidence.tracks), own.tracks.number(seen.name), :2] += by_m * direction(rng)
    rules = ("stood", "gripper", "end", "route", "schedule", "overlap")
    return Violated(replace(own), seen.name, rules, f"{seen.name} stands {by_m:.3f} m beside in {stay.station}")


def off_its_foot(evidence: Evidence, rng: Rng) -> Violated:
    """A part ends above the surface that it should stand on, or sunk into it."""
    seen = claimed_part(evidence, rng)
    own, by_m = copied(evidence), float(rng.choice([rng.uniform(0.004, 0.009), -rng.uniform(0.003, 0.0045)]))
    own.tracks.poses[seen.stays[-1].frames(evidence.tracks), own.tracks.number(seen.name), 2] += by_m
    return Violated(replace(own), seen.name, ("stood",), f"{seen.name} ends {1000 * by_m:.1f} mm off its foot")


def changed_places(evidence: Evidence, rng: Rng) -> Violated:
    """Two parts of one kind stand on each other's spots, for as long as both are at a station."""
    shared_spans = []
    parts = evidence.parts
    for first, second in ((a, b) for a in parts for b in parts if a.name < b.name and a.kind == b.kind):
        both = np.flatnonzero((first.at >= 0) & (first.at == second.at))
        runs = [run for run in spells(both, 10) if run[0] > 0 or run[-1] < len(first.at) - 1]
        shared_spans += [(first, second, run) for run in runs]
    first, second, run = drawn(rng, shared_spans)
    own = copied(evidence)
    a, b = own.tracks.number(first.name), own.tracks.number(second.name)
    own.tracks.poses[np.ix_(run, np.array([a, b]))] = own.tracks.poses[np.ix_(run, np.array([b, a]))]
    return Violated(
        replace(own), first.name, ("gripper", "stood"), f"{first.name} and {second.name} have changed places"
    )


def beside_the_hand(evidence: Evidence, rng: Rng) -> Violated:
    """A part moves beside the gripper that carries it."""
    seen = drawn(rng, [seen for seen in evidence.parts if seen.carried.any()])
    way = drawn(rng, spells(np.flatnonzero(seen.carried), 20))
    own, by_m = copied(evidence), float(rng.uniform(0.12, 0.2))
    own.tracks.poses[way, own.tracks.number(seen.name), 1] += by_m * np.sin(np.linspace(0.0, np.pi, len(way)))
    return Violated(own, seen.name, ("gripper",), f"{seen.name} moves {by_m:.2f} m beside the gripper")


def everything_moved(evidence: Evidence, rng: Rng) -> Violated:
    """All bodies are moved away from where the task puts them."""
    own, to, by_m = copied(evidence), direction(rng), float(rng.uniform(0.004, 0.05))
    own.tracks.poses[:, :, :2] += by_m * to
    return Violated(own, "", ("station",), f"all bodies are moved by {by_m:.3f} m")


def service_left_out(evidence: Evidence, rng: Rng) -> Violated:
    """The robot takes a part out without the service that the task requires before."""
    stays = [
        (seen, stay)
        for seen in evidence.parts
        for route in evidence.task.part(seen.kind).routes[:1]
        for stage in route
        for stay in seen.stays
        if stage.service is not None and stay.station == stage.station and seen.name in evidence.claimed
    ]
    seen, stay = drawn(rng, stays)
    own, by_m = copied(evidence), float(rng.uniform(0.1, 0.3))
    during = stay.frames(evidence.tracks)
    span = during[int(len(during) * rng.uniform(0.3, 0.6)) :]
    own.tracks.poses[np.ix_(span, np.array(own.tracks.robot[1:]))] += (0.0, by_m, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Violated(own, seen.name, ("service",), f"the robot does not serve {seen.name} in {stay.station}")


def plan_changed(evidence: Evidence, rng: Rng) -> Violated:
    """Two transfers of the plan have changed places."""
    moves = [row for row in evidence.planned if row["operation"] == "carry"]
    pairs = [(a, b) for a, b in pairwise(moves) if (a["part"], a["station"]) != (b["part"], b["station"])]
    first, second = drawn(rng, pairs)
    own = copied(evidence)
    rows = [dict(row) for row in own.planned]
    for row in rows:
        for this, that in ((first, second), (second, first)):
            if all(row[key] == this[key] for key in ("operation", "part", "start_s")):
                row |= {"start_s": that["start_s"], "end_s": that["end_s"]}
    return Violated(
        replace(own, planned=rows), "", ("schedule",), f"{first['part']} and {second['part']} in another order"
    )


def wait_changed(evidence: Evidence, rng: Rng) -> Violated:
    """A wait of the robot is given another end, in the plan or in the measured schedule."""
    as_planned = bool(rng.integers(2))
    rows = [dict(row) for row in (evidence.planned if as_planned else evidence.rows)]
    row = drawn(rng, [row for row in rows if row["robot"] and row["operation"] in ("wait", "empty")])
    row["end_s"] += float(rng.choice([-1, 1])) * float(rng.uniform(0.5, 20.0))
    own = replace(evidence, planned=rows) if as_planned else replace(evidence, rows=rows)
    words = f"a {row['operation']} of the robot is {row['when']} to {row['end_s']:.1f} s"
    return Violated(own, "", ("schedule",), words)


VIOLATIONS: tuple[Callable[[Evidence, Rng], Violated], ...] = (
    *(time_cut, time_hidden, station_swapped, station_left_out, overfull, window_overrun, head_idle, tilted, elsewhere),
    *(two_in_hand, row_moved, row_lost, drifting, beside, off_its_foot, changed_places, beside_the_hand),
    *(everything_moved, service_left_out, plan_changed, wait_changed),
)
