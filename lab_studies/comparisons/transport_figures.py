"""Two pictures of the board: the share of instances that each method solves within a gap, and its mean gap over time."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.sequencing.search import gap
from lab.studies.charts import legend_below
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lab_studies.comparisons.transport_entries import Entry, EntryResult
    from lab_studies.comparisons.transport_instances import Instance

COLOURS = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, INK, GREY)
DASHES = ("-", "--", ":")
WIDEST, POINTS = 100.0, 60  # percent; points in time
NOTHING = 100.0  # percent: the gap of a method that has found nothing yet


def profile(gaps: Mapping[str, Sequence[float]]) -> bytes:
    """A picture of the share of instances [%] within a gap, a line for each method; higher and further left is better."""

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for number, (method, values) in _ranked(gaps):
            ordered = np.sort(np.maximum(values, 0.0))
            x, y = [0.0, *ordered, WIDEST], 100.0 * np.arange(len(ordered) + 1) / len(ordered)
            axes.step(x, [*y, y[-1]], where="post", label=method, **_look(number))
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
        axes.set(xlim=(0, WIDEST), ylim=(0, 102), xlabel="gap to the best known [%]", ylabel="instances [%]")
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 7.0, 4.2)


def by_seconds(results: "Mapping[Entry, EntryResult]", least: "Mapping[Instance, float]") -> bytes:
    """A picture of the mean gap of each method's best order so far, by the seconds since it began."""
    ends = [entry.seconds for entry in results]
    seconds = np.geomspace(0.01, max(ends, default=1.0), POINTS)
    lines = dict[str, list[np.ndarray]]()
    for entry, result in results.items():
        if result.cost is not None:
            lines.setdefault(entry.method, []).append(_gaps_at(seconds, result.trace, least[entry.instance]))

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for number, (method, _) in _ranked({name: [float(line[-1]) for line in of] for name, of in lines.items()}):
            axes.plot(seconds, np.mean(lines[method], axis=0), label=method, **_look(number))
        axes.set_xscale("log")
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_yticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
        axes.set(ylim=(0, None), xlabel="seconds", ylabel="mean gap to the best known [%]")
        axes.grid()
        legend_below(figure)

    return picture_bytes(draw, 7.0, 4.2)


def _gaps_at(seconds: np.ndarray, trace: Sequence[tuple[float, float]], least: float) -> np.ndarray:
    """The gap [%] of the best order that was found by each of the times, (n,)."""
    gaps = np.full(len(seconds), NOTHING)
    for at_s, value in trace:
        gaps[seconds >= at_s] = min(NOTHING, 100.0 * gap(value, least))
    return gaps


def _ranked(gaps: Mapping[str, Sequence[float]]) -> list[tuple[int, tuple[str, Sequence[float]]]]:
    """The methods with their gaps, least mean first, each with the number of its look, the same in both pictures."""
    looks = {method: number for number, method in enumerate(sorted(gaps))}
    ranked = sorted(gaps.items(), key=lambda pair: float(np.mean(pair[1])))
    return [(looks[method], (method, values)) for method, values in ranked]


def _look(number: int) -> dict[str, Any]:
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": DASHES[number // len(COLOURS) % len(DASHES)],
        "linewidth": 1.5,
    }
