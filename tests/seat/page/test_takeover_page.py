"""The takeover's page: what it shows and takes, without a browser and in one."""

import json
import threading
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import pytest

from lab.cloning.person import Situation
from lab.cloning.takeover_command import TakeoverCommand
from lab.control import ControlEnv
from lab.seat.page.takeover_page import TakeoverPage, TakeoverPanel

if TYPE_CHECKING:
    from playwright.sync_api import Page

SEEN = Situation(
    "distance: its doubt is 3, above 2", "The part is 3.0 cm ahead.", "The fingers are <open>.", "Wanted: it."
)


def news(panel: TakeoverPanel, page: int = 1) -> dict[str, Any]:
    found: dict[str, Any] = json.loads("{" + panel.news(page) + "}")
    return found


def test_a_page_is_told_the_question_and_its_command_is_taken() -> None:
    panel = TakeoverPanel()
    panel.joined(1)
    assert news(panel)["seat"] == {"question": None, "asked": 0}
    panel.ask(SEEN)
    assert panel.stirred()
    assert news(panel)["seat"]["question"] == asdict(SEEN)
    panel.said(1, json.dumps({"command": "ahead 2 close"}))
    command = panel.command()
    assert command.moved[0] == pytest.approx(0.02)
    assert command.close
    assert news(panel)["seat"]["question"] is None
    panel.ask(replace(SEEN, demonstration="Demonstration 1 of 2"))
    assert news(panel)["seat"]["asked"] == 1  # questions of the clone alone are counted


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("{", "no message"),
        ("[]", "no message"),
        ('{"command": 3}', "no message"),
        ('{"command": "ahed"}', "did you mean"),
        (b"\xff", "no message"),
        ('{"command": "' + "a" * TakeoverPanel.most_chars + '"}', "no message"),
    ],
)
def test_what_is_no_command_is_refused_on_that_page_alone(message: str | bytes, told: str) -> None:
    panel = TakeoverPanel()
    panel.joined(1)
    panel.joined(2)
    panel.ask(SEEN)
    news(panel, 1)
    news(panel, 2)
    panel.said(1, message)
    assert told in news(panel, 1)["refusal"]
    assert panel.news(2) == ""


def test_the_first_command_counts() -> None:
    panel = TakeoverPanel()
    panel.joined(1)
    panel.ask(SEEN)
    panel.said(1, json.dumps({"command": "up 1"}))
    panel.said(1, json.dumps({"command": "down 1"}))
    assert panel.command().moved[2] == pytest.approx(0.01)
    assert "Nothing is asked" in news(panel)["refusal"]


def test_a_command_that_nobody_asked_for_is_refused() -> None:
    panel = TakeoverPanel()
    panel.joined(1)
    panel.said(1, json.dumps({"command": "ahead"}))
    assert "Nothing is asked" in news(panel)["refusal"]


def test_in_a_browser_the_arm_is_seen_and_a_button_answers(browser_page: "Page") -> None:
    env, answers = ControlEnv("toast", "grasp"), list[TakeoverCommand]()
    demonstrated = replace(SEEN, demonstration="Demonstration 2 of 15")
    env.reset(seed=1)
    with TakeoverPage() as page:
        page.step(env)
        asking = threading.Thread(target=lambda: answers.append(page.ask(SEEN)), daemon=True)
        asking.start()
        shown = browser_page
        shown.goto(page.url)
        shown.wait_for_selector("#takeover-title:has-text('question 1')")
        assert "The fingers are <open>. Wanted: it." in shown.inner_text("#takeover-where")
        shown.fill("#takeover-size", "4")
        shown.click("[data-move=left]")
        asking.join(30)
        shown.wait_for_selector("#takeover-title:has-text('Nothing is asked now')")
        asking = threading.Thread(target=lambda: answers.append(page.ask(demonstrated)), daemon=True)
        asking.start()
        shown.wait_for_selector("#takeover-title:has-text('Demonstration 2 of 15')")
        shown.click("[data-word=close]")
        asking.join(30)
    env.close()
    assert answers[0].moved == pytest.approx((0.0, 0.04, 0.0, 0.0))
    assert answers[1].close
