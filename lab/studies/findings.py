"""What a study comes to: rows, each a measured value beside what is printed, and what is said and drawn of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lab.sequencing.search import SAME
from lab.statistics import interval, mean_error, share, share_error, within, within_errors
from lab.studies.counted_apart import in_short, ranked

# settings under their names, then measure, value, ci95, thesis, within; where known also within_errors, used, easy
Row = dict[str, Any]


@dataclass(frozen=True)
class Findings:
    """Rows as `lab study run --json` gives them, a summary, pictures (SVG) by caption, remarks, texts by file name."""

    rows: list[Row]
    summary: Row
    figures: Mapping[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)


def row(
    named: Row,
    measure: str,
    value: float,
    ci: Sequence[float] | None = None,
    thesis: float | None = None,
    errors: tuple[float, float] | None = None,
) -> Row:
    """One row of a study: its settings, the measured value with its interval, the printed one, whether they agree.

    errors: the standard errors of both, where the thesis says how many sessions it ran.
    """
    ends = None if ci is None else [float(ci[0]), float(ci[1])]
    agrees = None if thesis is None else within(value, ends, thesis, measure)
    found = {**named, "measure": measure, "value": float(value), "ci95": ends, "thesis": thesis, "within": agrees}
    if thesis is not None and errors is not None:
        found["within_errors"] = within_errors(value, thesis, errors)
    return found


def share_row(
    named: Row, measure: str, success: ArrayLike, thesis: float | None = None, theirs: int | None = None
) -> Row:
    """The row of how many sessions succeeded, (N,) bool, in percent; theirs: sessions of the thesis."""
    percent, *ends = share(success)
    if thesis is None or theirs is None:
        return row(named, measure, percent, ends, thesis)
    return row(
        named, measure, percent, ends, thesis, (share_error(percent, np.size(success)), share_error(thesis, theirs))
    )


def mean_row(
    named: Row, measure: str, values: ArrayLike, thesis: float | None = None, theirs: float | None = None
) -> Row:
    """The row of the mean of values (N,), one a session; theirs: how many such values the thesis had, spread alike."""
    mean, *ends = interval(values)
    errors = None if theirs is None else (mean_error(values), mean_error(values, theirs))
    return row(named, measure, mean, ends, thesis, errors)


def varying_row(named: Row, measure: str, values: ArrayLike) -> Row:
    """The row of the mean of values (N,); without an interval where nothing varies."""
    found = np.asarray(values, np.float64)
    return row(named, measure, found.mean()) if np.ptp(found) <= SAME else mean_row(named, measure, found)


def median_row(named: Row, measure: str, values: Sequence[float]) -> Row:
    """The row of the median of a few values; its interval: the lowest and the highest."""
    return row(named, measure, median(values), (min(values), max(values)))


def those(rows: Iterable[Row], **wanted: Any) -> list[Row]:
    """The rows that have these values under these names; None: they have none."""
    return [one for one in rows if all(one.get(name) == value for name, value in wanted.items())]


def agreement(rows: Sequence[Row]) -> Row:
    """How many cells have a printed figure and how many lie within its bounds, in all and by measure."""
    compared = [one for one in rows if one["within"] is not None]
    summary: Row = {"cells": len(compared), "within": sum(one["within"] for one in compared)}
    for measure in dict.fromkeys(one["measure"] for one in compared):
        of = [one["within"] for one in those(compared, measure=measure)]
        summary[f"{measure} cells"], summary[f"{measure} within"] = len(of), sum(of)
    scores = [one for one in those(rows, measure="score") if one.get("thesis_rank")]
    return summary | in_short(compared) | (ranked(scores) if scores else {})
