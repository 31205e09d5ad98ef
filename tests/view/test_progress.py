"""Learning curves in the width of a line."""

from hypothesis import given
from hypothesis import strategies as st

from lab.view.progress import BARS, PLAIN_BARS, sparkline


def test_a_curve_by_hand() -> None:
    assert sparkline([8, 8, 4, 4, 2, 2, 1, 1], 4) == "█▅▃▂"
    assert sparkline([8, 4], 4) == "██▅▅"
    assert sparkline([5], 3) == "███"
    assert sparkline([], 3) == "   "
    assert sparkline([8, 1], 2, PLAIN_BARS) == "#."


@given(st.lists(st.integers(1, 1000), min_size=1, max_size=400), st.integers(1, 60))
def test_a_curve_has_its_width_and_its_peak(steps: list[int], width: int) -> None:
    curve = sparkline(steps, width)
    assert len(curve) == width
    assert set(curve) <= set(BARS)
    assert BARS[-1] in curve
