"""What every test stands on: its own toolbox folder, and hypothesis without a clock."""

import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

settings.register_profile("lab", deadline=None, derandomize=bool(os.environ.get("CI")), max_examples=50)
settings.load_profile("lab")

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
