"""`lab.show`: a task's scene or a world in 3D, as one page."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from lab.api.pictures import Page
from lab.errors import BadInput, counted
from lab.tasks.grid_world import GridWorld
from lab.tasks.task import Task

if TYPE_CHECKING:
    from lab.sim.frames import Recording


class Asked(NamedTuple):
    """What of a task is shown: --toasts, --parts and --seed."""

    toasts: int | None = None
    parts: str | None = None
    seed: int = 0


def show(
    what: str | Path | GridWorld | Task, *, toasts: int | None = None, parts: str | None = None, seed: int = 0
) -> Page:
    """A task's scene or a grid world in 3D, as `lab view` shows it. BadInput for what has no scene."""
    from lab.view.meshcat import replay_html

    with seen(what, Asked(toasts, parts, seed)) as (title, recording), TemporaryDirectory() as folder:
        path = replay_html(recording, Path(folder) / "scene.html", title=title)
        return Page(path.read_text(encoding="utf-8"))


@contextmanager
def seen(what: str | Path | GridWorld | Task, asked: Asked) -> "Iterator[tuple[str, Recording]]":
    """What a page calls a task or a world, and one frame of it; a large world's mesh is there as long as the block lasts."""
    from lab.mdp import shortest_path
    from lab.production.recorder import show_scene
    from lab.sim.scene.scene_check import check_scene
    from lab.skills.prepared_scene import lay_out
    from lab.tasks.cell_file import CellFile
    from lab.tasks.task_file import load, load_any
    from lab.view.rasterizer import Still
    from lab.view.world_bodies import WorldBodies

    found = load_any(str(what)) if isinstance(what, str | Path) else what
    if isinstance(found, GridWorld):
        mdp = found.mdp()
        way = [mdp.state_cell(state) for state in shortest_path(mdp)]
        with closing(WorldBodies(found)) as drawn:
            said = [found.title or found.name, f"shortest way: {counted(len(way) - 1, 'move')}"]
            if drawn.drawn < len(found.obstacles):
                said.append(f"{drawn.drawn} of {len(found.obstacles)} obstacles drawn")
            yield "; ".join(said), drawn.still(way)
        return
    if isinstance(found, CellFile) and found.in_physics is not None:
        found = load(str(what))
    if not isinstance(found, Task):
        raise BadInput(
            f"{what}: it is a cell, which has no scene: look at its order with lab sequence {what} --gantt x.svg"
        )
    order = found.ordered(asked.toasts, asked.parts)
    check_scene(found)
    still = Still()
    show_scene(found, order, lay_out(found, order, asked.seed), still)
    yield found.title or found.name, still.recording
