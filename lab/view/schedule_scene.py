"""Any schedule as a replay in 3D: parts stand in stations while they are processed, and move between them or are carried."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, inf, log2, radians
from typing import NamedTuple

import numpy as np

from lab.errors import counted
from lab.mdp import FloatArray
from lab.sequencing.cell.schedule import Activity, Schedule
from lab.sim.frames import Body, Frame, Recording, Rgba, Shape, Vector
from lab.tasks.schedule_table import ScheduleTable, TimedRow
from lab.view.canvas import seconds
from lab.view.gantt_bars import PRODUCTS, mixed
from lab.view.keyframes import BodyMotion, KeyframeTrack, continuous
from lab.view.scene_data import Story, camera_for
from lab.view.schedule_floor import (
    IDLE,
    INK,
    PART_M,
    WORKS,
    Carrier,
    CarrierStop,
    FloorSpot,
    PlanarArm,
    Vehicle,
    laid_out,
)

START, FINISHED = (
    "start",
    "finished",
)  # tiles on the floor, where the schedule does not say where parts come from or go to
SHADES = 1.0, 0.6, 0.35  # of each colour, before the first begins again
WATCHED_S = 40.0  # approximate playing time of a page
QUICK = 1 / 110  # share of the makespan that a part needs to move by itself
MOST_LABELS = 40  # parts up to which each has its name above it
MOST_ROWS = 8  # of a chart below the picture; a larger chart stands beside it (replay.js)
MOVES = ("carry", "pallet", "empty")
_CLOSE_S = 1e-9
Keys = list[tuple[float, Vector]]


class ScheduleScene(NamedTuple):
    """The arguments of `replay_html`: bodies, their motions, the story beside them, and the initial speed."""

    title: str
    recording: Recording
    tracks: dict[str, BodyMotion]
    story: Story
    speed: float


@dataclass
class _Stay:
    """A part's stay in a station; by: the vehicle that brought it, None: it came by itself."""

    part: str
    station: str
    begin_s: float
    end_s: float = inf
    works: bool = False
    by: TimedRow | None = None
    at: Vector = (0.0, 0.0, 0.0)


class _Move(NamedTuple):
    """A vehicle's drive from station to station; row: its transport, None: it is empty."""

    begin_s: float
    end_s: float
    origin: str
    target: str
    row: TimedRow | None


