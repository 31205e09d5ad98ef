"""The pictures of a comparison: how many sessions are solved and what advice they took, and the learning curves."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.statistics import interval, share
from lab.studies.charts import legend_below
from lab.studies.findings import Row
from lab.view.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, RED, SKY, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lab.studies.compared_sessions import Sessions

Result = tuple[Row, "Sessions"]
COLOURS = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY, GREY)
DASHES = ("-", "--", ":", "-.")
MOST_CURVES = 12  # more cannot be told apart
MOST_DOTS = 60  # lines of text of a picture


def figures(results: Sequence[Result]) -> dict[str, bytes]:
    """By caption, as SVG; of many settings the first, which the caption says."""
    ranked = sorted(results, key=lambda one: (-one[1].solved.mean(), one[1].mean_steps.mean()))
    most = "" if len(ranked) <= MOST_DOTS else f", the best {MOST_DOTS} of {len(ranked)} settings"
    several = "" if len(ranked) <= MOST_CURVES else f", the best {MOST_CURVES} of {len(ranked)} settings"
    return {
        f"Sessions that are solved in the end, steps and helped steps, with intervals{most}": _dots(ranked[:MOST_DOTS]),
        f"Mean steps of each episode{several}": _curves(ranked[:MOST_CURVES]),
    }


def words(named: Row, among: Sequence[Row]) -> str:
    """A setting by what differs among several: "ccrl, expert, psi 0.1"."""
    varies = [name for name in named if len({repr(one[name]) for one in among}) > 1] or [*named][:1]
    plain = ("advisor", "gate", "learner", "selection")
    return ", ".join(str(named[name]) if name in plain else f"{name} {named[name]}" for name in varies)


def _dots(results: Sequence[Result]) -> bytes:
    """A line a setting, a column a measure."""
    names = [words(named, [other for other, _ in results]) for named, _ in results]

    def draw(figure: "Figure") -> None:
        columns = figure.subplots(1, 3, sharey=True)
        measured: list[tuple[str, list[Any]]] = [
            ("solved [%]", [share(found.solved) for _, found in results]),
            ("mean steps of an episode", [_mean(found.mean_steps) for _, found in results]),
            ("helped steps of a session", [_mean(found.helped_steps) for _, found in results]),
        ]
        for axes, (title, values) in zip(columns, measured, strict=True):
            for line, (middle, low, high) in enumerate(values):
                axes.hlines(line, low, high, color=BLUE, linewidth=1.6)
                axes.plot(middle, line, "o", color=BLUE, markersize=4)
            axes.set_title(title)
            axes.grid(axis="x")
            axes.set_xlim(left=0)
        columns[0].set_xlim(0, 103)
        columns[0].set_yticks(range(len(names)), names)
        columns[0].set_ylim(len(names) - 0.5, -0.5)

    return picture_bytes(draw, 9.5, 0.9 + 0.24 * len(results))


def _mean(values: Any) -> tuple[float, float, float]:
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0]), float(values[0])
    return interval(values)


def _curves(results: Sequence[Result]) -> bytes:
    def draw(figure: "Figure") -> None:
        axes: Axes = figure.add_subplot()
        for n, (named, found) in enumerate(results):
            name = words(named, [other for other, _ in results])
            look: dict[str, Any] = {"color": COLOURS[n % len(COLOURS)], "linestyle": DASHES[n // len(COLOURS)]}
            axes.plot(np.arange(1, len(found.curve) + 1), found.curve, label=name, linewidth=1.3, **look)
        axes.set(xlabel="episode", ylabel="steps", ylim=(0, None))
        axes.yaxis.label.set_color(INK)
        axes.grid(axis="y")
        legend_below(figure)

    return picture_bytes(draw, 8.0, 4.2)
