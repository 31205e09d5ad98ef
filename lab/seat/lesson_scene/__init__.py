"""The live scene of a lesson for the teaching page: it shows the learner's state.

Nothing is simulated: bodies jump to a state. The cameras are placed so that the actions' names hold in the picture: right
is to the right, forward is away from the viewer.
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
    """A lesson's scene: all bodies, and a camera that sees all cells. It must be used in one thread only."""

    bodies: tuple[Body, ...]
    camera: Viewpoint

    def frame(self, state: int) -> Frame:
        """The frame with the changes since the last one, for the learner in `state`; the first frame places everything."""

    def close(self) -> None:
        """Free the scene's resources; safe to call again."""


def lesson_scene_of(where: "Prepared | GridWorld | None", problem: Problem) -> LessonScene | None:
    """The scene of a lesson in a world or in a skill of a prepared task; None where there is no scene."""
    if isinstance(where, GridWorld):
        return WorldScene(where, problem.mdp)
    if where is None or problem.name not in where.problems:
        return None
    return SkillScene(where.task, where.order, where.layout, where.skillset.skills[problem.name])


__all__ = ["LessonScene", "SkillScene", "WorldScene", "lesson_scene_of"]