def scene_of(table: ScheduleTable, name: str) -> ScheduleScene:
    """The scene of a schedule with this name."""
    rows = _whole(table.rows)
    last_s = max(row.end_s for row in rows)
    parts = list(dict.fromkeys(row.part for row in rows if row.part))
    looks = {part: (number, part, _colour(number)) for number, part in enumerate(parts, 1)}
    quick_s = max(last_s * QUICK, _CLOSE_S)
    moves = {vehicle: _moves(own, quick_s) for vehicle, own in _by_vehicle(rows).items()}
    departs = {id(move.row): move.begin_s for own in moves.values() for move in own if move.row is not None}
    own_rows = defaultdict[str, list[TimedRow]](list)
    for row in rows:
        own_rows[row.part or ""].append(row)
    stays = {part: _stays(part, own_rows[part], quick_s, departs) for part in parts}
    kinds = _kinds(rows, [stay for own in stays.values() for stay in own])
    around = table.has_arm and not table.places_m
    wide = 1.7 if len({row.vehicle or row.origin for row in rows}) <= MOST_ROWS else 0.9
    floor = laid_out(kinds, table.places_m, len(parts), around, wide)
    for own in _by_place(stays.values()).values():
        _place(own, floor)
    carriers: dict[str, Carrier] = {
        vehicle: PlanarArm(vehicle, [*floor.values()])
        if around
        else Vehicle(number, vehicle, len(moves), bool(table.places_m))
        for number, vehicle in enumerate(moves)
    }
    tracks = dict[str, BodyMotion]()
    bodies = list[Body]()
    for number, spot in enumerate(floor.values()):
        busy = [row for row in rows if row.vehicle is None and row.origin == spot.name and row.kind != "blocked"]
        for body in spot.bodies(number):
            bodies.append(body)
            steps = _steps(busy) if body.name.startswith("lamp") else ()
            tracks[body.name] = BodyMotion(spot.pose, None, None, steps, ())
    for vehicle, carrier in carriers.items():
        bodies += carrier.bodies
        tracks |= _carrier_tracks(carrier, moves[vehicle], stays, floor)
    for part in parts:
        body = _part_body(*looks[part], labelled=len(parts) <= MOST_LABELS)
        bodies.append(body)
        keys = _part_keys(stays[part], carriers, floor)
        tracks[body.name] = _motion(keys)
    end_s = max(last_s, *(own[-1].begin_s for own in stays.values())) if stays else last_s
    frames = [Frame(0.0, {}), Frame(max(end_s, _CLOSE_S), {})]
    numbers = {part: number for part, (number, _, _) in looks.items()}
    story = Story(
        _schedule(rows, numbers),
        _schedule(_whole(table.planned), numbers) if table.planned else None,
        tuple(_captions(rows)),
        begins_s=tuple(sorted({row.start_s for row in rows if row.kind in ("process", "carry")})),
        looks={number: (part, colour) for number, part, colour in looks.values()},
    )
    stations = sum(kind != "tile" for kind in kinds.values())
    counts = [counted(len(parts), "part"), counted(stations, "station")]
    counts += [counted(len(moves), "vehicle")] if moves and not around else []
    title = f"{name}: {', '.join(counts)}, {seconds(last_s)}"
    speed = 2.0 ** max(-1, ceil(log2(max(last_s, _CLOSE_S) / WATCHED_S)))
    camera = camera_for(_seen(floor.values()), -radians(75.0 if around else 90.0), radians(50.0), wide)
    return ScheduleScene(title, Recording(tuple(bodies), frames, camera), tracks, story, speed)


def _whole(rows: Sequence[TimedRow]) -> list[TimedRow]:
    """The rows with the missing origins and targets of transports filled in, from where the part is and where it is next."""
    whole, here = list[TimedRow](), dict[str, str]()
    later = defaultdict[str, list[TimedRow]](list)
    for row in rows:
        if row.part and (row.vehicle is None or row.kind == "carry"):
            later[row.part].append(row)
    for row in rows:
        part = row.part
        if part and (row.vehicle is None or row.kind == "carry"):
            later[part].pop(0)
            if row.kind == "carry":
                target = row.target or next(
                    (later_row.origin for later_row in later[part] if later_row.origin), FINISHED
                )
                row = replace(row, origin=row.origin or here.get(part, START), target=target)
            here[part] = row.target or START
        whole.append(row)
    return whole


def _by_vehicle(rows: Iterable[TimedRow]) -> dict[str, list[TimedRow]]:
    by_vehicle = defaultdict[str, list[TimedRow]](list)
    for row in rows:
        if row.vehicle and row.kind in MOVES and row.origin and row.target:
            by_vehicle[row.vehicle].append(row)
    return dict(by_vehicle)


def _moves(rows: Sequence[TimedRow], quick_s: float) -> list[_Move]:
    """The drives of a vehicle: its transports, and empty drives to the next part."""
    moves, here, free_s = list[_Move](), rows[0].origin or "", 0.0
    for row in rows:
        begin_s, origin = max(row.start_s, free_s), row.origin or ""
        end_s = max(row.end_s, begin_s)  # of overlapping rows, the later one takes no time
        if origin != here and row.kind != "empty":
            if begin_s - free_s > _CLOSE_S:
                moves.append(_Move(max(free_s, begin_s - 3 * quick_s), begin_s, here, origin, None))
            else:  # there is no time for it: it becomes a part of the transport
                until_s = begin_s + (end_s - begin_s) / 3
                moves.append(_Move(begin_s, until_s, here, origin, None))
                begin_s = until_s
        loaded = row if row.kind == "carry" else None
        moves.append(_Move(begin_s, end_s, origin if row.kind != "empty" else here, row.target or "", loaded))
        here, free_s = row.target or "", end_s
    return moves


