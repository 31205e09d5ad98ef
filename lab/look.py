"""What there is to look at alone: a picture as a grid, a scene or a replay on a page."""

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput
from lab.tasks.task_file import check_number, load

if TYPE_CHECKING:
    from lab.vision import View


def see_picture(image: Path, grid: str | None, task: str | None, out: Path | None) -> dict[str, Any]:
    """A picture's markers as a grid, the document of `lab see --json`.

    With a task the grid is the one of its overhead camera; without, the frame is the grid, 12 x 12 unless `grid` says so.
    """
    from lab.vision import draw, read_picture, see, write_picture

    shape = _shape(grid)
    picture = read_picture(image)
    camera = None
    if task is not None:
        height, width = picture.shape[:2]
        if height != width:
            raise BadInput(f"{image}: {width} x {height} pixels: the task's camera takes square pictures")
        camera = _camera(task, height, None if grid is None else shape)
    seen = see(picture, camera, shape=shape, where=str(image))
    if out is not None:
        write_picture(out, draw(picture, seen))
    return seen.to_json() | {"files": {} if out is None else {"picture": str(out)}}


def _shape(grid: str | None) -> tuple[int, int]:
    match = re.fullmatch(r"([1-9]\d{0,2})x([1-9]\d{0,2})", "12x12" if grid is None else grid)
    if match is None:
        raise BadInput(f"grid '{grid}' (--grid): wanted ROWSxCOLUMNS, each 1 to 999, such as 12x12")
    return int(match[1]), int(match[2])


def _camera(task: str, pixels: int, wanted: tuple[int, int] | None) -> "View":
    """How a task's camera with so many pixels a side sees its grid; BadInput when a grid of another shape is wanted."""
    from lab.skills.surveys import camera_view

    camera = camera_view(load(task), pixels)
    if wanted is not None and wanted != camera.shape:
        own, other = (f"{shape[0]}x{shape[1]}" for shape in (camera.shape, wanted))
        raise BadInput(f"grid '{other}' (--grid): the grid of the task's camera is {own}; leave --grid away")
    return camera


def show(what: str, toasts: int, seed: int, port: int, tell: Callable[[str, str], None]) -> None:
    """Serve a run's replay, or a task's scene, on 127.0.0.1 until interrupted; `tell(url, hint)` once it is there."""
    from lab.view.meshcat import LiveView

    folder = Path(what)
    if folder.is_dir():
        replay = folder / "replay.html"
        if not replay.is_file():
            raise BadInput(f"'{what}' holds no replay.html: give the folder of a run (--out of lab run) or a task")
        with LiveView(port, replay=replay) as page:
            tell(page.url, page.hint)
            _wait()
    check_number(toasts)
    task = load(what)
    import numpy as np

    from lab.production.recorder import show_scene
    from lab.sim.scene import check_scene, draw_layout

    check_scene(task)
    with LiveView(port) as live:
        show_scene(task, toasts, draw_layout(task, toasts, np.random.default_rng([seed, 1])), live)
        tell(live.url, live.hint)
        _wait()


def _wait() -> None:
    while True:
        time.sleep(3600)
