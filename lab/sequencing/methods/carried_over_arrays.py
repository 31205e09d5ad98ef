"""What features of decisions are made of: what is still to come from each position of a cell, as plain arrays."""

from typing import NamedTuple

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER, from_the_ends
from lab.sequencing.methods.rules import loads_s, machine_of, work_left_s
from lab.sequencing.simulate.cell_arrays import Floats, Ints

FEATURES = (
    "delay",
    "empty way",
    "resource waits",
    "part waited",
    "duration",
    "tail",
    "work left",
    "load ahead",
    "machine starves",
    "machine is busy",
    "load behind",
    "served",
    "room taken",
    "moves left",
    "slack",
    "way on",
    "other robot sooner",
    "enters",
    "load after",
    "tail behind the queue",
)

CONTEXTS = 3


class FeatureArrays(NamedTuple):
    """Of a cell with P positions and S stations, S standing for no station. scale_s: seconds of work a move, on average.

    left_s (P,): see `rules.work_left_s`; moves (P,): the fewest moves to the end. load_s (P, S + 1): processing still to come,
    divided by how many parts a machine works on at once. machine (P,): the machine that a part stands in; next_machine (P,):
    where it is worked on next. places (S + 1,).
    """

    scale_s: float
    whole_s: float
    left_s: Floats
    carried_s: Floats
    moves: Floats
    load_s: Floats
    machine: Ints
    next_machine: Ints
    places: Ints
    has_due: bool


class WorkArrays(NamedTuple):
    """Room for the features of D decisions of K parts at S stations.

    begin_s, end_s, drop_s (D,): of a decision; least_s (K,): the soonest end by any robot. to_come_s, free_s (S + 1,): processing to come, and
    when a machine is through with what it has. features (F,): of one decision. score (2,).
    """

    begin_s: Floats
    end_s: Floats
    least_s: Floats
    to_come_s: Floats
    free_s: Floats
    features: Floats
    most: Floats
    contexts: Floats
    weights: Floats


def feature_arrays(cell: Cell) -> FeatureArrays:
    """What the features of a cell are made of."""
    size = len(cell.stations)
    load_s = np.zeros((len(cell.positions), size + 1))
    places = np.array([*(one.servers or one.capacity for one in cell.stations), 1], np.int64)
    for place, loads in enumerate(loads_s(cell)):
        for station, seconds in loads.items():
            load_s[place, station] = seconds / places[station]
    left_s = np.array(work_left_s(cell))
    moves = np.array(
        from_the_ends(cell.positions, lambda _, ahead: min((1.0 + one for one in ahead), default=0.0)), np.float64
    )
    begun = list(cell.begin_at)
    machine = [machine_of(cell, place) for place in range(len(cell.positions))]
    return FeatureArrays(
        scale_s=max(1e-9, float(left_s[begun].sum() / max(1.0, moves[begun].sum()))),
        whole_s=max(1e-9, float(left_s[begun].sum())),
        left_s=left_s,
        carried_s=np.array(carried_s(cell)),
        moves=moves,
        load_s=load_s,
        machine=np.array([size if one is None else one for one in machine], np.int64),
        next_machine=np.array(_next_machines(cell), np.int64),
        places=places,
        has_due=cell.due_s is not None,
    )


def _next_machines(cell: Cell) -> list[int]:
    """For each position the machine that works on the part next, by its first way; as many as there are stations: none."""
    size = len(cell.stations)

    def following(place: int, ahead: list[int]) -> int:
        ways = cell.positions[place].options
        if not ways:
            return size
        if ways[0].robot == SERVER:
            return ways[0].target
        machine = machine_of(cell, ways[0].to)
        works = machine is not None and (cell.positions[ways[0].to].processing_s or cell.stations[machine].servers)
        return machine if machine is not None and works else ahead[0]

    return from_the_ends(cell.positions, following)


def work_arrays(cell: Cell) -> WorkArrays:
    """Room for the features of a cell's decisions."""
    decisions, size = cell.parts * cell.most_choices, len(cell.stations) + 1
    return WorkArrays(
        begin_s=np.zeros(decisions),
        end_s=np.zeros(decisions),
        least_s=np.zeros(cell.parts),
        to_come_s=np.zeros(size),
        free_s=np.zeros(size),
        features=np.zeros(len(FEATURES)),
        most=np.zeros(4),
        contexts=np.ones(CONTEXTS),
        weights=np.zeros(len(FEATURES)),
    )


def carried_s(cell: Cell) -> list[float]:
    least_s = cell.loaded_s / max([robot.speed for robot in cell.robots], default=1.0)

    def left_s(place: int, ahead: list[float]) -> float:
        ways = [
            option.service_s + (0.0 if option.robot == SERVER else least_s[option.origin, option.target]) + then
            for option, then in zip(cell.positions[place].options, ahead, strict=True)
        ]
        return min(ways, default=0.0)

    return from_the_ends(cell.positions, left_s)
