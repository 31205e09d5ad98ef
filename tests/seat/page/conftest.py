"""What the tests of the page in a browser stand on: the page, and a browser that has opened it."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from lab.seat.page.teaching_page import SeatPage

if TYPE_CHECKING:
    from playwright.sync_api import Page

Until = Callable[["Page", str], None]


@pytest.fixture
def page() -> Iterator[SeatPage]:
    with SeatPage() as running:
        yield running


@pytest.fixture
def tab(browser_page: "Page", page: SeatPage, until: Until) -> "Page":
    """The page in a browser, at the size of a small screen; rules that it breaks are errors, too."""
    browser_page.set_viewport_size({"width": 1280, "height": 800})
    browser_page.goto(page.url)
    until(browser_page, "document.querySelector('#chair.yours')")
    return browser_page
