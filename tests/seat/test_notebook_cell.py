"""The teaching page in a notebook's cell: its address, what stays in the notebook, and a lesson behind a proxy like Colab's."""

import re
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

import lab
from lab.errors import BadInput
from lab.seat.notebook_cell import COLAB, OVER, NotebookPlace, cell_seat, notebook_place

if TYPE_CHECKING:
    from playwright.sync_api import Page

Until = Callable[["Page", str], None]
ROW = "S.G"


@dataclass
class Cell:
    """Stands for IPython's output of a cell: what it shows now, and all that it ever showed."""

    shown: list[dict[str, str]] = field(default_factory=list)
    is_shown: threading.Event = field(default_factory=threading.Event)

    def display(self, data: dict[str, str], *, raw: bool, display_id: bool) -> "Cell":
        assert raw
        assert display_id
        self.shown.append(data)
        self.is_shown.set()
        return self

    def update(self, data: dict[str, str], *, raw: bool) -> None:
        assert raw
        self.shown.append(data)

    @property
    def url(self) -> str:
        self.is_shown.wait(60)
        found = re.search('<iframe src="([^"]+)"', self.shown[0]["text/html"])
        assert found is not None
        return found[1]


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> Cell:
    """A cell of a notebook: its kernel has a shell with an attribute `kernel`."""
    made = Cell()
    shell = SimpleNamespace(kernel=object())
    python, display = ModuleType("IPython"), ModuleType("IPython.display")
    python.get_ipython, python.version_info = (lambda: shell), (9, 0, 0)  # type: ignore[attr-defined]
    display.display = made.display  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", python)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return made


def test_outside_a_notebook_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with pytest.raises(BadInput, match=r"advisor 'web' \(lab.teach\): its page is shown in the cell of a notebook"):
        lab.teach(lab.world(ROW), advisor="web")
    with pytest.raises(BadInput, match=r"page 'x' \(lab.teach\): only the advisor 'web' has a page"):
        lab.teach(lab.world(ROW), page="x")


@pytest.mark.parametrize(
    "page",
    [
        "",
        "hub.example/{port}/",
        "https://hub.example/8000/",
        "https://h/{port}/?a",
        "{port}",
        "https://h/{x}/{port}/",
        "https://a-{port}.example/",
        "https://me@h/{port}/",
        "https://h:x/{port}/",
    ],
)
def test_an_address_without_its_port_is_refused(cell: Cell, page: str) -> None:
    with pytest.raises(BadInput, match=r"wanted an address with \{port\} in its path"):
        notebook_place(page)


def test_the_address_of_a_proxy_has_the_port_and_frames_the_page(cell: Cell) -> None:
    place = notebook_place("https://hub.example/user/me/proxy/{port}")
    assert place.url(8000, "secret") == "https://hub.example/user/me/proxy/8000/?token=secret"
    assert place.framing.ancestors[0] == place.framing.origin == "https://hub.example"
    assert place.framing.hosts == ("hub.example",)
    assert not place.framing.polls


def test_on_a_hub_the_address_has_to_be_given(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/me/")
    with pytest.raises(BadInput, match=r"https://YOUR-HUB/user/me/proxy/\{port\}/"):
        notebook_place(None)


def test_colab_gives_the_address_of_a_port(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    output = ModuleType("google.colab.output")
    output.eval_js = lambda script: asked.append(script) or "https://a-8000.colab.googleusercontent.com/"  # type: ignore[attr-defined,func-returns-value]
    for name in ("google", "google.colab"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, "google.colab.output", output)
    place = notebook_place(None)
    assert place.framing.polls
    assert place.url(8000, "secret") == "https://a-8000.colab.googleusercontent.com/?token=secret"
    assert asked == ["google.colab.kernel.proxyPort(8000)"]


def test_no_token_stays_in_the_notebook(cell: Cell) -> None:
    with cell_seat(None):
        assert "token=" in cell.url
    assert cell.shown[-1] == {"text/html": f"<p>{OVER}</p>", "text/plain": OVER}


# ---- behind a proxy


class Proxy(BaseHTTPRequestHandler):
    """Passes GET requests to /PORT/ on, with another host name; like Colab's, it passes neither POST requests nor websockets."""

    def do_GET(self) -> None:
        """Pass a request on; "/" is the notebook."""
        port, _, rest = self.path[1:].partition("/")
        if not port:
            self._answer(200, {"Content-Type": "text/html"}, self.server.notebook.encode())  # type: ignore[attr-defined]
            return
        if not port.isdigit() or "Upgrade" in self.headers:
            self._answer(500, {}, b"Not allowed.")
            return
        behind = HTTPConnection("127.0.0.1", int(port), timeout=60)
        behind.request("GET", f"/{rest}", headers={"Host": "a-1-colab.googleusercontent.com"})
        answer = behind.getresponse()
        kept = ("Content-Type", "Content-Security-Policy", "Cache-Control")
        self._answer(
            answer.status, {name: answer.headers[name] for name in kept if name in answer.headers}, answer.read()
        )
        behind.close()

    def do_POST(self) -> None:
        """Refuse."""
        self._answer(500, {}, b"Not allowed.")

    def _answer(self, code: int, headers: dict[str, str], body: bytes) -> None:
        self.send_response(code)
        for name, value in headers.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@contextmanager
def proxy() -> Iterator[ThreadingHTTPServer]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Proxy) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


def test_a_lesson_is_taught_in_a_frame_behind_a_proxy(
    cell: Cell, browser_page: "Page", until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page polls through it; two answers, "right" both times, end the only episode."""
    with proxy() as server, ThreadPoolExecutor() as pool:
        address = f"http://127.0.0.1:{server.server_port}"
        framing = replace(COLAB, ancestors=(address,))
        place = NotebookPlace(framing, f"{address}/{{port}}/")
        monkeypatch.setattr("lab.seat.notebook_cell.notebook_place", lambda page: place)
        settings: dict[str, Any] = {"gate": "always", "episodes": 1, "selection": "greedy"}
        taught = pool.submit(lab.teach, lab.world(ROW), advisor="web", seed=1, **settings)
        server.notebook = f"<!DOCTYPE html>{cell.shown[0]['text/html'] if cell.url else ''}"  # type: ignore[attr-defined]
        browser_page.set_viewport_size({"width": 1280, "height": 720})
        browser_page.goto(address)
        frame = browser_page.frame_locator("iframe")
        for step in (1, 2):
            frame.locator("#says", has_text=f"step {step}").wait_for()
            frame.locator("#moves button", has_text="right").click()
        lesson = taught.result(60)
    assert lesson.session.steps.tolist() == [2]
    assert lesson.receipt[0].startswith("advice: it asked in 1 episode about 2 steps")
    assert "token=" not in cell.shown[-1]["text/html"]
    assert lesson.receipt[0] in lesson._repr_html_()
