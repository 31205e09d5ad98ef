"""The parts' positions as seen by the camera in the hand: all that a robot at a real table knows of them."""

from dataclasses import replace

import numpy as np

from lab.errors import WorkFailed
from lab.sim.arms.kinematics import ToolPose
from lab.sim.camera import hand_camera, seen_corners
from lab.sim.parts.kinds import Spot, comes_as
from lab.sim.scene.scene import Scene
from lab.tasks.task import part_name
from lab.vision import Image
from lab.vision.lens import spoiled
from lab.vision.part_outline import Outlined, PartSeen, find_part

ABOVE_M = 0.16  # least height above the grasp from which the camera looks
REACHES = ((0.03, 0.2), (0.07, 0.4))  # [m], [rad] search ranges around a part's expected pose, tried in this order


class SkillFailed(Exception):
    """Raised by a skill that did not reach its aim; the text says why."""


class Sight:
    """The foot of each part, where it was last seen or set down; at first, where the task places it.

    The pictures have a room's uneven light, blur and noise, seeded by the physics step in which they are taken.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.where: dict[str, Spot] = {}
        for number, spot in enumerate(scene.places.begins(scene.order), start=1):
            name, kind = part_name(scene.order, number), comes_as(scene.task.part(scene.order[number - 1]))
            self.stands(name, kind, spot)

    def stands(self, name: str, kind: str, spot: Spot) -> None:
        """Record that a part stands on a spot, together with the bodies stacked below and above it."""
        for body, own in zip(self.scene.bodies_of(name, kind), self.scene.kinds[kind].stack(), strict=True):
            self.where[body] = spot
            spot = spot.raised(own.shape.height_m)

    def pose(self, body: str, like: float, held: str | None) -> ToolPose:
        """The tool pose that would hold a part at its known place; for the `held` part, the tool's own pose.

        like: yaw [rad] that the part's yaw is to be closest to, within its symmetry. WorkFailed for a part never seen.
        """
        kind = self.scene.kind_of[body]
        if body == held:
            return self.scene.robot.tool()
        if body not in self.where:
            raise WorkFailed(f"{body} has not been seen yet")
        pose = kind.held_at(self.where[body])
        return replace(pose, yaw=kind.turned_like(pose.yaw, like))

    def look(self, body: str, spot: Spot) -> PartSeen | None:
        """The part expected at `spot`, found in a new picture of the camera in the hand; None when it is not seen."""
        part, image = self.looked_for(body, spot), self.picture()
        for reach_m, reach_rad in REACHES:
            if seen := find_part(image, part, (spot.x, spot.y, spot.yaw), reach_m, reach_rad):
                yaw = spot.yaw if part.round else seen.yaw
                self.where[body] = Spot(seen.x, seen.y, spot.z, yaw)
                return seen
        return None

    def picture(self) -> Image:
        """The picture (H, W, 3) of the camera in the hand now."""
        world = self.scene.world
        return spoiled(hand_camera(self.scene.robot.tool()).picture(world), np.random.default_rng([world.steps]))

    def looked_for(self, body: str, spot: Spot) -> Outlined:
        """The outline that the part is expected to show from the camera's current pose."""
        kind = self.scene.kind_of[body]
        camera, shape = hand_camera(self.scene.robot.tool()), kind.shape
        colours = np.array([look.rgba[:3] for look in shape.looks])
        return Outlined(seen_corners(shape), spot.z, not kind.grip.period, camera.pixel_from_world(), colours)