def _stays(part: str, rows: Sequence[TimedRow], quick_s: float, departs: Mapping[int, float]) -> list[_Stay]:
    """The stays of a part in order; between two stays it moves by itself or is carried."""
    chain = [row for row in rows if (row.vehicle is None and row.kind != "blocked") or row.kind == "carry"]
    stays = [_Stay(part, (chain[0].origin or START) if chain and chain[0].vehicle else START, 0.0)]
    free_s = 0.0

    def go(station: str, leave_s: float, arrive_s: float, works: bool = False, by: TimedRow | None = None) -> None:
        stays[-1].end_s = max(leave_s, stays[-1].begin_s)
        stays.append(_Stay(part, station, max(arrive_s, stays[-1].end_s), inf, works, by))

    spans = set[tuple[float, float]]()
    for row in chain:
        here, origin = stays[-1], row.origin or START
        if row.vehicle is not None:
            depart_s = departs.get(id(row), row.start_s)
            if here.station != origin:
                go(origin, free_s, min(free_s + quick_s, depart_s))
            go(row.target or FINISHED, depart_s, row.end_s, by=row)
        elif (row.start_s, row.end_s) not in spans:  # of simultaneous ones, such as a machine and a person, the first
            spans.add((row.start_s, row.end_s))
            brief_s = min(quick_s, (row.end_s - row.start_s) / 2)
            if here.station == origin and (here.works or here.begin_s >= row.start_s - quick_s / 100):
                here.works = here.works or row.kind != "store"
            elif here.station == origin:
                go(origin, row.start_s, row.start_s + brief_s / 2, row.kind != "store")
            elif len(stays) == 1 or row.start_s - free_s <= _CLOSE_S:
                leave_s = max(0.0, row.start_s - quick_s) if len(stays) == 1 else row.start_s
                go(origin, leave_s, row.start_s if leave_s < row.start_s else row.start_s + brief_s, True)
            elif row.start_s - free_s <= quick_s:
                go(origin, free_s, row.start_s, True)
            else:
                go(origin, free_s, free_s + quick_s)
                go(origin, row.start_s, row.start_s + brief_s / 2, True)
        free_s = max(free_s, row.end_s)
    if chain and chain[-1].vehicle is None:
        go(FINISHED, free_s, free_s + quick_s)
    return stays


def _kinds(rows: Sequence[TimedRow], stays: Sequence[_Stay]) -> dict[str, str]:
    """The kind of each station ("machine", "store" or "tile"), by name, in the order of first use."""
    works = {row.origin for row in rows if row.vehicle is None and row.kind != "store"}
    said = {name for row in rows for name in (row.origin, row.target) if row.vehicle is None or row.kind != "carry"}
    names = [name for row in rows for name in (row.origin, row.target) if name]
    names += [stay.station for stay in stays]
    tiles = {START, FINISHED} - said
    return {name: "tile" if name in tiles else "machine" if name in works else "store" for name in dict.fromkeys(names)}


def _by_place(stays: Iterable[Sequence[_Stay]]) -> dict[tuple[str, bool], list[_Stay]]:
    by_place = defaultdict[tuple[str, bool], list[_Stay]](list)
    for own in stays:
        for stay in own:
            by_place[stay.station, stay.works].append(stay)
    return by_place


def _place(stays: Sequence[_Stay], floor: Mapping[str, FloorSpot]) -> None:
    """Assign to each stay the first free place of its station."""
    until_s = list[float]()
    for stay in sorted(stays, key=lambda one: one.begin_s):
        free = next((k for k, end_s in enumerate(until_s) if end_s <= stay.begin_s + _CLOSE_S), len(until_s))
        until_s[free : free + 1] = [stay.end_s]
        stay.at = floor[stay.station].place(free, stay.works)


