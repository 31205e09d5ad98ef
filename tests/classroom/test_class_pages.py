"""The teacher's page in a browser: what it does, and that whoever sees the screen does not see its key."""

from typing import TYPE_CHECKING

import pytest

from lab.classroom.class_server import ClassServer
from tests.classroom.conftest import join

if TYPE_CHECKING:
    from playwright.sync_api import Page

MARKUP = "<img src=x onerror=alert(1)>"


def key(server: ClassServer) -> str:
    return server.teacher_url.partition("token=")[2]


@pytest.mark.slow
def test_the_key_of_the_teacher_is_on_no_page(server: ClassServer, browser_page: "Page") -> None:
    said = join(server)
    browser_page.set_viewport_size({"width": 1200, "height": 800})
    browser_page.goto(server.teacher_url)
    browser_page.get_by_text(said["name"]).wait_for()
    assert "token" not in browser_page.url
    browser_page.reload()
    browser_page.get_by_text(said["name"]).wait_for()
    assert key(server) not in browser_page.content()
    with browser_page.context.expect_page() as opened:
        browser_page.get_by_role("button", name="Look").click()
    opened.value.get_by_text("Episode 1, step 1").first.wait_for()
    assert "token" not in opened.value.url
    opened.value.reload()
    opened.value.get_by_text("Episode 1, step 1").first.wait_for()
    opened.value.close()


@pytest.mark.slow
def test_the_teacher_shuts_the_door_and_removes_a_pupil_by_two_clicks(
    server: ClassServer, browser_page: "Page"
) -> None:
    name = join(server)["name"]
    browser_page.set_viewport_size({"width": 1200, "height": 800})
    browser_page.goto(server.teacher_url)
    tile = browser_page.locator(".tile")
    tile.get_by_text(name).wait_for()
    server.call(lambda: server.room.hint(1, MARKUP))
    browser_page.get_by_text(f"Hint: {MARKUP}").wait_for()
    assert browser_page.locator(".tile img").count() == 0
    browser_page.get_by_role("button", name="Close the door").click()
    browser_page.get_by_role("button", name="Open the door").wait_for()
    tile.get_by_role("button", name="Remove").click()
    tile.get_by_role("button", name="Once more: remove").click()
    tile.wait_for(state="detached")
    browser_page.get_by_text("Nobody has joined yet.").wait_for()
    assert server.call(server.room.tiles) == {}
