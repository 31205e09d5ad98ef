"""`lab see`: a picture as a grid, and a warning where it may be the wrong one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.cli.see import see_picture
from lab.errors import BadInput
from lab.vision import MARKERS, read_picture, write_picture

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


def test_without_a_task_the_grid_is_a_guess_and_that_is_said(lab: Lab, folder: Path) -> None:
    """Two cells of 40 pixels, a marker in each."""
    image = np.full((40, 80, 3), 200, np.uint8)
    down, right = np.mgrid[:40, :80]
    for kind, centre in (("gripper", 19.5), ("toaster", 59.5)):
        image[np.hypot(down - 19.5, right - centre) < 14] = MARKERS[kind].rgb
    write_picture(folder / "seen.png", image)
    for more in ([], ["--json"]):
        ran = lab("see", "seen.png", "--grid", "1x2", *more)
        assert (ran.code, ran.err.count("\n")) == (0, 1)
        assert ran.err.startswith("lab: no --task: the whole picture is taken for a grid of 1x2; ")
    assert ran.json["grid"] == ["SG"]


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