# ---- motions of carriers, parts and lamps


def _carrier_tracks(
    carrier: Carrier, moves: Sequence[_Move], stays: Mapping[str, Sequence[_Stay]], floor: Mapping[str, FloorSpot]
) -> dict[str, BodyMotion]:
    stops = [_stops(move, moves[k + 1 :][:1], stays, floor) for k, move in enumerate(moves)]
    times, hands = list[float](), list[FloatArray]()
    for k, (move, (start, end)) in enumerate(zip(moves, stops, strict=True)):
        begins = start if move.row is not None or k == 0 else stops[k - 1][1]
        way = carrier.way(begins, end)
        at_s, _ = _carried(carrier, move.begin_s, move.end_s, way, move.row is not None)
        times += at_s.tolist()
        hands += [*way[:, 1:]]
    poses = carrier.poses(np.array(hands))
    held = {body.name: BodyMotion((0.0,) * 6 + (1.0,), None, None, (), ()) for body in carrier.bodies}
    return held | {name: _motion_of(times, own[:, :3], continuous(own[:, 3:])) for name, own in poses.items()}


def _carried(
    carrier: Carrier, begin_s: float, end_s: float, way: FloatArray, loaded: bool
) -> tuple[FloatArray, FloatArray]:
    """The times at which the carrier is at each point of its path, and those points."""
    margin = carrier.handling if loaded else 0.0
    return begin_s + (margin + way[:, 0] * (1 - 2 * margin)) * (end_s - begin_s), way[:, 1:]


def _stops(
    move: _Move, following: Sequence[_Move], stays: Mapping[str, Sequence[_Stay]], floor: Mapping[str, FloorSpot]
) -> tuple[CarrierStop, CarrierStop]:
    """The stops between which the hand moves; an empty carrier moves to the next part, if it is there already."""
    if move.row is not None:
        before, after = _around(move.row, stays)
        return CarrierStop(floor[before.station], before.at), CarrierStop(floor[after.station], after.at)
    start, end = floor[move.origin], floor[move.target]
    hand = end.place(0, True)
    if following and following[0].row is not None and following[0].origin == move.target:
        hand = _around(following[0].row, stays)[0].at
    return CarrierStop(start, start.place(0, True)), CarrierStop(end, hand)


def _around(row: TimedRow, stays: Mapping[str, Sequence[_Stay]]) -> tuple[_Stay, _Stay]:
    """The stays of a part before and after a transport."""
    own = stays[row.part or ""]
    number = next(k for k, stay in enumerate(own) if stay.by is row)
    return own[number - 1], own[number]


def _part_keys(stays: Sequence[_Stay], carriers: Mapping[str, Carrier], floor: Mapping[str, FloorSpot]) -> Keys:
    """The positions of a part by time."""
    keys: Keys = [(0.0, stays[0].at)]
    for before, after in pairwise(stays):
        begin_s, end_s = before.end_s, after.begin_s
        keys.append((begin_s, before.at))
        if after.by is not None:
            carrier = carriers[after.by.vehicle or ""]
            way = carrier.way(
                CarrierStop(floor[before.station], before.at), CarrierStop(floor[after.station], after.at)
            )
            times, points = _carried(carrier, begin_s, end_s, way, True)
            keys += [(at_s, (x, y, z)) for at_s, (x, y, z) in zip(times.tolist(), points.tolist(), strict=True)]
        elif before.station != after.station:
            one, other = np.array(before.at), np.array(after.at)
            high = max(0.35, 0.2 * float(np.linalg.norm(other - one)))
            for share in np.linspace(0.1, 0.9, 9).tolist():
                x, y, z = (one + share * (other - one)).tolist()
                keys.append((begin_s + share * (end_s - begin_s), (x, y, z + 4 * high * share * (1 - share))))
        keys.append((end_s, after.at))
    return keys


def _motion(keys: Keys) -> BodyMotion:
    places = np.array([at for _, at in keys])
    return _motion_of([at_s for at_s, _ in keys], places, np.tile([0.0, 0.0, 0.0, 1.0], (len(keys), 1)))


