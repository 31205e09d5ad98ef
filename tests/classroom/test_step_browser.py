"""The page of a study's steps in a browser: nothing is sent unanswered, texts are shown as text, and one may withdraw."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from lab.classroom.class_server import ClassServer
from tests.classroom.scripted import served, study_in

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ClassServer]:
    """A study whose first page has items of all kinds."""
    scale = '{ name = "load", kind = "scale", text = "How <i>hard</i>?", step = 5 },\n  { name = "like"'
    with served(study_in(tmp_path, **{'{ name = "like"': scale})) as running:
        yield running


@pytest.mark.slow
def test_from_the_consent_to_the_withdrawal(server: ClassServer, browser_page: "Page") -> None:
    page = browser_page
    page.goto(server.join_url)
    page.click("button")
    page.click("#go:text('I agree')")
    page.wait_for_selector("fieldset")
    assert page.inner_text("#title") == "Three <b>arms</b>"
    assert "How <i>hard</i>?" in page.inner_text("legend >> nth=0")
    assert page.inner_text("output") == "not answered yet"
    page.click("#go")
    assert page.locator("fieldset.open").count() == 3
    page.locator("input[type=range]").press("ArrowRight")
    page.click("text=left")
    page.click("input[name=like][value='4']")
    assert page.inner_text("output") == "55"
    page.click("#go")
    page.wait_for_selector("#where:text('step 2 of 9'), #class-lesson:text('step 2 of 9')")
    page.goto(page.url.replace("/desk/", "/step/") + "#withdraw")
    page.reload()
    page.click("#withdraw-yes")
    page.wait_for_selector("#text:has-text('You have withdrawn')")
    assert [path.name for path in server.roster.folder.iterdir() if path.is_dir()] == []
    page.reload()
    page.wait_for_selector("#text:has-text('Nobody takes part')")


@pytest.mark.slow
def test_a_lesson_whose_time_is_up_offers_to_go_on(tmp_path: Path, browser_page: "Page") -> None:
    changed = {
        "time_limit_s = 1\n": "",
        "episodes = 2": "episodes = 2\ntime_limit_s = 1",
        'text = "Before a."\n': "",
        '["before", "end"]': '["end"]',
    }
    with served(study_in(tmp_path, **changed)) as server:
        page = browser_page
        page.goto(server.join_url)
        page.click("button")
        page.click("#go:text('I agree')")
        page.click("#class-go")
        page.wait_for_selector("legend:text('Mental demand')")
        assert page.inner_text("#where") == "P01, step 2 of 7"
        kept = json.loads((server.roster.folder / "01-P01" / "participant.json").read_text())
        assert [step["timed_out"] for step in kept["steps"]] == [True, False]
