"""The Gantt chart of a schedule: parts, machines and the robot over time (thesis fig. IV.1)."""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.lazy import matplotlib
from lab.sequencing.cell.schedule import Schedule
from lab.sequencing.cyclic.unrolled import Steady
from lab.view.canvas import GREY, INK, RED, picture_bytes, picture_file, seconds, tip
from lab.view.gantt_bars import LOOKS, Bar, Chart, CycleChart, mixed

MANY_ROWS = 12  # from this number on, times and names stand on both sides of the chart
FAR_PIXELS = 100  # closer to the row's name than this, a part's name is not repeated
BAND = "#F5F5F5"  # background of every other row
FONT_SIZES = 7.5, 6.0  # of the text on bars [pt]; the first that fits is used


def gantt(
    schedule: Schedule, path: Path, predicted: Schedule | None = None, due_s: Sequence[float] | None = None
) -> None:
    """Draw parts, machines and robots over time [s], with the makespan; `predicted` as a thin strip under each row.

    Marks show, on a machine's row, until when a part must be fetched, and on a part's row its due date [s]. The file is PNG
    or SVG by the path's suffix; in SVG each bar has a tooltip. The page grows with the number of moves and rows; colours
    stand for products. Raises BadInput for a schedule without activities, for a path with another suffix, and for one that
    cannot be written. Source: thesis fig. IV.1.
    """
    draw, size_inch = _drawing(Chart(schedule), predicted, due_s=due_s)
    with picture_file(path, *size_inch) as figure:
        draw(figure)


def cycle_gantt(shown: Steady, path: Path) -> None:
    """Draw stations and robot over a few periods [s] of a cycle, the periods' ends marked. Files and errors: see `gantt`."""
    period_s, named = shown.cycle.period_s, "the period"
    ends = [(n * period_s, "-", named if n == 1 else "") for n in range(1, shown.periods + 1)]
    draw, size_inch = _drawing(CycleChart(shown.schedule, shown), None, ends)
    with picture_file(path, *size_inch) as figure:
        draw(figure)


def gantt_picture(schedule: Schedule) -> bytes:
    """The Gantt chart of a schedule as SVG bytes. BadInput for a schedule without activities."""
    draw, size_inch = _drawing(Chart(schedule), None)
    return picture_bytes(draw, *size_inch)


def _drawing(
    chart: Chart,
    predicted: Schedule | None,
    ends: list[tuple[float, str, str]] | None = None,
    due_s: Sequence[float] | None = None,
) -> tuple[Callable[["matplotlib.figure.Figure"], None], tuple[float, float]]:
    """The function that draws the chart on a figure, and the figure's width and height [inch].

    ends: vertical lines, each with its time [s], dashes and name ("" for none); None: one line at the makespan.
    """
    schedule = chart.schedule
    if not (schedule.robot or schedule.machines):
        raise BadInput("Gantt chart: the schedule has no activities")
    width_inch, height_inch = chart.page_inch(predicted is not None)
    bars = chart.bars(schedule, -0.31 if predicted is None else -0.38, 0.62)
    if ends is None:
        ends = [(schedule.makespan_s, "-", "makespan" if predicted is None else "makespan, measured")]
    strips: list[Bar] = []
    if predicted is not None:
        strips = [bar for bar in chart.bars(predicted, 0.28, 0.13) if bar.look != "outside"]
        ends.append((predicted.makespan_s, "--", "makespan, predicted (thin strips)"))

    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        for bar in (*bars, *strips):
            _draw_bar(axes, bar, chart)
        lines = [line for end in ends if (line := _draw_end(axes, *end)) and end[2]]
        last_s = max(
            *(bar.activity.end_s for bar in (*bars, *strips)), *(end_s for end_s, _, _ in ends), *(due_s or ())
        )
        _dress(axes, chart, 1.01 * last_s, width_inch)
        marks = [*_draw_arrivals(axes, chart), *_draw_limits(axes, chart), *_draw_due(axes, chart, due_s or ())]
        _legend(figure, chart, [*lines, *marks], {bar.look for bar in bars}, width_inch)
        figure.draw_without_rendering()  # settles the layout, so that widths in pixels are known
        _write(axes, bars, chart)

    return draw, (width_inch, height_inch)


