"""The features of a decision that a carried-over policy weighs; they mean the same in a small cell and in a large one.

Times are divided by the cell's mean work per move, and loads by the highest load, so that no feature grows with the number of
parts. `features` is the readable form; `carried_over_kernels` holds the compiled one.
"""

from math import isnan
from typing import NamedTuple

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES
from lab.sequencing.cell.routes import SERVER, Option, from_the_ends, part_of
from lab.sequencing.methods.carried_over_policy import FEATURES
from lab.sequencing.methods.rules import loads_s, machine_of, work_left_s
from lab.sequencing.simulate.cell_arrays import Floats, Ints
from lab.sequencing.simulate.run import Run

WAITED = 10.0  # moves: a longer time since the part was ready counts as this much


class FeatureArrays(NamedTuple):
    """The work ahead of each of a cell's P positions; station index S (of S stations) means no station.

    scale_s: mean work per move [s]. left_s (P,): see `rules.work_left_s`. moves (P,): the fewest moves to the end. load_s
    (P, S + 1): processing still to come at each station [s], divided by `places` (S + 1,), the parts that it works on at once.
    machine (P,): the machine that the part stands in. following (P,): the machine that works on it next. due: whether due times
    count.
    """

    scale_s: float
    left_s: Floats
    moves: Floats
    load_s: Floats
    machine: Ints
    following: Ints
    places: Ints
    due: bool


def feature_arrays(cell: Cell, objective: str = MAKESPAN) -> FeatureArrays:
    """The arrays from which a cell's features are computed, for a policy that was learned for this objective."""
    size = len(cell.stations)
    places = np.array([*(own.servers or own.capacity for own in cell.stations), 1], np.int64)
    load_s = np.zeros((len(cell.positions), size + 1))
    for place, loads in enumerate(loads_s(cell)):
        for station, seconds in loads.items():
            load_s[place, station] = seconds / places[station]
    left_s = np.array(work_left_s(cell))
    fewest = from_the_ends(cell.positions, lambda _, ahead: min((1 + moves for moves in ahead), default=0))
    begun = list(cell.begin_at)
    machine = [machine_of(cell, place) for place in range(len(cell.positions))]
    return FeatureArrays(
        scale_s=float(left_s[begun].sum()) / sum(fewest[at] for at in begun) or 1.0,
        left_s=left_s,
        moves=np.array(fewest, np.float64),
        load_s=load_s,
        machine=np.array([size if number is None else number for number in machine], np.int64),
        following=np.array(_following(cell), np.int64),
        places=places,
        due=cell.due_s is not None and objective in WITH_DUE_TIMES,
    )


def _following(cell: Cell) -> list[int]:
    """For each position the machine that works on the part next, by its first way; the number of stations: none."""

    def following(place: int, ahead: list[int]) -> int:
        ways = cell.positions[place].options
        if not ways:
            return len(cell.stations)
        if ways[0].robot == SERVER:
            return ways[0].target
        machine = machine_of(cell, ways[0].to)
        if machine is None or not (cell.positions[ways[0].to].processing_s or cell.stations[machine].servers):
            return ahead[0]
        return machine

    return from_the_ends(cell.positions, following)


