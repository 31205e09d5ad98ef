"""Pictures of sequencing: what they say, for one session and for many, and with deadlocks."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lab.errors import BadInput
from lab.view.sequencing_plots import sequence_plot

SVG = "{http://www.w3.org/2000/svg}"
COSTS = [30.0, 28.5, 29.0, 25.0, 27.0]


def words(svg: bytes) -> list[str]:
    """The texts and tooltips of an SVG picture."""
    root = ElementTree.fromstring(svg)
    return ["".join(e.itertext()) for e in root.iter() if e.tag in (f"{SVG}text", f"{SVG}title")]


def plotted(path: Path, costs: Any, optimal: float | None = 25.0, **how: Any) -> list[str]:
    sequence_plot(costs, optimal, path / "plot.svg", **how)
    return words((path / "plot.svg").read_bytes())


PLOTS: dict[str, Callable[[Path], None]] = {
    "session": lambda path: sequence_plot(COSTS, 25.0, path),
    "sessions": lambda path: sequence_plot([COSTS, COSTS[::-1]], 25.0, path),
}


@pytest.mark.parametrize("form", ["png", "svg"])
@pytest.mark.parametrize("name", PLOTS)
def test_same_data_same_bytes(tmp_path: Path, name: str, form: str) -> None:
    for file in (f"one.{form}", f"two.{form}"):
        PLOTS[name](tmp_path / file)
    assert (tmp_path / f"one.{form}").read_bytes() == (tmp_path / f"two.{form}").read_bytes()
    with pytest.raises(BadInput, match=r"plots are written as \.png or \.svg"):
        PLOTS[name](tmp_path / "plot.jpeg")


def test_one_session_says_what_was_found_and_when(tmp_path: Path) -> None:
    said = plotted(tmp_path, COSTS)
    assert {"each episode", "best so far: 25 s", "found in episode 4", "proven optimum: 25 s"} <= set(said)
    assert "makespan [s]" in said


def test_without_an_optimum_none_is_claimed(tmp_path: Path) -> None:
    assert not [text for text in plotted(tmp_path, COSTS, None) if "optimum" in text]


@pytest.mark.parametrize("costs", [[7.0], [[7.0]], [[7, 8], [9]], [5] * 3])
def test_few_and_unlike_sessions(tmp_path: Path, costs: Any) -> None:
    assert plotted(tmp_path, costs)


def test_several_sessions_say_their_mean(tmp_path: Path) -> None:
    """Bests 25 and 27 s: 26 s in the mean; a session that ends early keeps its best."""
    said = plotted(tmp_path, [COSTS, [31.0, 27.0]])
    assert "mean best so far: 26 s" in said
    assert {"session 1: best 25 s", "session 2: best 27 s"} <= set(said)
    assert "Sequences tried in 2 sessions" in said


def test_other_objectives_are_no_seconds(tmp_path: Path) -> None:
    said = plotted(tmp_path, [3.0, 2.0], 1.0, ylabel="tardy parts")
    assert {"tardy parts", "best so far: 2", "proven optimum: 1"} <= set(said)


def test_deadlocks_are_marks_and_no_costs(tmp_path: Path) -> None:
    """One of five costs 999: it neither stretches the axis nor counts in a mean."""
    said = plotted(tmp_path, [*COSTS, 999.0], deadlock=999.0)
    assert "deadlock (1 of 6 episodes)" in said
    assert "best so far: 25 s" in said
    assert max(float(text) for text in said if text.replace(".", "").isdigit()) < 40
    said = plotted(tmp_path, [[10.0, 999.0], [20.0, 999.0]], deadlock=999.0)
    assert "mean best so far: 15 s" in said


def test_only_deadlocks(tmp_path: Path) -> None:
    said = plotted(tmp_path, [9.0, 9.0], 5.0, deadlock=9.0)
    assert {"best so far: none", "deadlock (2 of 2 episodes)"} <= set(said)


@pytest.mark.parametrize("costs", [[], [[]], [[1.0], []]])
def test_no_episodes(tmp_path: Path, costs: Any) -> None:
    with pytest.raises(BadInput, match="no episodes"):
        sequence_plot(costs, None, tmp_path / "plot.png")
    assert not list(tmp_path.iterdir())
