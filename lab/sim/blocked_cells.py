"""A scene -> the cells of a grid that are free, out of reach or blocked, and by what. Run it in a world of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from lab.files import assets_folder
from lab.sim import models
from lab.sim.kinematics import ToolPose
from lab.sim.robot import NAME
from lab.sim.scene import Scene

OUT_OF_REACH = "out of reach"
CARRIED = "carried slice"
_AWAY = (0.0, 0.0, -5.0)


@dataclass(frozen=True)
class Survey:
    """What stands in the way of each cell: `causes` has the grid's shape and holds '' (free), 'out of reach' or a body's name."""

    causes: NDArray[np.str_]

    @property
    def blocked(self) -> NDArray[np.bool_]:
        """The cells that the tool cannot be in, bool, the grid's shape."""
        return np.asarray(self.causes != "")

    def names(self, cells: Sequence[tuple[int, ...]]) -> list[str]:
        """What blocks these cells, each cause once, in order of the alphabet."""
        return sorted({str(self.causes[cell]) for cell in cells} - {""})


class Surveyor:
    """Puts the arm at one pose after the other in a scene and measures what is near; with or without a slice in the fingers."""

    def __init__(self, scene: Scene, *, loaded: bool, clearance: float, ignore: Sequence[str] = ()) -> None:
        """`clearance` [m] is how far everything must stay away; bodies in `ignore` may be touched."""
        self.scene, self.loaded, self.clearance = scene, loaded, clearance
        self.solid = [name for name in scene.solid if name not in ignore]
        world = scene.world
        if loaded:
            world.load(CARRIED, assets_folder() / "slice.urdf", _AWAY, fixed=False)
            scene.robot.open_at_once(models.SLICE[1] / 2 + 0.0005)

    def cause(self, pose: ToolPose) -> str:
        """'' when the tool can be at `pose`, else why not."""
        if hypot(pose.x, pose.y) < self.scene.robot.arm.nearest_m or not self.scene.robot.stand(pose):
            return OUT_OF_REACH
        world = self.scene.world
        if self.loaded:
            self.scene.put_slice(CARRIED, pose)
        for name in self.solid:
            if world.nearest(NAME, name, self.clearance) < self.clearance:
                return name
            if self.loaded and world.nearest(CARRIED, name, self.clearance) < self.clearance:
                return name
        return ""

    def grid(self, shape: tuple[int, ...], pose_of: Callable[[tuple[int, ...]], ToolPose]) -> Survey:
        """Survey every cell of a grid whose cell i has the tool at pose_of(i)."""
        causes = np.full(shape, "", dtype="U40")
        for cell in np.ndindex(*shape):
            causes[cell] = self.cause(pose_of(cell))
        return Survey(causes)
