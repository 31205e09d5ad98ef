"""What the panel sends to whom and when, without a server: big tables rarely, everything else once."""

import json
import threading
from typing import Any

import numpy as np
import pytest

from lab.learning.praise import Judgeable
from lab.learning.requests import AdviceRequest
from lab.learning.session_events import EpisodeEnded
from lab.mdp import TabularMDP, grid
from lab.production.controls import Controls, Held, StopKind
from lab.production.operation.desk import RunDesk
from lab.production.run_journal import RunJournal
from lab.seat.page.page_messages import PageAnswer
from lab.seat.page.page_panel import MOST_LAYERS, SeatPanel, plain_json, word_of
from lab.seat.page.page_run import hear_run
from lab.seat.page.page_state import PARTS, Pending, ShownLesson, hear
from lab.tasks.task_file import load
from lab.teaching.events import SkillBegan

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


def test_layers_without_end_are_not_all_kept(panel: SeatPanel, clock: list[float]) -> None:
    for number in range(2 * MOST_LAYERS):
        panel.said(1, json.dumps({"layer": number}))
        clock[0] += 0.2
        assert "slice" in told(panel)["seat"]
    assert len(panel._layers) <= MOST_LAYERS


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
    assert [word_of(request, one) for one in (PageAnswer(1, 3), PageAnswer(1, None, "undo"))] == ["right", "undo"]
    words: list[str] = []
    panel.on_word = words.append
    number = panel.pose(Pending(request, offered=True)).number
    panel.said(1, json.dumps({"answer": {"question": number, "action": 0}}))
    assert words == ["up"]
    number = panel.pose(Pending(request)).number  # somebody waits for this one here
    panel.said(1, json.dumps({"answer": {"question": number, "action": 0}}))
    assert words == ["up"]


# ---- a run that is steered here


@pytest.fixture
def desk(panel: SeatPanel) -> RunDesk:
    """The console of a run of one slice; pages 1, which has the seat, and 2."""
    task = load("toast")
    made = RunDesk(task, task.ordered(1), Controls(), RunJournal(), lambda event: hear_run(panel.known, event))
    panel.known.console = made
    panel.joined(2)
    return made


def say(panel: SeatPanel, words: str, page: int = 1) -> str:
    """Give a command; why it was ignored."""
    panel.said(page, json.dumps({"command": words}))
    refusal = told(panel, page).get("refusal", "")
    assert isinstance(refusal, str)
    return refusal


def test_only_who_has_the_seat_commands_but_anybody_stops(panel: SeatPanel, desk: RunDesk) -> None:
    assert say(panel, "pause", 2) == "Another page operates: here only the emergency stop works."
    assert not desk.controls.stops
    assert say(panel, "stop", 2) == ""
    assert desk.controls.held == Held(StopKind.EMERGENCY, "pressed by hand", "onlooker")
    assert say(panel, "reset", 2)
    assert say(panel, "reset") == ""
    assert [*desk.controls.stops] == [StopKind.PAUSE]
    panel.left(1)
    assert say(panel, "go", 2) == "Nobody operates yet: press 'Operate here' first."
    assert say(panel, "stop", 2) == ""
    assert StopKind.EMERGENCY in desk.controls.stops


def test_an_emergency_stop_does_not_wait_for_the_lock(panel: SeatPanel, desk: RunDesk) -> None:
    """The session's thread is busy with the panel meanwhile."""
    with panel.lock:
        pressed = threading.Event()
        desk.controls.on_change.append(pressed.set)
        server = threading.Thread(target=panel.said, args=(2, '{"command": "stop"}'))
        server.start()
        assert pressed.wait(20)
        assert desk.controls.holds_arm
    server.join(20)
    assert not server.is_alive()


def test_what_a_run_does_not_take_is_among_what_came_of_commands(
    panel: SeatPanel, desk: RunDesk, clock: list[float]
) -> None:
    told(panel)
    clock[0] += 1.0
    panel.said(1, '{"command": "jog +x 10"}')
    run = told(panel)["seat"]["run"]
    assert run["said"] == 1
    assert "this run carries itself out" in run["done"][0]["refused"]
    assert run["commands"] == ["pause", "step", "go", "stop", "reset", "speed"]


def test_without_a_run_no_command_is_taken(panel: SeatPanel) -> None:
    assert say(panel, "stop") == "Nothing is carried out here that takes commands."


def test_where_a_run_stands_is_sent_ten_times_a_second_but_a_stop_at_once(
    panel: SeatPanel, desk: RunDesk, clock: list[float]
) -> None:
    told(panel)
    clock[0] += 1.0
    sent = 0
    for step in range(100):  # a second and an event each 10 ms
        clock[0] += 0.01
        hear_run(panel.known, SkillBegan("home", f"goes home, {step}", "slice 1", step / 100))
        sent += '"run"' in panel.news(1)
    desk.controls.emergency()
    assert told(panel)["seat"]["held"]["kind"] == "emergency"
    assert panel.stirred()
    clock[0] += 1.0
    assert told(panel)["seat"]["run"]["words"] == "goes home, 99"
    assert panel.news(1) == ""
    assert sent in (9, 10)


def test_a_run_without_news_sends_nothing(panel: SeatPanel, desk: RunDesk, clock: list[float]) -> None:
    told(panel)
    for _ in range(5):
        clock[0] += 1.0
        panel.stirred()
        assert panel.news(1) == ""


@pytest.mark.parametrize("looks_before", [True, False])
def test_a_command_that_ended_between_two_looks_is_not_shown_as_under_way(
    panel: SeatPanel, desk: RunDesk, clock: list[float], looks_before: bool
) -> None:
    """The server looks for news now and then: a short command begins, is shown, and ends before it looks again."""
    told(panel)
    if looks_before:
        panel.stirred()
    clock[0] += 1.0
    desk.busy = "jog +z 20"
    panel.known.changed("run")
    assert told(panel)["seat"]["run"]["busy"] == "jog +z 20"
    desk.busy = ""
    clock[0] += 1.0
    assert panel.stirred()
    assert told(panel)["seat"]["run"]["busy"] == ""
    assert not panel.stirred()


def test_pages_that_come_and_go_are_who_attends(panel: SeatPanel, desk: RunDesk) -> None:
    assert desk.controls.attended
    panel.left(1)
    panel.left(2)
    assert not desk.controls.attended


# ---- judgements -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("judgement", "answer", "refusal"),
    [
        ("only", {"word": "+"}, ""),
        ("only", {"action": 3}, "This question is about the move that it makes: press + or -, or skip."),
        ("only", {"word": "skip"}, ""),
        ("also", {"word": "-"}, ""),
        ("also", {"action": 3}, ""),
        ("no", {"word": "+"}, "Nothing was done yet that could be good or bad."),
    ],
)
def test_what_may_be_answered(
    panel: SeatPanel, mdp: TabularMDP, judgement: Judgeable, answer: dict[str, object], refusal: str
) -> None:
    asked = AdviceRequest(
        mdp=mdp, q=[[0.0] * 4] * 3, state=0, episode=1, step=1, own=3, allowed=range(4), judgement=judgement
    )
    number = panel.pose(Pending(asked)).number
    shown = told(panel)["seat"]["question"]
    assert shown.get("judges", "no") == judgement
    assert ({"+", "-"} <= {*shown["words"]}) == (judgement != "no")
    panel.said(1, json.dumps({"answer": {"question": number, **answer}}))
    assert told(panel).get("refusal", "") == refusal
