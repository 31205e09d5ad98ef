"""Plots of the episode costs of sequencing sessions, one or many."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted
from lab.lazy import matplotlib
from lab.view.canvas import BLUE, GREY, INK, ORANGE, RED, SKY, picture_file, seconds, tip

SIZE_INCH = 7.0, 4.0
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PlotBeside:
    """What stands beside the episodes of a plot: other costs for comparison, by name; whether the optimum is one, or a bound."""

    title: str = ""
    costs: Mapping[str, float] = field(default_factory=dict)
    proven: bool = True


def sequence_plot(
    episode_costs: Sequence[float] | Sequence[Sequence[float]],
    optimal: float | None,
    path: Path,
    *,
    ylabel: str = "makespan [s]",
    deadlock: float | None = None,
    beside: PlotBeside | None = None,
) -> None:
    """Plot the cost of each sequencing episode, the incumbent, and the proven optimum; PNG or SVG by the path's suffix.

    Of several sessions (a list of lists): each incumbent as a pale line, their mean, and the mean cost of an episode.
    deadlock: the cost of episodes that ended in a deadlock (`stuck_cost`), drawn as marks at the upper edge and excluded
    from all means. optimal: the proven optimum, or None.
    Raises BadInput without episodes, and for a path that cannot be written. Source: thesis fig. 7.3.
    """
    sessions, beside = _sessions(episode_costs), beside or PlotBeside()
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
            label = f"proven {'optimum' if beside.proven else 'bound'}: {_number(optimal, unit)}"
            axes.axhline(optimal, color=RED, linestyle="--", linewidth=1.4, label=label)
        for (label, value), look in zip(beside.costs.items(), cycle((":", "-.")), strict=False):
            axes.axhline(value, color=ORANGE, linestyle=look, linewidth=1.2, label=label)
        _draw_stuck(axes, stuck)
        axes.set(xlabel="episode", ylabel=ylabel, xlim=(0, 1.02 * max(2, costs.shape[1])))
        axes.xaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True))
        axes.grid()
        several = f"Sequences tried in {len(sessions)} sessions"
        axes.set_title(beside.title or ("Sequences tried" if len(sessions) == 1 else several))
        figure.legend(loc="outside lower center", ncols=3)


def _sessions(costs: Sequence[float] | Sequence[Sequence[float]]) -> list[Sequence[float]]:
    """The costs as a list of sessions, also when only one is given."""
    numbers = [cost for cost in costs if isinstance(cost, int | float | np.number)]
    return [numbers] if numbers else [session for session in costs if not isinstance(session, int | float)]


def _draw_session(axes: "matplotlib.axes.Axes", costs: FloatArray, unit: str) -> None:
    """Draw the costs (1, n) of one session."""
    (session,) = costs
    episodes = np.arange(1, len(session) + 1)
    dots: dict[str, Any] = {"color": GREY, "marker": ".", "markersize": 4.5, "linewidth": 0.4, "alpha": 0.9}
    axes.plot(episodes, session, label="each episode", **dots)
    (best,) = _best_so_far(costs)
    label = f"best so far: {_number(best[-1], unit)}" if np.isfinite(best[-1]) else "best so far: none"
    axes.step(episodes, best, where="post", color=BLUE, linewidth=1.8, label=label)
    bests = np.flatnonzero(best == best[-1])
    if len(bests):
        axes.plot(episodes[bests[0]], best[-1], "o", color=BLUE, label=f"found in episode {bests[0] + 1}")


def _draw_sessions(axes: "matplotlib.axes.Axes", costs: FloatArray, unit: str) -> None:
    """Draw the costs (sessions, episodes) of several sessions."""
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


def _draw_stuck(axes: "matplotlib.axes.Axes", stuck: NDArray[np.bool_]) -> None:
    """Draw a mark at the upper edge for each episode with a deadlock in `stuck` (sessions, episodes)."""
    where = np.flatnonzero(stuck.any(axis=0))
    if len(where):
        look: dict[str, Any] = {"linestyle": "none", "marker": "x", "color": INK, "markersize": 4, "clip_on": False}
        label = f"deadlock ({stuck.sum()} of {counted(stuck.size, 'episode')})"
        axes.plot(where + 1, np.ones(len(where)), transform=axes.get_xaxis_transform(), label=label, **look)


def _best_so_far(costs: FloatArray) -> FloatArray:
    """The incumbent's cost at each episode, along the last axis; NaN until there is one."""
    best: FloatArray = np.fmin.accumulate(costs, axis=1)
    return best


def _mean(costs: FloatArray) -> FloatArray:
    """The mean (episodes,) over the sessions that have a cost; NaN where none has."""
    there = np.isfinite(costs)
    count = there.sum(axis=0)
    return np.where(count > 0, np.where(there, costs, 0).sum(axis=0) / np.maximum(1, count), np.nan)


def _number(value: float, unit: str) -> str:
    """A cost for reading: seconds with their unit, others without needless digits."""
    return seconds(value) if unit else f"{value:.4g}"