def _draw_bar(axes: "matplotlib.axes.Axes", bar: Bar, chart: Chart) -> None:
    start_s, end_s, outside = bar.activity.start_s, bar.activity.end_s, bar.look == "outside"
    look: dict[str, Any] = {"facecolor": chart.colour(bar), "hatch": LOOKS[bar.look].hatch, "edgecolor": GREY}
    patch = matplotlib.patches.Rectangle(
        (start_s, bar.top), end_s - start_s, bar.height, linewidth=0 if outside else 0.4, **look
    )
    patch.set_in_layout(False)
    tip(patch, chart.tip(bar.activity))
    axes.add_patch(patch)


def _dress(axes: "matplotlib.axes.Axes", chart: Chart, last_s: float, width_inch: float) -> None:
    """Draw the rows' names, the bands behind them, and the time axis."""
    rows, parts = chart.rows, len({activity.resource for activity in chart.schedule.parts})
    for row in range(1, len(rows), 2):
        axes.axhspan(row - 0.5, row + 0.5, color=BAND, linewidth=0, zorder=0.5)
    for edge in (parts, len(rows) - 1) if chart.robots else (parts,):
        axes.axhline(edge - 0.5, color=GREY, linewidth=0.8, zorder=0.8)
    axes.set_yticks(range(len(rows)), rows, parse_math=False)
    axes.set(ylim=(len(rows) - 0.5, -0.5), xlim=(0, last_s), xlabel="time [s]")
    axes.tick_params(axis="y", length=0, labelright=len(rows) > MANY_ROWS)
    axes.tick_params(axis="x", top=len(rows) > MANY_ROWS, labeltop=len(rows) > MANY_ROWS)
    axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(nbins=int(1.5 * width_inch), steps=[1, 2, 5, 10]))
    axes.grid(axis="x")
    axes.set_title(chart.title())


def _draw_end(axes: "matplotlib.axes.Axes", end_s: float, dashes: str, name: str) -> "matplotlib.lines.Line2D":
    """A vertical line at a time, such as the makespan, behind the bars."""
    look: dict[str, Any] = {"color": RED, "linestyle": dashes, "linewidth": 1.4, "zorder": 0.9}
    return axes.axvline(end_s, label=f"{name}: {seconds(end_s)}", **look)


def _draw_arrivals(axes: "matplotlib.axes.Axes", chart: Chart) -> list["matplotlib.lines.Line2D"]:
    """Marks at the arrivals of parts; none for parts that are there from the start."""
    came_s = {activity.resource: activity.start_s for activity in reversed(chart.schedule.parts)}
    late = [(at_s, chart.rows.index(row)) for row, at_s in came_s.items() if at_s > 0]
    look: dict[str, Any] = {"marker": 5, "color": INK, "linestyle": "none", "markersize": 6}  # 5: the tip is the place
    return axes.plot(*zip(*late, strict=True), label="arrives", **look) if late else []


def _draw_limits(axes: "matplotlib.axes.Axes", chart: Chart) -> list["matplotlib.lines.Line2D"]:
    """Marks on the machines' rows at the latest times for fetching a part; none without such a limit."""
    limits, rows = chart.schedule.fetch_by, chart.rows
    until = [(limit.until_s, rows.index(limit.station)) for limit in limits if limit.station in rows]
    look: dict[str, Any] = {"marker": "|", "color": RED, "linestyle": "none", "markersize": 14, "markeredgewidth": 2}
    return axes.plot(*zip(*until, strict=True), label="to be fetched until then", **look) if until else []


