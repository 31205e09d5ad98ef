"""The pictures of chapter 7: what stands in them, and the one session that two of them show."""

from xml.etree import ElementTree

import numpy as np
import pytest

from lab.sequencing.simulate.follow import simulate
from lab.studies.findings import Row
from lab.studies.runner import Job
from lab_studies.thesis import chapter_7_figures as figures
from lab_studies.thesis.chapter_7_cells import Measured, printed, robot_cell


def words(picture: bytes) -> str:
    """All text of an SVG picture that keeps its text."""
    return " ".join(ElementTree.fromstring(picture).itertext())


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """The shortest sessions of all methods with three toasts."""
    cells = [
        cell for cell in printed("tables-7.4-7.6-iv.2.csv") if cell.setting.toasts == 3 and cell.setting.episodes < 25
    ]
    measured = Measured(Job(10), [cell.setting for cell in cells])
    return [measured.row("Table 7.5", cell.setting, cell.measure, cell.value) for cell in cells]


@pytest.mark.parametrize("seed", [0, 1])
def test_the_session_shown_settles_on_the_optimum(seed: int) -> None:
    times_s, sequence = figures.shown_session(seed)
    assert len(times_s) == figures.SESSION.episodes
    assert times_s.min() == times_s[-1] == 700
    assert simulate(robot_cell("II", 3), sequence).makespan_s == 700
    assert simulate(robot_cell("II", 3), figures.SEQUENCE_PRINTED).makespan_s == 700


def test_pictures_of_one_session() -> None:
    pictures = figures.session_pictures(0)
    assert pictures == figures.session_pictures(0)
    settles, places, exploration = map(words, pictures.values())
    assert "optimum: 700 s" in settles
    assert "printed: from 67 on" in settles
    assert all(f"toast {number}" in places for number in (1, 2, 3))
    assert "5  butter applier" in places
    assert "β = 1.7" in exploration


def test_settles_where_the_time_stops_changing() -> None:
    picture = figures.convergence(np.array([900.0, 700, 800, 700, 700, 700]))
    assert "stays the same from episode 4 on" in words(picture)
    assert "stays the same from episode 1 on" in words(figures.convergence(np.array([700.0, 700])))


def test_what_a_picture_by_length_shows(rows: list[Row]) -> None:
    """Only the cells of its case, toasts, environment and methods, each once; the printed ones beside them."""
    wanted = {"a": figures.Compared("II", 3, "deterministic")}
    (picture,) = figures.length_pictures(rows, wanted).values()
    own = [one for one in rows if (one["case"], one["environment"]) == ("II", "deterministic")]
    shown = [one for one in own if one.get("reward_factor") != "A"]
    assert len(rows) > len(own) > len(shown) == 6
    assert figures.length_pictures(shown, wanted)["a"] == picture
    assert "3 toasts, case II" in words(picture)
    assert all(name in words(picture) for name in ("SRL, type B", "Monte Carlo", "random search", "printed"))
    assert "sessions that find the optimum [%]" in words(picture)


def test_drawn_times_are_shown_as_times(rows: list[Row]) -> None:
    captions = figures.of_case("III", "Table 7.6")
    assert [*captions] == [
        *("Table 7.6: 3 toasts, case III", "Table 7.6: 3 toasts, case III, times drawn"),
        *("Table 7.6: 4 toasts, case III", "Table 7.6: 4 toasts, case III, times drawn"),
    ]
    caption = "Table 7.6: 3 toasts, case III, times drawn"
    (picture,) = figures.length_pictures(rows, {caption: captions[caption]}).values()
    assert "mean best makespan [s]" in words(picture)


def test_the_figures_of_the_thesis() -> None:
    """Figures 7.7 to 7.12: the reward factors by themselves, SRL with type B beside the others."""
    assert [caption.split(":")[0] for caption in figures.COMPARED] == [f"Figure 7.{n}" for n in range(7, 13)]
    assert tuple(figures.COMPARED)[:2] == figures.OF_FACTORS
    assert {shown.names for shown in figures.COMPARED.values()} == {figures.FACTORS, figures.METHODS}
