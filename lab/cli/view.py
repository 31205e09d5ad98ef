"""`lab view`: a scene, a grid world or a replay on a page."""

import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from lab.cli.options import Json, Parts, Seed, Toasts
from lab.cli.output import end, show, write, write_json
from lab.errors import BadInput, counted

if TYPE_CHECKING:
    from lab.sim.frames import Recording

Tell = Callable[[str, str], None]


class Asked(NamedTuple):
    """What of a task is shown: --toasts, --parts and --seed."""

    toasts: int | None
    parts: str | None
    seed: int


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
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0: any free one.")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", help="An .html file to write instead: the page, for any browser, offline.")
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Look at a task's scene, at a grid world in 3D or at a run's replay, on a page on 127.0.0.1, until Ctrl-C."""
    if out is not None:
        show(write_page(what, Asked(toasts, parts, seed), out), as_json, lambda document: document["file"])
        return

    def tell(url: str, hint: str) -> None:
        if as_json:
            write_json({"url": url, "hint": hint})
        else:
            write(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it\n")

    try:
        serve(what, Asked(toasts, parts, seed), port, tell)
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)


def serve(what: str, asked: Asked | None, port: int, tell: Tell) -> None:
    """Serve a run's replay, a task's scene or a world on 127.0.0.1 until interrupted; `tell(url, hint)` once it is there."""
    from lab.view.meshcat import LiveView

    if Path(what).is_dir():
        replay = Path(what) / "replay.html"
        if not replay.is_file():
            raise BadInput(
                f"'{what}' holds no replay.html: give the folder of a run (--out of lab run), a task or a world"
            )
        with LiveView(port, replay=replay) as page:
            tell(page.url, page.hint)
            _wait()
    with seen(what, asked or Asked(None, None, 0)) as (title, recording), LiveView(port, title=title) as live:
        live.show(recording.bodies, recording.camera)
        live.update(recording.frames[-1])
        tell(live.url, live.hint)
        _wait()


def write_page(what: str, asked: Asked, out: Path) -> dict[str, str]:
    """Write a task's scene or a world as one HTML file; the document of `lab view --out --json`."""
    from lab.view.meshcat import replay_html

    if Path(what).is_dir():
        raise BadInput(f"'{what}' is the folder of a run: its replay.html is such a page already (--out)")
    if out.suffix != ".html":
        raise BadInput(f"page '{out}' (--out): its name must end in .html")
    with seen(what, asked) as (title, recording):
        return {"file": str(replay_html(recording, out, title=title))}


@contextmanager
def seen(what: str, asked: Asked) -> "Iterator[tuple[str, Recording]]":
    """What a page calls a task or a world, and one frame of it; a large world's mesh is there as long as the block lasts."""
    from lab.mdp import shortest_way
    from lab.production.recorder import show_scene
    from lab.sim.scene.scene_check import check_scene
    from lab.skills.prepared_scene import lay_out
    from lab.tasks.cell_file import CellFile
    from lab.tasks.grid_world import GridWorld
    from lab.tasks.task import Task
    from lab.tasks.task_file import load, load_any
    from lab.view.still import Still
    from lab.view.world_bodies import WorldBodies

    found = load_any(what)
    if isinstance(found, GridWorld):
        mdp = found.mdp()
        way = [mdp.state_cell(state) for state in shortest_way(mdp)]
        with closing(WorldBodies(found)) as drawn:
            said = [found.title or found.name, f"shortest way: {counted(len(way) - 1, 'move')}"]
            if drawn.drawn < len(found.obstacles):
                said.append(f"{drawn.drawn} of {len(found.obstacles)} obstacles drawn")
            yield "; ".join(said), drawn.still(way)
        return
    if isinstance(found, CellFile) and found.in_physics is not None:
        found = load(what)
    if not isinstance(found, Task):
        raise BadInput(
            f"{what}: it is a cell, which has no scene: look at its order with lab sequence {what} --gantt x.svg"
        )
    order = found.ordered(asked.toasts, asked.parts)
    check_scene(found)
    still = Still()
    show_scene(found, order, lay_out(found, order, asked.seed), still)
    yield found.title or found.name, still.recording


def _wait() -> None:
    while True:
        time.sleep(3600)
