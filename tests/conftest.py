"""What every test stands on: a toolbox of its own, hypothesis without a clock, the command, pages with and without a browser."""

import gc
import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from io import StringIO
from math import radians, tan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from lab.plugins import code_file
from lab.plugins.family import Family

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page
    from websockets.sync.client import ClientConnection

    from lab.mdp import FloatArray
    from lab.sim.frames import Viewpoint
    from lab.toolbox.policy import Policy
    from lab.view.meshcat import LiveView

settings.register_profile("lab", deadline=None, derandomize=bool(os.environ.get("CI")), max_examples=50)
settings.load_profile("lab")
settings.register_profile("first cases", settings.get_profile("lab"), max_examples=10)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--first-cases",
        action="store_true",
        help="run the first case of each test alone, with ten examples where a test does not say how many it draws",
    )


def pytest_collection() -> None:
    """Thousands of tests are collected without looking for garbage among them, which took half of that time."""
    gc.disable()


def pytest_collection_finish() -> None:
    """What was collected stays until the end: no later search for garbage goes through it."""
    gc.freeze()
    gc.set_threshold(10_000)
    gc.enable()


LONGEST = (  # files of tests, the longest first: begun last, one would keep one worker busy while the other has nothing to do
    "tests/production/test_run.py",
    "tests/test_docs.py",
    "tests/production/faults/test_runs_with_faults.py",
    "tests/sequencing/methods/test_portfolio.py",
    "tests/sequencing/test_sequencers.py",
)


def pytest_configure(config: pytest.Config) -> None:
    """Files go to the workers in our order, not by how many tests they hold."""
    if config.getoption("first_cases"):
        settings.load_profile("first cases")
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The longest files first, each one's tests together and in their order; with --first-cases one case of each."""
    place = {name: n for n, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(place)))
    if config.getoption("first_cases"):
        first = {item.nodeid.partition("[")[0]: item for item in reversed(items)}
        kept = [item for item in items if first[item.nodeid.partition("[")[0]] is item]
        config.hook.pytest_deselected(items=list(set(items) - set(kept)))
        items[:] = kept


ROOT = Path(__file__).resolve().parent.parent
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",  # WebGL without a GPU
    "--enable-unsafe-swiftshader",
)


@pytest.fixture(scope="session", autouse=True)
def _own_toolbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test reads or writes the user's own toolbox."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LAB_TOOLBOX", str(tmp_path_factory.mktemp("toolbox")))
        yield


@pytest.fixture(scope="session", autouse=True)
def _one_process_a_test() -> Iterator[None]:
    """Tests run side by side already: what a test does in this process is shared with others only where it asks for that."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lab.workers.cores", lambda: 1)
        yield


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c_is_heard() -> Iterator[None]:
    """Begun in the background, a shell has the tests and all that they start ignore Ctrl-C; some of them press it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(autouse=True)
def _own_members_are_gone_afterwards(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a test adds to the families of gates, rules and so on, from a file or by hand, no other test finds there."""
    added, adopted = list[tuple[Family[Any], str]](), Family.adopted

    def noted(family: Family[Any], name: str, thing: Any, source: str) -> None:
        adopted(family, name, thing, source)
        if not source.startswith("package "):  # installed: those are loaded once, by whoever needs them first
            added.append((family, name))

    monkeypatch.setattr(Family, "adopted", noted)
    monkeypatch.setattr(code_file, "_files", {})
    yield
    for family, name in added:
        family.pop(name, None)


@dataclass(frozen=True)
class Ran:
    """A command that ended: its exit code, stdout and stderr."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """What stdout holds, one JSON document."""
        return json.loads(self.out)

    @property
    def gave_nothing(self) -> bool:
        """Whether stdout is empty, or holds, as --json has it, the error alone that stderr ends with."""
        if not self.out:
            return True
        why = self.err.splitlines()[-1].removeprefix("lab: ")
        return bool(self.json == {"error": why, "exit_code": self.code})


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Ran]:
    """The command `lab` in this process, without a terminal: lab("run", "toast", stdin="typed lines")."""
    from lab.cli import main

    def run(*words: str, stdin: str = "") -> Ran:
        out, err = StringIO(), StringIO()
        monkeypatch.setattr("sys.argv", ["lab", *words])
        monkeypatch.setattr("sys.stdin", StringIO(stdin))
        with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended:
            main()
        return Ran(int(ended.value.code or 0), out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def in_picture() -> "Callable[[Viewpoint, FloatArray], bool]":
    """Whether a page 1.2 times as wide as high, with 38 degrees from bottom to top, has all points (n, 3) in it."""
    import numpy as np

    def seen(camera: "Viewpoint", points: "FloatArray") -> bool:
        eye, target = np.array(camera.eye), np.array(camera.target)
        ahead = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        off = points - eye
        far = off @ ahead
        up, aside = off @ np.cross(right, ahead) / far, off @ right / far
        reach = tan(radians(19.0))
        return bool(np.all(far > 0) and np.all(abs(up) <= reach) and np.all(abs(aside) <= 1.2 * reach))

    return seen


@pytest.fixture(scope="session")
def make_policy() -> "Callable[..., Policy]":
    """Makes a small policy: make_policy(name="insert", solved=False); `fill`: all that its table holds."""
    import numpy as np

    from lab.toolbox.policy import Policy

    def made(fill: float | None = None, **changed: Any) -> Policy:
        base = Policy(
            name="insert",
            subtask="insert",
            task="toast",
            q=np.arange(8.0).reshape(4, 2) if fill is None else np.full((4, 2), float(fill)),
            visits=np.arange(8, dtype=np.int64).reshape(4, 2),
            action_labels=("left", "right"),
            shape=(4,),
            start=0,
            signature="0123456789abcdef",
            learner={"learner": "q", "alpha": 0.95},
            gate={"gate": "ccrl"},
            advisor="expert",
            seed=0,
            curve=[21, 3],
            guided=[False, True],
            helped_steps=3,
            requests=1,
            optimal_steps=3,
            final_steps=3,
            solved=True,
            created="2026-05-01T12:00:00+00:00",
            versions={"numpy": "2.0"},
            ends=np.array([0, 0, 0, 1], np.uint8),
        )
        ends = np.zeros(len(changed.get("q", base.q)), np.uint8)
        ends[-1] = 1
        return replace(base, **{"ends": ends} | changed)

    return made


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout's folder."""
    return ROOT


@pytest.fixture(scope="module")
def browser() -> Iterator["Browser"]:
    """Chromium without a window; one for each module, as Playwright keeps an event loop in this thread meanwhile."""
    program = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        pytest.skip(f"no browser: none of {', '.join(CHROMIUM)} is installed")
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright: install the extra 'test'")
    with playwright.sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=program, args=list(FLAGS))
        yield chromium
        chromium.close()


