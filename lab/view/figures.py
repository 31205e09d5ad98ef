"""Figures that agree: what differs looks different, and a gap that is not zero is not shown as zero."""

MOST_DECIMALS = 6
SAME = 1e-9  # what differs by less, as a fraction, is the same: sums are rounded


def beside(cost: float, bound: float, unit: str, decimals: int) -> tuple[str, str]:
    """A cost and its bound as text, with `decimals`, or with as many more as make them look different when they are."""
    if abs(cost - bound) > SAME * max(abs(cost), abs(bound)):
        while decimals < MOST_DECIMALS and f"{cost:.{decimals}f}" == f"{bound:.{decimals}f}":
            decimals += 1
    return f"{cost:.{decimals}f}{unit}", f"{bound:.{decimals}f}{unit}"


def gap_of(gap: float, decimals: int) -> str:
    """A gap, a fraction, in percent, with as many more decimals as show that it is not zero."""
    if abs(gap) < SAME:
        return f"{0:.{decimals}%}"
    while decimals < MOST_DECIMALS and float(f"{gap:.{decimals}%}"[:-1]) == 0.0:
        decimals += 1
    return f"{gap:.{decimals}%}"
