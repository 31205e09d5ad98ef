"""The learning curves of a lesson as a drawing of lines: points in a picture, which a report's template writes as SVG."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, isfinite, log10
from statistics import median
from typing import Literal

WIDE, HIGH = 700.0, 270.0  # of the picture, in its own unit
LEFT, RIGHT, TOP, BOTTOM = 52.0, 12.0, 12.0, 40.0  # margins
MOST_BLOCKS = 80  # points of a curve; of a longer one each is the mean of a block of episodes
MOST_TICKS = 6
STEEP = 4.0  # with values so many times as large as the least, the axis is logarithmic
Kind = Literal["believed", "dropped", "open", "best", "own", "middle"]  # of a line, which styles it
Point = tuple[float, float, bool]  # the middle of a block [episodes], its mean, whether an episode of it was advised
Curve = Sequence[tuple[float, bool]]  # of each episode its steps or cost, and whether it was advised


@dataclass(frozen=True)
class ChartLine:
    """A line of a chart: its points "x,y x,y", whose it is, and the points of the advised blocks."""

    kind: Kind
    name: str
    points: str
    advised: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Chart:
    """A chart; x_ticks, y_ticks: places on the axes with their text; best_y: of the fewest steps possible, None if unknown."""

    lines: tuple[ChartLine, ...]
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    best_y: float | None
    block: int  # episodes a point

    wide, high, left, right, bottom = WIDE, HIGH, LEFT, WIDE - RIGHT, HIGH - BOTTOM


@dataclass(frozen=True)
class Middle:
    """The median of several curves: its points, of blocks of so many episodes."""

    block: int
    points: tuple[Point, ...]


def middle_of(curves: Sequence[Curve]) -> Middle | None:
    """The median of the curves, as far as half of them reach; None for fewer than two with an episode."""
    known = [finite for curve in curves if (finite := _finite(curve))]
    if len(known) < 2:
        return None
    block = _block(max(map(len, known)))
    parts = [_blocks(curve, block) for curve in known]
    longest, enough = max(parts, key=len), ceil(len(parts) / 2)
    there = [[part[k][1] for part in parts if k < len(part)] for k in range(len(longest))]
    points = [(longest[k][0], median(values), False) for k, values in enumerate(there) if len(values) >= enough]
    return Middle(block, tuple(points))


def chart_of(
    curves: Sequence[tuple[Kind, str, Curve]],
    best: float | None,
    middle: Middle | None = None,
    *,
    from_zero: bool = True,
) -> Chart | None:
    """The chart of several curves, each (kind, name, values); None if none of them has an episode.

    best: the least value possible; middle: the median of the curves, or of more than these; from_zero: whether a linear axis
    begins at 0.
    """
    known = [(kind, name, finite) for kind, name, curve in curves if (finite := _finite(curve))]
    if not known:
        return None
    longest = max(len(curve) for _, _, curve in known)
    block = _block(longest) if middle is None else middle.block
    drawn = [(kind, name, _blocks(curve, block)) for kind, name, curve in known]
    if middle is not None:
        drawn.append(("middle", "median of all", [point for point in middle.points if point[0] <= longest]))
    values = [value for _, _, points in drawn for _, value, _ in points] + ([] if best is None else [best])
    x_axis, y_axis = _Axis(0.0, float(longest), LEFT, WIDE - RIGHT, False), _y_axis(values, from_zero)
    lines = []
    for kind, name, points in drawn:
        placed = [(x_axis.place(x), y_axis.place(value), advised) for x, value, advised in points]
        advised = tuple((x, y) for x, y, is_advised in placed if is_advised)
        lines.append(ChartLine(kind, name, " ".join(f"{x:g},{y:g}" for x, y, _ in placed), advised))
    best_y = None if best is None else y_axis.place(best)
    return Chart(tuple(lines), x_axis.ticks(), y_axis.ticks(), best_y, block)


def _finite(curve: Curve) -> Curve:
    """The values that can be drawn."""
    return [one for one in curve if isfinite(one[0])]


def _block(episodes: int) -> int:
    """The episodes a point, for a curve of so many."""
    return ceil(episodes / MOST_BLOCKS)


def _blocks(curve: Curve, block: int) -> list[Point]:
    """The means of blocks of episodes; the last block may be shorter."""
    points = []
    for first in range(0, len(curve), block):
        part = curve[first : first + block]
        mean = sum(value for value, _ in part) / len(part)
        points.append((first + (len(part) + 1) / 2, mean, any(advised for _, advised in part)))
    return points


@dataclass(frozen=True)
class _Axis:
    """An axis from `low` to `high`, which are at the places `begin` and `end` of the picture."""

    low: float
    high: float
    begin: float
    end: float
    is_log: bool

    def place(self, value: float) -> float:
        """The place of a value, with one decimal."""
        low, high, at = self.low, self.high, value
        if self.is_log:
            low, high, at = log10(low), log10(high), log10(max(value, low))
        return round(self.begin + (at - low) / ((high - low) or 1.0) * (self.end - self.begin), 1)

    def ticks(self) -> tuple[tuple[float, str], ...]:
        """The places and texts of round values."""
        round_values = _log_ticks(self.low, self.high) if self.is_log else _ticks(self.low, self.high)
        return tuple((self.place(value), f"{value:.10g}") for value in round_values)


def _y_axis(values: Sequence[float], from_zero: bool) -> _Axis:
    low, high = min(values), max(values)
    begin, end = HIGH - BOTTOM, TOP
    if low > 0 and from_zero and high > STEEP * low:
        return _Axis(low * 0.9, high * 1.05, begin, end, True)
    low = min(0.0, low) if from_zero else low - 0.05 * (high - low or abs(high) or 1.0)
    return _Axis(low, high + 0.05 * (high - low or 1.0), begin, end, False)


def _ticks(low: float, high: float) -> list[float]:
    """At most MOST_TICKS round values of an interval: 1, 2 or 5 times a power of ten apart."""
    rough = (high - low) / MOST_TICKS
    size = 10.0 ** floor(log10(rough))
    step = next(step for step in (size, 2 * size, 5 * size, 10 * size) if step >= rough * (1 - 1e-9))
    return [round(k * step, 10) for k in range(ceil(low / step), floor(high / step) + 1)]


def _log_ticks(low: float, high: float) -> list[float]:
    """The values 1, 2, 5 times powers of ten of an interval, or the powers alone if there are too many."""
    powers = range(floor(log10(low)), ceil(log10(high)) + 1)
    for steps in ((1, 2, 5), (1,)):
        values = [step * 10.0**power for power in powers for step in steps if low <= step * 10.0**power <= high]
        if len(values) <= MOST_TICKS:
            break
    return values
