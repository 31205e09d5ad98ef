"""The findings of a study: rows of measured and printed values, and summaries of their agreement, in values and in ranks."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from math import comb
from statistics import mean, median
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lab.sequencing.search import SAME
from lab.statistics import allowed, interval, mean_error, share, share_error, within, within_errors

Row = dict[str, Any]  # see `row`

JUDGED = ("within", "within_errors", "used", "easy")  # the judgements of a row with a printed figure
TABLE = (
    "table",
    "environment",
    "case",
    "toasts",
    "world",
    "view",
)  # rows with equal values here belong to the same printed table
PARTS = {"not used": False, "used to choose": True}


def marked(rows: Iterable[Row]) -> list[Row]:
    """The rows; those with a printed figure also say whether that is `easy` to reproduce.

    It is if more than half of the other figures that its table prints for the same measure agree with it (`statistics.allowed`).
    """
    rows = list(rows)
    tables: dict[tuple[Any, ...], list[float]] = {}
    for one in rows:
        if one["thesis"] is not None:
            tables.setdefault(_table(one), []).append(one["thesis"])
    return [one if one["thesis"] is None else {**one, "easy": _is_easy(one, tables[_table(one)])} for one in rows]


def _table(row: Row) -> tuple[Any, ...]:
    return (row["measure"], *(row.get(name) for name in TABLE))


def _is_easy(row: Row, printed: Sequence[float]) -> bool:
    room: float = allowed(row["thesis"], row["measure"])
    hit: int = sum(abs(other - row["thesis"]) <= room for other in printed) - 1  # without itself
    return 2 * hit > len(printed) - 1


def counts(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows that say whether they were used to choose settings, in three groups: not used, used to choose, easy."""
    told = [one for one in rows if one.get("used") is not None]
    parts = {name: [one for one in told if one["used"] == used and not one.get("easy")] for name, used in PARTS.items()}
    return {**parts, "easy": [one for one in told if one.get("easy")]} if told else {}


def share_within(rows: Iterable[Row], judged: str = "within") -> str:
    """The agreement of the rows for which it is known, such as "3 of 4 agree"."""
    known = [one[judged] for one in rows if one.get(judged) is not None]
    return f"{sum(known)} of {len(known)} agree"


def in_short(rows: Sequence[Row]) -> Row:
    """The summary of agreement: of rows that were used and that were not, by both rules, and of easy ones."""
    parts = counts(rows)
    if not parts:
        return {}
    easy = parts.pop("easy")
    return {
        "headline": "; ".join(f"{name}: {share_within(of)}" for name, of in parts.items() if of)
        or "all cells are easy",
        "within both sampling errors": "; ".join(
            f"{name}: {share_within(of, 'within_errors')}" for name, of in parts.items() if of
        ),
        "easy, left out of both": share_within(easy),
    }


def middle(rank: str) -> float:
    """A printed rank as a number: "2" is 2, "1-2" and "1,2" are 1.5."""
    return mean(float(number) for number in rank.replace("-", ",").split(","))


def ordered(groups: Iterable[Sequence[tuple[float, str]]]) -> tuple[int, int, float]:
    """(right, pairs, p): of the pairs with different printed ranks, how many the measured values order alike, and p by chance.

    groups: (measured value, printed rank) of each member of a group that is ranked together; the best has the highest value.
    p: the exact probability of at least as many right pairs if the values of each group are shuffled.
    """
    right, pairs, ways = 0, 0, {0: 1.0}  # chance of so many right pairs
    for group in groups:
        values, ranks = [value for value, _ in group], [middle(rank) for _, rank in group]
        right += _right(values, ranks)
        pairs += comb(len(ranks), 2) - sum(comb(ranks.count(rank), 2) for rank in {*ranks})
        shuffled = [_right(order, ranks) for order in permutations(values)]
        ways = {
            total: sum(chance * shuffled.count(total - before) / len(shuffled) for before, chance in ways.items())
            for total in range(pairs + 1)
        }
    return right, pairs, sum(chance for total, chance in ways.items() if total >= right)


def _right(values: Sequence[float], ranks: Sequence[float]) -> int:
    each = range(len(ranks))
    return sum(ranks[one] < ranks[other] and values[one] > values[other] for one in each for other in each)


