"""The arm and its gripper: tool paths become joint targets, one per physics step."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import atan2, inf, pi
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.sim.arms.arm import Arm
from lab.sim.arms.fingers import PAD_M
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.tool_path import timed
from lab.sim.urdf_reader import rotation
from lab.sim.world import TIME_STEP, World

NAME = "robot"
_TURNED_RAD = pi / 2  # [rad] turn above which the tool turns on the spot before it follows a path
_SETTLE_STEPS = 12  # physics steps of rest after a path
_HELD_RAD = 0.005  # a larger distance from the targets means that something has pushed the arm
GRIP_STEPS = 72  # 0.3 s to close or open
FINGER_M_S, _OPENS_N = 0.2, 60.0  # limits for each finger
_STRONG_NM = 2000.0  # torque limit of a joint whose motor is taken as strong enough
_TOUCH_RAD, _TOUCH_STEPS = 0.1, 8  # turn after which contacts are recomputed; steps between checks
_PEDESTAL_M, _PEDESTAL_RGBA = 0.09, (0.22, 0.23, 0.26, 1.0)  # radius
_POINT_M = 0.002  # effective radius, as PAD_M, of a finger's contact in a point
_FINE_ITERATIONS = 200  # of the solver: with 60, a slice creeps 2 mm/s between fingers that a linkage moves

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Joint targets, one row a physics step: positions (n, k) [rad] and velocities (n, k) [rad/s]."""

    positions: Array
    velocities: Array


def plan(
    arm: Arm,
    poses: Sequence[ToolPose],
    speed: float,
    acceleration: float,
    blend: float | Sequence[float] = 0.0,
    before: Array | None = None,
) -> Trajectory:
    """The timed trajectory along tool poses, corners rounded by `blend` [m], within `speed` [m/s] and `acceleration` [m/s2].

    Joint speeds stay within the arm's; `before` (k,) [rad] are the joints it starts from. WorkFailed names a pose out of reach.
    """
    tools = timed(poses, speed, acceleration, blend)
    joints = arm.inverse_path(tools, before)
    _check_reached(joints, tools)
    if before is not None and abs(joints[0, -1] - before[-1]) > _TURNED_RAD:
        joints = np.concatenate([_turned_back(arm, before[-1], joints[0], speed, acceleration), joints])
        _check_reached(joints, np.concatenate([np.repeat(tools[:1], len(joints) - len(tools), axis=0), tools]))
    velocities = np.gradient(joints, TIME_STEP, axis=0) if len(joints) > 1 else np.zeros_like(joints)
    hurry = float(np.max(np.abs(velocities) / arm.speed)) if len(joints) > 1 else 0.0
    if hurry > 1.0:
        return plan(arm, poses, speed / (hurry * 1.02), acceleration / (hurry * 1.02) ** 2, blend, before)
    return Trajectory(joints, velocities)


def _check_reached(joints: Array, poses: Array) -> None:
    lost = np.isnan(joints[:, 0])
    if lost.all() and len(poses) > 1:
        lost[:-1] = False  # where the tool cannot turn, all rows are NaN: the last pose names the yaw
    if lost.any():
        x, y, z, _ = poses[int(np.argmax(lost))]
        raise WorkFailed(f"the tool cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m")


def _turned_back(arm: Arm, turn: float, first: Array, speed: float, acceleration: float) -> Array:
    """Rows (n, k) that turn the tool on the spot by half turns, from `turn` [rad] to `first` (k,), where its range ends."""
    if arm.kinematics.aside.any():  # the first joint turns, too
        turn = first[-1] + pi * round((turn - first[-1]) / pi)
    turns = timed([ToolPose(0.0, 0.0, 0.0, turn), ToolPose(0.0, 0.0, 0.0, first[-1])], speed, acceleration)[:, 3]
    return arm.spun(first, turns - first[-1])


class MotionListener(Protocol):
    """A listener to the motions that a robot carries out; see `lab.export.recorder`."""

    def began(self, poses: Sequence[ToolPose], blend: float, way: Trajectory, before: Array) -> None:
        """The tool is about to follow `poses` on this trajectory; `before` (k,) [rad]: the joints it starts from."""

    def drives(self, row: int) -> None:
        """This row of the trajectory becomes the target; the number of its rows means that the last one was reached."""

    def ended(self) -> None:
        """The tool is at rest at the end of the motion."""

    def pressed(self, closed: bool) -> None:
        """The fingers are about to close (`closed`) or to open."""

    def rested(self, steps: int) -> None:
        """The arm is about to rest for `steps` physics steps."""


