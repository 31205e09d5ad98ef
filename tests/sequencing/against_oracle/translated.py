"""The lab's cells and plans as the oracle's data."""

import math
from collections.abc import Sequence
from itertools import product

from oracle import cell as plain

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.schedule import Move
from lab.sequencing.cell.stations import UNLIMITED, Stage, Station
from lab.sequencing.simulate.follow import follow


def plain_cell(cell: Cell) -> plain.Cell:
    """A cell that begins at the beginning: ValueError for one in its middle, or with stations that are closed."""
    if cell.closed or any(one.stays or one.position is None for one in cell.begins or ()):
        raise ValueError("the work is in its middle")
    if any(one.position != start for one, start in zip(cell.begins or (), cell.starts, strict=False)):
        raise ValueError("the work is in its middle")
    return plain.Cell(
        tuple(_station(one) for one in cell.stations),
        {
            one.name: tuple(_route(cell, way) for route in one.routes for way in product(*(s.ways for s in route)))
            for one in cell.products
        },
        cell.order,
        _table(cell, cell.empty_s.tolist()),
        _table(cell, cell.loaded_s.tolist()),
        tuple(
            plain.Robot(one.name, one.start, one.speed, None if one.serves is None else frozenset(one.serves))
            for one in cell.robots
        ),
        cell.buffers == "busy",
        cell.due_s,
        None if cell.begins is None else tuple(one.ready_s for one in cell.begins),
        None if cell.arrivals is None else cell.arrivals.interval_s,
        "clock" if cell.arrivals is None else cell.arrivals.after,
        tuple((one.origin, one.target, one.seconds) for one in cell.track),
    )


def plain_plan(cell: Cell, moves: Sequence[Move]) -> plain.Plan:
    """What the lab's simulation says happens, as it says it."""
    carried = [
        plain.Carried(
            move.part, move.by, move.origin, move.target, move.leave_s, move.pick_s, move.pick_s + move.held_s,
            move.drop_s, move.service_s, move.carries,
        )
        for move in moves
        if not move.served
    ]  # fmt: skip
    worked = [plain.Worked(move.part, move.target, move.pick_s, move.end_s) for move in moves if move.served]
    return plain.Plan(tuple(carried), tuple(worked))


def moves_of(cell: Cell, sequence: Sequence[int]) -> list[Move]:
    """The timed moves of a sequence of decisions."""
    return follow(cell, sequence).moves


def _station(one: Station) -> plain.Station:
    capacity = None if one.capacity >= UNLIMITED else one.capacity
    setups = {(a, b): seconds for a, b, seconds in one.setups}
    return plain.Station(one.name, capacity, one.kind == "machine", one.servers, setups)


def _route(cell: Cell, route: Sequence[Stage]) -> tuple[plain.Stage, ...]:
    return tuple(_stage(stage, cell.stations[cell.index(stage.station)]) for stage in route)


def _stage(stage: Stage, station: Station) -> plain.Stage:
    processing_s = station.processing_s if stage.processing_s is None else stage.processing_s
    at_most_s = station.at_most_s if stage.at_most_s is None else stage.at_most_s
    return plain.Stage(stage.station, processing_s, stage.buffer, stage.service_s, stage.pallet, at_most_s)


def _table(cell: Cell, seconds: list[list[float]]) -> dict[plain.Pair, float]:
    names = cell.names
    return {
        (names[a], names[b]): one
        for a, row in enumerate(seconds)
        for b, one in enumerate(row)
        if a != b and not math.isnan(one)
    }
