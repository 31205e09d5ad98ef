"""Pictures of studies as SVG (or PNG) bytes: success by beta, convergence of one session, bars by advisor, scores.

What the thesis prints stands beside what was measured as a hollow diamond. The same data gives the same bytes.
"""

from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lab.advice.gates import improvement
from lab.errors import BadInput
from lab.view.canvas import BLUE, GREY, INK, ORANGE, PALE_GREY, RED, SKY, STYLE, YELLOW

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("svg", "png")
SERIES = (
    (BLUE, None),
    (ORANGE, "///"),
    (SKY, None),
    (RED, "\\\\\\"),
    (YELLOW, None),
    (PALE_GREY, "xxx"),
)  # colour, hatch
MARKERS = "os^vXP"
PRINTED: dict[str, Any] = {"marker": "D", "markersize": 5.5, "markerfacecolor": "white", "markeredgecolor": INK}
GROUP_WIDTH = 0.8  # of the distance between two groups of bars
LOWEST_RATE = -2.0  # improvement rates below are drawn as a mark at the edge

FloatArray = NDArray[np.float64]
Point = tuple[float, float, float, float]  # beta, success, low and high end of its interval [%]


def success_by_beta(
    curves: Mapping[str, Sequence[Point]], printed: Mapping[str, tuple[float, float]] | None = None, form: str = "svg"
) -> bytes:
    """Success percentage against beta with intervals, one curve a world; `printed` (beta, success) of a world.

    Raises BadInput without points and for a form not in FORMATS. Source: thesis fig. 9.4.
    """
    if not curves or not all(curves.values()):
        raise BadInput("success by beta: every curve needs a point")

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for (name, points), (colour, _), marker in zip(curves.items(), SERIES, MARKERS, strict=False):
            beta, success, low, high = np.array(sorted(points), dtype=np.float64).T
            axes.fill_between(beta, low, high, color=colour, alpha=0.2, linewidth=0)
            axes.plot(beta, success, color=colour, marker=marker, markersize=4.5, label=name)
        for name, (beta_there, success_there) in (printed or {}).items():
            label = "printed" if name == next(iter(printed or {})) else None
            axes.plot(beta_there, success_there, linestyle="none", label=label, zorder=3, **PRINTED)
        axes.set(xlabel="β (softmax temperature $n^{-β}$ in episode n)", ylabel="sessions that end optimal [%]")
        axes.set_ylim(0, 1.08 * max(20.0, *(point[3] for points in curves.values() for point in points)))
        axes.grid()
        _legend(figure, axes.get_legend_handles_labels()[0], 6)

    _check_series(len(curves))
    return _picture(draw, 6, 3.8, form)


def convergence(
    steps_per_episode: Sequence[int],
    guided: Sequence[bool],
    optimum: int,
    *,
    window: int = 5,
    threshold: float | None = None,
    title: str = "",
    form: str = "svg",
) -> bytes:
    """Steps of each episode (n,) of one session, guided ones marked, above the improvement rate before each episode.

    optimum: fewest possible steps; window: K of the rate; threshold: Lambda, below which the learner asks.
    Raises BadInput without episodes, for lengths that differ, and for a form not in FORMATS.
    Source: thesis figs. 9.3, 9.5, 9.6; eq. 6.1.
    """
    if not len(steps_per_episode) or len(steps_per_episode) != len(guided):
        raise BadInput(f"convergence: {len(steps_per_episode)} episodes, {len(guided)} marks of guided ones")

    def draw(figure: "Figure") -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _draw_steps(above, np.asarray(steps_per_episode), np.asarray(guided, dtype=np.bool_), optimum)
        _draw_rate(below, [int(steps) for steps in steps_per_episode], window, threshold)
        above.set_title(title)
        handles = [line for axes in (above, below) for line in axes.get_legend_handles_labels()[0]]
        _legend(figure, handles, 7)

    return _picture(draw, 7, 4.6, form)


