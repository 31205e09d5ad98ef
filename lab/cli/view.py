"""`lab view`: a scene or a replay on a page."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from lab.cli.options import Json, Parts, Seed, Toasts
from lab.cli.output import end, write, write_json
from lab.errors import BadInput


def view(
    what: Annotated[
        str, typer.Argument(help="A task (its scene is shown) or the folder of a run (its replay is served).")
    ],
    toasts: Toasts = None,
    parts: Parts = None,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0: any free one.")] = 0,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Look at a task's scene or at a run's replay, on a page on 127.0.0.1, until Ctrl-C."""

    def tell(url: str, hint: str) -> None:
        if as_json:
            write_json({"url": url, "hint": hint})
        else:
            write(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it\n")

    try:
        show(what, toasts, parts, seed, port, tell)
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)


def show(
    what: str, toasts: int | None, parts: str | None, seed: int, port: int, tell: Callable[[str, str], None]
) -> None:
    """Serve a run's replay, or a task's scene, on 127.0.0.1 until interrupted; `tell(url, hint)` once it is there."""
    from lab.production.recorder import show_scene
    from lab.sim.scene_check import check_scene
    from lab.skills.prepared_scene import lay_out
    from lab.tasks.task_file import load
    from lab.view.meshcat import LiveView

    folder = Path(what)
    if folder.is_dir():
        replay = folder / "replay.html"
        if not replay.is_file():
            raise BadInput(f"'{what}' holds no replay.html: give the folder of a run (--out of lab run) or a task")
        with LiveView(port, replay=replay) as page:
            tell(page.url, page.hint)
            _wait()
    task = load(what)
    order = task.ordered(toasts, parts)
    check_scene(task)
    with LiveView(port) as live:
        show_scene(task, order, lay_out(task, order, seed), live)
        tell(live.url, live.hint)
        _wait()


def _wait() -> None:
    while True:
        time.sleep(3600)
