"""The page of `lab find`, in two rooms with one doorway: what it shows, and which choices it takes."""

import json
from typing import Any

import pytest

import lab
from lab.seat.page.finding_page import FindingPage, FindingPanel
from lab.teaching.found_subtasks import Finding, found
from lab.teaching.subjects import subject_from

ROOMS = "S..#...\n...#...\n.......\n...#...\n...#..G"


@pytest.fixture(scope="module")
def finding() -> Finding:
    return found(subject_from(lab.world(ROOMS)).prepare(0), "spectral", 20, 0)


@pytest.fixture
def panel(finding: Finding) -> FindingPanel:
    shown = FindingPanel(finding)
    shown.joined(1)
    return shown


def news(panel: FindingPanel) -> dict[str, Any]:
    return dict(json.loads(f"{{{panel.news(1)}}}"))


def test_it_shows_the_map_and_each_proposal_once(panel: FindingPanel) -> None:
    assert panel.stirred()
    known = news(panel)["seat"]
    assert known["map"].split("\n")[2] == "...1..."
    assert [(one["mark"], one["name"], one["more"]) for one in known["proposals"]] == [("1", "doorway 1", 0)]
    assert not panel.stirred()
    assert news(panel) == {}
    panel.tell(said="done")
    assert news(panel)["seat"]["said"] == "done"


@pytest.mark.parametrize(
    "message",
    ["", "[]", "{}", b"\xff", '{"names": []}', '{"names": ["a", "b"]}', '{"names": [3]}', '{"names": "a"}', '{"names": [""]}',
     json.dumps({"names": ["x" * 41]}), json.dumps({"names": ["a\n"]}), "[" * 99_999, '{"names": ["' + "x" * 70_000 + '"]}'],
)  # fmt: skip
def test_another_message_is_refused_and_the_choice_is_waited_for(panel: FindingPanel, message: str | bytes) -> None:
    news(panel)
    panel.said(1, message)
    assert news(panel)["refusal"]
    panel.said(1, '{"names": [null]}')
    assert panel.answer() == [None]


def test_a_choice_is_made_once(panel: FindingPanel) -> None:
    panel.said(1, '{"names": ["hall"]}')
    news(panel)
    panel.said(1, '{"names": [null]}')
    assert "already" in news(panel)["refusal"]
    assert panel.answer() == ["hall"]
    panel.left(1)
    assert panel.news(1) == ""


def test_a_choice_in_a_browser_names_the_accepted_sub_tasks(finding: Finding, browser_page: Any, until: Any) -> None:
    with FindingPage(finding) as page:
        browser_page.goto(page.url)
        until(browser_page, "document.querySelector('#finding-list input[type=text]:enabled')")
        browser_page.fill("#finding-list input[type=text]", "<b>hall</b>")
        browser_page.click("#finding button")
        assert page.accepted() == {finding.proposals[0].states: "<b>hall</b>"}
        page.tell("2 ways")
        until(browser_page, "document.querySelector('#finding-said').textContent === '2 ways'")
