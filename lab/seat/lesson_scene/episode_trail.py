"""The episode in a lesson's scene: marks at the cells that the learner visited, and at the obstacle that it ran into."""

from collections.abc import Callable
from dataclasses import dataclass

from lab.mdp import TabularMDP
from lab.sim.frames import Body, Pose, Rgba, Shape, Vector

STEP_S = 0.1  # [s] between two frames; nothing is simulated, times only have to increase
TRAIL = 48  # number of latest cells of the episode that are marked
RED: Rgba = (0.86, 0.16, 0.14, 0.6)
FAINT: Rgba = (0.16, 0.38, 0.78, 0.35)

Changes = tuple[dict[str, Pose], dict[str, bool]]  # poses and visibility, by body, for a frame


@dataclass
class EpisodeTrail:
    """Balls at the cells of the episode so far, and at a blocked cell that was entered.

    `place` gives the centre of a state's cell [m]; the radii [m] are those of both kinds of balls. A new episode begins
    after a terminal state, and when the state is not a neighbour of the last one.
    """

    mdp: TabularMDP
    place: Callable[[int], Vector]
    trail_m: float
    collision_m: float
    _last: int | None = None
    _count: int = 0

    def bodies(self) -> tuple[Body, ...]:
        """The balls, at the origin."""
        step = Shape("sphere", (self.trail_m,), None, FAINT)
        collision = Shape("sphere", (self.collision_m,), None, RED)
        return (*(Body(f"trail {number}", (step,)) for number in range(TRAIL)), Body("collision", (collision,)))

    def at(self, state: int) -> Changes:
        """The changes when the learner comes to `state`."""
        last, self._last = self._last, state
        poses: dict[str, Pose] = {}
        visible: dict[str, bool] = {}
        if last is None or self.mdp.terminal[last] or state not in self.mdp.successor[last]:
            visible = {f"trail {number}": False for number in range(TRAIL)}
        elif state != last:
            name = f"trail {self._count % TRAIL}"
            self._count += 1
            poses[name], visible[name] = upright(self.place(last)), True
        visible["collision"] = bool(self.mdp.terminal[state] and not self.mdp.goal[state])
        if visible["collision"]:
            poses["collision"] = upright(self.place(state))
        return poses, visible


def upright(at: Vector) -> Pose:
    """The pose at a place, without rotation."""
    return (*at, 0.0, 0.0, 0.0, 1.0)
