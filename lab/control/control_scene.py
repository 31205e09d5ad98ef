"""The scene of an episode: where the tool starts and where the goal is, drawn from a generator, and how it stands."""

from dataclasses import replace
from math import cos, hypot, pi, sin

import numpy as np

from lab.control.controlled_skill import GOAL_RANGE, START_RANGE, Aim, ControlledSkill
from lab.errors import WorkFailed
from lab.sim import models
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME
from lab.sim.parts.kinds import Spot, beside
from lab.sim.scene.scene import MARKER, TABLE, Scene
from lab.sim.world import World
from lab.skills.camera_grids import RELEASE_ABOVE
from lab.skills.skill import LOST_M, STAND_STEPS, UPRIGHT, Bench

CLEAR_M = 0.008  # [m] least clearance of arm and part from all bodies at the start
LIFTED_M = 0.03  # by which a part that was taken is lifted, and by which the tool is clear of one that was set down
REACHED_M, REACHED_RAD = 0.015, 0.10  # from the end of a transfer
MOST_DRAWS = 200  # of a start
GOAL_MARKER = "goal"


class ControlScene:
    """A skill's bodies in a world, for one episode after another; close it after use.

    goal: the tool pose that takes or releases the part, or that ends the transfer; start: where the tool begins. body: the
    part's, "" for none; spot: where it begins or is to stand.
    """

    def __init__(self, skill: ControlledSkill) -> None:
        self.skill, self.aim, self.name, self.kind = skill, skill.aim, skill.skill.trial_part(), skill.skill.kind
        self.world = World()
        task, layout = skill.nearby
        self.scene = Scene(self.world, task, (), layout)
        self.bench, self.robot = Bench(self.scene), self.scene.robot
        self.body, self.spot = "", Spot(0.0, 0.0, 0.0, 0.0)
        self.goal = self.start = skill.goal
        if self.aim is Aim.REACH:
            self.world.disc(GOAL_MARKER, models.MARKER_RADIUS, models.MARKER_THICK, (0.0, 0.0, 0.0), models.MARKER_CYAN)
        own = skill.skill.station
        self._placed = {name: self.world.pose(name) for name in (own, f"{own}{MARKER}") if name in self.world.names()}

    @property
    def is_fresh(self) -> bool:
        """Whether the arm touches nothing but parts, so that the next episode is the same as in a new world."""
        return self.world.touched(NAME) <= set(self.scene.kind_of)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw where the tool starts and where the station stands, or the transfer ends, and put all there.

        Raises WorkFailed if no start is clear of all bodies.
        """
        self.scene.remove_parts()
        self.robot.wait_open()
        self.world.forget_contacts(NAME)
        self.world.steps, self.body = 0, ""
        self.skill.skill.aim(self.name)
        off = rng.uniform(-1.0, 1.0, 3) * GOAL_RANGE
        if self.aim is Aim.REACH:
            self.goal = self.skill.goal.shifted(off[0], off[1], 0.0, off[2])
            self.world.put(GOAL_MARKER, (self.goal.x, self.goal.y, self.goal.z))
        else:
            self._put_station(off)
        self._begin(self._clear_start(rng))

    def close(self) -> None:
        """Free the world."""
        self.world.close()

    # ---- where things are at the start -------------------------------------------------------------------------------

    def _put_station(self, off: np.ndarray) -> None:
        """Move the station, unless parts or a pallet stand there already, and put on it the part that is to be taken."""
        own, known = self.skill.skill, len(self.scene.kind_of)
        own.furnish(self.bench)
        spot = own.stands_on()
        if len(self.scene.kind_of) == known:
            x, y, _ = self.skill.task.station(own.station).pose
            for name in self._placed:
                self._turn_body(name, (x, y), off)
            spot = Spot(*_moved((spot.x, spot.y), (x, y), off), spot.z, spot.yaw + off[2])
        self.spot = spot
        if self.aim is Aim.TAKE:
            self.scene.add(self.name, self.kind, spot)
            self.body = self.scene.body_of(self.name, self.kind)
        self.goal = own.own_kind.held_at(spot)

    def _turn_body(self, name: str, about: tuple[float, float], off: np.ndarray) -> None:
        """Move a fixed body by x, y [m] and turn it by yaw [rad] about a point."""
        position, turn = self._placed[name]
        x, y = _moved((float(position[0]), float(position[1])), about, off)
        s, c = sin(off[2] / 2), cos(off[2] / 2)
        i, j, k, w = turn
        self.world.put(name, (x, y, float(position[2])), (c * i - s * j, c * j + s * i, c * k + s * w, c * w - s * k))

    def _clear_start(self, rng: np.random.Generator) -> ToolPose:
        """A drawn tool pose at which arm and part are CLEAR_M from every body."""
        base, low, high = self.skill.start, *self.skill.box
        for _ in range(MOST_DRAWS):
            x, y, z, yaw = np.clip(
                [base.x, base.y, base.z, base.yaw] + rng.uniform(-1.0, 1.0, 4) * START_RANGE, low, high
            )
            pose = ToolPose(float(x), float(y), float(z), float(yaw))
            if hypot(x, y) >= self.robot.arm.nearest_m and self.robot.stand(pose) and self._is_clear(pose):
                return pose
        raise WorkFailed(f"skill '{self.skill.skill.name}': none of {MOST_DRAWS} starts is clear of all bodies")

    def _is_clear(self, pose: ToolPose) -> bool:
        solid, moving = list(self.scene.solid), [NAME]
        if self.skill.skill.carries:
            if self.body == "":
                self.scene.add(self.name, self.kind, self.skill.skill.own_kind.foot_at(pose))
                self.body = self.scene.body_of(self.name, self.kind)
            self.scene.put(self.name, self.kind, pose)
            moving += self.scene.bodies_of(self.name, self.kind)
            solid.append(TABLE)
        elif self.body:
            solid += self.scene.bodies_of(self.name, self.kind)
        return not any(
            self.world.nearest(one, other, CLEAR_M) < CLEAR_M
            for one in moving
            for other in solid
            if (one, other) != (NAME, TABLE)
        )

    def _begin(self, pose: ToolPose) -> None:
        """Put the arm at the start, with the part in its fingers if it carries one, and let all bodies come to rest."""
        self.start, robot = pose, self.robot
        if self.skill.skill.carries:
            robot.open_at_once(self.scene.kinds[self.kind].grip.width_m / 2 + 0.0005)
            for _ in robot.grip(self.scene.grips_n[self.kind]):
                self.world.step()
        else:
            robot.open_at_once()
        for _ in range(STAND_STEPS):
            self.world.step()
        self.low_m = float(self.world.pose(self.body)[0][2]) if self.body else 0.0

    @property
    def grip_n(self) -> float | None:
        """The force [N] with which each finger presses on the part; None without one."""
        return self.scene.grips_n.get(self.kind)

    # ---- how it stands -----------------------------------------------------------------------------------------------

    def opening(self) -> float:
        """The fingers' opening, from 0 to 1."""
        fingers = self.robot.arm.fingers
        return fingers.opening(self.world.joints(NAME, fingers.joints)) / fingers.open_m

    def touches(self) -> tuple[bool, bool]:
        """Whether the left and the right fingers touch the part."""
        left, right = self.robot.arm.fingers.links
        if not self.body:
            return False, False
        return self._touched(left), self._touched(right)

    def _touched(self, links: tuple[str, ...]) -> bool:
        return any(self.world.touching(NAME, self.body, link) for link in links)

    def part_pose(self, like: float) -> ToolPose:
        """The tool pose that would hold the part where it is, its yaw the one closest to `like` [rad]."""
        return self.bench.true_pose(self.body, like)

    def goal_like(self, yaw: float) -> ToolPose:
        """The goal, its yaw the equivalent one that is closest to `yaw` [rad]."""
        if self.aim is Aim.REACH:
            return replace(self.goal, yaw=yaw + (self.goal.yaw - yaw + pi) % (2 * pi) - pi)
        return replace(self.goal, yaw=self.scene.kind_of[self.body].turned_like(self.goal.yaw, yaw))

    def holds(self, tool: ToolPose) -> bool:
        """Whether both fingers touch the part and it is within LOST_M of its place between them."""
        at = self.part_pose(tool.yaw)
        return all(self.touches()) and hypot(tool.x - at.x, tool.y - at.y, tool.z - at.z) < LOST_M

    def lifted_m(self) -> float:
        """The height [m] of the part above where it stood at the start."""
        return float(self.world.pose(self.body)[0][2]) - self.low_m

    def stands(self) -> bool:
        """Whether the part stands upright in its place, and all that it carries on it."""
        in_place = self.bench.stands(self.body, self.spot, self.skill.within_m, truly=True)
        return in_place and not self.bench.fallen_off(self.name, self.kind)

    def is_upright(self) -> bool:
        """Whether the part stands or hangs upright."""
        return self.bench.upright(self.body) > UPRIGHT

    def release_pose(self, tool: ToolPose) -> ToolPose:
        """The tool pose at which to release, so that the part, as it is held, stands on the spot."""
        wanted, hangs = self.goal_like(tool.yaw), self.part_pose(tool.yaw)
        c, s = cos(hangs.yaw), sin(hangs.yaw)
        dx, dy, turn = tool.x - hangs.x, tool.y - hangs.y, tool.yaw - hangs.yaw
        return wanted.local(c * dx + s * dy, -s * dx + c * dy, tool.z - hangs.z + RELEASE_ABOVE, turn)

    def is_done(self, tool: ToolPose) -> bool:
        """Whether the aim is reached."""
        if self.aim is Aim.TAKE:
            return self.robot.closed and self.lifted_m() >= LIFTED_M and self.holds(tool)
        if self.aim is Aim.SET_DOWN:
            is_clear = tool.z - self.goal.z >= LIFTED_M
            return is_clear and not self.robot.closed and not any(self.touches()) and self.stands()
        near = hypot(tool.x - self.goal.x, tool.y - self.goal.y, tool.z - self.goal.z) < REACHED_M
        turn = (tool.yaw - self.goal.yaw + pi) % (2 * pi) - pi
        return near and abs(turn) < REACHED_RAD and (not self.body or self.holds(tool))


def _moved(point: tuple[float, float], about: tuple[float, float], off: np.ndarray) -> tuple[float, float]:
    """A point (x, y) [m] turned about another one and moved by `off`, x, y [m] and yaw [rad]."""
    x, y = beside(about, float(off[2]), (point[0] - about[0], point[1] - about[1]))
    return x + float(off[0]), y + float(off[1])
