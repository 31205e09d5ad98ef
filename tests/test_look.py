"""Looking: a picture as a grid, a scene and a replay on a page."""

from collections.abc import Callable
from pathlib import Path
from signal import SIGINT, pthread_kill
from threading import Thread, main_thread
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

from lab.errors import BadInput
from lab.look import see_picture, show
from lab.vision import MARKERS, read_picture, write_picture


@pytest.fixture
def picture(tmp_path: Path) -> Callable[..., Path]:
    """Draws a grid of 4 x 6 cells of 40 pixels with round markers in the middle of cells."""

    def draw(**cells: list[tuple[int, int]]) -> Path:
        image = np.full((160, 240, 3), 200, np.uint8)
        down, right = np.mgrid[:160, :240]
        for kind, places in cells.items():
            for i, j in places:
                disc = np.hypot(down - (40 * i + 19.5), right - (40 * j + 19.5)) < 14
                image[disc] = MARKERS[kind].rgb
        path = tmp_path / "picture.png"
        write_picture(path, image)
        return path

    return draw


def test_a_picture_becomes_a_grid(picture: Callable[..., Path], tmp_path: Path) -> None:
    path = picture(gripper=[(0, 0)], toaster=[(3, 5)], obstacle=[(1, 1), (2, 3)])
    document = see_picture(path, "4x6", None, tmp_path / "seen.png")
    assert document["grid"] == ["S.....", ".#....", "...#..", ".....G"]
    assert (document["start"], document["goal"]) == ([0, 0], [3, 5])
    assert document["obstacles"] == [[1, 1], [2, 3]]
    assert [marker["kind"] for marker in document["markers"]] == ["gripper", "obstacle", "obstacle", "toaster"]
    assert document["markers"][0]["pixel"] == pytest.approx([19.5, 19.5], abs=0.5)
    assert document["files"] == {"picture": str(tmp_path / "seen.png")}
    assert read_picture(tmp_path / "seen.png").shape == (160, 240, 3)


@pytest.mark.parametrize(
    ("markers", "reason"),
    [
        ({}, "no round coloured marker found"),
        ({"gripper": [(0, 0)]}, "no toaster marker: wanted exactly one round cyan spot"),
        ({"gripper": [(0, 0)], "toaster": [(1, 1), (3, 5)]}, "2 toaster markers at pixels"),
    ],
)
def test_pictures_without_start_or_goal(
    picture: Callable[..., Path], tmp_path: Path, markers: dict[str, Any], reason: str
) -> None:
    path = picture(**markers)
    with pytest.raises(BadInput, match=f"^{path}: {reason}"):
        see_picture(path, "4x6", None, tmp_path / "seen.png")
    assert not (tmp_path / "seen.png").exists()


@pytest.mark.parametrize("grid", ["", "12", "0x3", "3x0", "-1x3", "1000x3", "3x3x3", "axb", "3X3"])
def test_grids_that_are_none(tmp_path: Path, grid: str) -> None:
    with pytest.raises(BadInput, match=r"--grid.: wanted ROWSxCOLUMNS"):
        see_picture(tmp_path / "none.png", grid, None, None)


# ---- view ---------------------------------------------------------------------------------------------------------


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
