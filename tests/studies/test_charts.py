"""What the studies' pictures share: valid, alike for like data, of the right things, refused when the data do not fit."""

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.studies.charts import bars, curve, legend_below
from lab.studies.findings import Row, row
from lab.view.canvas import BLUE, INK, ORANGE, SKY, picture_bytes

GROUPS = ["expert", "novice"]


def line(*values: float, printed: float | None = None) -> list[Row]:
    """A row for each group, the interval 5 to either side."""
    ranks = ("2", "1-2")
    return [
        row({"rank": rank}, "SP_percent", value, (value - 5, value + 5), printed)
        for rank, value in zip(ranks, values, strict=True)
    ]


def texts(picture: bytes) -> list[str]:
    """What stands in an SVG picture."""
    return [text.strip() for text in ElementTree.fromstring(picture).itertext() if text.strip()]


def test_same_data_same_bytes_of_the_right_colours() -> None:
    import matplotlib

    before, lines = dict(matplotlib.rcParams), {"Ω = 1": line(65, 55), "Ω = 7": line(75, 60)}
    picture = bars(GROUPS, lines, "SP [%]")
    assert picture == bars(GROUPS, lines, "SP [%]")
    assert dict(matplotlib.rcParams) == before
    assert all(colour in picture.decode().upper() for colour in (BLUE, ORANGE, INK))
    assert SKY not in picture.decode().upper()  # a third series
    assert {*GROUPS, *lines, "SP [%]"} <= {*texts(picture)}
    assert "printed" not in texts(picture)


def test_what_is_printed_stands_last_in_the_legend_and_labels_on_the_bars() -> None:
    found = texts(bars(GROUPS, {"IA": line(65, 55, printed=60), "both": line(75, 60)}, "score", label="rank"))
    assert found[-1] == "printed"
    assert [word for word in found if word in ("2", "1-2")] == ["2", "1-2"] * 2


def test_a_curve_has_its_band() -> None:
    """Values 1 and 3 at beta .5 and 1, the first with an interval."""
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    curve(axes, [row({"beta": 0.5}, "x", 1, (0, 2)), row({"beta": 1.0}, "x", 3)], "beta", (BLUE, "o", "name"))
    (drawn,), (band,) = axes.get_lines(), axes.collections
    assert np.asarray(drawn.get_xydata()).tolist() == [[0.5, 1], [1.0, 3]]
    corners = {tuple(corner) for corner in band.get_paths()[0].vertices.tolist()}  # type: ignore[union-attr]
    assert corners == {(0.5, 0.0), (0.5, 2.0), (1.0, 3.0)}


def test_a_legend_names_everything_once() -> None:
    def draw(figure: Any) -> None:
        for axes in figure.subplots(1, 2):
            axes.plot([1, 2], label="same")
        legend_below(figure)

    assert texts(picture_bytes(draw, 4, 3)).count("same") == 1


@settings(max_examples=4)
@given(data=st.data(), series=st.integers(1, 6), groups=st.integers(1, 5))
def test_any_bars(data: st.DataObject, series: int, groups: int) -> None:
    """Zeros, nothing, any number of series that has a colour."""
    value = st.floats(0, 1e4) | st.none()
    made = st.builds(lambda value, thesis: {"value": value, "ci95": None, "thesis": thesis}, value, value)
    lines = {f"series {n}": data.draw(st.lists(made, min_size=groups, max_size=groups)) for n in range(series)}
    assert bars([*map(str, range(groups))], lines, "y").startswith(b"<?xml")


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ({}, "0 series: allowed 1 to 6"),
        ({str(n): line(1, 2) for n in range(7)}, "7 series: allowed 1 to 6"),
        ({"a": line(1, 2), "b": line(1, 2)[:1]}, r"\[2, 1\] rows of the series; needed: 2 of each"),
    ],
)
def test_data_that_do_not_fit(lines: dict[str, Sequence[Row]], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        bars(GROUPS, lines, "y")
