"""What the panel sends to whom and when, without a server: big tables rarely, everything else once."""

import json
from typing import Any

import numpy as np
import pytest

from lab.learning.requests import AdviceRequest
from lab.learning.session_events import EpisodeEnded
from lab.mdp import TabularMDP, grid
from lab.seat.page.page_events import hear
from lab.seat.page.page_messages import Answer
from lab.seat.page.page_panel import SeatPanel, plain_json, word_of
from lab.seat.page.page_state import PARTS, Pending, ShownLesson

LABELS = ("up", "down", "left", "right")


@pytest.fixture
def mdp() -> TabularMDP:
    return grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=LABELS)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time [s] that the panel reads."""
    now = [100.0]
    monkeypatch.setattr("lab.seat.page.page_panel.time.monotonic", lambda: now[0])
    return now


@pytest.fixture
def panel(mdp: TabularMDP, clock: list[float]) -> SeatPanel:
    made = SeatPanel("the page")
    made.known.learning = ShownLesson("row", mdp=mdp, q=[[0.0, 0.0, 0.0, 1.0]] * 3)
    made.joined(1)
    return made


def told(panel: SeatPanel, page: int = 1) -> dict[str, Any]:
    message: dict[str, Any] = json.loads(f"{{{panel.news(page)}}}")
    return message


def end_an_episode(panel: SeatPanel) -> None:
    panel.known.changed(*hear(panel.known.learning, EpisodeEnded(1, 9, False, 0, None, True)))


def test_a_new_page_is_told_all_and_then_nothing(panel: SeatPanel) -> None:
    assert set(told(panel)["seat"]) == {*PARTS, "slice", "you"}
    assert panel.news(1) == ""


def test_then_only_what_has_changed(panel: SeatPanel, clock: list[float]) -> None:
    told(panel)
    clock[0] += 1.0
    end_an_episode(panel)
    assert set(told(panel)["seat"]) == {"curve", "standing", "slice"}
    panel.joined(2)
    assert set(told(panel)["seat"]) == {"you"}  # there is one more


def test_a_layer_is_sent_at_most_ten_times_a_second(panel: SeatPanel, clock: list[float]) -> None:
    told(panel)
    assert panel.stirred()
    sent = 0
    for _ in range(100):  # a second and an episode each 10 ms
        clock[0] += 0.01
        end_an_episode(panel)
        sent += "slice" in told(panel)["seat"]
    assert sent in (9, 10)


def test_a_layer_that_was_held_back_is_sent_later(panel: SeatPanel, clock: list[float]) -> None:
    told(panel)
    end_an_episode(panel)
    assert "slice" not in told(panel)["seat"]
    assert panel.stirred()
    assert panel.news(1) == ""
    clock[0] += 0.11
    assert panel.stirred()  # though nothing has happened
    assert set(told(panel)["seat"]) == {"slice"}
    assert not panel.stirred()


def test_a_layer_that_takes_long_is_sent_seldom(
    panel: SeatPanel, clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a second of work: the next one 15 s later."""

    def slowly(*_: object) -> dict[str, int]:
        clock[0] += 0.5
        return {"layer": 0}

    monkeypatch.setattr("lab.seat.page.page_panel.layer_of", slowly)
    told(panel)
    for later_s, is_sent in ((14.0, False), (1.1, True)):
        clock[0] += later_s
        end_an_episode(panel)
        assert ("slice" in told(panel)["seat"]) == is_sent


def test_another_layer_is_sent_as_soon_as_it_is_time(panel: SeatPanel, clock: list[float]) -> None:
    told(panel)
    panel.said(1, '{"layer": 0}')
    assert panel.news(1) == ""
    clock[0] += 0.11
    assert set(told(panel)["seat"]) == {"slice"}


def test_a_page_that_has_left_is_told_nothing(panel: SeatPanel) -> None:
    panel.left(1)
    assert panel.news(1) == ""
    assert panel.chair.holder is None


def test_what_is_not_finite_is_null() -> None:
    assert json.loads(plain_json({"a": [float("nan"), 1.0], "b": {"c": float("-inf")}})) == {
        "a": [None, 1.0],
        "b": {"c": None},
    }


def test_the_terminal_hears_labels(panel: SeatPanel, mdp: TabularMDP) -> None:
    request = AdviceRequest(mdp=mdp, q=[[0.0] * 4] * 3, state=0, episode=1, step=1, own=2, allowed=range(mdp.n_actions))
    assert [word_of(request, one) for one in (Answer(1, 3), Answer(1, None, "undo"))] == ["right", "undo"]
    words: list[str] = []
    panel.on_word = words.append
    number = panel.pose(Pending(request, offered=True)).number
    panel.said(1, json.dumps({"answer": {"question": number, "action": 0}}))
    assert words == ["up"]
    number = panel.pose(Pending(request)).number  # somebody waits for this one here
    panel.said(1, json.dumps({"answer": {"question": number, "action": 0}}))
    assert words == ["up"]