def _draw_due(axes: "matplotlib.axes.Axes", chart: Chart, due_s: Sequence[float]) -> list["matplotlib.lines.Line2D"]:
    """Marks on the parts' rows at their due dates, in another colour for parts that are late."""
    drawn = []
    for late, colour, label in ((False, INK, "due"), (True, RED, "due, and late")):
        marks = [
            (due_s[part - 1], chart.rows.index(name))
            for part, name in chart.names.items()
            if part <= len(due_s) and (chart.finished_s[name] > due_s[part - 1] + 1e-6) is late
        ]
        look: dict[str, Any] = {"marker": "v", "color": colour, "linestyle": "none", "markersize": 7, "clip_on": False}
        drawn += axes.plot(*zip(*marks, strict=True), label=label, **look) if marks else []
    return drawn


def _write(axes: "matplotlib.axes.Axes", bars: Sequence[Bar], chart: Chart) -> None:
    """Write on each bar the first of its texts that fits, or nothing."""
    renderer = axes.figure.canvas.get_renderer()  # type: ignore[attr-defined]
    fonts = {size: matplotlib.font_manager.FontProperties(size=size) for size in FONT_SIZES}

    @cache
    def extent(text: str, size: float) -> tuple[float, float]:
        wide, high, _ = renderer.get_text_width_height_descent(text, fonts[size], ismath=False)
        return wide, high

    corners = axes.transData.transform([(0, 0), (1, 1)])
    second, row = np.abs(corners[1] - corners[0])
    for bar in bars:
        across, tall = second * (bar.activity.end_s - bar.activity.start_s), row * bar.height
        if bar.look == "outside":  # the line continues beside the text, and the row's name must not be close
            across, tall = min(across - 12, second * bar.activity.end_s - FAR_PIXELS), inf
        for text, size in product(chart.texts(bar), FONT_SIZES):
            wide, high = extent(text, size)
            if wide + 4 <= across and high <= tall:
                _write_text(axes, bar, text, size, chart.colour(bar))
                break


def _write_text(axes: "matplotlib.axes.Axes", bar: Bar, text: str, size: float, colour: str) -> None:
    """Write a text in the middle of its bar; beside the part's bars when it has not begun or is finished."""
    start_s, end_s = bar.activity.start_s, bar.activity.end_s
    at_s, align, points = (start_s + end_s) / 2, "center", 0
    if bar.look == "outside":
        at_s, align, points = (start_s, "left", 4) if text.startswith("finished") else (end_s, "right", -4)
    look: dict[str, Any] = {"ha": align, "va": "center_baseline", "fontsize": size, "color": LOOKS[bar.look].ink}
    where: dict[str, Any] = {"xytext": (points, 0), "textcoords": "offset points"}
    written = axes.annotate(text, (at_s, bar.middle), parse_math=False, **where, **look)
    written.set_in_layout(False)
    if bar.look == "outside":
        written.set_bbox({"facecolor": BAND if bar.row % 2 else "white", "linewidth": 0, "pad": 1})
    elif LOOKS[bar.look].hatch:
        written.set_bbox({"facecolor": colour, "linewidth": 0, "pad": 1})


def _legend(
    figure: "matplotlib.figure.Figure", chart: Chart, lines: Sequence[Any], kinds: set[str], width_inch: float
) -> None:
    handles: list[Any] = []
    labels: list[str] = []
    for kind, look in LOOKS.items():
        if kind not in kinds:
            continue
        colours = [look.colour] if look.colour else [mixed(own, look.strength) for own in chart.products.values()]
        handles.append(
            tuple(
                matplotlib.patches.Patch(facecolor=own, hatch=look.hatch, edgecolor=GREY, linewidth=0.4)
                for own in colours
            )
        )
        several = f" ({', '.join(chart.products)})" if kind == "process" and len(chart.products) > 1 else ""
        labels.append(look.says + several)
    columns = max(1, int(width_inch / 2.7))
    figure.legend(
        [*handles, *lines],
        [*labels, *(str(line.get_label()) for line in lines)],
        loc="outside lower left",
        ncols=columns,
        handler_map={tuple: matplotlib.legend_handler.HandlerTuple(ndivide=None, pad=0)},
    )
