"""Schedules: timed moves, the activities of robots, machines and parts that follow from them, and their rows in files."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

from lab.errors import BadInput
from lab.files import csv_of, write_whole
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import ROBOT

Kind = Literal["carry", "pallet", "empty", "wait", "service", "process", "blocked", "store"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_ROWS = ("robot", "machines", "parts")


@dataclass(frozen=True)
class Activity:
    """One activity of a resource from `start_s` to `end_s`; for a stay, `origin` and `target` are the same station.

    Robot: "carry" (a part), "pallet" (an empty one), "empty", "wait", "service". Machine: "process", "blocked"
    (finished, not fetched yet). Part: "store" (storage or buffer), "process", "blocked", "carry". `part` is None where
    none is involved.
    """

    resource: str
    kind: Kind
    part: int | None
    origin: str
    target: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Move:
    """One decision as it is carried out: the robot leaves `start`, picks at `origin`, and drops at `target`.

    process_s: the processing that begins with the drop [s]. service_s: the robot's work that ends with the pick [s]. by: the
    robot's name; the name of `target` where a server of that machine takes the part, at `pick_s` and `drop_s` alike. held_s: how
    long the robot stays at `origin` with what it has picked, until its way is free [s].
    """

    part: int
    start: str
    origin: str
    target: str
    leave_s: float
    reach_s: float
    pick_s: float
    drop_s: float
    process_s: float = 0.0
    service_s: float = 0.0
    carries: Literal["part", "pallet"] = "part"
    by: str = ROBOT
    held_s: float = 0.0

    @property
    def served(self) -> bool:
        """Whether a server of a machine takes the part, and no robot."""
        return self.by == self.target

    @property
    def end_s(self) -> float:
        """When the move is done: at the drop, or at the end of a server's work [s]."""
        return self.drop_s + (self.process_s if self.served else 0.0)


@dataclass(frozen=True)
class FetchBy:
    """The latest pick of a part at a machine that finishes it at `done_s`; later it is spoilt."""

    part: int
    station: str
    done_s: float
    until_s: float


@dataclass(frozen=True)
class Schedule:
    """A timed run, predicted or measured: activities of robots, machines and parts, sorted by start [s].

    makespan_s: when the last part is finished. sequence: the decisions (see `Run`). fetch_by: the latest picks, by time, which
    `to_json` has only where such limits exist. Raises BadInput for an activity that ends before it starts, times that are not
    finite, or an unknown kind.
    Source: fig. IV.1.
    """

    robot: tuple[Activity, ...]
    machines: tuple[Activity, ...]
    parts: tuple[Activity, ...]
    makespan_s: float
    sequence: tuple[int, ...]
    fetch_by: tuple[FetchBy, ...] = ()

    def __post_init__(self) -> None:
        for activity in (*self.robot, *self.machines, *self.parts):
            _check_activity(activity)

    @classmethod
    def from_moves(
        cls,
        cell: Cell,
        moves: Sequence[Move],
        sequence: Sequence[int] | None = None,
        came_s: Sequence[float] | None = None,
    ) -> "Schedule":
        """A schedule from timed moves, simulated or measured; sequence None: the parts moved, in their order.

        came_s: when each part came to its first station [s]; None: all at 0. A part that makes no move has no row.
        """
        robot = [activity for move in moves for activity in robot_activities(move)]
        end_s = max((move.end_s for move in moves), default=0.0)
        parts: list[Activity] = []
        machines: list[Activity] = []
        limits: list[FetchBy] = []
        together = _batches(cell, moves)
        for part in cell.unfinished:
            own = [move for move in moves if move.part == part and move.carries == "part"]
            rows = _part_activities(cell, part, own, 0.0 if came_s is None else came_s[part - 1], end_s, together)
            parts += rows[0]
            machines += rows[1]
            limits += _limits(cell, part, own) if cell.has_windows else ()
        order = [move.part for move in moves] if sequence is None else sequence
        limits.sort(key=lambda limit: limit.until_s)
        robot.sort(key=lambda a: (a.start_s, a.end_s)) if not cell.serial else None
        return cls(tuple(robot), _by_start(machines), tuple(parts), end_s, tuple(order), tuple(limits))

    def later(self, by_s: float) -> "Schedule":
        """The schedule shifted by `by_s` [s], as for work that was replanned in the middle of a run."""
        rows = [
            tuple(replace(a, start_s=a.start_s + by_s, end_s=a.end_s + by_s) for a in row)
            for row in (self.robot, self.machines, self.parts)
        ]
        limits = tuple(
            replace(limit, done_s=limit.done_s + by_s, until_s=limit.until_s + by_s) for limit in self.fetch_by
        )
        return Schedule(rows[0], rows[1], rows[2], self.makespan_s + by_s, self.sequence, limits)

    def to_json(self) -> dict[str, Any]:
        """Plain dicts, lists, numbers and strings, for `json.dumps`."""
        rows = {name: [asdict(a) for a in getattr(self, name)] for name in _ROWS}
        limits = {"fetch_by": [asdict(limit) for limit in self.fetch_by]} if self.fetch_by else {}
        return {"makespan_s": self.makespan_s, "sequence": list(self.sequence)} | rows | limits


