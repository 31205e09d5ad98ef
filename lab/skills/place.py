"""Place: set a slice down on a plate, a buffer or in a machine's groove, and let go."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from lab.sim.kinematics import ToolPose
from lab.sim.scene import Spot, is_toaster, spots
from lab.skills.around_slice import SLOW, AroundSlice
from lab.skills.skill import Bench, SkillFailed
from lab.skills.surveys import RELEASE_ABOVE
from lab.tasks.task_file import Task

if TYPE_CHECKING:
    from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up")  # of the spot's axes
GOAL = (2, 2, 0)
NEAR_M = 0.012  # a slice this near to its spot stands on it


class Place(AroundSlice):
    """Set a slice down at one station: the table holds the tool's position relative to the spot (x, y, z)."""

    subtask: ClassVar[str] = "place"
    help: ClassVar[str] = "a slice is set down at a station and let go"
    actions: ClassVar[tuple[str, ...]] = ACTIONS
    goal: ClassVar[tuple[int, ...]] = GOAL
    carries = True

    @classmethod
    def on_carry(cls, task: Task, origin: str, target: str) -> "Place | None":
        """At the end, where the camera's grid does not lead."""
        return None if is_toaster(task.station(target)) else cls(target)

    def goal_pose(self) -> ToolPose:
        """Where the tool lets go of a slice held in its middle."""
        return self._spot().grasp().shifted(dz=RELEASE_ABOVE)

    def _spot(self) -> Spot:
        return self.spot or spots(self.surveys.task.station(self.station))[0]

    def motion(self, bench: Bench, policy: "Policy") -> Iterator[None]:
        """Go above the spot, follow the learned cells down, let go, rise, and see that the slice stands."""
        name, spot = bench.held, self._spot()
        if name is None:
            raise SkillFailed(f"nothing in the gripper to place at '{self.station}'")
        goal = release_pose(bench, name, spot)
        yield from self.down(bench, policy, goal)
        yield from let_go(bench, goal, self.surveys.approach(self.station))
        if not bench.stands(name, spot.grasp(), NEAR_M):
            raise SkillFailed(f"{name} does not stand on '{self.station}'")


def release_pose(bench: Bench, name: str, spot: Spot) -> ToolPose:
    """Where the tool lets go so that the slice, as it hangs in the fingers, stands on the spot."""
    tool, hangs, wanted = bench.scene.robot.tool(), bench.slice_pose(name), spot.grasp()
    c, s = np.cos(tool.yaw), np.sin(tool.yaw)
    along = c * (hangs.x - tool.x) + s * (hangs.y - tool.y)
    return wanted.local(-along, 0.0, tool.z - hangs.z + RELEASE_ABOVE)


def let_go(bench: Bench, at: ToolPose, approach: ToolPose) -> Iterator[None]:
    """Open the fingers, rise straight up, and come to the station's approach."""
    robot = bench.scene.robot
    yield from robot.release()
    bench.held = None
    yield from robot.follow([ToolPose(at.x, at.y, approach.z, at.yaw)], slow=SLOW)
    yield from robot.follow([approach], slow=SLOW)
