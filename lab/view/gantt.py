"""The Gantt chart of a schedule: robot, machines and toasts over time (thesis fig. IV.1)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from lab.errors import BadInput
from lab.sequencing.events import Activity, Schedule
from lab.view.canvas import BLUE, GREY, INK, ORANGE, PALE_GREEN, PALE_GREY, RED, SKY, YELLOW, picture_file, seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

TOUCHING_S = 1e-3  # measured activities that overlap by less follow one another

# kind of activity -> (what the legend says, colour, hatch), in the legend's order
ACTIVITIES: dict[str, tuple[str, str, str | None]] = {
    "carry": ("robot carries a toast", BLUE, None),
    "empty": ("robot moves empty", SKY, None),
    "wait": ("robot idle", PALE_GREY, "////"),
    "process": ("machine processes", ORANGE, None),
    "blocked": ("finished, not fetched yet", YELLOW, "...."),
    "store": ("toast in storage or buffer", PALE_GREEN, None),
}
LABELS: dict[str, Callable[[Activity], tuple[str, ...]]] = {  # what to write on a bar: the first that fits
    "carry": lambda a: (f"{a.toast}: {a.origin} \N{RIGHTWARDS ARROW} {a.target}", f"{a.toast}"),
    "empty": lambda a: (f"to {a.target}",),
    "wait": lambda a: ("idle",),
    "process": lambda a: (f"toast {a.toast}", f"{a.toast}"),
    "blocked": lambda a: (f"{a.toast}",),
}
TOAST_LABELS: dict[str, Callable[[Activity], tuple[str, ...]]] = {
    "carry": lambda a: (f"to {a.target}",),
    "process": lambda a: (a.target,),
    "blocked": lambda a: (a.target,),
    "store": lambda a: (a.target,),
}


def gantt(schedule: Schedule, path: Path, predicted: Schedule | None = None) -> None:
    """Robot, machines and toasts over time [s], the makespan marked; `predicted` as a thin strip under each row.

    Raises BadInput for a schedule without activities and as all plots here do: for a path that is not a PNG file or
    cannot be written. Source: thesis fig. IV.1.
    """
    if not schedule.robot:
        raise BadInput("Gantt chart: the schedule has no activities")
    rows = _rows(schedule)
    toasts = len(set(schedule.sequence))
    middle = 0.29 if predicted is None else 0.38
    with picture_file(path, 12, 1.5 + (0.42 if predicted is None else 0.5) * len(rows)) as figure:
        axes = figure.add_subplot()
        bars = [bar for y, row in enumerate(rows.values()) for bar in _draw_row(axes, row, y - middle, 0.58)]
        ends = [(schedule.makespan_s, "-", "makespan" if predicted is None else "makespan, measured")]
        if predicted is not None:
            for y, row in enumerate(_rows(predicted).get(name, []) for name in rows):
                _draw_row(axes, row, y + 0.24, 0.13)
            ends.append((predicted.makespan_s, "--", "makespan, predicted (thin strips)"))
        for end_s, dashes, name in ends:  # behind the bars
            line = axes.axvline(end_s, color=RED, linestyle=dashes, linewidth=1.4, zorder=0.9)
            line.set_label(f"{name}: {seconds(end_s)}")
        axes.set_yticks(range(len(rows)), list(rows))
        axes.tick_params(axis="y", length=0)
        last_s = max(*(activity.end_s for activity, _, _ in bars), *(end_s for end_s, _, _ in ends))
        axes.set(ylim=(len(rows) - 0.5, -0.55), xlim=(0, 1.01 * last_s), xlabel="time [s]")
        axes.grid(axis="x")
        axes.set_title(f"{toasts} toast{'s' * (toasts > 1)}: {seconds(schedule.makespan_s)}")
        keys = [*_activity_keys(rows), *axes.get_lines()]
        figure.legend(handles=keys, loc="outside lower center", ncols=4)
        figure.draw_without_rendering()  # settles the layout, so that widths in pixels are known
        for activity, low, height in bars:
            choices = (TOAST_LABELS if activity.resource.startswith("toast ") else LABELS)[activity.kind](activity)
            _write_on_bar(axes, activity, low, height, choices)


def _rows(schedule: Schedule) -> dict[str, list[Activity]]:
    """Activities by row, top to bottom: the robot, machines in order of first use, toasts by number."""
    rows: dict[str, list[Activity]] = {}
    for activity in (*schedule.robot, *schedule.machines, *schedule.toasts):
        rows.setdefault(activity.resource, []).append(activity)
    return rows


def _draw_row(axes: "Axes", row: Sequence[Activity], top: float, height: float) -> list[tuple[Activity, float, float]]:
    """Bars of one row and where each is (activity, top, height); side by side where a machine holds several toasts."""
    lanes: list[float] = []
    placed: list[tuple[Activity, int]] = []
    holds: dict[int | None, int] = {}
    for activity in row:
        follows = activity.kind == "blocked" and activity.toast in holds
        free = [lane for lane, end_s in enumerate(lanes) if end_s <= activity.start_s + TOUCHING_S]
        lane = holds[activity.toast] if follows else free[0] if free else len(lanes)
        lanes[lane : lane + 1] = [activity.end_s]
        holds[activity.toast] = lane
        placed.append((activity, lane))
    lane_height = height / max(1, len(lanes))
    bars = [(activity, top + lane * lane_height, lane_height) for activity, lane in placed]
    for activity, low, tall in bars:
        _, colour, hatch = ACTIVITIES[activity.kind]
        span = [(activity.start_s, activity.end_s - activity.start_s)]
        axes.broken_barh(span, (low, tall), facecolor=colour, hatch=hatch, edgecolor=GREY, linewidth=0.4)
    return bars


def _write_on_bar(axes: "Axes", activity: Activity, top: float, height: float, choices: Sequence[str]) -> None:
    """The first of the texts that fits into the bar; nothing when none does."""
    ends = axes.transData.transform([(activity.start_s, top), (activity.end_s, top + height)])
    room_across, room_down = abs(ends[1] - ends[0])
    _, background, hatch = ACTIVITIES[activity.kind]
    for choice in choices:
        text = axes.text((activity.start_s + activity.end_s) / 2, top + height / 2, choice, ha="center", fontsize=7.5)
        text.set(va="center_baseline", in_layout=False, color="white" if activity.kind == "carry" else INK)
        if hatch:
            text.set_bbox({"facecolor": background, "linewidth": 0, "pad": 1})
        extent = text.get_window_extent()
        if extent.width + 4 <= room_across and extent.height <= room_down:
            return
        text.remove()


def _activity_keys(rows: Mapping[str, Sequence[Activity]]) -> list["Patch"]:
    from matplotlib.patches import Patch

    kinds = {activity.kind for row in rows.values() for activity in row}
    return [
        Patch(facecolor=colour, hatch=hatch, edgecolor=GREY, linewidth=0.4, label=says)
        for kind, (says, colour, hatch) in ACTIVITIES.items()
        if kind in kinds
    ]
