"""Pages behind a proxy that passes no websockets, and pages in frames: who gets in, and what a page is told. No browser here."""

import json
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import quote
from urllib.request import Request, urlopen

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from lab.sim.frames import Body, Frame, Shape
from lab.view.framing import Framing
from lab.view.meshcat import LiveView
from lab.view.server_page import ScenePanel

POLLED = Framing(("https://site.example",), ("*.site.example",), polls=True)
PROXIED = Framing(("https://hub.example",), ("hub.example",), "https://hub.example")
AHEAD = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)


class Talk:
    """A panel that remembers what pages said, and when they came and left."""

    files: Sequence[Path] = ()

    def __init__(self) -> None:
        self.heard: list[Any] = []
        self.is_left = threading.Event()

    def joined(self, page: int, watches: bool = False) -> None:
        self.heard.append(("joined", page))

    def left(self, page: int) -> None:
        self.heard.append(("left", page))
        self.is_left.set()

    def said(self, page: int, message: str | bytes) -> None:
        self.heard.append(message)

    def stirred(self) -> bool:
        return False

    def news(self, page: int) -> str:
        return ""


@pytest.fixture
def talk() -> Talk:
    return Talk()


@pytest.fixture
def view(talk: Talk) -> Iterator[LiveView]:
    class WithPanel(LiveView):
        _panel: ScenePanel | None = talk

    with WithPanel(framing=POLLED) as running:
        running.show([Body("ball", (Shape("sphere", (0.1,)),))])
        yield running


def asked(view: LiveView, name: str, **more: str) -> Any:
    """The answer to a page's request."""
    text = "".join(f"&{key}={quote(value)}" for key, value in more.items())
    with urlopen(view.url.replace("/?", f"/{name}?") + text, timeout=30) as answer:
        told = answer.read()
    return json.loads(told) if told else None


def status(url: str, **headers: str) -> int:
    """The status of an answer."""
    try:
        with urlopen(Request(url, headers=headers), timeout=30) as answer:
            return int(answer.status)
    except HTTPError as error:
        error.close()
        return error.code


def test_a_page_polls_for_what_a_websocket_would_tell_it(view: LiveView, talk: Talk) -> None:
    page = asked(view, "open")["page"]
    assert [body["name"] for body in json.loads(asked(view, "news", page=page)["news"])["scene"]["bodies"]] == ["ball"]
    view.update(Frame(0.5, {"ball": AHEAD}))
    frame = json.loads(asked(view, "news", page=page)["news"])["frame"]
    assert (frame["time_s"], frame["poses"]) == (0.5, {"ball": list(AHEAD)})
    asked(view, "say", page=page, say="left & right")
    asked(view, "leave", page=page)
    assert talk.is_left.wait(60)
    assert talk.heard == [("joined", 1), "left & right", ("left", 1)]


def test_a_page_takes_the_place_of_the_one_before(view: LiveView, talk: Talk) -> None:
    first = asked(view, "open")["page"]
    second = asked(view, "open", instead=first)["page"]
    asked(view, "news", page=second)
    assert talk.heard == [("joined", 1), ("left", 1), ("joined", 2)]


def test_a_page_that_polls_hears_of_the_end(view: LiveView) -> None:
    page = asked(view, "open")["page"]
    asked(view, "news", page=page)
    closing = threading.Thread(target=view.close)
    closing.start()
    assert asked(view, "news", page=page) == {"ended": [1001, "the run has ended"]}
    closing.join()


def test_a_page_that_asks_nothing_has_left(view: LiveView, talk: Talk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lab.view.polled_pages.GONE_S", 0.01)
    page = asked(view, "open")["page"]
    assert talk.is_left.wait(60)
    while status(f"{view.url.replace('/?', '/say?')}&page={page}") != 410:  # until its key is forgotten
        pass
    assert talk.heard == [("joined", 1), ("left", 1)]


def test_what_polls_needs_the_token_and_is_served_only_where_it_was_asked_for(view: LiveView) -> None:
    for name in ("open", "news", "say", "leave"):
        assert status(f"http://127.0.0.1:{view.port}/{name}?token=wrong") == 403
    with LiveView() as plain:
        assert status(plain.url.replace("/?", "/open?")) == 404
        with urlopen(plain.url) as answer:
            assert "polling.js" not in answer.read().decode()
    with urlopen(view.url) as answer:
        assert "polling.js" in answer.read().decode()


def test_a_page_is_framed_by_those_that_were_named_alone(view: LiveView) -> None:
    for framing, ancestors in ((None, "'none'"), (POLLED, "https://site.example"), (PROXIED, "https://hub.example")):
        with LiveView(framing=framing) as shown, urlopen(shown.url) as answer:
            rules = dict(rule.split(" ", 1) for rule in answer.headers["Content-Security-Policy"].split("; "))
        assert rules["frame-ancestors"] == ancestors
        assert ("wss://hub.example" in rules["connect-src"]) == (framing is PROXIED)


def test_requests_through_a_proxy_name_its_host(view: LiveView) -> None:
    assert status(view.url, Host="x-1.site.example") == 200
    assert status(view.url, Host="site.elsewhere") == 400
    with LiveView(framing=PROXIED) as proxied:
        address = proxied.url.replace("http", "ws").replace("/?", "/frames?")
        with connect(address, additional_headers={"Origin": "https://hub.example"}):
            pass
        for origin in ("http://hub.example", "https://elsewhere.example", "https://hub.example.elsewhere"):
            with pytest.raises(InvalidStatus, match="403"), connect(address, additional_headers={"Origin": origin}):
                pass
