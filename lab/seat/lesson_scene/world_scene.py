"""The scene of a grid world: the robot is a ball on a board (two axes) or in a room (three)."""

from lab.mdp import TabularMDP
from lab.seat.lesson_scene.skill_scene import STEP_S, EpisodeTrail, upright
from lab.sim.frames import Body, Frame, Rgba, Shape, Vector
from lab.tasks.grid_world import GridWorld
from lab.view.scene_data import vector
from lab.view.world_bodies import BALL_M, BLUE, FLAT, WorldBodies

SHADE: Rgba = (0.30, 0.36, 0.46, 0.55)


class WorldScene:
    """The robot in a world's bodies, with its episode's trail."""

    def __init__(self, world: GridWorld, mdp: TabularMDP) -> None:
        """`mdp` is the world's problem."""
        self._mdp, self._frames = mdp, 0
        self._drawn = WorldBodies(world)
        self._ball = max(0.36 * self._drawn.size, BALL_M)
        self._marks = EpisodeTrail(mdp, self.place, 0.3 * self._ball, 1.6 * self._ball)
        self.bodies = (*self._drawn.bodies, *self._robot(), *self._marks.bodies())
        self.camera = self._drawn.camera()

    def place(self, state: int) -> Vector:
        """The centre of a state's cell [m]."""
        return vector(self._drawn.centres([self._mdp.state_cell(state)])[0])

    def _robot(self) -> tuple[Body, ...]:
        """A ball, and in a room a disc on the ground below it, which shows its depth."""
        ball = Body("robot", (Shape("sphere", (self._ball,), None, BLUE),))
        if self._drawn.flat:
            return (ball,)
        return (ball, Body("below", (Shape("cylinder", (self._ball, FLAT * self._drawn.size), None, SHADE),)))

    def frame(self, state: int) -> Frame:
        """The frame with the robot in the cell of `state`."""
        poses, visible = self._marks.at(state)
        x, y, z = self.place(state)
        poses["robot"] = upright((x, y, z))
        if not self._drawn.flat:
            poses["below"] = upright((x, y, FLAT * self._drawn.size))
        self._frames += 1
        return Frame(self._frames * STEP_S, poses, {}, visible)

    def close(self) -> None:
        """Remove the mesh's file."""
        self._drawn.close()
