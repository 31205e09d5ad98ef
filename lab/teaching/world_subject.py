"""A grid world as what a lesson is about."""

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

SIGHTS = ("full", "limited")


@dataclass
class WorldSubject(Subject):
    """A grid world, in which nothing is simulated; with the sight "limited" advice comes from the region in its file only.

    Raises BadInput for an unknown sight, and when the world has no limited one.
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
                f"task '{options.task}' (--task): the world '{options.subtask}' belongs to no task: leave --task away"
            )
        return cls(options.changed(world), options.view or "full")

    def prepare(self, seed: int) -> Problem:
        """What the world sets to learn; BadInput when that cannot be learned (see `GridWorld.check`)."""
        return Problem(self.name, "world", self.world.check())

    def facts(self) -> dict[str, Any]:
        """Where the advisor saw the robot."""
        return {"view": self.sight}

    def draw(self, policy: Policy, out: Path) -> dict[str, str]:
        """The values of a world with two axes, and the learned way through it."""
        if len(self.world.shape) != 2:
            return {}
        from lab.view.plots import grid_values

        path = out / "value-map.png"
        grid_values(policy.q, self.world.mdp(), path)
        return {"value_map": str(path)}
