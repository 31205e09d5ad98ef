"""Figures that stand side by side: what differs looks different."""

import pytest

from lab.view.figures import beside, gap_of


@pytest.mark.parametrize(
    ("cost", "bound", "text"),
    [
        (118.9, 118.8, ("118.9 s", "118.8 s")),
        (118.84, 118.8, ("118.84 s", "118.80 s")),
        (118.851, 118.849, ("118.851 s", "118.849 s")),  # with one decimal 118.9 s and 118.8 s
        (110.0, 100.0, ("110.0 s", "100.0 s")),
        (29.37, 28.11, ("29.4 s", "28.1 s")),
        (118.8, 118.8, ("118.8 s", "118.8 s")),
        (118.8 + 1e-12, 118.8, ("118.8 s", "118.8 s")),
        (0.0, 0.0, ("0.0 s", "0.0 s")),
        (1.0000001, 1.0, ("1.000000 s", "1.000000 s")),
    ],
)
def test_decimals_until_they_differ(cost: float, bound: float, text: tuple[str, str]) -> None:
    assert beside(cost, bound, " s", 1) == text


@pytest.mark.parametrize(
    ("gap", "text"),
    [(0.0, "0.0%"), (0.1, "10.0%"), (0.0004, "0.04%"), (0.00001, "0.001%"), (-5e-12, "0.0%")],
)
def test_a_gap_that_is_there_is_not_nothing(gap: float, text: str) -> None:
    assert gap_of(gap, 1) == text