def robot_activities(move: Move) -> list[Activity]:
    """The robot's activities in one move; those without duration are included only where something is moved."""
    if move.served:
        return []
    served_s = move.pick_s - move.service_s
    carries: Kind = "carry" if move.carries == "part" else "pallet"
    spans: tuple[tuple[Kind, int | None, str, str, float, float], ...] = (
        ("empty", None, move.start, move.origin, move.leave_s, move.reach_s),
        ("wait", move.part, move.origin, move.origin, move.reach_s, served_s),
        ("service", move.part, move.origin, move.origin, served_s, move.pick_s),
        (carries, move.part, move.origin, move.target, move.pick_s, move.drop_s),
    )
    return [Activity(move.by, *span) for span in spans if span[5] > span[4] or span[0] == carries]


def _part_activities(
    cell: Cell,
    part: int,
    moves: Sequence[Move],
    came_s: float,
    end_s: float,
    together: Mapping[tuple[int, str], tuple[float, float]],
) -> tuple[list[Activity], list[Activity]]:
    """The activities of one part and of the machines that it passes, from its arrival to `end_s`."""
    row, since_s, process_s = cell.part_name(part), came_s, cell.begin_s[part - 1]
    place = cell.names[cell.positions[cell.begin_at[part - 1]].station]
    begin_s = since_s  # when its processing there begins
    works = False  # whether it is processed there, even for 0 s
    rows: list[Activity] = []
    machines: list[Activity] = []
    for move in [*moves, None]:
        station = cell.stations[cell.index(place)]
        # A measured run may fetch a little before the nominal end: processing then ends with the pick.
        until_s = end_s if move is None else move.pick_s
        done_s = min(begin_s + process_s, until_s)
        if begin_s > since_s:
            rows.append(Activity(row, "store", part, place, place, since_s, begin_s))
        if station.kind == "machine" and (works or done_s > begin_s):
            for resource, log in ((row, rows), (place, machines)):
                log.append(Activity(resource, "process", part, place, place, begin_s, done_s))
        if station.kind == "machine" and station.servers is None:
            for resource, log in ((row, rows), (place, machines)):
                log.append(Activity(resource, "blocked", part, place, place, done_s, until_s))
        elif move is not None or station.kind != "machine":
            idle_s = done_s if station.kind == "machine" else since_s
            rows.append(Activity(row, "store", part, place, place, idle_s, until_s))
        if move is not None:
            if not move.served:
                rows.append(Activity(row, "carry", part, move.origin, move.target, move.pick_s, move.drop_s))
            since_s, place = move.drop_s, move.target
            begin_s, process_s = together.get((part, place), (move.drop_s, move.process_s))
            works = move.served or cell.stations[cell.index(place)].servers is None
    return _lasting(rows), _lasting(machines)


def _batches(cell: Cell, moves: Sequence[Move]) -> dict[tuple[int, str], tuple[float, float]]:
    """Begin and duration of each part's processing in a machine with batches [s], by part and machine."""
    times: dict[tuple[int, str], tuple[float, float]] = {}
    for name in [cell.names[station] for station in cell.batches]:
        batch: list[Move] = []
        for move in moves:
            if move.target == name:
                batch = [*batch, move]
                at_s, process_s = max(stay.drop_s for stay in batch), max(stay.process_s for stay in batch)
                times |= {(stay.part, name): (at_s, process_s) for stay in batch}
            elif move.origin == name:
                batch = []
    return times


