"""The commands about task files: check one, describe it, write a random world."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lab.cellfile import CellFile
from lab.errors import BadInput, LabError
from lab.mdp import shortest_steps
from lab.production.report import check_out
from lab.production.skill_subject import fitting
from lab.tasks.grid_world import RANDOM, GridWorld, parse_shape, random_world
from lab.tasks.record import read_text, write_whole
from lab.tasks.task_file import check_number, find, load_any
from lab.teaching.world_subject import world_problem

AXES = """\
Drawn at random. Cells are counted from 0; with two axes they are [row, column], row 0 on top, with three [x, y, z], y
away from you and z up.
"""


def check_task(file: str, toasts: int | None, seed: int) -> list[str]:
    """What is wrong with a task file, its scene and its problems for so many toasts, or with a cell or a world; or nothing.

    Without a number: a task for 3 toasts, or as many as there is room for; a cell for its own order.
    Raises BadInput for a file that is not there, and for a number that this kind of file never takes.
    """
    if not file.startswith(RANDOM):
        find(file)
    try:
        task = load_any(file)
    except LabError as error:
        return [str(error)]
    if toasts is not None:
        task.ordered(toasts) if isinstance(task, CellFile) else check_number(toasts)
    try:
        if isinstance(task, GridWorld):
            world_problem(task)
        elif isinstance(task, CellFile):
            task.cell(toasts)
        else:
            from lab.production.run import prepare

            prepare(task, fitting(task, 3) if toasts is None else toasts, seed)
    except LabError as error:
        return [str(error)]
    return []


def describe(word: str) -> tuple[str, dict[str, Any]]:
    """The text of a task, a cell or a world, and the document of `lab task show --json`; a drawn world has no "file"."""
    found = load_any(word)
    if isinstance(found, GridWorld) and word.startswith(RANDOM):
        return found.to_toml(), {"file": None, **found.model_dump(mode="json")}
    path = find(word)
    return read_text(path), {"file": str(path), **found.model_dump(mode="json")}


def write_random(shape: str, density: float, seed: int, out: Path) -> dict[str, Any]:
    """Write a random world as a task file; the document of `lab task random --json`."""
    if out.suffix != ".toml":
        raise BadInput(f"task file '{out}' (--out): its name must end in .toml")
    world = random_world(parse_shape(shape, "SHAPE"), density, seed)
    if out.exists():
        raise BadInput(f"task file '{out}' (--out): there is one already: choose another name, or remove it")
    write_whole(out, world.to_toml(AXES))
    return {
        "file": str(out),
        "name": world.name,
        "shape": list(world.shape),
        "density": density,
        "seed": seed,
        "start": list(world.start),
        "goal": list(world.goal),
        "obstacles": len(world.obstacles),
        "optimal_steps": shortest_steps(world.mdp()),
    }


def reconstruct_world(seed: int, out: Path, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Look for a world like world II and write it as a task file; the document of `lab task reconstruct --json`."""
    from lab.studies.thesis.world_2 import COMMENT, reconstruct

    if out.suffix != ".toml":
        raise BadInput(f"task file '{out}' (--out): its name must end in .toml")
    check_out(out.parent)
    world = reconstruct(seed, progress)
    write_whole(out, world.to_toml(COMMENT.format(seed=seed, file=out.name)))
    return {"file": str(out), "seed": seed, **world.model_dump(mode="json")}
