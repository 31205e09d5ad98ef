"""The live scene of a lesson: where the learner is, state by state, for the page that a person teaches in.

Nothing is simulated: a state is put up at once. The cameras look so that the actions' words are true in the picture:
right is to the right, forward is away from the viewer.
"""

from typing import TYPE_CHECKING, Protocol

from lab.seat.stage.skill_stage import SkillStage
from lab.seat.stage.world_stage import WorldStage
from lab.sim.frames import Body, Camera, Frame
from lab.skills.skill import Problem
from lab.tasks.grid_world import GridWorld

if TYPE_CHECKING:
    from lab.skills.prepared_scene import Prepared


class Stage(Protocol):
    """What a page shows of a lesson; it belongs to one thread."""

    @property
    def camera(self) -> Camera:
        """Where to look from: all cells are in sight."""

    def bodies(self) -> tuple[Body, ...]:
        """What there is to see."""

    def frame(self, state: int) -> Frame:
        """What has moved now that the learner is in `state`; the first frame places everything, times count up."""

    def close(self) -> None:
        """Free what the stage holds; safe to call again."""


def stage_of(where: "Prepared | GridWorld | None", problem: Problem) -> Stage | None:
    """The stage of a lesson in a world or in a skill of a prepared task; None where there is no scene."""
    if isinstance(where, GridWorld):
        return WorldStage(where, problem.mdp)
    if where is None or problem.name not in where.problems:
        return None
    return SkillStage(where.task, where.toasts, where.layout, where.skillset.skills[problem.name])


__all__ = ["SkillStage", "Stage", "WorldStage", "stage_of"]
