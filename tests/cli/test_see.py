"""`lab see`: a picture as a grid, and a warning where it may be the wrong one."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.cli.see import see_picture
from lab.errors import BadInput
from lab.skills.camera_grids import camera_view
from lab.tasks.task_file import load
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


def test_pictures_are_made_read_back_and_their_camera_calibrated(lab: Lab, folder: Path) -> None:
    made = lab("see", "--make", "1", "--out", "made", "--seed", "2", "--json")
    assert made.code == 0
    assert (made.json["pictures"], made.json["mats"], made.json["seed"]) == (1, 6, 2)
    ran = lab("see", "made/mat-1.png", "made/mat-2.png", "made/mat-3.png", "made/mat-4.png", "--calibrate", "--json",
              "--task", "toast", "--out", "camera.json", "--overlay", "mat.png")  # fmt: skip
    assert ran.code == 0
    assert ran.json["residual_px"] < 1
    assert set(ran.json["lens"]["distortion"]) == {"k1", "k2", "p1", "p2", "k3"}
    assert read_picture(folder / "mat.png").shape == (640, 640, 3)
    seen = lab(
        "see", "made/00001.png", "--task", "toast", "--calibration", "camera.json", "--overlay", "seen.png", "--json"
    )
    truth = json.loads((folder / "made" / "00001.json").read_text())
    assert [seen.json[one] for one in ("start", "goal", "obstacles")] == [
        truth[one] for one in ("start", "goal", "obstacles")
    ]
    assert read_picture(folder / "seen.png").shape == (640, 640, 3)
    score = lab("see", "made", "--score", "--calibration", "camera.json", "--json")
    assert (score.code, score.json["exact"]) == (0, 1)
    assert "1 of 1 grids exact" in lab("see", "made", "--score").out


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((), "0 pictures: wanted one"),
        (("a.png", "b.png"), "2 pictures: wanted one"),
        (("--make", "2"), "wanted no picture, and --out FOLDER"),
        (("a.png", "--score", "--calibrate"), "wanted one of them"),
        (("a.png", "--corners", "1,2"), "goes with --calibrate"),
        (("grey.png", "--calibrate", "--corners", "1,2"), "wanted the pixels of four corners"),
        (("grey.png", "--calibrate", "--corners", "1,2 3,4 5,6 7,8"), "goes with --task"),
        (("grey.png", "--calibration", "none.json"), "none.json: cannot be read"),
    ],
)
def test_words_that_do_not_go_together(lab: Lab, folder: Path, words: tuple[str, ...], reason: str) -> None:
    write_picture(folder / "grey.png", np.full((64, 64, 3), 200, np.uint8))
    ran = lab("see", *words)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert reason in ran.err


def test_four_corners_place_the_camera(lab: Lab, folder: Path) -> None:
    """The grid's corners of toast's camera, where its own projection has them."""
    write_picture(folder / "grey.png", np.full((640, 640, 3), 200, np.uint8))
    view = camera_view(load("toast"), "toaster")
    points = view.pixel([(0.5, -0.3, 0), (1.1, -0.3, 0), (1.1, 0.3, 0), (0.5, 0.3, 0)])
    words = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
    ran = lab("see", "grey.png", "--calibrate", "--task", "toast", "--corners", words, "--json")
    assert ran.code == 0
    assert ran.json["eye_m"] == pytest.approx([0.84, 0.0, 2.4], abs=0.005)
