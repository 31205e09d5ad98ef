"""A grid world as the subject of a lesson."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lab.errors import BadInput, unknown
from lab.learning.problem import Problem
from lab.tasks.grid_world import GridWorld
from lab.tasks.task_file import load_world
from lab.teaching.lesson import Subject
from lab.teaching.lesson_options import LessonOptions
from lab.toolbox.policy import Policy
from lab.view.plots import grid_values

SIGHTS = ("full", "limited")


@dataclass
class WorldSubject(Subject):
    """A grid world as a subject; with the sight "limited", advice counts in the region of its file only.

    Raises BadInput for an unknown sight, and if the file has no region.
    """

    world: GridWorld
    sight: str = "full"

    def __post_init__(self) -> None:
        if self.sight not in SIGHTS:
            raise unknown("sight", self.sight, SIGHTS, "--sight")
        if self.sight == "limited" and self.world.view is None:
            raise BadInput(f"sight 'limited' (--sight): the file of world '{self.world.name}' has no [view]")
        self.name, self.settings, self.scene = self.world.name, self.world, self.world
        self.region = self.world.region() if self.sight == "limited" else None

    @classmethod
    def of(cls, options: LessonOptions) -> "WorldSubject":
        """The world that the options name."""
        world = load_world(options.subtask)
        if options.task is not None:
            raise BadInput(
                f"task '{options.task}' (--task): the world '{options.subtask}' belongs to no task: remove --task"
            )
        return cls(options.changed(world), options.view or "full")

    def prepare(self, seed: int) -> Problem:
        """The problem that the world poses. Raises BadInput if it cannot be learned (see `GridWorld.check`)."""
        return Problem(self.name, "world", self.world.check())

    def facts(self) -> dict[str, Any]:
        """The sight of the advisor."""
        return {"view": self.sight}

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """Draws the values of a world with two axes, and the greedy path."""
        if len(self.world.shape) != 2:
            return {}
        path = out / "value-map.png"
        grid_values(policy.q, self.world.mdp(), path)
        return {"value_map": str(path)}
