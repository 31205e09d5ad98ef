"""The report on rules and takeovers, of a cart that strays; its figures are read as SVG."""

import re

import numpy as np
import pytest

from lab.mentor.takeovers import RulesCompared, rules_compared
from lab.recordings.episode import Episode, Recording
from lab.view.mentor_report import COLUMNS, curves_figure, episode_figure, report_document, report_page, table_lines


def cart(places: list[float], corrected: list[int]) -> Episode:
    states = np.array(places, np.float32)[:, None]
    marked = np.isin(np.arange(len(places)), corrected)
    pictures = [np.full((4, 6, 3), 10 * step, np.uint8) for step in range(len(places))]
    return Episode("go <right>", states, states, marked, True, {"top": pictures})


@pytest.fixture(scope="module")
def compared() -> RulesCompared:
    straight = [0.1 * step for step in range(11)]
    episodes = [cart(straight, []) for _ in range(12)]
    episodes += [cart([0.0, 0.1, 0.2, 5.0, 5.1, 0.3], [5]) for _ in range(3)]
    return rules_compared(
        Recording(1, "cart", ("x",), ("dx",), episodes), window_s=2, rules=["distance", "clock", "chunk"]
    )


def test_a_line_a_rule(compared: RulesCompared) -> None:
    distance, clock = table_lines(compared)
    assert len(distance) == len(COLUMNS)
    assert distance[:3] == ("distance", "3", "3 of 3")
    assert distance[4] == "3 of 3"
    assert distance[6] == "2 s"
    assert clock[:5] == ("clock", "0", "0 of 3", "0.0", "–")


def test_the_document_has_the_same_numbers(compared: RulesCompared) -> None:
    document = report_document(compared)
    assert (document["takeovers"], document["episodes"]) == (3, 15)
    distance, clock = document["rules"]
    assert (distance["rule"], distance["recall"], distance["precision"], distance["lead_s"]) == (
        "distance",
        1.0,
        1.0,
        2.0,
    )
    assert (clock["recall"], clock["precision"], clock["lead_s"]) == (0.0, None, None)
    assert "chunk" in document["notes"][0]


def test_the_page_shows_the_episodes_with_takeovers_and_needs_no_network(compared: RulesCompared) -> None:
    page = report_page(compared, "<b>")
    assert [int(number) for number in re.findall(r"Episode (\d+)", page)] == [12, 13, 14]
    assert "<b>" not in page
    assert "&lt;right&gt;" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)


def test_the_figures_show_rules_alarms_and_pictures(compared: RulesCompared) -> None:
    curves, episode = curves_figure(compared).decode(), episode_figure(compared, 12).decode()
    assert all(f">{text}</text>" in curves for text in ("distance", "clock", "at random"))
    assert ">3.0 s: distance asks</text>" in episode
    assert ">5.0 s: takeover</text>" in episode
    assert episode.count("<image") == 2
    assert curves_figure(compared).decode() == curves
