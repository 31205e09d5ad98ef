"""What a replay tells beside the picture: the schedule beside its plan, what the robot does in words, what went wrong."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

from lab.errors import unknown
from lab.sequencing.cell.schedule import Activity, Schedule

MarkKind = Literal["fault", "trouble", "stop", "lost", "operator"]
MARKS: tuple[MarkKind, ...] = get_args(MarkKind)


@dataclass(frozen=True)
class Mark:
    """Something on the timeline, at this time [s], in words. Raises BadInput for a kind that is not of MARKS."""

    at_s: float
    kind: MarkKind
    words: str

    def __post_init__(self) -> None:
        if self.kind not in MARKS:
            raise unknown("kind of mark", self.kind, MARKS, "Mark")


@dataclass(frozen=True)
class Story:
    """A run beside its recording, on the same clock [s].

    captions: from when on which words say what happens. begins_s: when each move began. looks: what parts are called, and
    their colours, by number; without it bars have the colours of what is done.
    """

    measured: Schedule
    planned: Schedule | None = None
    captions: tuple[tuple[float, str], ...] = ()
    marks: tuple[Mark, ...] = ()
    begins_s: tuple[float, ...] = ()
    looks: Mapping[int, tuple[str, str]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """For the page: rows of robot and machines, activities as in `Schedule.to_json`, the rest in the order of time."""
        return {
            "measured": self._rows(self.measured),
            "planned": [] if self.planned is None else self._rows(self.planned),
            "captions": sorted(self.captions, key=lambda caption: caption[0]),
            "marks": [asdict(mark) for mark in sorted(self.marks, key=lambda mark: mark.at_s)],
            "begins_s": sorted(self.begins_s),
        }

    def _rows(self, schedule: Schedule) -> list[dict[str, Any]]:
        return [self._row(activity) for activity in (*schedule.robot, *schedule.machines)]

    def _row(self, activity: Activity) -> dict[str, Any]:
        times = {"start_s": round(activity.start_s, 3), "end_s": round(activity.end_s, 3)}
        name, color = self.looks.get(activity.part or 0, ("", ""))
        look = {"color": color} if color and activity.kind in ("carry", "process", "blocked") else {}
        return asdict(activity) | times | ({"name": name} if name else {}) | look