def ranked(rows: Sequence[Row]) -> Row:
    """The summary of agreement in ranks, with the values expected by chance; rows with `rank` and `thesis_rank`."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for one in rows:
        groups.setdefault((*_table(one), one.get("tau")), []).append(one)
    by_chance = sum(
        sum(one["rank"] == other["thesis_rank"] for one in of for other in of) / len(of) for of in groups.values()
    )
    right, pairs, p = ordered([[(one["value"], one["thesis_rank"]) for one in of] for of in groups.values()])
    return {
        "ranks": len(rows),
        "ranks as printed": sum(one["rank"] == one["thesis_rank"] for one in rows),
        "ranks as printed by chance": round(by_chance, 1),
        "pairs in the printed order": f"{right} of {pairs} ({pairs / 2:g} by chance, p = {p:.2g})",
    }


# ---- the record, and the makers of its rows -------------------------------------------------------------------------


# settings under their names, then measure, value, ci95, thesis, within; where known also within_errors, used, easy


@dataclass(frozen=True)
class Findings:
    """The findings of a study.

    rows: as `lab study run --json` prints them, see `row`; summary: by name; figures: SVG pictures by caption; notes: remarks;
    files: texts by file name.
    """

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
    """One row of a study: the settings, then measure, value, ci95, thesis, within, and, with `errors`, within_errors.

    named: the settings by name; ci: the (low, high) 95 % interval; thesis: the printed value; errors: the standard errors of the
    measured and of the printed value, if the thesis says how many sessions it ran.
    """
    ends = None if ci is None else [float(ci[0]), float(ci[1])]
    agrees = None if thesis is None else within(value, ends, thesis, measure)
    cells = {**named, "measure": measure, "value": float(value), "ci95": ends, "thesis": thesis, "within": agrees}
    if thesis is not None and errors is not None:
        cells["within_errors"] = within_errors(value, thesis, errors)
    return cells


def share_row(
    named: Row, measure: str, success: ArrayLike, thesis: float | None = None, theirs: int | None = None
) -> Row:
    """The row of the share [%] of sessions that succeeded; success: (N,) bool; theirs: the number of sessions of the thesis."""
    percent, *ends = share(success)
    if thesis is None or theirs is None:
        return row(named, measure, percent, ends, thesis)
    return row(
        named, measure, percent, ends, thesis, (share_error(percent, np.size(success)), share_error(thesis, theirs))
    )


def mean_row(
    named: Row, measure: str, values: ArrayLike, thesis: float | None = None, theirs: float | None = None
) -> Row:
    """The row of the mean of values (N,), one per session; theirs: the number of values of the thesis, assumed to vary alike."""
    mean, *ends = interval(values)
    errors = None if theirs is None else (mean_error(values), mean_error(values, theirs))
    return row(named, measure, mean, ends, thesis, errors)


def varying_row(named: Row, measure: str, values: ArrayLike) -> Row:
    """The row of the mean of values (N,), without an interval if they are constant."""
    numbers = np.asarray(values, np.float64)
    return row(named, measure, numbers.mean()) if np.ptp(numbers) <= SAME else mean_row(named, measure, numbers)


def median_row(named: Row, measure: str, values: Sequence[float]) -> Row:
    """The row of the median of a few values; its interval is their range."""
    return row(named, measure, median(values), (min(values), max(values)))


def those(rows: Iterable[Row], **wanted: Any) -> list[Row]:
    """The rows with these values under these names; None selects rows without the name."""
    return [one for one in rows if all(one.get(name) == value for name, value in wanted.items())]


def agreement(rows: Sequence[Row]) -> Row:
    """The summary of agreement: how many rows have a printed figure and how many agree with it, in total and by measure."""
    compared = [one for one in rows if one["within"] is not None]
    summary: Row = {"cells": len(compared), "within": sum(one["within"] for one in compared)}
    for measure in dict.fromkeys(one["measure"] for one in compared):
        of = [one["within"] for one in those(compared, measure=measure)]
        summary[f"{measure} cells"], summary[f"{measure} within"] = len(of), sum(of)
    scores = [one for one in those(rows, measure="score") if one.get("thesis_rank")]
    return summary | in_short(compared) | (ranked(scores) if scores else {})
