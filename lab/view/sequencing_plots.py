"""Pictures of how sequences were found: one session or many, and how often a session finds the optimum."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted
from lab.view.canvas import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    picture_bytes,
    picture_file,
    seconds,
    tip,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

METHODS = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED, GREY, INK)
MARKERS = "os^vXPD*"
SIZE_INCH = 7.0, 4.0
PERCENT = (0.0, 104.0)

FloatArray = NDArray[np.float64]
# session lengths (n,), what was measured at each (n,), and low and high end of its interval (n, 2), NaN where there is none
Curve = tuple[Sequence[float], Sequence[float], Sequence[tuple[float, float]]]
Printed = tuple[Sequence[float], Sequence[float]]  # session lengths (n,), what is printed for each (n,)


class Around(TypedDict, total=False):
    """What a picture of success may show beside the curves.

    printed: by method, what is printed; optimal: a proven optimum, as a line; ylabel and ylim (None: as the data have
    it): for other measures than percentages, such as the mean best makespan.
    """

    printed: Mapping[str, Printed]
    optimal: float
    title: str
    ylabel: str
    ylim: tuple[float, float] | None


def sequence_plot(
    episode_costs: Sequence[float] | Sequence[Sequence[float]],
    optimal: float | None,
    path: Path,
    *,
    ylabel: str = "makespan [s]",
    deadlock: float | None = None,
) -> None:
    """Cost of each sequencing episode, the best so far, and the proven optimum; PNG or SVG by the path's suffix.

    Several sessions (a list of lists): the best so far of each as a pale line, their mean, and the mean cost of an
    episode. deadlock: the cost of episodes that ended in one (`stuck_cost`), drawn as marks at the upper edge; they
    count in no mean. Raises BadInput without episodes, and as all plots here do. Source: thesis fig. 7.3.
    """
    sessions = _sessions(episode_costs)
    if not sessions or not all(map(len, sessions)):
        raise BadInput("sequencing plot: there are no episodes")
    costs = np.full((len(sessions), max(map(len, sessions))), np.nan)
    for row, session in zip(costs, sessions, strict=True):
        row[: len(session)] = session
    stuck = np.zeros(costs.shape, dtype=np.bool_) if deadlock is None else costs >= deadlock
    unit = " s" if ylabel.endswith("[s]") else ""
    with picture_file(path, *SIZE_INCH) as figure:
        axes = figure.add_subplot()
        kept = np.where(stuck, np.nan, costs)
        draw = _draw_session if len(sessions) == 1 else _draw_sessions
        draw(axes, kept, unit)
        if optimal is not None:
            label = f"proven optimum: {_number(optimal, unit)}"
            axes.axhline(optimal, color=RED, linestyle="--", linewidth=1.4, label=label)
        _draw_stuck(axes, stuck)
        _dress(axes, "episode", ylabel, costs.shape[1])
        axes.set_title("Sequences tried" if len(sessions) == 1 else f"Sequences tried in {len(sessions)} sessions")
        figure.legend(loc="outside lower center", ncols=3)


def success_picture(rows: Mapping[str, Curve], form: str = "svg", **around: Unpack[Around]) -> bytes:
    """Success of each method by session length, with intervals, as PNG or SVG bytes; what is printed as open markers.

    rows: method -> (lengths, percent, ci95), see `Curve`; around: see `Around`. Raises BadInput without rows, for more
    than eight methods, for lengths that do not fit, and for another form. Source: thesis figs. 7.7-7.12.
    """
    return picture_bytes(lambda figure: _draw_success(figure, rows, around), *SIZE_INCH, form)


def _draw_success(figure: "Figure", rows: Mapping[str, Curve], around: Around) -> None:
    printed, optimal = around.get("printed", {}), around.get("optimal")
    names = list(dict.fromkeys([*rows, *printed]))
    if not rows or len(names) > len(METHODS):
        raise BadInput(f"success by session length: {len(names)} methods; allowed are 1 to {len(METHODS)}")
    axes = figure.add_subplot()
    for name, colour, marker in zip(names, METHODS, MARKERS, strict=False):
        if name in rows:
            _draw_curve(axes, name, _columns(name, *rows[name]), colour, marker)
        if name in printed:
            _draw_printed(axes, name, *printed[name], colour, marker)
    if printed:
        axes.plot([], [], linestyle="none", marker="o", color=INK, markerfacecolor="white", label="printed")
    if optimal is not None:
        axes.axhline(optimal, color=RED, linestyle="--", linewidth=1.2, label=f"proven optimum: {optimal:g}")
    _dress(axes, "episodes in a session", around.get("ylabel", "sessions that find the optimum [%]"), None)
    axes.set(title=around.get("title", ""), ylim=around.get("ylim", PERCENT) or (None, None))
    figure.legend(loc="outside lower center", ncols=4)


def _sessions(costs: Sequence[float] | Sequence[Sequence[float]]) -> list[Sequence[float]]:
    """One list of costs, or several, as several."""
    one = [cost for cost in costs if isinstance(cost, int | float | np.number)]
    return [one] if one else [session for session in costs if not isinstance(session, int | float)]


def _draw_session(axes: "Axes", costs: FloatArray, unit: str) -> None:
    """Costs (1, n) of one session."""
    (session,) = costs
    episodes = np.arange(1, len(session) + 1)
    dots: dict[str, Any] = {"color": GREY, "marker": ".", "markersize": 4.5, "linewidth": 0.4, "alpha": 0.9}
    axes.plot(episodes, session, label="each episode", **dots)
    (best,) = _best_so_far(costs)
    label = f"best so far: {_number(best[-1], unit)}" if np.isfinite(best[-1]) else "best so far: none"
    axes.step(episodes, best, where="post", color=BLUE, linewidth=1.8, label=label)
    found = np.flatnonzero(best == best[-1])
    if len(found):
        axes.plot(episodes[found[0]], best[-1], "o", color=BLUE, label=f"found in episode {found[0] + 1}")


def _draw_sessions(axes: "Axes", costs: FloatArray, unit: str) -> None:
    """Costs (sessions, episodes) of several sessions."""
    episodes = np.arange(1, costs.shape[1] + 1)
    best = _best_so_far(costs)
    for number, session in enumerate(best, 1):
        (line,) = axes.step(episodes, session, where="post", color=SKY, linewidth=0.8, alpha=0.8)
        tip(line, f"session {number}: best {_number(session[-1], unit)}")
    line.set_label("best so far in each session")
    mean = _mean(costs)
    axes.plot(episodes, mean, color=GREY, linewidth=1.0, label="mean of the episodes")
    mean = _mean(best)
    label = f"mean best so far: {_number(mean[-1], unit)}"
    axes.step(episodes, mean, where="post", color=BLUE, linewidth=2.0, label=label)


def _draw_stuck(axes: "Axes", stuck: NDArray[np.bool_]) -> None:
    """A mark at the upper edge for each episode in which a session, of (sessions, episodes), ended in a deadlock."""
    where = np.flatnonzero(stuck.any(axis=0))
    if len(where):
        look: dict[str, Any] = {"linestyle": "none", "marker": "x", "color": INK, "markersize": 4, "clip_on": False}
        label = f"deadlock ({stuck.sum()} of {counted(stuck.size, 'episode')})"
        axes.plot(where + 1, np.ones(len(where)), transform=axes.get_xaxis_transform(), label=label, **look)


def _draw_curve(axes: "Axes", name: str, columns: FloatArray, colour: str, marker: str) -> None:
    """One method's (lengths, values, lows, highs)."""
    lengths, values, low, high = columns
    axes.fill_between(lengths, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(lengths, values, color=colour, marker=marker, markersize=5, linewidth=1.5, label=name, zorder=3)


def _draw_printed(
    axes: "Axes", name: str, lengths: Sequence[float], values: Sequence[float], colour: str, marker: str
) -> None:
    """What is printed of one method: open markers on a dotted line."""
    if len(lengths) != len(values):
        raise BadInput(f"success of '{name}': {len(lengths)} printed lengths, {len(values)} values")
    look: dict[str, Any] = {"markerfacecolor": "white", "markersize": 6, "linestyle": ":", "linewidth": 0.9}
    axes.plot(lengths, values, color=colour, marker=marker, zorder=2.5, **look)


def _columns(
    name: str, lengths: Sequence[float], values: Sequence[float], ends: Sequence[tuple[float, float]]
) -> FloatArray:
    """(4, n): lengths, values, low and high ends, by length; BadInput when they are not equally many, or none."""
    if not len(lengths) or not len(lengths) == len(values) == len(ends):
        raise BadInput(f"success of '{name}': {len(lengths)} lengths, {len(values)} values, {len(ends)} intervals")
    table = np.column_stack([lengths, values, np.asarray(ends, dtype=np.float64).reshape(-1, 2)]).astype(np.float64)
    return table[np.argsort(table[:, 0], kind="stable")].T


def _best_so_far(costs: FloatArray) -> FloatArray:
    """The lowest cost up to each episode, along the last axis; NaN until there is one."""
    best: FloatArray = np.fmin.accumulate(costs, axis=1)
    return best


def _mean(costs: FloatArray) -> FloatArray:
    """The mean over sessions (sessions, episodes) that have a cost, NaN where none has."""
    there = np.isfinite(costs)
    count = there.sum(axis=0)
    return np.where(count > 0, np.where(there, costs, 0).sum(axis=0) / np.maximum(1, count), np.nan)


def _dress(axes: "Axes", xlabel: str, ylabel: str, episodes: int | None) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(xlabel=xlabel, ylabel=ylabel)
    if episodes is not None:
        axes.set_xlim(0, 1.02 * max(2, episodes))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid()


def _number(value: float, unit: str) -> str:
    """A cost for reading: seconds as such, else without needless digits."""
    return seconds(value) if unit else f"{value:.4g}"