def features(run: Run, allowed: tuple[int, ...], known: FeatureArrays) -> Floats:
    """The features (D, F) of the allowed decisions of a run, in the order of FEATURES."""
    cell, survey = run.cell, _Survey(run, known)
    parts = [part_of(decision, cell.parts) for decision in allowed]
    options = [_way(run, decision) for decision in allowed]
    begins = [run.pick_s(part, way) - _service_s(way) for part, way in zip(parts, options, strict=True)]
    ends = [run.drop_s(part, way) for part, way in zip(parts, options, strict=True)]
    table = np.zeros((len(allowed), len(FEATURES)))
    for i, (part, way) in enumerate(zip(parts, options, strict=True)):
        here, there, index = run.locations[part - 1], way.to, part - 1
        left_s, ready_s, end_s = known.left_s[here], run.ready_s[index], ends[i]
        ahead, behind = int(known.following[here]), int(known.machine[here])
        served, enters, last = way.robot == SERVER, here == cell.starts[index], len(cell.stations)
        free_s = survey.free_s.get(ahead, 0.0)
        brought = not served and known.machine[there] == ahead != last
        queue_s = max(0.0, free_s - end_s) if brought else 0.0
        work_s = 0.0 if served else cell.positions[there].processing_s or 0.0
        full = not served and behind != last and run.occupied[behind] >= cell.capacities[behind]
        others = [
            max(_empty_s(cell, o, way.target), run.ready_s[p - 1] - end_s if o.waits else 0.0)
            for p, o in zip(parts, options, strict=True)
            if not served and o.robot == way.robot and p != part and not isnan(_empty_s(cell, o, way.target))
        ]
        began_s = run.free_s(way.target) if served else run.reach_s(way)
        seconds = {
            "delay": begins[i] - min(begins),
            "empty-way": 0.0 if served else began_s - run.robots_s[way.robot],
            "idle": begins[i] - began_s,
            "part-waited": 0.0 if enters else min(WAITED * known.scale_s, max(0.0, begins[i] - ready_s)),
            "duration": end_s - begins[i],
            "tail": begins[i] + left_s - survey.tail_s,
            "work-left": left_s - survey.mean_left_s,
            "starves": max(0.0, end_s - max(free_s, run.now_s)) if brought else 0.0,
            "queue": queue_s,
            "slack": (cell.due_s or ())[index] - begins[i] - left_s if known.due else 0.0,
            "way-on": min(others, default=0.0),
            "other-way": end_s - min(e for e, p in zip(ends, parts, strict=True) if p == part),
            "queued-tail": end_s + queue_s + work_s + known.left_s[there] - survey.tail_s,
        }
        plain = {
            "load-ahead": survey.share(ahead) - 1.0 if ahead != last else 0.0,
            "load-behind": survey.share(behind) if full else 0.0,
            "server": float(served),
            "room": 1.0 / max(1, cell.capacities[way.needs[0]] - run.occupied[way.needs[0]]) if way.needs else 0.0,
            "moves-left": known.moves[here],
            "enters": float(enters),
            "load-after": survey.share(int(known.following[there])) - 1.0 if known.following[there] != last else 0.0,
        }
        for k, name in enumerate(FEATURES):
            table[i, k] = plain[name] if name in plain else seconds[name] / known.scale_s
    return table


class _Survey:
    """The values of a run with which the features of its decisions are compared.

    tail_s: the latest end of any part if none waited any more. mean_left_s: mean work left of the unfinished parts. free_s: by
    machine, when it has finished the parts that it holds. loads_s: by machine, how long it would still work on all parts
    that are to come if it never stood idle.
    """

    def __init__(self, run: Run, known: FeatureArrays) -> None:
        cell = run.cell
        going = [part for part, at in enumerate(run.locations) if cell.positions[at].options]
        left_s = [known.left_s[run.locations[part]] for part in going]
        self.tail_s = max(max(run.now_s, run.ready_s[part]) + left for part, left in zip(going, left_s, strict=True))
        self.mean_left_s = sum(left_s) / len(going)
        self.free_s: dict[int, float] = {}
        self.loads_s: dict[int, float] = {}
        for station in range(len(cell.stations)):
            inside = [part for part in going if known.machine[run.locations[part]] == station]
            if cell.stations[station].servers:
                queue = [cell.positions[run.locations[part]].options[0] for part in going]
                waits = [cell.positions[way.to].processing_s or 0.0 for way in queue if _serves(way, station)]
                self.free_s[station] = run.free_s(station) + sum(waits) / known.places[station]
            elif run.occupied[station] >= cell.capacities[station]:
                self.free_s[station] = min((run.ready_s[part] for part in inside), default=0.0)
            to_come_s = sum(known.load_s[run.locations[part], station] for part in going)
            if to_come_s > 0.0:
                free_s = run.free_s(station) if cell.stations[station].servers else self.free_s.get(station, 0.0)
                self.loads_s[station] = (
                    max(0.0, free_s - run.now_s) + to_come_s
                )  # waiting parts are counted in to_come_s

    def share(self, station: int) -> float:
        """The load of a machine as a share of the highest one."""
        return self.loads_s.get(station, 0.0) / max(self.loads_s.values(), default=1.0)


def _serves(way: Option, station: int) -> bool:
    return way.robot == SERVER and way.target == station


def _service_s(way: Option) -> float:
    return 0.0 if way.robot == SERVER else way.service_s


def _empty_s(cell: Cell, way: Option, at: int) -> float:
    """How long the robot of a way drives to its pick from a station."""
    return 0.0 if at == way.origin else float(cell.empty_s[at, way.origin]) / cell.robots[way.robot].speed


def _way(run: Run, decision: int) -> Option:
    way = run.option(decision)
    assert way is not None  # it is allowed
    return way