def bars(
    groups: Sequence[str],
    series: Sequence[str],
    values: ArrayLike,
    intervals: ArrayLike | None,
    ylabel: str,
    *,
    xlabel: str = "",
    printed: ArrayLike | None = None,
    labels: Sequence[Sequence[str]] | None = None,
    title: str = "",
    form: str = "svg",
) -> bytes:
    """Bars of several series side by side, group by group, such as settings by the advisor's tau.

    values, printed (series, groups); intervals (series, groups, 2), low and high; NaN where there is nothing; labels:
    a word on each bar. Raises BadInput for shapes that do not fit, more than six series, and a form not in FORMATS.
    Source: thesis figs. 9.7-9.13.
    """
    _check_series(len(series))
    shape = (len(series), len(groups))
    heights = _shaped(values, shape, "values")
    ends = _shaped(intervals, (*shape, 2), "intervals")
    there = _shaped(printed, shape, "printed figures")
    if labels is not None and [*map(len, labels)] != [len(groups)] * len(series):
        raise BadInput(f"bars: the labels do not fit {shape[0]} series of {shape[1]} groups")

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for number, name in enumerate(series):
            x: FloatArray = np.arange(len(groups), dtype=np.float64) + (
                number - (len(series) - 1) / 2
            ) * GROUP_WIDTH / len(series)
            _draw_series(axes, x, GROUP_WIDTH / len(series), number, name, heights[number], ends[number])
            axes.plot(x, there[number], linestyle="none", zorder=4, **PRINTED)
            _write_labels(axes, x, np.fmax(heights[number], np.fmax(ends[number, :, 1], there[number])), number, labels)
        axes.set_xticks(range(len(groups)), groups)
        axes.tick_params(axis="x", length=0)
        axes.set(xlabel=xlabel, ylabel=ylabel, xlim=(-0.55, len(groups) - 0.45), title=title)
        axes.set_ylim(0, 1.1 * (np.fmax.reduce([0.0, *heights.flat, *ends.flat, *there.flat]) or 1.0))
        axes.grid(axis="y")
        if np.isfinite(there).any():
            axes.plot([], [], linestyle="none", label="printed", **PRINTED)
        handles, _ = axes.get_legend_handles_labels()
        _legend(figure, sorted(handles, key=lambda handle: handle.get_label() == "printed"), width_inch)

    width_inch = max(5.0, 1.4 + 0.34 * len(groups) * (len(series) + 1))
    return _picture(draw, width_inch, 3.8, form)


def scores(
    groups: Sequence[str],
    methods: Sequence[str],
    values: ArrayLike,
    ranks: Sequence[Sequence[str]],
    *,
    intervals: ArrayLike | None = None,
    printed: ArrayLike | None = None,
    title: str = "",
    form: str = "svg",
) -> bytes:
    """Scores of the methods by advisor, with the rank of each written on its bar.

    values, ranks, printed (methods, groups); intervals (methods, groups, 2). Raises BadInput as `bars` does.
    Source: thesis tables 9.2-9.5, eq. 9.4.
    """
    xlabel = "advisor, number on a bar: rank among the methods"
    kept: dict[str, Any] = {"xlabel": xlabel, "printed": printed, "labels": ranks, "title": title, "form": form}
    return bars(groups, methods, values, intervals, "score", **kept)


def _picture(draw: Callable[["Figure"], None], width_inch: float, height_inch: float, form: str) -> bytes:
    """A figure in the lab's style as bytes, alike for like data: no date, no random names."""
    import matplotlib.style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if form not in FORMATS:
        raise BadInput(f"picture as '{form}': known: {', '.join(FORMATS)}")
    with matplotlib.style.context({**STYLE, "svg.hashsalt": "lab"}, after_reset=True):
        figure = Figure(figsize=(width_inch, height_inch), layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure)
        drawn = BytesIO()
        metadata = {"Software": None} if form == "png" else {"Date": None, "Creator": None}
        figure.savefig(drawn, format=form, metadata=metadata)
    return drawn.getvalue()


