"""The operator's console in a real browser: keys, buttons, two pages, words for who is not asked. Skipped without Chromium."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from lab.production.controls import Controls, StopKind
from lab.production.operation.desk import RunDesk
from lab.production.run_journal import RunJournal
from lab.seat.page.teaching_page import SeatPage
from lab.sequencing.cell.schedule import Move
from lab.tasks.task_file import load
from lab.teaching.events import MachineBegan, MoveBegan, MoveMade, PhaseBegan, SkillBegan, TroubleMet

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    Until = Callable[["Page", str], None]


@pytest.fixture
def desk(page: SeatPage) -> RunDesk:
    """A run of one slice that nobody is asked in; where it stands is told by the tests."""
    task = load("toast")
    made = RunDesk(task, task.ordered(1), Controls(), RunJournal(), page.hear)
    page.asks_nobody()
    page.steer(made)
    return made


@pytest.fixture
def steered(tab: "Page", desk: RunDesk, until: "Until") -> "Page":
    until(tab, "!document.getElementById('run-console').hidden")
    return tab


def shows(identity: str, text: str) -> str:
    return f"document.getElementById('{identity}').textContent.includes({text!r})"


def test_a_run_is_stopped_reset_and_gone_on_with_by_keys(steered: "Page", desk: RunDesk, until: "Until") -> None:
    assert steered.inner_text("#chair") == "You operate this run"
    assert steered.inner_text("#run-simulated") == "Simulated: not a safety function."
    assert steered.is_hidden("#question")
    assert steered.is_hidden("[data-say=grasp]")
    steered.keyboard.press("4")
    until(steered, "document.querySelector('[data-say=\"speed 4\"][aria-pressed=true]')")
    steered.keyboard.press("Escape")
    until(steered, shows("run-held-kind", "Emergency stop by the operator"))
    assert desk.controls.holds_arm
    steered.keyboard.press(" ")  # go on: not before it is reset
    steered.keyboard.press("r")
    until(steered, "document.querySelector('[data-say=go]:enabled')")
    assert desk.controls.held is not None
    assert desk.controls.held.kind is StopKind.PAUSE
    steered.keyboard.press(" ")
    until(steered, "document.getElementById('run-held').hidden")
    steered.keyboard.press("r")
    until(steered, shows("refusal", "reset: refused: no emergency stop is pressed"))
    steered.click("[data-say=pause]")
    until(steered, shows("run-held-kind", "Paused"))
    assert [done.words for done in desk.done] == ["speed 4", "stop", "reset", "go", "reset", "pause"]


def test_where_it_stands_is_shown_also_in_a_narrow_window(
    steered: "Page", desk: RunDesk, page: SeatPage, until: "Until"
) -> None:
    steered.set_viewport_size({"width": 400, "height": 700})
    move = Move(1, "plate", "plate", "toaster", 0.0, 2.0, 2.0, 10.0, 40.0)
    for event in (
        PhaseBegan("carry out", 3),
        MoveBegan(1, 3, "slice 1", "plate", "plate", "toaster", 0.0),
        SkillBegan("grasp at plate", "takes slice 1 up at 'plate'", "slice 1", 2.0),
        MachineBegan("toaster", "slice 1", 10.0, 50.0),
        MoveMade(move, "slice 1"),
        MoveBegan(2, 3, "slice 1", "toaster", "toaster", "butter_applier", 10.0),
        SkillBegan("wait", "waits at 'toaster'", "slice 1", 12.0),
        TroubleMet("it slipped", "takes it up again", "slice 1", "toaster", 13.0),
    ):
        page.hear(event)
    until(steered, shows("run-doing", "The robot waits at 'toaster'."))
    assert steered.inner_text("#run-progress") == "step 2 of 3, next station butter_applier; 0 of 1 finished"
    assert "▶ busy" in steered.inner_text("#run-machines")
    assert "until 50 s, 37 s more" in steered.inner_text("#run-machines")
    assert "slice 1 at toaster" in steered.inner_text("#run-parts")
    assert "it slipped. What is done: takes it up again." in steered.inner_text("#run-trouble")
    until(steered, "document.querySelectorAll('#run-gantt g .k-carry').length === 1")
    assert steered.locator("#run-gantt g .k-process").count() == 1
    assert steered.evaluate("document.documentElement.scrollWidth") <= 400
    stop = steered.locator("#run-stop").bounding_box()
    assert stop is not None
    assert stop["y"] + stop["height"] <= 700


def test_a_second_page_only_stops(
    steered: "Page", desk: RunDesk, browser: "Browser", page: SeatPage, until: "Until"
) -> None:
    other = browser.new_page(viewport={"width": 600, "height": 600})
    try:
        other.goto(page.url)
        until(other, shows("chair-text", "You are watching: another page operates"))
        other.keyboard.press("s")
        until(other, shows("refusal", "Another page operates: here only the emergency stop works."))
        assert desk.done == []
        other.click("#run-stop")
        until(steered, shows("run-held-kind", "Emergency stop by somebody who only watches"))
    finally:
        other.close()
