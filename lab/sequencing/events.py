"""Event simulation of a cell: a sequence of toasts in, a timed Schedule of robot, machines and toasts out."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, get_args

from lab.errors import BadInput
from lab.sequencing.cell import ROBOT, Cell

Kind = Literal["carry", "empty", "wait", "process", "blocked", "store"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Activity:
    """What one resource does from `start_s` to `end_s`; for a stay, `origin` and `target` are the same station.

    Robot: "carry", "empty", "wait". Machine: "process", "blocked" (finished, not fetched yet). Toast: "store" (storage
    or buffer), "process", "blocked", "carry". `toast` is None where none is involved.
    """

    resource: str
    kind: Kind
    toast: int | None
    origin: str
    target: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Move:
    """One decision carried out: the robot leaves `start`, reaches the toast, picks it, and drops it at `target`."""

    toast: int
    start: str
    origin: str
    target: str
    leave_s: float
    reach_s: float
    pick_s: float
    drop_s: float


@dataclass(frozen=True)
class Schedule:
    """A timed run, predicted or measured: activities by start for the robot, the machines and the toasts; seconds.

    `makespan_s` is the end of the last carry, which is the last arrival at the final station. Source: fig. IV.1.
    """

    robot: tuple[Activity, ...]
    machines: tuple[Activity, ...]
    toasts: tuple[Activity, ...]
    makespan_s: float
    sequence: tuple[int, ...]

    @classmethod
    def from_activities(cls, activities: Iterable[Activity], sequence: Sequence[int]) -> "Schedule":
        """A schedule from activities logged in any order: "robot" and "toast N" are known by name, others are machines.

        Raises BadInput for an activity that ends before it starts, times that are not finite, or an unknown kind.
        """
        rows: dict[str, list[Activity]] = defaultdict(list)
        for activity in sorted(activities, key=lambda a: (a.start_s, a.end_s)):
            _check_activity(activity)
            is_toast = activity.resource == toast_row(activity.toast)
            rows["robot" if activity.resource == ROBOT else "toasts" if is_toast else "machines"].append(activity)
        makespan_s = max((a.end_s for a in rows["robot"] if a.kind == "carry"), default=0.0)
        toasts = sorted(rows["toasts"], key=lambda a: a.toast or 0)
        return cls(tuple(rows["robot"]), tuple(rows["machines"]), tuple(toasts), makespan_s, tuple(sequence))

    @classmethod
    def from_moves(cls, cell: Cell, moves: Sequence[Move]) -> "Schedule":
        """A schedule from timed moves, simulated or measured; machines process as `cell` says, from each drop on."""
        activities = [activity for move in moves for activity in _robot_activities(move)]
        end_s = max((move.drop_s for move in moves), default=0.0)
        for toast in range(1, cell.toasts + 1):
            activities += _toast_activities(cell, toast, [move for move in moves if move.toast == toast], end_s)
        timed = cls.from_activities(activities, [move.toast for move in moves])
        return replace(timed, makespan_s=end_s)  # a last carry of 0 s is no activity, yet it ends the run

    def to_json(self) -> dict[str, Any]:
        """Plain dicts, lists, numbers and strings, for `json.dumps`."""
        rows = {name: [asdict(a) for a in getattr(self, name)] for name in ("robot", "machines", "toasts")}
        return {"makespan_s": self.makespan_s, "sequence": list(self.sequence)} | rows

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> "Schedule":
        """The schedule that `to_json` wrote; BadInput when it is not one."""
        try:
            rows = [Activity(**entry) for name in ("robot", "machines", "toasts") for entry in document[name]]
            sequence = [int(toast) for toast in document["sequence"]]
            return cls.from_activities(rows, sequence)
        except (KeyError, TypeError, ValueError) as error:
            raise BadInput(f"not a schedule: {type(error).__name__} {error}") from error


@dataclass(frozen=True)
class EpisodeSequenced:
    """One sequence tried: number from 1, its makespan and the best one so far."""

    episode: int
    makespan_s: float
    best_makespan_s: float


@dataclass(frozen=True)
class SequenceResult:
    """What every sequencer returns: the best sequence found, its makespan, and the makespan of each sequence tried."""

    sequence: tuple[int, ...]
    makespan_s: float
    episode_makespans_s: tuple[float, ...]


@dataclass(frozen=True)
class LearnedSequence(SequenceResult):
    """What a learning sequencer returns beside: the makespan of its greedy policy at the end."""

    final_makespan_s: float


@dataclass
class Run:
    """One pass through a cell, decision by decision: where toasts and robot are, and at what time.

    `ready_s[toast - 1]` is when that toast may be picked. The robot travels empty to the toast, waits there for its
    machine, and carries it on; processing starts at arrival.
    """

    cell: Cell
    locations: list[int] = field(init=False)
    counts: list[int] = field(init=False)
    ready_s: list[float] = field(init=False)
    robot: int = field(init=False)
    now_s: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self.locations = list(self.cell.start_locations())
        self.counts = self.cell.counts(self.locations)
        self.ready_s = [0.0] * self.cell.toasts
        self.robot = self.cell.index(self.cell.robot_start)

    def allowed(self) -> tuple[int, ...]:
        """The toasts that may be picked now; empty when all are done."""
        return self.cell.movable(self.counts, self.locations)

    def move(self, toast: int) -> Move:
        """Carry an allowed toast one stage on; BadInput when it may not be picked."""
        cell, origin = self.cell, self.locations[toast - 1]
        target = cell.target(self.counts, origin)
        if target is None:
            raise BadInput(f"{cell.refusal(self.locations, toast)}")
        start, leave_s = self.robot, self.now_s
        reach_s = leave_s + (0.0 if start == origin else float(cell.empty_s[start, origin]))
        pick_s = max(reach_s, self.ready_s[toast - 1])
        drop_s = pick_s + float(cell.loaded_s[origin, target])
        self.locations[toast - 1] = self.robot = target
        self.counts[origin] -= 1
        self.counts[target] += 1
        self.ready_s[toast - 1] = drop_s + cell.stations[target].processing_s
        self.now_s = drop_s
        names = cell.names
        return Move(toast, names[start], names[origin], names[target], leave_s, reach_s, pick_s, drop_s)


def simulate(cell: Cell, sequence: Sequence[int]) -> Schedule:
    """The predicted schedule of a sequence of toasts (numbered from 1, one entry a move).

    Raises BadInput, with the position, for a toast that may not move there and for a sequence that ends too early.
    Source: thesis ch. 7.4, 7.5; makespan to the last arrival at the final station.
    """
    run, moves = Run(cell), []
    for position, toast in enumerate(sequence, 1):
        reason = cell.refusal(run.locations, toast)
        if reason is not None:
            allowed = ", ".join(str(other) for other in run.allowed()) or "none, all are done"
            raise BadInput(f"position {position} of the sequence: {reason}; allowed here: {allowed}")
        moves.append(run.move(toast))
    left = [toast for toast, station in enumerate(run.locations, 1) if station != cell.last]
    if left:
        where = cell.names[run.locations[left[0] - 1]]
        raise BadInput(f"the sequence ends after {len(moves)} moves, but toast {left[0]} is still at '{where}'")
    return Schedule.from_moves(cell, moves)


def toast_row(toast: int | None) -> str:
    """Name of the resource row of a toast."""
    return f"toast {toast}"


def _robot_activities(move: Move) -> list[Activity]:
    spans: tuple[tuple[Kind, int | None, str, str, float, float], ...] = (
        ("empty", None, move.start, move.origin, move.leave_s, move.reach_s),
        ("wait", move.toast, move.origin, move.origin, move.reach_s, move.pick_s),
        ("carry", move.toast, move.origin, move.target, move.pick_s, move.drop_s),
    )
    return [Activity(ROBOT, *span) for span in spans if span[5] > span[4]]


def _toast_activities(cell: Cell, toast: int, moves: Sequence[Move], end_s: float) -> list[Activity]:
    """Rows of one toast and of the machines that it passes, from time 0 to `end_s`."""
    row, since_s, place = toast_row(toast), 0.0, cell.names[cell.first]
    rows: list[Activity] = []
    for move in [*moves, None]:
        until_s = end_s if move is None else move.pick_s
        station = cell.stations[cell.index(place)]
        if station.kind == "machine":
            # A measured run may fetch a little before the nominal end: processing then ends with the pick.
            done_s = min(since_s + station.processing_s, until_s)
            for resource in (row, place):
                rows.append(Activity(resource, "process", toast, place, place, since_s, done_s))
                rows.append(Activity(resource, "blocked", toast, place, place, done_s, until_s))
        else:
            rows.append(Activity(row, "store", toast, place, place, since_s, until_s))
        if move is not None:
            rows.append(Activity(row, "carry", toast, move.origin, move.target, move.pick_s, move.drop_s))
            since_s, place = move.drop_s, move.target
    return [activity for activity in rows if activity.end_s > activity.start_s]


def _check_activity(activity: Activity) -> None:
    if activity.kind not in KINDS:
        raise BadInput(f"activity of '{activity.resource}': unknown kind '{activity.kind}'; known: {', '.join(KINDS)}")
    times = f"from {activity.start_s} to {activity.end_s} s"
    if not (math.isfinite(activity.start_s) and math.isfinite(activity.end_s)):
        raise BadInput(f"activity '{activity.kind}' of '{activity.resource}' {times}: times must be finite")
    if activity.end_s < activity.start_s:
        raise BadInput(f"activity '{activity.kind}' of '{activity.resource}' {times}: it ends before it starts")
