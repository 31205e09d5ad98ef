"""Checks a schedule against its cell from first principles: plain data in, faults in words out, without the simulators.

cell: the values of a cell file (`tomllib.load`, `CellFile.model_dump`). rows: what `--schedule` writes as JSON. It is not
checked that a buffer for when the machine ahead is full (buffers = "busy") was used only then.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

Row = Mapping[str, Any]
EPS, NEVER, NONE = 1e-6, float("inf"), dict[str, Any](robot=None, start_s=float("inf"), end_s=float("inf"))
Rooms = list[tuple[str, float, float]]  # station, from, to [s]


def faults(cell: Row, rows: Sequence[Row], makespan_s: float) -> list[str]:
    """The faults of a schedule that claims this makespan [s], in words; an empty list if there are none."""
    robots = {robot.get("name") or "robot": robot for robot in cell.get("robots") or [cell.get("robot")] if robot}
    order = cell.get("order") or [cell["products"][0]["name"]] * cell["parts"]
    parts, arrivals = [f"{name} {n}" for n, name in enumerate(order, 1)], cell.get("arrivals") or {}
    for row in rows:
        known = row["part"] in (*parts, None) and (row["robot"] in robots or row["operation"] in ("process", "blocked"))
        if not (known and 0 <= row["start_s"] <= row["end_s"] < NEVER):
            return [f"an impossible row: {row}"]
    errors, taken, end_s, came_s = list[str](), Rooms(), 0.0, 0.0
    rows = [row for row in rows if row["operation"] != "service" or row["end_s"] > row["start_s"] + EPS]
    rows.sort(key=lambda row: (row["start_s"], row["end_s"]))
    for part, name, free_s in zip(parts, order, cell.get("release_s") or [0.0] * len(order), strict=True):
        came_s += arrivals.get("interval_s", 0.0)  # the parts come in their order
        own = [row for row in rows if row["part"] == part and row["operation"] not in ("wait", "blocked")]
        routes = next(product["routes"] for product in cell["products"] if product["name"] == name)
        tried = [_way(cell, robots, route, own, max(free_s, came_s)) for route in routes]
        wrong, rooms, done_s, first_s = min(tried, key=lambda way: len(way[0]))
        errors += [f"{part}: {words}" for words in wrong]
        taken, end_s = taken + rooms, max(end_s, done_s)
        came_s = first_s if arrivals.get("after") == "pick" else came_s
    for station in cell["stations"]:
        work = [row for row in rows if row["operation"] == "process" and row["station"] == station["name"]]
        errors += _crowd(station, [(a, b) for at, a, b in taken if at == station["name"]]) + _overload(station, work)
    for name, robot in robots.items():
        errors += _trips(cell, robot, [row for row in rows if row["robot"] == name])
    if cell.get("track"):
        errors += _collisions(cell, robots, [row for row in rows if row["operation"] in ("empty", "carry", "pallet")])
    return errors + ([] if abs(end_s - makespan_s) <= EPS else [f"the makespan is {end_s:g}, not {makespan_s:g}"])


Spans = list[
    tuple[int, float, float]
]  # a stretch of the track, and the times from and until which a robot is on it [s]
MOST_CHOICES = 256  # combinations of the times at which robots set out


def _ways(cell: Row) -> dict[str, dict[str, list[tuple[int, float, float]]]]:
    """The shortest way on the track between any two stations: its stretches with the times from and until [s]."""
    stretches = [
        (n, a, b, seconds)
        for n, stretch in enumerate(cell["track"]["stretches"])
        for a, b, seconds in (stretch, [*stretch[1::-1], stretch[2]])
    ]
    ways: dict[str, Any] = {station["name"]: {station["name"]: []} for station in cell["stations"]}
    for _ in cell["stations"]:
        for own in ways.values():
            for n, a, b, seconds in stretches:
                way = [*own[a], (n, (at := own[a][-1][2] if own[a] else 0.0), at + seconds)] if a in own else None
                if way and (b not in own or (own[b] and (way[-1][2], len(way)) < (own[b][-1][2], len(own[b])))):
                    own[b] = way
    return ways


def _collisions(cell: Row, robots: Row, rows: Sequence[Row]) -> list[str]:
    """The faults where two robots are on one stretch at a time, whenever they set out; all drive without stopping.

    A robot with a part sets out after the pick or when a stretch is free, at the latest so that it arrives in time: rows do
    not say when.
    """
    ways, chosen = _ways(cell), [Spans()]
    worst = list[str]()
    for row in sorted(rows, key=lambda row: row["end_s"]):
        way, speed = ways[row["station"]][row["target"]], float(robots[row["robot"]].get("speed") or 1.0)
        way = [(n, since / speed, until / speed) for n, since, until in way]
        first_s, late_s = row["start_s"], row["end_s"] - (way[-1][2] if way else 0.0)
        tried = list[tuple[Spans, list[str]]]()
        for held in chosen:
            free = {until - since for n, since, _ in way for m, _, until in held if n == m}
            at_s = sorted({late_s, first_s, *(s for s in free if first_s < s < late_s)} if row["part"] else {first_s})
            own = [[(n, out_s + since, out_s + until) for n, since, until in way] for out_s in at_s]
            tried += [([*held, *more], _met(held, more)) for more in own]
        worst = worst or min((met for _, met in tried), key=len)
        chosen = [held for held, met in tried if not met][:MOST_CHOICES] or [tried[0][0]]
    return worst


def _met(held: Spans, more: Spans) -> list[str]:
    """The faults where new spans overlap held ones on the same stretch."""
    pairs = [(n, min(end, until)) for n, begin, end in more for m, since, until in held
             if n == m and max(begin, since) < min(end, until) - EPS]  # fmt: skip
    return [f"two robots on stretch {n} of the track at {until_s:g}" for n, until_s in pairs]


def _travel_s(cell: Row, robot: Row, ends: Sequence[str], tables: Sequence[str] = ("travel",)) -> float:
    if cell.get("track"):
        way = _ways(cell)[ends[0]].get(ends[-1])
        return NEVER if way is None else (way[-1][2] if way else 0.0) / float(robot.get("speed") or 1.0)
    times = [row[ends[-1]] for table in tables if ends[-1] in (row := (cell.get(table) or {}).get(ends[0], {}))]
    return float([*times, 0.0 if ends[0] == ends[-1] else NEVER][0]) / float(robot.get("speed") or 1.0)


def _way(
    cell: Row, robots: Row, route: Any, rows: Sequence[Row], free_s: float
) -> tuple[list[str], Rooms, float, float]:
    """The faults of a part on a route, the room that it takes, and the times of its end and its first pick [s]."""
    stations = {station["name"]: station for station in cell["stations"]}
    wrong, rooms, left = list[str](), Rooms(), [*rows]

    def within(what: str, least_s: float, at_s: float, most_s: float = NEVER) -> None:
        wrong.extend([f"{what}: {at_s:g}, not {least_s:g} to {most_s:g}"] * (not least_s - EPS <= at_s <= most_s + EPS))

    def take(kind: str, *ends: str) -> tuple[float, float]:
        fits = [row for row in left if (row["operation"], row["station"], row["target"]) == (kind, ends[0], ends[-1])]
        row = (*fits, NONE)[0]
        least_s = _travel_s(cell, robots.get(row["robot"], {}), ends, ("loaded", "travel"))
        within(f"{kind} {' > '.join(ends)}", least_s, row["end_s"] - row["start_s"] if fits else -1.0)
        left.remove(row) if fits else None
        return row["start_s"], row["end_s"]

    stages: list[Row] = [{"station": entry} if isinstance(entry, str) else entry for entry in route]
    at, since_s, ready_s, first_s, most_s, service_s = stages[0]["station"], NEVER, free_s, NEVER, NEVER, 0.0
    pallet: list[tuple[str, float]] = []  # the station of the part's waiting pallet, and since when it is there
    for entry in stages[1:]:
        stage = _taken(entry, left)
        place, own_s, buffer = stations[stage["station"]], stage.get("processing_s"), stage.get("buffer")
        through = [buffer] if any(row["operation"] == "carry" and row["target"] == buffer for row in left) else []
        for target in [*through, place["name"]] if robots and at != place["name"] else []:
            pick_s, came_s = take("carry", at, target)
            within(f"picked in '{at}'", ready_s + service_s, pick_s, ready_s + most_s)
            served_s = take("service", at) if service_s > EPS else (ready_s, pick_s)
            within(f"service in '{at}'", service_s, min(served_s[1], pick_s) - max(served_s[0], ready_s))
            rooms, since_s, ready_s, kept = [*rooms, (at, since_s, pick_s)], came_s, came_s, (at, since_s)
            for before, stood_s in pallet:  # the pallet goes ahead, from the station before to the one after
                left_s, since_s = take("pallet", before, target)
                within("pallet picked", kept[1], left_s, pick_s)
                within("pallet dropped", left_s, since_s, pick_s)
                rooms.append((before, stood_s, left_s))
            at, first_s, most_s, service_s = target, min(first_s, pick_s), NEVER, 0.0
            pallet, rooms = ([kept], rooms[:-1]) if stage.get("pallet") else ([], rooms)
        if place["kind"] == "machine":
            begin_s, end_s = take("process", place["name"])
            latest_s = most_s if not robots else 0.0 if place.get("servers") is None else NEVER
            within(f"begun in '{place['name']}'", ready_s, begin_s, ready_s + latest_s)
            work_s = (place.get("processing_s") or 0.0) if own_s is None else own_s
            within(f"worked on in '{place['name']}'", work_s, end_s - begin_s, work_s)
            limits = [limited["at_most_s"] for limited in (stage, place) if limited.get("at_most_s") is not None]
            ready_s, most_s, first_s = end_s, [*limits, NEVER][0], min(first_s, begin_s)
            service_s = stage.get("service_s") or 0.0
    rooms += [(at, since_s, ready_s)] if stations[at]["kind"] == "machine" else []
    return wrong + [f"not on its route: {row}" for row in left[:1]], rooms, ready_s, first_s


def _taken(stage: Row, rows: Sequence[Row]) -> Row:
    """The one of a stage and its alternatives that a part took, by the next station in the rest of its rows."""
    ways = [
        {"station": entry} if isinstance(entry, str) else entry for entry in (stage, *stage.get("alternatives", ()))
    ]
    done = sorted(rows, key=lambda row: (row["start_s"], row["end_s"]))
    names = [row["target"] for row in done if row["operation"] in ("carry", "process")]
    places = [name for name in names if name in {way["station"] for way in ways}]
    return next((way for way in ways if way["station"] == places[0]), stage) if places else stage


def _crowd(station: Row, spans: Sequence[tuple[float, float]]) -> list[str]:
    """The fault of a station that ever holds more parts than it has room for."""
    most = max((sum(a <= begin < b - EPS for a, b in spans) for begin, _ in spans), default=0)
    return [f"'{station['name']}' holds {most}"] * (station["capacity"] != "unlimited" and most > station["capacity"])


def _overload(station: Row, work: Sequence[Row]) -> list[str]:
    """The fault of a machine that needs more servers than it has, setups included: the fewest chains that cover its work."""
    follows, setups = np.zeros((len(work), len(work)), dtype=bool), station.get("setup_s") or {}
    for (i, first), (j, then) in combinations(enumerate(work), 2):
        setup_s = setups.get(first["product"], {}).get(then["product"], 0.0)
        follows[i, j] = first["end_s"] + setup_s <= then["start_s"] + EPS
    chains = len(work) - int((maximum_bipartite_matching(csr_array(follows)) >= 0).sum()) if work else 0
    return [f"'{station['name']}' needs {chains} servers"] if chains > (station.get("servers") or NEVER) else []


def _trips(cell: Row, robot: Row, rows: Sequence[Row]) -> list[str]:
    """The faults where a robot is at two places, drives too fast, leaves its service, or works where it does not serve."""
    at, free_s, errors, serves, busy = robot["start"], 0.0, list[str](), robot.get("serves"), None
    for row in rows:
        ends, carries = (row["station"], row["target"]), row["operation"] in ("carry", "pallet")
        short = row["operation"] == "empty" and row["end_s"] - row["start_s"] + EPS < _travel_s(cell, robot, ends)
        wrong = {"late": row["start_s"] + EPS < free_s + _travel_s(cell, robot, (at, ends[0])), "short": short}
        wrong["barred"] = serves is not None and carries and not {*ends} <= {*serves}
        wrong["gone from its service"] = busy is not None and (busy != row["part"] or not carries)
        errors += [f"robot {word}: {row}" for word, is_so in wrong.items() if is_so]
        at, free_s, busy = row["target"], row["end_s"], row["part"] if row["operation"] == "service" else None
    return errors
