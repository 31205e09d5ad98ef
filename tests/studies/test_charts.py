"""The studies' pictures: valid, alike for like data, of the right things, and refused when the data do not fit."""

from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.studies import charts
from lab.studies.charts import bars, convergence, scores, success_by_beta
from lab.view.canvas import BLUE, INK, ORANGE, RED, SKY

STEPS = [201] * 20 + [40, 30, 60, 20] * 5 + [13] * 20
GUIDED = [False] * 25 + [True] * 5 + [False] * 30


def draw_beta(**options: Any) -> bytes:
    curves = {"world I": [(0.5, 20, 12, 30), (1.3, 62, 52, 71)], "world II": [(0.7, 37, 28, 47)]}
    return success_by_beta(curves, {"world I": (1.3, 63), "world II": (0.7, 37)}, **options)


def draw_session(**options: Any) -> bytes:
    return convergence(STEPS, GUIDED, 13, threshold=0.05, title="world I", **options)


def draw_bars(**options: Any) -> bytes:
    values = np.array([[65, 55], [75, np.nan]])
    intervals = np.stack([values - 5, values + 5], axis=-1)
    return bars(["expert", "novice"], ["Ω = 1", "Ω = 7"], values, intervals, "SP [%]", **options)


def draw_scores(**options: Any) -> bytes:
    ranks = [["2", "1-2"], ["1", "1"]]
    return scores(["expert", "all"], ["IA", "combined"], [[0.96, 0.77], [1, 0.88]], ranks, **options)


PICTURES: dict[str, Callable[..., bytes]] = {
    "beta": draw_beta,
    "session": draw_session,
    "bars": draw_bars,
    "scores": draw_scores,
}


@pytest.mark.parametrize("name", PICTURES)
def test_same_data_same_bytes_in_both_forms(name: str) -> None:
    picture = PICTURES[name]()
    assert picture == PICTURES[name]()
    assert ElementTree.fromstring(picture).tag.endswith("svg")
    assert b"<dc:date>" not in picture
    assert PICTURES[name](form="png").startswith(b"\x89PNG")


@pytest.mark.parametrize("name", PICTURES)
def test_a_form_that_is_not_known(name: str) -> None:
    with pytest.raises(BadInput, match="picture as 'jpeg': known: svg, png"):
        PICTURES[name](form="jpeg")


@pytest.mark.parametrize("name", PICTURES)
def test_the_global_style_is_left_alone(name: str) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    PICTURES[name]()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize(
    ("name", "colours"),
    [
        ("beta", {BLUE, ORANGE, INK}),
        ("session", {BLUE, ORANGE, RED}),
        ("bars", {BLUE, ORANGE, INK}),
        ("scores", {BLUE, ORANGE}),
    ],
)
def test_colours(name: str, colours: set[str]) -> None:
    picture = PICTURES[name]().decode().upper()
    assert all(colour in picture for colour in colours)
    assert SKY not in picture  # a third series


def texts(picture: bytes) -> list[str]:
    """What stands in an SVG picture: matplotlib writes each text as a comment beside its outlines."""
    return [part.partition("-->")[0].strip() for part in picture.decode().split("<!--")[1:]]


def test_what_is_written() -> None:
    assert {"world I", "world II", "printed"} <= {*texts(draw_beta())}
    assert {"guided episodes", "fewest possible: 13", "asks below Λ = 0.05", "world I"} <= {*texts(draw_session())}
    assert {"expert", "novice", "Ω = 1", "Ω = 7", "SP [%]"} <= {*texts(draw_bars())}
    assert "printed" not in texts(draw_bars())
    assert texts(draw_bars(printed=[[60, 50], [70, 60]]))[-1] == "printed"  # last in the legend
    found = texts(draw_scores())
    assert [label for label in found if label in ("1", "2", "1-2")] == ["2", "1-2", "1", "1"]


def test_the_rate_is_the_one_that_the_learner_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    """K = 1: the rate before episode 3 is 1 - 5/10, before episode 4 is 1 - 20/5 = -3, below the plot's edge."""
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    charts._draw_rate(axes, [10, 5, 20, 1], 1, None)
    rate, cut = axes.get_lines()[:2]
    assert np.asarray(rate.get_xydata()).tolist() == [[3, 0.5], [4, -3]]
    assert np.asarray(cut.get_xydata()).tolist() == [[4, charts.LOWEST_RATE]]


def test_bars_stand_side_by_side() -> None:
    """Two series in a group .8 wide: bars .4 wide, their middles at -.2 and .2."""
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    for number, x in enumerate((-0.2, 0.2)):
        ends = np.array([[1.0, 3.0]])
        charts._draw_series(axes, np.array([x]), 0.4, number, "name", np.array([2.0]), ends)
    assert [patch.get_x() for patch in axes.patches] == pytest.approx([-0.4, 0.0])  # type: ignore[attr-defined]


@settings(max_examples=10)
@given(steps=st.lists(st.integers(1, 201), min_size=1, max_size=30), data=st.data())
def test_any_session(steps: list[int], data: st.DataObject) -> None:
    guided = data.draw(st.lists(st.booleans(), min_size=len(steps), max_size=len(steps)))
    assert convergence(steps, guided, 1).startswith(b"<?xml")


@settings(max_examples=10)
@given(data=st.data(), series=st.integers(1, 6), groups=st.integers(1, 5))
def test_any_bars(data: st.DataObject, series: int, groups: int) -> None:
    """Zeros, nothing, any number of series that has a colour."""
    value = st.floats(0, 1e4) | st.just(np.nan)
    line = st.lists(value, min_size=groups, max_size=groups)
    values = data.draw(st.lists(line, min_size=series, max_size=series))
    names = [f"series {n}" for n in range(series)]
    assert bars([*map(str, range(groups))], names, values, None, "y", printed=values).startswith(b"<?xml")


@pytest.mark.parametrize(
    ("draw", "says"),
    [
        (lambda: success_by_beta({}), "every curve needs a point"),
        (lambda: success_by_beta({"world I": []}), "every curve needs a point"),
        (lambda: success_by_beta({str(n): [(1, 2, 1, 3)] for n in range(7)}), "7 series: allowed 1 to 6"),
        (lambda: convergence([], [], 5), "0 episodes, 0 marks"),
        (lambda: convergence([5, 5], [True], 5), "2 episodes, 1 marks"),
        (lambda: bars(["a"], [], [], None, "y"), "0 series: allowed 1 to 6"),
        (lambda: bars(["a"], ["x"], [[1, 2]], None, "y"), r"values of shape \(1, 2\); needed: \(1, 1\)"),
        (lambda: bars(["a"], ["x"], [[1]], [[1, 2]], "y"), r"intervals of shape \(1, 2\); needed: \(1, 1, 2\)"),
        (lambda: bars(["a"], ["x"], [[1]], None, "y", printed=[1]), r"printed figures of shape \(1,\)"),
        (lambda: scores(["a"], ["x"], [[1]], [["1", "2"]]), "labels do not fit 1 series of 1 groups"),
    ],
)
def test_data_that_do_not_fit(draw: Callable[[], bytes], says: str) -> None:
    with pytest.raises(BadInput, match=says):
        draw()
