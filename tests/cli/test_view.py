"""`lab view`: a scene, a grid world and a replay on a page."""

import json
from collections.abc import Callable
from pathlib import Path
from signal import SIGINT, pthread_kill
from threading import Thread, main_thread
from typing import Any
from urllib.request import urlopen

import pytest

from lab.api.scenes import SceneRequest
from lab.cli.view import serve, write_page
from lab.errors import BadInput

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
ONE = SceneRequest(1, None, 0)


def looked_at(what: str) -> tuple[str, str]:
    """The address of what is shown, and its page, which is read once before Ctrl-C is pressed."""
    told: list[str] = []

    def look(url: str) -> None:
        with urlopen(url, timeout=10) as page:
            told.extend((url, page.read().decode()))
        pthread_kill(main_thread().ident or 0, SIGINT)

    with pytest.raises(KeyboardInterrupt):
        serve(what, ONE, 0, lambda url, hint: Thread(target=look, args=(url,)).start())
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
        serve(str(tmp_path), ONE, 0, lambda url, hint: None)
    with pytest.raises(BadInput, match=r"^51 toasts"):
        serve("toast", SceneRequest(51, None, 0), 0, lambda url, hint: None)


def data(file: str) -> Any:
    """What a page in a file has of its scene."""
    text = Path(file).read_text(encoding="utf-8")
    return json.loads(text.partition('type="application/json">')[2].partition("</script>")[0])


def test_a_world_is_shown_and_written_as_a_page(tmp_path: Path) -> None:
    _, page = looked_at("world-1")
    assert "World I: a path through 10 x 10 x 10 cells; shortest path: 12 moves" in page
    document = write_page("world-1", ONE, tmp_path / "w.html")
    assert document == {"file": str(tmp_path / "w.html")}
    assert {body["name"] for body in data(document["file"])["scene"]["bodies"]} == {
        *("ground", "room", "obstacles", "start", "goal", "shortest path", "limited view", "axes")
    }


@pytest.mark.parametrize(
    ("what", "title"),
    [
        ("w.txt", "w; shortest path: 3 moves"),
        ("random:20x20x20:0.3:3", "Random world of 20x20x20 cells, density 0.3, seed 3; shortest path: "),
        ("toast", "Toast making with one robot"),
    ],
)
def test_any_world_or_task_is_written_as_a_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str, title: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("w.txt").write_text("S#.\n..G\n")
    text = Path(write_page(what, ONE, Path("page.html"))["file"]).read_text(encoding="utf-8")
    said = text.partition("<title>")[2].partition("</title>")[0]
    assert said.startswith(title)
    assert ("1500 of 2400 obstacles drawn" in said) == what.startswith("random")


def test_a_page_that_cannot_be_written(tmp_path: Path, lab: Lab) -> None:
    for what, out, line in (
        ("world-1", tmp_path / "w.png", r"its name must end in \.html"),
        (str(tmp_path), tmp_path / "w.html", r"its replay\.html is such a page already"),
        ("toast-case-1", tmp_path / "w.html", r"it is a cell, which has no scene"),
    ):
        with pytest.raises(BadInput, match=line):
            write_page(what, ONE, out)
    (tmp_path / "w.txt").write_text("S#G\n")
    ran = lab("view", str(tmp_path / "w.txt"), "--out", str(tmp_path / "w.html"))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == "lab: world 'w': no path from (0, 0) to (0, 2): the goal is enclosed by (0, 1)\n"
    assert {path.name for path in tmp_path.iterdir()} == {"w.txt"}


def test_the_scene_of_a_task_holds_the_parts_that_are_asked_for() -> None:
    from lab.api.scenes import SceneRequest, seen

    with seen("breakfast", SceneRequest(None, "slice=1,cup=1", 0)) as (title, recording):
        parts = {body.name for body in recording.bodies if body.name.startswith(("slice", "cup"))}
    assert (title, parts) == ("Two toasts and a cup of coffee to a tray", {"slice 1", "cup 2"})
