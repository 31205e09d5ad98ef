"""What an audit goes by, and what it finds: evidence, faults that struck, findings."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import atan2, cos, sin
from typing import Any

from lab.audit.stays import PartSeen, parts_seen
from lab.audit.tracks import Array, BodyTracks
from lab.tasks.task import Order, Task
from lab.tasks.task_fields import Stage

SLACK_S = 0.25  # two frames, and what rounding does


@dataclass(frozen=True)
class Finding:
    """Something that is not as the task asks: by which rule, about which part ("": about none alone), where and when [s]."""

    rule: str
    part: str
    station: str
    at_s: float
    words: str


@dataclass(frozen=True)
class Struck:
    """A fault that a hand or a machine had in a run, about a part or a station ("": about none)."""

    what: str
    part: str = ""
    station: str = ""


@dataclass
class Evidence:
    """What a run left: the task and its order, the tracks of its bodies, the measured rows of its schedule, what was claimed.

    rows: as `schedule.csv` has them. claimed: the names of the parts that are said to be delivered. struck: the faults.
    planned: the rows of the plan that the run had; none where it was changed on the way, or there was none.
    """

    task: Task
    order: Order
    tracks: BodyTracks
    rows: Sequence[dict[str, Any]]
    claimed: Collection[str]
    struck: Sequence[Struck] = ()
    planned: Sequence[dict[str, Any]] = ()
    parts: list[PartSeen] = field(init=False)

    def __post_init__(self) -> None:
        self.parts = parts_seen(self.task, self.order, self.tracks)
        moved = {one.station for one in self.struck if one.what == "station moved"}
        self._touched = {one.part for one in self.struck if one.part}
        self._touched |= {one.name for one in self.parts for stay in one.stays if stay.station in moved}

    def undisturbed(self, part: str) -> bool:
        """Whether no fault has touched a part."""
        return part not in self._touched

    def own_rows(self, part: str, operation: str) -> list[dict[str, Any]]:
        """The measured rows of a part of one kind, by time."""
        return [row for row in self.rows if row["part"] == part and row["operation"] == operation]

    def work_s(self, kind: str, stage: Stage) -> float | None:
        """How long a part of a kind is to be worked on in a stage by the task [s]; None where it is no machine's."""
        station = self.task.station(stage.station)
        if station.kind != "machine":
            return None
        if station.process is not None:
            process = self.task.processes[station.process]
            return process.grid[0] * process.grid[1] * process.dwell_s
        return stage.processing_s if stage.processing_s is not None else station.processing_s

    def at_most_s(self, stage: Stage) -> float | None:
        """How long it may stay there after that by the task [s]; None: for ever."""
        return stage.at_most_s if stage.at_most_s is not None else self.task.station(stage.station).at_most_s

    def off_pose(self, station: str, place: Array) -> tuple[float, float]:
        """A point in the frame of a station's body [m], off the station's pose along and across, wherever the body is by now."""
        x, y, _, *turn = self.tracks.poses[0, self.tracks.number(station)]
        at_x, at_y, yaw = self.task.station(station).pose
        along, across = turned(place[0], place[1], 2.0 * atan2(turn[2], turn[3]))
        return turned(along + x - at_x, across + y - at_y, -yaw)


def turned(x: float, y: float, yaw: float) -> tuple[float, float]:
    """A vector, turned about the vertical."""
    return cos(yaw) * x - sin(yaw) * y, sin(yaw) * x + cos(yaw) * y
