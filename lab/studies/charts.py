"""Chart elements of several studies: grouped bars, curves with intervals, and a legend below the plots.

Hollow diamonds mark the values that the thesis prints. The same data gives the same bytes.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lab.errors import BadInput
from lab.lazy import matplotlib
from lab.studies.findings import Row
from lab.view.canvas import BLUE, INK, ORANGE, PALE_GREY, RED, SKY, YELLOW, picture_bytes

Look = tuple[str, str, str]  # of a curve: colour, marker, name
# of the bars of a series: colour, hatch
SERIES = ((BLUE, None), (ORANGE, "///"), (SKY, None), (RED, "\\\\\\"), (YELLOW, None), (PALE_GREY, "xxx"))
GROUP_WIDTH = 0.8  # of the distance between two groups of bars
LETTERS_AN_INCH = 13  # of a legend
PRINTED: dict[str, Any] = {
    "linestyle": "none",
    "marker": "D",
    "markersize": 5.5,
    "markerfacecolor": "white",
    "markeredgecolor": INK,
}


def bars(
    groups: Sequence[str], lines: Mapping[str, Sequence[Row]], ylabel: str, *, xlabel: str = "", label: str = ""
) -> bytes:
    """An SVG picture of grouped bars, such as settings (series) by the advisor's tau (groups).

    lines: for each series a row per group, whose value, interval and printed figure may be None; label: the key of the text on a
    bar, such as "rank". Raises BadInput if the rows do not fit the groups, and for more than six series.
    Source: thesis tables 9.2-9.5, figs. 9.7-9.13.
    """
    if not 1 <= len(lines) <= len(SERIES):
        raise BadInput(f"picture of {len(lines)} series: allowed 1 to {len(SERIES)}")
    if any(len(line) != len(groups) for line in lines.values()):
        raise BadInput(f"bars: {[*map(len, lines.values())]} rows of the series; needed: {len(groups)} of each")

    def draw(figure: "matplotlib.figure.Figure") -> None:
        axes = figure.add_subplot()
        for number, (name, line) in enumerate(lines.items()):
            middle = GROUP_WIDTH * ((number + 0.5) / len(lines) - 0.5)
            for group, row in enumerate(line):
                if row["value"] is not None:
                    _draw_bar(axes, group + middle, row, number, GROUP_WIDTH / len(lines))
                    _write(axes, group + middle, row, str(row.get(label, "")))
            colour, hatch = SERIES[number]
            axes.bar([0], [0], color=colour, hatch=hatch, edgecolor="white", label=name)
        if any(row["thesis"] is not None for line in lines.values() for row in line):
            axes.plot([], [], label="printed", **PRINTED)
        axes.set_xticks(range(len(groups)), groups)
        axes.tick_params(axis="x", length=0)
        axes.set(xlabel=xlabel, ylabel=ylabel, xlim=(-0.55, len(groups) - 0.45))
        axes.set_ylim(0, 1.1 * (max(_top(row) for line in lines.values() for row in line) or 1.0))
        axes.grid(axis="y")
        handles, names = axes.get_legend_handles_labels()
        legend_below(figure, dict(sorted(zip(names, handles, strict=True), key=lambda item: item[0] == "printed")))

    return picture_bytes(draw, max(5.0, 1.4 + 0.34 * len(groups) * (len(lines) + 1)), 3.8)


def curve(axes: "matplotlib.axes.Axes", rows: Sequence[Row], by: str, look: Look) -> None:
    """Draws the values of rows over one of their settings, with a band for the intervals."""
    colour, marker, name = look
    x, y = [row[by] for row in rows], [row["value"] for row in rows]
    low, high = ([(row["ci95"] or [row["value"]] * 2)[end] for row in rows] for end in (0, 1))
    axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(x, y, color=colour, marker=marker, markersize=4.5, linewidth=1.4, label=name, zorder=2.5)


def legend_below(
    figure: "matplotlib.figure.Figure", handles: Mapping[str, "matplotlib.artist.Artist"] | None = None
) -> None:
    """Draws one legend below all plots, in as many columns as fit; handles: by name, None for all artists with labels."""
    if handles is None:
        legends = [axes.get_legend_handles_labels() for axes in figure.axes]
        handles = {name: handle for some, names in legends for handle, name in zip(some, names, strict=True)}
    fitting = int(LETTERS_AN_INCH * figure.get_figwidth() / (max(map(len, handles)) + 6))
    columns = min(len(handles), max(1, fitting))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)


def _top(row: Row) -> float:
    """The greatest height that is drawn for a row."""
    heights = (row["value"], *(row["ci95"] or ()), row["thesis"])
    return max((float(height) for height in heights if height is not None), default=0.0)


def _draw_bar(axes: "matplotlib.axes.Axes", x: float, row: Row, series: int, width: float) -> None:
    colour, hatch = SERIES[series]
    axes.bar(x, row["value"], width, color=colour, hatch=hatch, edgecolor="white", linewidth=0.6)
    for line_colour, line_width in (("white", 3.0), (INK, 1.2)):  # a white rim, or it is lost on dark bars
        axes.vlines(x, *(row["ci95"] or [np.nan] * 2), color=line_colour, linewidth=line_width, zorder=3)
    axes.plot(x, np.nan if row["thesis"] is None else row["thesis"], zorder=4, **PRINTED)


def _write(axes: "matplotlib.axes.Axes", x: float, row: Row, text: str) -> None:
    offset: dict[str, Any] = {"xytext": (0, 4), "textcoords": "offset points", "ha": "center"}
    axes.annotate(text, (x, _top(row)), fontsize=8, color=INK, **offset)
