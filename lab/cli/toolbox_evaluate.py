"""`lab toolbox evaluate`: how often a policy does what it is for."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, Seed, ToolboxPlace
from lab.cli.output import console, end, show
from lab.errors import counted

if TYPE_CHECKING:
    from rich.console import RenderableType

MAX_SCENES = 100_000


def toolbox_evaluate(
    name: str,
    scenes: Annotated[int, typer.Option("--scenes", min=1, max=MAX_SCENES, help="How many scenes are drawn.")] = 20,
    task: Annotated[
        str | None, typer.Option("--task", help="Whose scenes; default: the task that it was learned in.")
    ] = None,
    skill: Annotated[
        str | None, typer.Option("--skill", help="The skill that it is for, where its name does not tell.")
    ] = None,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Carry a policy out in physics, in scenes drawn from the seed on: how often it does what it is for, for its log."""
    box = deferred.Toolbox(toolbox)
    policy = box.load(box.show(name)["file"])
    found = deferred.task_of(policy, task)
    wanted = deferred.skill_of(policy, found, skill)
    with deferred.counting(console(), "scenes") as told:
        evaluation = deferred.evaluate(policy, found, wanted, scenes, seed, told)
    document = evaluation.to_json()
    if document["scenes"]:
        box.note(policy.name, deferred.EVALUATED, **evaluation.facts())
    show(document, as_json, evaluation_summary)
    if evaluation.interrupted:
        end(f"stopped by Ctrl-C after {counted(len(evaluation.scenes), 'scene')} of {scenes}", 130)
    if not document["scenes"]:
        end(f"in none of {counted(scenes, 'drawn scene')} can '{wanted}' reach its goal", 1)


def evaluation_summary(found: Mapping[str, Any]) -> "RenderableType":
    """What `lab toolbox evaluate` shows, from its JSON document: the share, and a line for each scene that failed."""
    from rich.console import Group
    from rich.text import Text

    scenes = f"{counted(found['scenes'], 'drawn scene')} of {found['task']} from seed {found['seed']}"
    lines = [f"'{found['policy']}' as '{found['skill']}': {found['successes']} of {scenes} succeeded"]
    if found["success_percent"] is not None:
        low, high = found["ci95"]
        lines.append(f"success {found['success_percent']:.1f} % (95 % interval {low:.1f} to {high:.1f})")
    if found["mean_sim_s"] is not None:
        lines.append(f"a success takes {found['mean_sim_s']:.1f} s on average")
    if found["unsolvable"]:
        lines.append(f"not counted: {counted(found['unsolvable'], 'scene')} in which nobody could reach the goal")
    failed = [row for row in found["rows"] if not row["success"]]
    return Group(*map(Text, lines), *(Text(f"seed {row['seed']}: {row['reason']}", "red") for row in failed))