def _motion_of(times: Sequence[float], places: FloatArray, turns: FloatArray) -> BodyMotion:
    """The motion through these points; of times that a page cannot distinguish, the last one counts."""
    at_s = np.asarray(times, dtype=np.float32).astype(np.float64)
    last = np.append(np.diff(at_s) > 0, True)
    at_s, places, turns = at_s[last], places[last], turns[last]
    moves, turned = np.ptp(places, axis=0).max() > 0, np.ptp(turns, axis=0).max() > 0
    start = (*places[0].tolist(), *turns[0].tolist())
    return BodyMotion(
        start, KeyframeTrack(at_s, places) if moves else None, KeyframeTrack(at_s, turns) if turned else None, (), ()
    )


def _steps(rows: Sequence[TimedRow]) -> tuple[tuple[float, Rgba], ...]:
    """A lamp's colours over time: lit while the machine works."""
    steps, until_s = list[tuple[float, Rgba]](), -inf
    for row in rows:
        if row.start_s > until_s + _CLOSE_S:
            steps += [(until_s, IDLE), (row.start_s, WORKS)] if steps else [(row.start_s, WORKS)]
        until_s = max(until_s, row.end_s)
    return (*steps, (until_s, IDLE)) if steps else ()


# ---- looks, chart, captions and camera


def _part_body(number: int, name: str, colour: str, *, labelled: bool) -> Body:
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    shapes = [Shape("box", (PART_M,) * 3, None, (red, green, blue, 1.0))]
    shapes += [Shape("label", (0.09,), None, INK, (0.0, 0.0, PART_M / 2 + 0.13), text=name)] if labelled else []
    return Body(f"part {number}", tuple(shapes))


def _colour(number: int) -> str:
    """The colour of a part, in three shades before the colours repeat."""
    shade, colour = divmod(number - 1, len(PRODUCTS))
    return mixed(PRODUCTS[colour], SHADES[shade % len(SHADES)])


def _schedule(rows: Sequence[TimedRow], numbers: Mapping[str, int]) -> Schedule:
    """The rows as the schedule of a chart."""

    def activity(row: TimedRow) -> Activity:
        resource = row.vehicle or row.origin or ""
        origin = row.origin or resource
        part = numbers.get(row.part or "")
        return Activity(resource, row.kind, part, origin, row.target or origin, row.start_s, row.end_s)

    robot = tuple(activity(row) for row in rows if row.vehicle)
    machines = tuple(activity(row) for row in rows if not row.vehicle)
    return Schedule(robot, machines, (), max(row.end_s for row in rows), ())


def _captions(rows: Sequence[TimedRow]) -> Iterable[tuple[float, str]]:
    """The captions: for each start [s], what begins then."""
    begins = defaultdict[float, dict[str, list[str]]](dict)
    for row in rows:
        if row.part and row.kind == "carry":
            begins[row.start_s].setdefault(f"{row.vehicle} carries {row.part} to", []).append(row.target or "")
        elif row.part and row.kind == "process" and not row.vehicle:
            begins[row.start_s].setdefault(f"{row.part} begins in", []).append(row.origin or "")
    for at_s, said in begins.items():
        words = [f"{what} {', '.join(where)}" for what, where in said.items()]
        more = f" and {len(words) - 3} more" if len(words) > 3 else ""
        yield at_s, f"{'; '.join(words[:3])}{more}"


def _seen(spots: Iterable[FloorSpot]) -> FloatArray:
    """The points (n, 3) [m] that the picture must contain: stations, their names, and vehicles in front of them."""
    ends = [(spot, spot.edges[0] / 2 + 0.1) for spot in spots]
    return np.array(
        [
            (spot.x + x * edge, spot.y + y, z)
            for spot, edge in ends
            for x in (-1, 1)
            for y in (-edge - 0.35, edge)
            for z in (0.0, 0.9)
        ]
    )
