"""The arm and its gripper: paths of the tool become joint targets, one a physics step."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, pi

import numpy as np
from numpy.typing import NDArray

from lab.errors import WorkFailed
from lab.files import assets_folder
from lab.sim import kinematics
from lab.sim.kinematics import ToolPose
from lab.sim.models import FINGER_OPEN
from lab.sim.world import TIME_STEP, World

NAME = "robot"
FINGERS = ("finger_left", "finger_right")
YAW_ARM = 0.15  # [m/rad] a turn of the tool counts as this much way
_SAMPLE = 0.004  # [m] between points of a path before it is timed
_SETTLE_STEPS = 12  # after a path ends
_GRIP_STEPS = 72  # 0.3 s to close or open

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Joint targets, one row a physics step: positions (n, 6) [rad] and velocities (n, 6) [rad/s]."""

    positions: Array
    velocities: Array


def plan(
    poses: Sequence[ToolPose], speed: float, acceleration: float, blend: float = 0.0, before: Array | None = None
) -> Trajectory:
    """Time a path of tool poses: rounded by `blend` [m] at its corners, at most `speed` [m/s] and `acceleration` [m/s2].

    Joint speeds stay within the arm's; `before` (6,) [rad] are the joints it starts from. WorkFailed names a pose out of reach.
    """
    points = _rounded(_sampled(poses), blend)
    way = np.concatenate([[0.0], np.cumsum(_lengths(points))])
    ticks = _trapezoid(float(way[-1]), speed, acceleration)
    rows = [_joints(np.array([np.interp(at, way, points[:, k]) for k in range(4)])) for at in ticks]
    joints = np.array(rows)
    joints[:, 5] = _unwound(joints[:, 5], None if before is None else float(before[5]))
    if before is not None and abs(joints[0, 5] - before[5]) > pi:
        joints = np.concatenate([_turned_back(before[5], joints[0], speed, acceleration), joints])
    velocities = np.gradient(joints, TIME_STEP, axis=0) if len(joints) > 1 else np.zeros_like(joints)
    hurry = float(np.max(np.abs(velocities) / kinematics.SPEED)) if len(joints) > 1 else 0.0
    if hurry > 1.0:
        return plan(poses, speed / (hurry * 1.02), acceleration / (hurry * 1.02) ** 2, blend, before)
    return Trajectory(joints, velocities)


