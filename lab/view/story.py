"""What a replay tells beside the picture: the schedule beside its plan, what the robot does in words, what went wrong."""

from dataclasses import asdict, dataclass
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

    captions: from when on which words say what happens. begins_s: when each move began.
    """

    measured: Schedule
    planned: Schedule | None = None
    captions: tuple[tuple[float, str], ...] = ()
    marks: tuple[Mark, ...] = ()
    begins_s: tuple[float, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """For the page: rows of robot and machines, activities as in `Schedule.to_json`, the rest in the order of time."""
        return {
            "measured": _rows(self.measured),
            "planned": [] if self.planned is None else _rows(self.planned),
            "captions": sorted(self.captions, key=lambda caption: caption[0]),
            "marks": [asdict(mark) for mark in sorted(self.marks, key=lambda mark: mark.at_s)],
            "begins_s": sorted(self.begins_s),
        }


def _rows(schedule: Schedule) -> list[dict[str, Any]]:
    return [_rounded(activity) for activity in (*schedule.robot, *schedule.machines)]


def _rounded(activity: Activity) -> dict[str, Any]:
    times = {"start_s": round(activity.start_s, 3), "end_s": round(activity.end_s, 3)}
    return asdict(activity) | times
