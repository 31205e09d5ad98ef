"""Place: set a part down on a plate, a buffer, a pallet or in a machine's groove, and release it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.kinds import Spot, on_its_pallet
from lab.sim.scene.scene import pallet_of
from lab.skills.around_part import SLOW, AroundPart
from lab.skills.camera_grids import RELEASE_ABOVE
from lab.skills.free_way import look_at
from lab.skills.sight import SkillFailed
from lab.skills.skill import Bench
from lab.skills.state_words import plain
from lab.tasks.task import Task
from lab.toolbox.policy import Policy

ACTIONS = ("left", "right", "backward", "forward", "down", "up")  # of the spot's axes
GOAL = (2, 2, 0)
NEAR_M = 0.012  # largest distance from its spot at which a part counts as standing on it


class PlacePart(AroundPart):
    """Set a part down at one station; a state is the tool's position relative to the spot (x, y, z)."""

    subtask: ClassVar[str] = "place"
    help: ClassVar[str] = "a part is set down at a station and let go"
    doing: ClassVar[str] = "sets {part} down"
    actions: ClassVar[tuple[str, ...]] = ACTIONS
    goal: ClassVar[tuple[int, ...]] = GOAL
    carries = True

    @classmethod
    def on_carry(cls, task: Task, kind: str, origin: str, target: str) -> "PlacePart | None":
        """The skill that sets the part down at the target; None for a target with a camera's grid (see `Insert`)."""
        return None if task.station(target).grid is not None else cls(task, kind, target)

    def goal_pose(self) -> ToolPose:
        """The tool pose at which a correctly held part is released."""
        return super().goal_pose().shifted(dz=RELEASE_ABOVE)

    def way_in_words(self) -> tuple[str, str]:
        """The part in the fingers, and its place at the station."""
        return f"{plain(self.kind).capitalize()} in the fingers is", f"its place at {plain(self.station)}"

    def motion(self, bench: Bench, policy: Policy) -> Iterator[None]:
        """Move above the spot, follow the learned path down, release, rise, and check that the part stands."""
        body, spot = bench.held, self.stands_on()
        if body is None:
            raise SkillFailed(f"nothing in the gripper to place at '{self.station}'")
        pallet = pallet_of(self.part)
        if pallet in bench.scene.kind_of and on_its_pallet(self.surveys.task, self.kind, self.station):
            foot = bench.scene.kind_of[pallet].foot_at(bench.part_pose(pallet, spot.yaw))
            spot = replace(spot, x=foot.x, y=foot.y)  # where the pallet was really set down
        goal = release_pose(bench, body, spot)
        yield from self.down(bench, policy, goal)
        yield from let_go(bench, self.surveys.exit_path(self.station, goal))
        yield from look_at(bench, self.surveys, self.station, body, spot)
        if bench.sight is not None:
            bench.sight.stands(self.part, self.kind, bench.sight.where[body])
        if not bench.stands(body, spot, NEAR_M):
            raise SkillFailed(f"{body} does not stand on '{self.station}'")
        if lost := bench.fallen_off(self.part, self.kind):
            raise SkillFailed(f"{lost} does not stand on {body} at '{self.station}'")


def release_pose(bench: Bench, body: str, spot: Spot) -> ToolPose:
    """The tool pose at which to release, so that the part, as it is actually held, stands on the spot.

    Raises SkillFailed when the fingers no longer hold the part.
    """
    if not bench.holds(body):
        raise SkillFailed(f"{body} is not in the gripper any more")
    tool, wanted = bench.scene.robot.tool(), bench.scene.kind_of[body].held_at(spot)
    hangs = bench.part_pose(body, tool.yaw)
    c, s = np.cos(tool.yaw), np.sin(tool.yaw)
    along = c * (hangs.x - tool.x) + s * (hangs.y - tool.y)
    one_jaw = bench.scene.robot.arm.gripper.one_jaw  # it has pushed the part aside; two fingers hold it in the middle
    across = c * (hangs.y - tool.y) - s * (hangs.x - tool.x) if one_jaw else 0.0
    return wanted.local(-along, -across, tool.z - hangs.z + RELEASE_ABOVE)


def let_go(bench: Bench, exit_path: Sequence[ToolPose]) -> Iterator[None]:
    """Open the fingers, and leave the station through the poses `exit_path`."""
    robot = bench.scene.robot
    yield from robot.release()
    bench.held = None
    for pose in exit_path:
        yield from robot.follow([pose], slow=SLOW)