@pytest.fixture
def browser_page(browser: "Browser") -> Iterator["Page"]:
    """A new page of 320 x 200 pixels; the test fails when a script on it raises."""
    page = browser.new_page(viewport={"width": 320, "height": 200})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert not errors


WAIT_S = 60.0  # of a machine that is busy with other tests, too


@dataclass
class Watcher:
    """A page as the server sees it: what it was told last of each part of the panel, and what it was refused."""

    socket: "ClientConnection"
    seat: dict[str, Any] = field(default_factory=dict)
    refusals: list[str] = field(default_factory=list)

    def hear(self) -> dict[str, Any]:
        """The next message."""
        message = json.loads(self.socket.recv(timeout=WAIT_S))
        assert isinstance(message, dict)
        self.seat |= message.get("seat", {})
        self.refusals += [message["refusal"]] if "refusal" in message else []
        return message

    def hear_until(self, fits: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Listen until what is known of the panel fits."""
        while not fits(self.seat):
            self.hear()
        return self.seat

    def say(self, message: Any) -> None:
        """Send something, as JSON unless it is text or bytes."""
        self.socket.send(message if isinstance(message, str | bytes) else json.dumps(message))

    def refused(self, message: Any) -> str:
        """Send something, and hear why it is ignored."""
        before = len(self.refusals)
        self.say(message)
        while len(self.refusals) == before:
            self.hear()
        return self.refusals[-1]


Opens = Callable[..., AbstractContextManager[Watcher]]


@pytest.fixture
def opens() -> Opens:
    """Open a view's page without a browser: `with opens(view) as page`; headers as keywords."""

    @contextmanager
    def watch(view: "LiveView", **headers: str) -> Iterator[Watcher]:
        from websockets.sync.client import connect

        address = view.url.replace("http", "ws").replace("/?", "/frames?")
        with connect(address, additional_headers=headers, max_size=None, open_timeout=WAIT_S) as socket:
            yield Watcher(socket)

    return watch


Until = Callable[["Page", str], None]


@pytest.fixture
def until() -> Until:
    """Wait until an expression is true in a browser's page; its rules forbid the way that Playwright has for this."""

    def wait(page: "Page", expression: str) -> None:
        look = f"() => ({expression}) ? yes() : performance.now() > end ? no(new Error('never came')) : setTimeout(look, 10)"
        page.evaluate(
            f"() => new Promise((yes, no) => {{ const end = performance.now() + {1000 * WAIT_S}; const look = {look}; look(); }})"
        )

    return wait


@pytest.fixture
def paused(until: Until) -> Callable[["Page"], None]:
    """Stop a replay that has begun; on a slow machine it may have ended before, and its button would play it again."""

    def pause(page: "Page") -> None:
        until(page, "player.state().playing || player.state().time > 0")
        page.keyboard.press("p")  # the beginning of the move before, which pauses

    return pause