def _legend(figure: "Figure", handles: Sequence["Artist"], width_inch: float) -> None:
    """All handles below the plot, in as many columns as fit."""
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, int(13 * width_inch / (longest + 6))))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns)


def _check_series(count: int) -> None:
    if not 1 <= count <= len(SERIES):
        raise BadInput(f"picture of {count} series: allowed 1 to {len(SERIES)}")


def _shaped(values: ArrayLike | None, shape: tuple[int, ...], what: str) -> FloatArray:
    """The values as an array of this shape, NaN where there are none."""
    array = np.full(shape, np.nan) if values is None else np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise BadInput(f"bars: {what} of shape {array.shape}; needed: {shape}")
    return array


def _draw_steps(axes: "Axes", steps: NDArray[np.int64], guided: NDArray[np.bool_], optimum: int) -> None:
    from matplotlib.ticker import MaxNLocator

    episodes = np.arange(1, len(steps) + 1)
    axes.plot(episodes, steps, color=BLUE, linewidth=0.9, label="steps")
    if guided.any():
        look: dict[str, Any] = {"markersize": 4, "markeredgecolor": INK, "markeredgewidth": 0.4}
        axes.plot(episodes[guided], steps[guided], "o", color=ORANGE, label="guided episodes", **look)
    axes.axhline(optimum, color=RED, linestyle="--", linewidth=1.2, label=f"fewest possible: {optimum}")
    axes.set(ylabel="steps", xlim=(0, 1.02 * max(2, len(steps))), ylim=(0, 1.08 * max(optimum, int(steps.max()), 2)))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid()


def _draw_rate(axes: "Axes", steps: Sequence[int], window: int, threshold: float | None) -> None:
    """The improvement rate that the learner knows before each episode; it exists from episode 2K + 1 on."""
    known = [(n + 1, found.rate) for n in range(len(steps)) if (found := improvement(steps[:n], window)) is not None]
    if known:
        axes.plot(*zip(*known, strict=True), color=INK, linewidth=0.9)
        cut = [episode for episode, rate in known if rate < LOWEST_RATE]
        if cut:
            axes.plot(
                cut, [LOWEST_RATE] * len(cut), "v", color=GREY, markersize=5, clip_on=False, label="rate below −2"
            )
    axes.axhline(0, color=GREY, linewidth=0.6)
    if threshold is not None:
        axes.axhline(threshold, color=ORANGE, linestyle=":", linewidth=1.4, label=f"asks below Λ = {threshold:g}")
    axes.set(xlabel="episode", ylabel="improvement rate")
    axes.set_ylim(max(LOWEST_RATE, min([-0.1, *(1.1 * rate for _, rate in known)])), 1.05)
    axes.grid()


def _draw_series(
    axes: "Axes", x: FloatArray, width: float, number: int, name: str, heights: FloatArray, ends: FloatArray
) -> None:
    """Bars of one series (groups,) and their intervals (groups, 2)."""
    colour, hatch = SERIES[number]
    look: dict[str, Any] = {"color": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0.6}
    axes.bar(x, heights, width, label=name, **look)
    known = np.isfinite(ends).all(axis=1)
    for line_colour, line_width in (("white", 3.0), (INK, 1.2)):  # a white rim, or it is lost on dark bars
        axes.vlines(x[known], ends[known, 0], ends[known, 1], color=line_colour, linewidth=line_width, zorder=3)


def _write_labels(
    axes: "Axes", x: FloatArray, tops: FloatArray, number: int, labels: Sequence[Sequence[str]] | None
) -> None:
    for place, top, label in zip(x, tops, labels[number] if labels is not None else (), strict=False):
        if np.isfinite(top):
            offset: dict[str, Any] = {"xytext": (0, 4), "textcoords": "offset points", "ha": "center"}
            axes.annotate(label, (place, top), fontsize=8, color=INK, **offset)
