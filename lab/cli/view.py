"""`lab view`: show a scene, a grid world or a replay on a page."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from lab.cli import deferred
from lab.cli.options import Json, Parts, Seed, Toasts
from lab.cli.output import end, show, write, write_json
from lab.errors import BadInput

Tell = Callable[[str, str], None]


def view(
    what: Annotated[
        str,
        typer.Argument(
            help="A task (its scene is shown), a grid world, random:10x10x10:0.06:7 among them, "
            "or the folder of a run (its replay is served)."
        ),
    ],
    toasts: Toasts = None,
    parts: Parts = None,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="The page's port; 0: any free one.")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", help="An .html file to write instead: the page, for any browser, offline.")
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Look at a task's scene, at a grid world in 3D or at a run's replay, on a page on 127.0.0.1, until Ctrl-C."""
    if out is not None:
        show(
            write_page(what, deferred.SceneAsked(toasts, parts, seed), out), as_json, lambda document: document["file"]
        )
        return

    def tell(url: str, hint: str) -> None:
        if as_json:
            write_json({"url": url, "hint": hint})
        else:
            write(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it\n")

    try:
        serve(what, deferred.SceneAsked(toasts, parts, seed), port, tell)
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)


def serve(what: str, asked: "deferred.SceneAsked | None", port: int, tell: Tell) -> None:
    """Serve a run's replay, a task's scene or a world on 127.0.0.1 until interrupted; calls `tell(url, hint)` when ready."""
    if Path(what).is_dir():
        with deferred.LiveView(port, replay=replay_page(Path(what))) as page:
            tell(page.url, page.hint)
            _wait()
    with (
        deferred.seen(what, asked or deferred.SceneAsked()) as (title, recording),
        deferred.LiveView(port, title=title) as live,
    ):
        live.show(recording.bodies, recording.camera)
        live.update(recording.frames[-1])
        tell(live.url, live.hint)
        _wait()


def replay_page(folder: Path) -> Path:
    """The path of a run's replay page in its folder. Raises BadInput when there is none."""
    page = folder / "replay.html"
    if not page.is_file():
        raise BadInput(
            f"'{folder}' holds no replay.html: give the folder of a run (--out of lab run), a task or a world"
        )
    return page


def write_page(what: str, asked: "deferred.SceneAsked", out: Path) -> dict[str, str]:
    """The document of `lab view --out --json`, after writing a task's scene or a world as one HTML file."""
    if Path(what).is_dir():
        raise BadInput(f"'{what}' is the folder of a run: its replay.html is such a page already (--out)")
    if out.suffix != ".html":
        raise BadInput(f"page '{out}' (--out): its name must end in .html")
    with deferred.seen(what, asked) as (title, recording):
        return {"file": str(deferred.replay_html(recording, out, title=title))}


def _wait() -> None:
    while True:
        time.sleep(3600)
