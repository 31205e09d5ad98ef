"""A Gymnasium environment as what a lesson is about."""

from dataclasses import dataclass

from lab.errors import BadInput
from lab.gym.gym_problem import GymWorld, gym_world
from lab.learning.problem import Problem
from lab.teaching.lesson import Subject
from lab.teaching.lesson_options import LessonOptions


@dataclass
class GymSubject(Subject):
    """An environment with discrete states and actions; nothing of it is shown beside its table."""

    world: GymWorld

    def __post_init__(self) -> None:
        self.name, self.settings = self.world.name, self.world

    @classmethod
    def of(cls, options: LessonOptions) -> "GymSubject":
        """The environment that the options name."""
        for option, value in (("--task", options.task), ("--sight", options.view)):
            if value is not None:
                raise BadInput(
                    f"{option} {value}: a Gymnasium environment, '{options.subtask}', has none: leave it away"
                )
        return cls(options.changed(gym_world(options.subtask)))

    def prepare(self, seed: int) -> Problem:
        """What the environment sets to learn."""
        return self.world.problem()
