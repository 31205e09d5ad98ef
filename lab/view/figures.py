"""Figures that agree: what differs looks different, and a gap that is not zero is not shown as zero."""

from lab.sequencing.cell.cell import EVERY_PLAN

MOST_DECIMALS = 6
SAME = 1e-9  # what differs by less, as a fraction, is the same: sums are rounded
NEAR = 0.1  # a gap worked out from the figures shown is off by this share of the true one, at most


def beside(cost: float, bound: float, unit: str, decimals: int) -> tuple[str, str]:
    """A cost and its bound as text, with `decimals`, or with as many more as let the figures shown tell their true gap."""
    while decimals < MOST_DECIMALS and not _agree(cost, bound, decimals):
        decimals += 1
    return f"{cost:.{decimals}f}{unit}", f"{bound:.{decimals}f}{unit}"


def _agree(cost: float, bound: float, decimals: int) -> bool:
    """Whether both figures, rounded, lie as far apart as they really do; what is the same may look so."""
    apart = cost - bound
    if abs(apart) <= SAME * max(abs(cost), abs(bound)):
        return f"{cost:.{decimals}f}" == f"{bound:.{decimals}f}"
    shown = round(cost, decimals) - round(bound, decimals)
    return abs(shown - apart) <= NEAR * abs(apart)


def gap_of(gap: float, decimals: int) -> str:
    """A gap, a fraction, in percent, with as many more decimals as show that it is not zero."""
    if abs(gap) < SAME:
        return f"{0:.{decimals}%}"
    while decimals < MOST_DECIMALS and float(f"{gap:.{decimals}%}"[:-1]) == 0.0:
        decimals += 1
    return f"{gap:.{decimals}%}"


def among(of: str) -> str:
    """Of which plans something is proven, where these are not all (see `Cell.proven_of`): ", among ...", else ""."""
    return "" if of == EVERY_PLAN else f", among {of}"
