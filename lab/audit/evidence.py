"""The records of an audit: the evidence that it judges, the faults that struck, and its findings."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import atan2, cos, sin
from typing import Any

from lab.audit.stays import PartStays, parts_seen
from lab.audit.tracks import Array, BodyTracks
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Stage

SLACK_S = 0.25  # tolerance of times: two frames and rounding


@dataclass(frozen=True)
class Finding:
    """A violation of the task: its rule, the part ("": not of a single part), the station and the time [s]."""

    rule: str
    part: str
    station: str
    at_s: float
    words: str


@dataclass(frozen=True)
class Struck:
    """A fault of the gripper or a machine in a run, and the part and station that it affected ("": none)."""

    what: str
    part: str = ""
    station: str = ""


@dataclass
class Evidence:
    """The evidence of a run: task and order, the tracks of its bodies, the measured schedule, and its claims.

    rows: the measured rows of `schedule.csv`. claimed: the names of the parts that the run claims to have delivered.
    struck: the faults. planned: the rows of the run's plan; empty if there was none or it was changed during the run.
    """

    task: Task
    order: Order
    tracks: BodyTracks
    rows: Sequence[dict[str, Any]]
    claimed: Collection[str]
    struck: Sequence[Struck] = ()
    planned: Sequence[dict[str, Any]] = ()
    parts: list[PartStays] = field(init=False)

    def __post_init__(self) -> None:
        self.parts = parts_seen(self.task, self.order, self.tracks)
        moved = {fault.station for fault in self.struck if fault.what == "station moved"}
        self._touched = {fault.part for fault in self.struck if fault.part}
        self._touched |= {part.name for part in self.parts for stay in part.stays if stay.station in moved}

    def undisturbed(self, part: str) -> bool:
        """Whether no fault has affected a part."""
        return part not in self._touched

    def own_rows(self, part: str, operation: str) -> list[dict[str, Any]]:
        """The measured rows of a part for one kind of operation, by time."""
        return [row for row in self.rows if row["part"] == part and row["operation"] == operation]

    def work_s(self, kind: str, stage: Stage) -> float | None:
        """The processing time [s] of a stage for a part of a kind; None where no machine works."""
        station = self.task.station(stage.station)
        if station.kind != "machine":
            return None
        if station.process is not None:
            process = self.task.processes[station.process]
            return process.grid[0] * process.grid[1] * process.dwell_s
        return stage.processing_s if stage.processing_s is not None else station.processing_s

    def at_most_s(self, stage: Stage) -> float | None:
        """The longest time [s] that a part may stay after its processing; None: no limit."""
        return stage.at_most_s if stage.at_most_s is not None else self.task.station(stage.station).at_most_s

    def off_pose(self, station: str, place: Array) -> tuple[float, float]:
        """A point in the frame of a station's body [m], relative to the station's pose, along and across."""
        x, y, _, *turn = self.tracks.poses[0, self.tracks.number(station)]
        at_x, at_y, yaw = self.task.station(station).pose
        along, across = turned(place[0], place[1], 2.0 * atan2(turn[2], turn[3]))
        return turned(along + x - at_x, across + y - at_y, -yaw)


def turned(x: float, y: float, yaw: float) -> tuple[float, float]:
    """The vector (x, y), rotated about the vertical by `yaw` [rad]."""
    return cos(yaw) * x - sin(yaw) * y, sin(yaw) * x + cos(yaw) * y