def _sampled(poses: Sequence[ToolPose]) -> Array:
    corners = np.array([[p.x, p.y, p.z, p.yaw] for p in poses])
    rows = [corners[:1]]
    for start, end in pairwise(corners):
        count = max(1, int(np.ceil(_lengths(np.array([start, end]))[0] / _SAMPLE)))
        rows.append(start + (end - start) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(rows)


def _rounded(points: Array, blend: float) -> Array:
    """A moving average along the path cuts its corners by about blend / 2; the ends stay."""
    half = int(blend / _SAMPLE / 2)
    if half < 1 or len(points) < 3:
        return points
    padded = np.concatenate([np.repeat(points[:1], half, 0), points, np.repeat(points[-1:], half, 0)])
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    smooth = np.stack([np.convolve(padded[:, k], kernel, mode="valid") for k in range(4)], axis=1)
    smooth[0], smooth[-1] = points[0], points[-1]
    return smooth


def _lengths(points: Array) -> Array:
    steps = np.diff(points, axis=0) * np.array([1.0, 1.0, 1.0, YAW_ARM])
    return np.asarray(np.linalg.norm(steps, axis=1))


def _trapezoid(length: float, speed: float, acceleration: float) -> Array:
    """Way [m] after each physics step when speeding up, cruising and slowing down over `length` [m]."""
    if length < 1e-9:
        return np.array([0.0])
    ramp = min(speed**2 / acceleration, length) / 2.0
    top = np.sqrt(2.0 * acceleration * ramp)
    speeding, cruising = top / acceleration, (length - 2.0 * ramp) / top
    total = 2.0 * speeding + cruising
    t = np.minimum(np.arange(1, int(np.ceil(total / TIME_STEP)) + 1) * TIME_STEP, total)
    left = np.maximum(total - t, 0.0)
    slowing = np.where(left < speeding, length - acceleration * left**2 / 2.0, ramp + top * (t - speeding))
    return np.asarray(np.where(t < speeding, acceleration * t**2 / 2.0, slowing))


def _joints(point: Array) -> Array:
    joints = kinematics.inverse(ToolPose(*map(float, point)))
    if joints is None:
        raise WorkFailed(f"the tool cannot reach ({point[0]:.3f}, {point[1]:.3f}, {point[2]:.3f}) m")
    return joints


def _unwound(turns: Array, before: float | None) -> Array:
    """The same tool turns without jumps of 2 pi, near where the tool was, within the joint's range."""
    turns = np.unwrap(turns)
    if before is not None:
        turns = turns + 2 * pi * np.round((before - turns[0]) / (2 * pi))
    while turns.max() > kinematics.UPPER[5]:
        turns = turns - 2 * pi
    while turns.min() < kinematics.LOWER[5]:
        turns = turns + 2 * pi
    return turns


def _turned_back(turn: float, first: Array, speed: float, acceleration: float) -> Array:
    """Rows (n, 6) that take the tool on the spot from `turn` [rad] by whole turns to `first` (6,): its range ends there."""
    back = first[5] - turn
    ticks = _trapezoid(abs(float(back)), speed / YAW_ARM, acceleration / YAW_ARM)
    rows = np.repeat(first[None], len(ticks), axis=0)
    rows[:, 5] = turn + np.sign(back) * ticks
    return rows


class Robot:
    """The arm in a world. Its motions are generators: each `next` sets the targets of one physics step."""

    def __init__(self, world: World, speed: float, acceleration: float, grip_force: float) -> None:
        """Load the arm at the world's origin; `speed` [m/s], `acceleration` [m/s2], `grip_force` [N]."""
        self.world, self.speed, self.acceleration, self.grip_force = world, speed, acceleration, grip_force
        world.load(NAME, assets_folder() / "robot.urdf")
        world.friction(NAME, 1.0, links=FINGERS, spinning=0.002)
        world.gear(NAME, *FINGERS)
        self.closed = False
        self.hold(kinematics.HOME)
        self.open_at_once()

    def hold(self, joints: Array) -> None:
        """Put the arm at `joints` (6,) [rad] at once and hold it there: for building and surveying a scene."""
        self.world.set_joints(NAME, kinematics.JOINTS, joints)
        self.world.drive(NAME, kinematics.JOINTS, joints)

    def stand(self, pose: ToolPose) -> bool:
        """Put the arm at a tool pose at once; False when that is out of reach."""
        joints = kinematics.inverse(pose)
        if joints is not None:
            self.hold(joints)
        return joints is not None

    def open_at_once(self, opening: float = FINGER_OPEN) -> None:
        """Put the fingers at `opening` [m] from the middle at once: for building and surveying a scene."""
        self.world.set_joints(NAME, FINGERS, [opening, opening])
        self.world.drive(NAME, FINGERS, [opening, opening], force=200.0)

    def tool(self) -> ToolPose:
        """Where the finger tips are, as measured from the links' poses in physics."""
        position, turn = self.world.pose(NAME, "tool")
        x, y, z, w = turn
        forward = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])  # tool x axis in world
        across = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])  # tool y axis in world
        tip = position + kinematics.TOOL * forward
        return ToolPose(float(tip[0]), float(tip[1]), float(tip[2]), atan2(-float(across[0]), float(across[1])))

    def override(self, share: float) -> None:
        """Move from now on with a share of speed and acceleration, as an operator's speed override."""
        self.speed, self.acceleration = share * self.speed, share * self.acceleration

    def follow(self, poses: Sequence[ToolPose], *, blend: float = 0.0, slow: float = 1.0) -> Iterator[None]:
        """Move the tool from where it is along `poses`; `slow` < 1 lowers speed and acceleration."""
        before = self.world.joints(NAME, kinematics.JOINTS)
        here = kinematics.forward(before)
        first = poses[0]
        turn = (here.yaw - first.yaw + pi) % (2 * pi) - pi
        start = ToolPose(here.x, here.y, here.z, first.yaw + turn)
        way = plan([start, *poses], self.speed * slow, self.acceleration * slow, blend, before)
        for position, velocity in zip(way.positions, way.velocities, strict=True):
            self.world.drive(NAME, kinematics.JOINTS, position, velocity)
            yield
        self.world.drive(NAME, kinematics.JOINTS, way.positions[-1])
        yield from self.rest(_SETTLE_STEPS)

    def rest(self, steps: int) -> Iterator[None]:
        """Stay for so many physics steps."""
        for _ in range(steps):
            yield

    def grip(self) -> Iterator[None]:
        """Close the fingers and keep pressing with the grip force."""
        self.world.drive(NAME, FINGERS, [0.0, 0.0], force=self.grip_force)
        self.closed = True
        yield from self.rest(_GRIP_STEPS)

    def release(self) -> Iterator[None]:
        """Open the fingers."""
        self.world.drive(NAME, FINGERS, [FINGER_OPEN, FINGER_OPEN], force=60.0)
        self.closed = False
        yield from self.rest(_GRIP_STEPS)