def _limits(cell: Cell, part: int, moves: Sequence[Move]) -> Iterator[FetchBy]:
    """The latest picks of a part at the machines that it begins in or is brought to."""
    begins = cell.names[cell.positions[cell.begin_at[part - 1]].station], cell.begin_s[part - 1]
    served = [station.servers is not None for station in cell.stations]
    queued = {(move.target, move.drop_s) for move in moves if served[cell.index(move.target)] and not move.served}
    for station, done_s in (begins, *((move.target, move.drop_s + move.process_s) for move in moves)):
        at_most_s = cell.at_most_s(part, station)
        if at_most_s is not None and (station, done_s) not in queued:
            yield FetchBy(part, station, done_s, done_s + at_most_s)


def _lasting(activities: Iterable[Activity]) -> list[Activity]:
    """The activities without waits of no duration."""
    done = ("process", "carry")
    return [activity for activity in activities if activity.end_s > activity.start_s or activity.kind in done]


def _by_start(activities: Iterable[Activity]) -> tuple[Activity, ...]:
    return tuple(sorted(activities, key=lambda a: (a.start_s, a.end_s)))


def _check_activity(activity: Activity) -> None:
    if activity.kind not in KINDS:
        raise BadInput(f"activity of '{activity.resource}': unknown kind '{activity.kind}'; known: {', '.join(KINDS)}")
    times = f"from {activity.start_s} to {activity.end_s} s"
    if not (math.isfinite(activity.start_s) and math.isfinite(activity.end_s)):
        raise BadInput(f"activity '{activity.kind}' of '{activity.resource}' {times}: times must be finite")
    if activity.end_s < activity.start_s:
        raise BadInput(f"activity '{activity.kind}' of '{activity.resource}' {times}: it ends before it starts")


# ---- Rows of a schedule, and the files that hold them -----------------------------------------------------------------


COLUMNS = ("part", "product", "operation", "station", "target", "resource", "robot", "start_s", "end_s", "when")
TABLES = (".csv", ".json")


def rows_of(schedule: Schedule, cell: Cell, when: Literal["planned", "measured"]) -> list[dict[str, Any]]:
    """The activities of robots and machines by start: a row for each, with its values by COLUMNS.

    operation: an `Activity`'s kind. part, product: None where no part is involved. target: where a carry ends. robot: the
    resource, where it is a robot. A job-shop library may read a part as a job, a resource as a machine, and each row of a part as
    a task from start_s to end_s.
    """
    names = [cell.part_name(number) for number in range(1, cell.parts + 1)]

    def row(activity: Activity, robot: str | None) -> dict[str, Any]:
        part = activity.part
        own = (None, None) if part is None else (names[part - 1], cell.order[part - 1])
        what = (activity.kind, activity.origin, activity.target, activity.resource, robot)
        return dict(zip(COLUMNS, (*own, *what, activity.start_s, activity.end_s, when), strict=True))

    rows = [row(activity, activity.resource) for activity in schedule.robot] + [
        row(activity, None) for activity in schedule.machines
    ]
    return sorted(rows, key=lambda one: (one["start_s"], one["end_s"]))


def check_table(path: Path) -> None:
    """Raises BadInput unless the file's ending is that of a table or of a JSON list, and its folder exists."""
    if path.suffix.lower() not in TABLES:
        raise BadInput(f"schedule '{path}' (--schedule): wanted a file that ends with {' or '.join(TABLES)}")
    if not path.parent.is_dir():
        raise BadInput(f"schedule '{path}' (--schedule): there is no folder '{path.parent}'")


def write_table(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Writes the rows to a file, whole or not at all; raises BadInput when it cannot be written."""
    check_table(path)
    text = csv_of(rows, COLUMNS) if path.suffix.lower() == ".csv" else json.dumps(list(rows), indent=1) + "\n"
    try:
        write_whole(path, text.encode())
    except OSError as error:
        raise BadInput(f"schedule '{path}' (--schedule): cannot be written: {error.strerror or error}") from None
