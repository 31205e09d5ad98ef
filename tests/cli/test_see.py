"""`lab see`: a picture as a grid, and a warning where it may be the wrong one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lab.vision import MARKERS, write_picture

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
