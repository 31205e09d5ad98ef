"""`lab view`: a scene and a replay on a page."""

from pathlib import Path
from signal import SIGINT, pthread_kill
from threading import Thread, main_thread
from urllib.request import urlopen

import pytest

from lab.cli.view import show
from lab.errors import BadInput


def looked_at(what: str) -> tuple[str, str]:
    """The address of what is shown, and its page, which is read once before Ctrl-C is pressed."""
    told: list[str] = []

    def look(url: str) -> None:
        with urlopen(url, timeout=10) as page:
            told.extend((url, page.read().decode()))
        pthread_kill(main_thread().ident or 0, SIGINT)

    with pytest.raises(KeyboardInterrupt):
        show(what, 1, 0, 0, lambda url, hint: Thread(target=look, args=(url,)).start())
    url, page = told
    return url, page


def test_a_scene_is_shown_on_this_computer_only() -> None:
    url, page = looked_at("toast")
    assert url.startswith("http://127.0.0.1:")
    assert "<canvas" in page or "<script" in page
    with pytest.raises(OSError, match="refused"):
        urlopen(url, timeout=10)


def test_a_runs_replay_is_served(tmp_path: Path) -> None:
    (tmp_path / "replay.html").write_text('<p>replay</p><script id="lab-data"></script>')
    _, page = looked_at(str(tmp_path))
    assert page.startswith("<p>replay</p>")


def test_what_is_neither_a_task_nor_a_run(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"holds no replay.html: give the folder of a run"):
        show(str(tmp_path), 3, 0, 0, lambda url, hint: None)
    with pytest.raises(BadInput, match=r"^51 toasts"):
        show("toast", 51, 0, 0, lambda url, hint: None)
