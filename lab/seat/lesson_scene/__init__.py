"""The live scene of a lesson: where the learner is, state by state, for the page that a person teaches in.

Nothing is simulated: a state is put up at once. The cameras look so that the actions' words are true in the picture:
right is to the right, forward is away from the viewer.
"""

from typing import TYPE_CHECKING, Protocol

from lab.learning.problem import Problem
from lab.seat.lesson_scene.skill_scene import SkillScene
from lab.seat.lesson_scene.world_scene import WorldScene
from lab.sim.frames import Body, Frame, Viewpoint
from lab.tasks.grid_world import GridWorld

if TYPE_CHECKING:
    from lab.skills.prepared_scene import Prepared


class LessonScene(Protocol):
    """What a page shows of a lesson: all bodies, and a camera that has all cells in sight; it belongs to one thread."""

    bodies: tuple[Body, ...]
    camera: Viewpoint

    def frame(self, state: int) -> Frame:
        """What has moved now that the learner is in `state`; the first frame places everything, times count up."""

    def close(self) -> None:
        """Free what the scene holds; safe to call again."""


def lesson_scene_of(where: "Prepared | GridWorld | None", problem: Problem) -> LessonScene | None:
    """The scene of a lesson in a world or in a skill of a prepared task; None where there is no scene."""
    if isinstance(where, GridWorld):
        return WorldScene(where, problem.mdp)
    if where is None or problem.name not in where.problems:
        return None
    return SkillScene(where.task, where.order, where.layout, where.skillset.skills[problem.name])


__all__ = ["LessonScene", "SkillScene", "WorldScene", "lesson_scene_of"]
