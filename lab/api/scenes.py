"""`lab.show`: the scene of a task or a grid world in 3D, as an HTML page."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from lab.api.options import check_common
from lab.api.pictures import Page
from lab.errors import BadInput, counted
from lab.mdp import shortest_path
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import GridWorld
from lab.tasks.task import Task
from lab.tasks.task_file import load, load_any

if TYPE_CHECKING:
    from lab.sim.frames import Recording


class SceneRequest(NamedTuple):
    """The options that say which scene of a task is shown: --toasts, --parts and --seed."""

    toasts: int | None = None
    parts: str | None = None
    seed: int = 0


def show(
    what: str | Path | GridWorld | Task, *, toasts: int | None = None, parts: str | None = None, seed: int = 0
) -> Page:
    """The scene of a task or a grid world in 3D, as a page.

    what: a name or file of a task or world, or the object itself; toasts, parts: the order, as for `lab run`; seed: of the scene.
    Raises BadInput for anything that has no scene, such as a cell without physics.

        >>> import lab, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     lab.show("toast", toasts=1).save(f"{folder}/toast.html").suffix
        '.html'
    """
    from lab.view.meshcat import replay_html

    check_common("lab.show", toasts=toasts, parts=parts, seed=seed)
    if not isinstance(what, str | Path | GridWorld | Task):
        raise BadInput(f"what {what!r} (lab.show): wanted a name or file of a task or a world, a GridWorld or a Task")
    with seen(what, SceneRequest(toasts, parts, seed)) as (title, recording), TemporaryDirectory() as folder:
        path = replay_html(recording, Path(folder) / "scene.html", title=title)
        return Page(path.read_text(encoding="utf-8"))


@contextmanager
def seen(what: str | Path | GridWorld | Task, asked: SceneRequest) -> "Iterator[tuple[str, Recording]]":
    """The title of a task or world, and a recording of one frame; the meshes of a large world exist only within the block."""
    from lab.production.recorder import show_scene
    from lab.sim.scene.scene_check import check_scene
    from lab.skills.prepared_scene import lay_out
    from lab.view.rasterizer import Still
    from lab.view.world_bodies import WorldBodies

    shown = load_any(str(what)) if isinstance(what, str | Path) else what
    if isinstance(shown, GridWorld):
        mdp = shown.mdp()
        path = [mdp.state_cell(state) for state in shortest_path(mdp)]
        with closing(WorldBodies(shown)) as drawn:
            title_parts = [shown.title or shown.name, f"shortest path: {counted(len(path) - 1, 'move')}"]
            if drawn.drawn < len(shown.obstacles):
                title_parts.append(f"{drawn.drawn} of {len(shown.obstacles)} obstacles drawn")
            yield "; ".join(title_parts), drawn.still(path)
        return
    if isinstance(shown, CellFile) and shown.in_physics is not None:
        shown = load(str(what))
    if not isinstance(shown, Task):
        raise BadInput(
            f"{what}: it is a cell, which has no scene: look at its order with lab sequence {what} --gantt x.svg"
        )
    order = shown.ordered(asked.toasts, asked.parts)
    check_scene(shown)
    still = Still()
    show_scene(shown, order, lay_out(shown, order, asked.seed), still)
    yield shown.title or shown.name, still.recording
