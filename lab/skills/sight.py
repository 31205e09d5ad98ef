"""Where parts stand as the camera in the hand has seen it: what a robot at a real table knows of them."""

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

ABOVE_M = 0.16  # from the grasp up to where the tool looks from, at least
REACHES = ((0.03, 0.2), (0.07, 0.4))  # [m], [rad] around where a part should be; the second when it is not in the first


class SkillFailed(Exception):
    """A skill noticed that it did not do what it is for; the text says why."""


class Sight:
    """Where the foot of each part was seen or set down last; at the beginning, where the task says that it stands.

    The pictures have a room's uneven light, blur and noise, drawn from the physics step in which they are taken.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.where: dict[str, Spot] = {}
        for number, spot in enumerate(scene.places.begins(scene.order), start=1):
            name, kind = part_name(scene.order, number), comes_as(scene.task.part(scene.order[number - 1]))
            self.stands(name, kind, spot)

    def stands(self, name: str, kind: str, spot: Spot) -> None:
        """Take it that a part stands on a spot, with what it rides on or carries."""
        for body, own in zip(self.scene.bodies_of(name, kind), self.scene.kinds[kind].stack(), strict=True):
            self.where[body] = spot
            spot = spot.raised(own.shape.height_m)

    def pose(self, body: str, like: float, held: str | None) -> ToolPose:
        """The tool pose that holds a part where it is known to be; what is in the gripper is where the gripper is."""
        kind = self.scene.kind_of[body]
        if body == held:
            return self.scene.robot.tool()
        if body not in self.where:
            raise WorkFailed(f"{body} has not been seen yet")
        pose = kind.held_at(self.where[body])
        return replace(pose, yaw=kind.turned_like(pose.yaw, like))

    def look(self, body: str, spot: Spot) -> PartSeen | None:
        """Take a picture with the camera in the hand, and find the part in it that should stand at `spot`; None: not seen."""
        part, image = self.looked_for(body, spot), self.picture()
        for reach_m, reach_rad in REACHES:
            if seen := find_part(image, part, (spot.x, spot.y, spot.yaw), reach_m, reach_rad):
                yaw = spot.yaw if part.round else seen.yaw
                self.where[body] = Spot(seen.x, seen.y, spot.z, yaw)
                return seen
        return None

    def picture(self) -> Image:
        """What the camera in the hand sees now (H, W, 3)."""
        world = self.scene.world
        return spoiled(hand_camera(self.scene.robot.tool()).picture(world), np.random.default_rng([world.steps]))

    def looked_for(self, body: str, spot: Spot) -> Outlined:
        """What the part looks like from where the camera is now."""
        kind = self.scene.kind_of[body]
        camera, shape = hand_camera(self.scene.robot.tool()), kind.shape
        colours = np.array([look.rgba[:3] for look in shape.looks])
        return Outlined(seen_corners(shape), spot.z, not kind.grip.period, camera.pixel_from_world(), colours)