class RobotArm:
    """The arm in a world. Its motions are generators: each `next` sets the targets of one physics step."""

    def __init__(
        self, world: World, arm: Arm, speed: float, acceleration: float, grip_force: float, fine: bool = False
    ) -> None:
        """Load the arm at the world's origin; `speed` [m/s], `acceleration` [m/s2], `grip_force` [N] unless `grip` gets a force.

        fine: physics is solved in many iterations, so that pads hold as areas, not as points, and parts do not creep. Fingers
        that a linkage moves are always solved finely, because light parts would creep out of them.
        """
        self.world, self.arm, self.grip_force = world, arm, grip_force
        self.speed, self.acceleration = speed, acceleration
        fingers = arm.fingers
        fine = fine or len(fingers.joints) > 2 or fingers.gripper.one_jaw
        holding = [link for side in fingers.links for link in side]
        world.load(NAME, arm.urdf, (0.0, 0.0, arm.base_up_m), checked=True)
        if arm.base_up_m > 0.0:
            world.disc(f"{NAME} pedestal", _PEDESTAL_M, arm.base_up_m, (0.0, 0.0, arm.base_up_m / 2), _PEDESTAL_RGBA)
        world.friction(NAME, 1.0, links=holding, spinning=PAD_M if fine else _POINT_M, sticks=fine)
        for follower, leader in fingers.leaders.items():
            world.gear(NAME, leader, follower, fingers.ratio(follower))
        if fine:
            world.at_least(_FINE_ITERATIONS)
        self._free = [joint for joint in fingers.joints if joint not in fingers.driven]
        self.listener: MotionListener | None = None
        self.wait_open()

    def wait_open(self) -> None:
        """Put the arm where it waits, with open fingers, at once, as when it was loaded."""
        self.closed = self._let_go = False
        self._touched_at = 0.0  # the tool's yaw [rad] when the contacts of the held part were last recomputed
        self._half_on = False  # whether the tool is half a turn away from the requested yaw
        self.hold(self.arm.home)
        self.open_at_once()

    def hold(self, joints: Array) -> None:
        """Put the arm at `joints` (k,) [rad] at once and hold it there: for building and surveying a scene."""
        self.world.set_joints(NAME, self.arm.joints, joints)
        self._lead(joints)

    def _lead(self, joints: Array, velocities: Array | None = None) -> None:
        """Set the joints' targets (k,) [rad], and how fast they move there [rad/s]."""
        force = _STRONG_NM if self.arm.torque_nm is None else self.arm.torque_nm
        self.world.drive(NAME, self.arm.joints, joints, velocities, force=force)
        self._led = np.array(joints, float)

    def stand(self, pose: ToolPose) -> bool:
        """Put the arm at a tool pose at once; False when that is out of reach."""
        joints = self.arm.inverse(pose)
        if joints is not None:
            self.hold(joints)
            self._half_on = self.arm.is_half_on(joints, pose)
        return joints is not None

    def open_at_once(self, opening: float | None = None) -> None:
        """Put the fingers at `opening` [m] from the middle at once, by default open: for building and surveying a scene."""
        joints = self.arm.fingers.at(self.arm.fingers.open_m if opening is None else opening)
        self.world.set_joints(NAME, self.arm.fingers.joints, joints)
        self._press(joints, 200.0)

    def _press(self, joints: Array, force: float) -> None:
        """Drive the fingers to `joints` (k,), each with at most `force` [N]; geared joints follow."""
        fingers = self.arm.fingers
        now = fingers.opening(self.world.joints(NAME, fingers.joints))
        targets = [joints[fingers.joints.index(joint)] for joint in fingers.driven]
        most = inf if self.arm.torque_nm is None else self.arm.torque_nm
        forces = [min(needed, most) for needed in fingers.forces(force, now)]
        self.world.drive(NAME, fingers.driven, targets, force=forces)
        if self._free:
            self.world.drive(NAME, self._free, [0.0] * len(self._free), force=0.0)

    def touches(self, name: str) -> bool:
        """Whether fingers of both sides touch a body."""
        return all(any(self.world.touching(NAME, name, link) for link in side) for side in self.arm.fingers.links)

    def tool(self) -> ToolPose:
        """Where the finger tips are, measured from the links' poses in physics; half turns of the tool are ignored."""
        position, turn = self.world.pose(NAME, self.arm.tool_link)
        axes = rotation(turn)
        tip, across = position + axes @ self.arm.tip[:3, 3], axes @ self.arm.tip[:3, 1]
        yaw = atan2(-float(across[0]), float(across[1]))
        return ToolPose(float(tip[0]), float(tip[1]), float(tip[2]), self._counted(yaw))

    def _counted(self, yaw: float) -> float:
        return (yaw + 2 * pi) % (2 * pi) - pi if self._half_on else yaw

    def brake(self) -> None:
        """Hold all joints where they are, from the next physics step on: what a protective or emergency stop does."""
        self._lead(self.world.joints(NAME, self.arm.joints))

    def override(self, share: float) -> None:
        """Scales speed and acceleration from now on by a share, as an operator's speed override does."""
        self.speed, self.acceleration = share * self.speed, share * self.acceleration

    def follow(
        self, poses: Sequence[ToolPose], *, blend: float | Sequence[float] = 0.0, slow: float = 1.0
    ) -> Iterator[None]:
        """Move the tool from where it is held along `poses`, with a `blend` [m] for all or one each.

        slow: below 1 it lowers speed and acceleration.
        """
        blends = [0.0, *np.broadcast_to(blend, len(poses)).tolist()]
        before = self.world.joints(NAME, self.arm.joints)
        if np.abs(before - self._led).max() < _HELD_RAD:
            before = self._led  # the last targets: from other joint positions the targets would jump
        here = self.arm.forward(before)
        first = poses[0]
        turn = (self._counted(here.yaw) - first.yaw + pi) % (2 * pi) - pi
        start = ToolPose(here.x, here.y, here.z, first.yaw + turn)
        way = plan(self.arm, [start, *poses], self.speed * slow, self.acceleration * slow, blends, before)
        self._half_on = self.arm.is_half_on(way.positions[-1], poses[-1])
        heard = self.listener
        if heard is not None:
            heard.began(poses, max(blends), way, before)
        for row, _ in enumerate(self.along(way)):
            if heard is not None:
                heard.drives(row)
            yield
        self._lead(way.positions[-1])
        if heard is not None:
            heard.drives(len(way.positions))
        yield from _stay(_SETTLE_STEPS)
        if heard is not None:
            heard.ended()

    def along(self, way: Trajectory) -> Iterator[None]:
        """Set the rows of a trajectory as targets, one a physics step, without a rest at its end: for streamed motions."""
        for row, (position, velocity) in enumerate(zip(way.positions, way.velocities, strict=True)):
            self._lead(position, velocity)
            if self.closed and row % _TOUCH_STEPS == 0:
                self._touch_anew()
            yield

    def _touch_anew(self) -> None:
        """Lets physics recompute the contacts of the held part after the tool has turned with it."""
        yaw = self.tool().yaw
        if abs((yaw - self._touched_at + pi) % (2 * pi) - pi) > _TOUCH_RAD:
            self._touched_at = yaw
            self.world.touch_anew(NAME, [link for side in self.arm.fingers.links for link in side])

    def rest(self, steps: int) -> Iterator[None]:
        """Rest for `steps` physics steps."""
        if self.listener is not None:
            self.listener.rested(steps)
        yield from _stay(steps)

    def grip(self, force_n: float | None = None) -> Iterator[None]:
        """Close the fingers and keep pressing, each with a force [N], by default the grip force."""
        self.closed, self._touched_at = True, self.tool().yaw
        yield from self._fingers_to(0.0, self.grip_force if force_n is None else force_n)

    def release(self) -> Iterator[None]:
        """Open the fingers."""
        self.closed = False
        yield from self._fingers_to(self.arm.fingers.open_m, _OPENS_N)

    def _fingers_to(self, opening: float, force: float) -> Iterator[None]:
        """Move the fingers until each pad is `opening` [m] from the middle, or presses with a force [N] on what is between them.

        Faster than FINGER_M_S they would penetrate a light part before physics stops them, and throw it out.
        """
        if self.listener is not None:
            self.listener.pressed(self.closed)
        fingers = self.arm.fingers
        now = fingers.opening(self.world.joints(NAME, fingers.joints))
        fast_m_s = FINGER_M_S / 2 if fingers.gripper.one_jaw else FINGER_M_S
        most = max(fast_m_s * TIME_STEP, 1.5 * abs(opening - now) / GRIP_STEPS)  # wide ones are reached in time
        self._let_go = False
        for _ in range(GRIP_STEPS):
            now += min(max(opening - now, -most), most)
            if not self._let_go:
                self._press(fingers.at(now), force)
            yield

    def lose(self) -> None:
        """Opens the fingers as when the air pressure fails; the code that moves the arm still takes them for closed."""
        self._let_go = True
        self._press(self.arm.fingers.at(self.arm.fingers.open_m), _OPENS_N)


def _stay(steps: int) -> Iterator[None]:
    for _ in range(steps):
        yield
