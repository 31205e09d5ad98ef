"""The survey of a grid in a scene: cells that are free, out of reach or blocked, and by what. It needs its own world."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import Spot
from lab.sim.scene.scene import TABLE, Scene

OUT_OF_REACH = "out of reach"
CARRIED = "carried part"
FINGERS_OFF_M = 0.0005  # [m] gap between a finger and a part that is put between the fingers
FOREARM = 3  # the first link that a level tool brings near the table; the links before it stand on the table
_AWAY = Spot(0.0, 0.0, -5.0, 0.0)


@dataclass(frozen=True)
class Survey:
    """The result of a survey; causes: '' (free), 'out of reach' or the name of a blocking body, of the grid's shape."""

    causes: NDArray[np.str_]

    @property
    def blocked(self) -> NDArray[np.bool_]:
        """A mask of the cells that the tool cannot enter, bool of the grid's shape."""
        return np.asarray(self.causes != "")

    def names(self, cells: Sequence[tuple[int, ...]]) -> list[str]:
        """The causes that block these cells, each once, in alphabetical order."""
        return sorted({str(self.causes[cell]) for cell in cells} - {""})


def in_the_way(causes: Sequence[str], station: str) -> str:
    """The text of an error about bodies that block a station; for the station's own body, with the fields to change."""
    if [*causes] == [OUT_OF_REACH]:
        return OUT_OF_REACH
    named = ", ".join(f"{cause} itself" if cause == station else cause for cause in causes)
    own = ": change its body, size_m, floor_m, spots or approach" if [*causes] == [station] else ""
    return f"in the way: {named}{own}"


class Surveyor:
    """Places the arm at poses in a scene, with or without a part in the fingers, and measures distances to all bodies."""

    def __init__(self, scene: Scene, carried: str | None, *, clearance: float, ignore: Sequence[str] = ()) -> None:
        """carried: the kind in the fingers; clearance: the least distance to every body [m], except those of `ignore`."""
        self.scene, self.carried, self.clearance = scene, carried, clearance
        self.solid = [name for name in scene.solid if name not in ignore]
        self.moving = [NAME]
        if carried is not None:
            scene.add(CARRIED, carried, _AWAY)
            self.moving += scene.bodies_of(CARRIED, carried)
            scene.robot.open_at_once(scene.kinds[carried].grip.width_m / 2 + FINGERS_OFF_M)

    def cause(self, pose: ToolPose) -> str:
        """The cause that keeps the tool from `pose`; '' if there is none."""
        return next(self._causes([pose]))

    def free(self, poses: Sequence[ToolPose]) -> bool:
        """Whether the tool can be at all of these poses."""
        return not any(self._causes(poses))

    def _causes(self, poses: Sequence[ToolPose]) -> Iterator[str]:
        """The cause of each of many poses, whose joint positions are computed together."""
        robot = self.scene.robot
        joints = robot.arm.inverse_each(np.array([[p.x, p.y, p.z, p.yaw] for p in poses]))  # (n, k)
        for pose, own in zip(poses, joints, strict=True):
            if hypot(pose.x, pose.y) < robot.arm.nearest_m or np.isnan(own[0]):
                yield OUT_OF_REACH
                continue
            robot.hold(own)
            yield self._touched(pose)

    def _touched(self, pose: ToolPose) -> str:
        """The body that is too near to the arm at `pose` or to its part; '' if there is none."""
        world = self.scene.world
        if self.carried is not None:
            self.scene.put(CARRIED, self.carried, pose)
        for name in self.solid:
            if any(world.nearest(moving, name, self.clearance) < self.clearance for moving in self.moving):
                return name
        level = self.scene.robot.arm.level is not None
        if level and world.nearest(NAME, TABLE, self.clearance, FOREARM) < self.clearance:
            return TABLE
        return ""

    def grid(self, shape: tuple[int, ...], pose_of: Callable[[tuple[int, ...]], ToolPose]) -> Survey:
        """Survey every cell of a grid whose cell i has the tool at pose_of(i)."""
        causes = np.array([*self._causes([pose_of(cell) for cell in np.ndindex(*shape)])], dtype="U40")
        return Survey(causes.reshape(shape))
