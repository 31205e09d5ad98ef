"""Agreement that shows something, counted apart from agreement that shows little.

A cell was `used` to choose what the thesis leaves open, or not; it is `easy` when nearly anything would agree with it;
and it may agree by a rule that is the same for all cells, or within the sampling errors of both figures.
"""

from collections.abc import Iterable, Sequence
from itertools import permutations
from math import comb
from statistics import mean
from typing import Any

from lab.statistics import allowed

Row = dict[str, Any]  # of a study, see `findings`

JUDGED = ("within", "within_errors", "used", "easy")  # what a row with a printed figure is said to be
TABLE = ("table", "environment", "case", "toasts", "world", "view")  # rows that agree in these are one printed table
PARTS = {"not used": False, "used to choose": True}


def marked(rows: Iterable[Row]) -> list[Row]:
    """The rows; those with a printed figure also say whether it is `easy`: more than half of the other figures that
    its table prints of the same measure lie within what counts as agreeing with it (`statistics.allowed`).
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
    """Rows that say whether they were used, by what their agreement shows: not used, used to choose, easy."""
    told = [one for one in rows if one.get("used") is not None]
    parts = {name: [one for one in told if one["used"] == used and not one.get("easy")] for name, used in PARTS.items()}
    return {**parts, "easy": [one for one in told if one.get("easy")]} if told else {}


def share(rows: Iterable[Row], judged: str = "within") -> str:
    """ "3 of 4 agree", of the rows for which that is known."""
    known = [one[judged] for one in rows if one.get(judged) is not None]
    return f"{sum(known)} of {len(known)} agree"


def in_short(rows: Sequence[Row]) -> Row:
    """The lines of a summary: agreement of what was used and what was not, by both rules, and of easy cells."""
    parts = counts(rows)
    if not parts:
        return {}
    easy = parts.pop("easy")
    return {
        "headline": "; ".join(f"{name}: {share(of)}" for name, of in parts.items() if of) or "all cells are easy",
        "within both sampling errors": "; ".join(
            f"{name}: {share(of, 'within_errors')}" for name, of in parts.items() if of
        ),
        "easy, left out of both": share(easy),
    }


def middle(rank: str) -> float:
    """A printed rank as a number: "2" is 2, "1-2" and "1,2" are 1.5."""
    return mean(float(number) for number in rank.replace("-", ",").split(","))


def ordered(groups: Iterable[Sequence[tuple[float, str]]]) -> tuple[int, int, float]:
    """Pairs of a group that the thesis ranks differently and we order as it does, of how many, and p by chance.

    groups: (our value, the printed rank) of what is ranked together, the best having the highest value. By chance half of
    the pairs are right; p: that so many or more are when the values of each group are shuffled, counted exactly.
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
    """The lines of a summary about ranks, beside what chance gives; rows with `rank` and `thesis_rank`."""
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
