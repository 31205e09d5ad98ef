"""Numbers as text with enough decimals: different values look different, and a non-zero gap is never shown as zero."""

MOST_DECIMALS = 6
SAME = 1e-9  # relative difference below which values are equal up to rounding
NEAR = 0.1  # largest relative error of a gap that a reader computes from the numbers shown


def beside(cost: float, bound: float, unit: str, decimals: int) -> tuple[str, str]:
    """A cost and its bound as text, with `decimals`, or more if the gap would otherwise be misleading."""
    while decimals < MOST_DECIMALS and not _agree(cost, bound, decimals):
        decimals += 1
    return f"{cost:.{decimals}f}{unit}", f"{bound:.{decimals}f}{unit}"


def _agree(cost: float, bound: float, decimals: int) -> bool:
    """Whether the rounded numbers have the true gap up to NEAR; equal values may look equal."""
    apart = cost - bound
    if abs(apart) <= SAME * max(abs(cost), abs(bound)):
        return f"{cost:.{decimals}f}" == f"{bound:.{decimals}f}"
    shown = round(cost, decimals) - round(bound, decimals)
    return abs(shown - apart) <= NEAR * abs(apart)


def gap_of(gap: float, decimals: int) -> str:
    """A gap (a fraction) in percent, with more decimals if it would otherwise look like zero."""
    if abs(gap) < SAME:
        return f"{0:.{decimals}%}"
    while decimals < MOST_DECIMALS and float(f"{gap:.{decimals}%}"[:-1]) == 0.0:
        decimals += 1
    return f"{gap:.{decimals}%}"
