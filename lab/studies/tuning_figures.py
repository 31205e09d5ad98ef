"""The pictures of tuning: what it gains session by session, which settings matter, and how the trials went."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lab.mdp import FloatArray
from lab.studies.tuning_search import Trial
from lab.view.canvas import BLUE, GREY, INK, ORANGE, picture_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures(trials: Sequence[Trial], importances: Mapping[str, float], gained: FloatArray) -> dict[str, bytes]:
    """By caption, as SVG; gained (N,): of each unseen session."""
    found = {"Gain of each session over the problem's own settings, on unseen seeds": _gain(gained)}
    if importances:
        found["Which settings the cost hangs on"] = _importance(importances)
    return found | {"Cost of each trial, and the best so far": _history(trials)}


def _gain(gained: FloatArray) -> bytes:
    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        axes.hist(gained, bins=30, color=BLUE)
        axes.axvline(0.0, color=INK, linewidth=1.0)
        axes.axvline(float(gained.mean()), color=ORANGE, linewidth=1.6, label="mean")
        axes.set_xlabel("steps an episode less than with its own settings")
        axes.set_ylabel("sessions")
        axes.legend()

    return picture_bytes(draw, 6.5, 3.0)


def _importance(importances: Mapping[str, float]) -> bytes:
    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        axes.barh(range(len(importances)), [100 * one for one in importances.values()], color=BLUE)
        axes.set_yticks(range(len(importances)), list(importances))
        axes.invert_yaxis()
        axes.set_xlabel("share of the importance [%]")

    return picture_bytes(draw, 6.5, 0.9 + 0.26 * len(importances))


def _history(trials: Sequence[Trial]) -> bytes:
    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for pruned, colour, name in ((True, GREY, "given up early"), (False, BLUE, "tried to the end")):
            shown = [one for one in trials if one.pruned == pruned and one.costs]
            axes.plot(
                [one.number for one in shown], [one.costs[-1] for one in shown], "o", ms=4, color=colour, label=name
            )
        ended = [one for one in trials if not one.pruned]
        best = np.minimum.accumulate([one.costs[-1] for one in ended])
        axes.step([one.number for one in ended], best, where="post", color=ORANGE, label="best so far")
        axes.set_xlabel("trial")
        axes.set_ylabel("cost [steps an episode]")
        axes.legend()

    return picture_bytes(draw, 6.5, 3.2)
