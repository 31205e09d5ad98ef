"""A check of exported files: they are read back, played in physics by the arm alone, and compared with the run's tool."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, radians

import numpy as np
import scipy

from lab.errors import BadInput
from lab.export.commands import (
    Await,
    Check,
    Command,
    GripperOutput,
    JointMove,
    Path,
    Pause,
    Payload,
    Reset,
    Start,
    jobs_of,
)
from lab.export.program import Array, Program
from lab.export.recorder import SEEN_EVERY, tips
from lab.export.timed import TimedPoints
from lab.sim.arms.arm import Arm
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import NAME, RobotArm
from lab.sim.arms.tool_path import YAW_ARM
from lab.sim.parts.holding import USUAL_N
from lab.sim.world import TIME_STEP, World
from lab.tasks.robot_fields import RobotSettings

MOST_M, MOST_RAD = 0.001, radians(1.0)  # largest accepted deviations
HOLD_STEPS = 60  # physics steps of a rest that are simulated; after them nothing moves
_AT_REST_RAD = 1e-3  # two points far apart in time whose joints differ by less than this are a rest


@dataclass(frozen=True)
class ToolDeviation:
    """The largest deviations of the played tool from the run's [m], [rad]: along the paths, and at rest at their ends.

    motions: the number of paths compared; poses: the number of points on them. run_off_m: the largest deviation of the
    run's own tool from its target at the end of a path, as after a collision, which cannot happen when the arm plays alone.
    """

    along_m: float
    along_rad: float
    at_rest_m: float
    at_rest_rad: float
    motions: int
    poses: int
    run_off_m: float

    @property
    def max_m(self) -> float:
        """The largest distance [m]."""
        return max(self.along_m, self.at_rest_m)

    @property
    def max_rad(self) -> float:
        """The largest angle [rad]."""
        return max(self.along_rad, self.at_rest_rad)

    @property
    def near_enough(self) -> bool:
        """Whether all deviations are within 1 mm and 1 degree."""
        return self.max_m <= MOST_M and self.max_rad <= MOST_RAD


def deviation(program: Program, played: "list[Command] | TimedPoints") -> ToolDeviation:
    """The deviation of what is `played` from the run. BadInput unless it has the run's paths, outputs and waits in order."""
    arm, robot = program.arm, program.carried.robot
    jobs = jobs_of(program)
    wanted = [command for job in jobs for command in job.commands]
    if isinstance(played, TimedPoints):
        wanted = [command for command in wanted if isinstance(command, Await | GripperOutput)]
    if signals(played, program) != signals(wanted, program):
        raise BadInput("what was read back has other gripper outputs or waits than the run")
    if isinstance(played, TimedPoints):
        return _compared_by_time(program, play_timed(played, arm, robot, program.seen_at_s))
    motions, ways = [way for job in jobs for way in job.ways], play(played, arm, robot)
    if len(motions) != len(ways):
        raise BadInput(f"{len(ways)} paths were read back, the run had {len(motions)}")
    worst, poses = np.zeros(4), 0
    for together, way in zip(motions, ways, strict=True):
        motion = together[-1]
        seen = program.seen[together[0].seen_first : motion.seen_last]
        there, back = apart(seen, way), apart(way[::SEEN_EVERY], seen)
        rest = _gaps(seen[-1:], way[-1:]) if motion.complete else (np.zeros(1), np.zeros(1))
        along = max(there[0].max(), back[0].max()), max(there[1].max(), back[1].max())
        worst = np.maximum(worst, [*along, rest[0].max(), rest[1].max()])
        poses += len(seen)
    along_m, along_rad, at_rest_m, at_rest_rad = worst.tolist()
    return ToolDeviation(along_m, along_rad, at_rest_m, at_rest_rad, len(motions), poses, run_off(program))


def signals(played: "Sequence[Command] | TimedPoints", program: Program) -> list[str]:
    """The gripper's changes, beginning open, and the waits for machines, in order, as comparable words."""
    machines, words, closed = program.carried.machines, list[str](), False
    if isinstance(played, TimedPoints):
        told: list[Command] = []
        for point in played.points:
            told += [Await(machines.index(point.waits_for) + 1)] if point.waits_for in machines else []
            told.append(GripperOutput(point.closed))
        played = told
    for command in played:
        if isinstance(command, Await):
            words.append(f"wait for input {command.machine}")
        elif isinstance(command, GripperOutput) and command.closed != closed:
            closed = command.closed
            words.append("close" if closed else "open")
        elif isinstance(command, Start | Reset):
            words.append(f"{type(command).__name__} machine {command.machine}")
        elif isinstance(command, Check):
            words.append("check the gripper")
        elif isinstance(command, Payload):
            words.append(f"carry {command.mass_kg:.3f} kg")
    return words


def _compared_by_time(program: Program, played: Array) -> ToolDeviation:
    if not len(program.seen):
        return ToolDeviation(0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    far, turned = _gaps(program.seen, played)
    ends = [motion.seen_last - 1 for motion in program.motions if motion.complete]
    at_rest = (float(far[ends].max()), float(turned[ends].max())) if ends else (0.0, 0.0)
    return ToolDeviation(
        float(far.max()), float(turned.max()), *at_rest, len(program.motions), len(far), run_off(program)
    )


def run_off(program: Program) -> float:
    """The largest deviation [m] of the run's own tool from its target at the ends of its paths."""
    ends = [motion for motion in program.motions if motion.complete]
    wanted = [program.tools(motion.last - 1, motion.last)[0, :3] for motion in ends]
    seen = [program.seen[motion.seen_last - 1, :3] for motion in ends]
    return float(np.linalg.norm(np.array(wanted) - np.array(seen), axis=-1).max(initial=0.0))


# ---- playing ------------------------------------------------------------------------------------------------------


def play(commands: Sequence[Command], arm: Arm, settings: RobotSettings) -> list[Array]:
    """The tool's poses on each `Path` (n, 7), see `Program.seen`, one row per physics step, when the arm plays alone."""
    with World() as world:
        robot = RobotArm(world, arm, settings.speed_m_s, settings.acceleration_m_s2, settings.grip_force_n or USUAL_N)
        ways: list[Array] = []
        stood = False
        for command in commands:
            if isinstance(command, JointMove):
                target = np.array(command.joints)
                if not stood:
                    robot.hold(target)
                    stood = True
                _run(world, _joint_motion(robot, target, command.percent))
            elif isinstance(command, Path):
                robot.speed = float(command.speeds.max())
                poses = [ToolPose(*point) for point in command.points.tolist()]
                way = robot.follow(poses, blend=(2.0 * command.roundings).tolist())
                ways.append(_run(world, way, robot))
            elif isinstance(command, GripperOutput):
                _run(world, robot.grip() if command.closed else robot.release())
            elif isinstance(command, Pause):
                _run(world, robot.rest(min(HOLD_STEPS, ceil(command.seconds / TIME_STEP))))
        return ways


def _run(world: World, motion: Iterator[None], robot: RobotArm | None = None) -> Array:
    """The tool's poses (n, 7) while a motion is carried out, the first one included; empty without a robot."""
    seen = [] if robot is None else [_link(world, robot.arm)]
    for _ in motion:
        world.step()
        if robot is not None:
            seen.append(_link(world, robot.arm))
    return np.empty((0, 7)) if robot is None else tips(np.array(seen), robot.arm.tip)


def _link(world: World, arm: Arm) -> Array:
    return np.concatenate(world.pose(NAME, arm.tool_link))


def _joint_motion(robot: RobotArm, target: Array, percent: float) -> Iterator[None]:
    """Move all joints together and evenly, with a share of their speed; no steps if they are there already."""
    here = robot.world.joints(NAME, robot.arm.joints)
    seconds = float(np.max(np.abs(target - here) / (robot.arm.speed * percent / 100.0)))
    steps = ceil(seconds / TIME_STEP - 1e-9)
    for step in range(1, steps + 1):
        robot.world.drive(NAME, robot.arm.joints, here + (target - here) * step / steps)
        yield
    yield from robot.rest(HOLD_STEPS)


def play_timed(played: TimedPoints, arm: Arm, settings: RobotSettings, at_s: Array) -> Array:
    """The tool's poses (n, 7), see `Program.seen`, at times `at_s` (n,) [s], when the arm alone goes through the points."""
    if not played.points:
        raise BadInput("there are no points to play")
    times = np.array([point.t_s for point in played.points]) / TIME_STEP  # in physics steps from here on
    joints = np.array([point.joints for point in played.points])
    wanted = np.rint(at_s / TIME_STEP).astype(int)
    with World() as world:
        robot = RobotArm(world, arm, settings.speed_m_s, settings.acceleration_m_s2, settings.grip_force_n or USUAL_N)
        robot.hold(joints[0])
        seen: dict[int, Array] = {}
        rests = _rests(times, joints)
        clock, end = 0, int(wanted.max(initial=0))
        while clock <= end:
            clock = rests.get(clock, clock)  # nothing moves until then
            seen[clock] = _link(world, arm)
            now, target, then = (_at(times, joints, clock + ahead) for ahead in (0, 1, 2))
            world.drive(NAME, arm.joints, target, (then - now) / (2 * TIME_STEP))
            world.step()
            clock += 1
        return tips(np.array([seen[step] for step in wanted.tolist()]).reshape(-1, 7), arm.tip)


def _rests(times: Array, joints: Array) -> dict[int, int]:
    """The physics steps to skip, first -> last: the arm rests in between and has come to a stop."""
    rests = {}
    for number in range(len(times) - 1):
        first, last = ceil(times[number]) + HOLD_STEPS, int(times[number + 1]) - HOLD_STEPS
        if first < last and np.abs(joints[number + 1] - joints[number]).max() < _AT_REST_RAD:
            rests[first] = last
    return rests


def _at(times: Array, joints: Array, step: int) -> Array:
    """The joints (k,) [rad] at a physics step, by linear interpolation."""
    after = int(np.searchsorted(times, step, side="left"))
    if after == 0 or after == len(times):
        return np.asarray(joints[min(after, len(times) - 1)])
    share = (step - times[after - 1]) / (times[after] - times[after - 1])
    return np.asarray(joints[after - 1] + share * (joints[after] - joints[after - 1]))


# ---- comparing ----------------------------------------------------------------------------------------------------


def _gaps(one: Array, other: Array) -> tuple[Array, Array]:
    """The distances (n,) [m] and angles (n,) [rad] between two rows of poses (n, 7), row by row."""
    rotation = scipy.spatial.transform.Rotation
    turn = rotation.from_quat(one[:, 3:]).inv() * rotation.from_quat(other[:, 3:])
    return np.linalg.norm(one[:, :3] - other[:, :3], axis=1), np.asarray(turn.magnitude())


def apart(seen: Array, way: Array) -> tuple[Array, Array]:
    """The distance (n,) [m] and angle (n,) [rad] of each pose of `seen` (n, 7) from the nearest one of the path `way` (m, 7).

    For the nearest pose, turns are converted to lengths with YAW_ARM.
    """
    way = np.repeat(way, 2, axis=0) if len(way) == 1 else way
    points, line = _flat(seen), _flat(way)
    line[:, 3] += 2 * np.pi * YAW_ARM * np.round((points[0, 3] - line[0, 3]) / (2 * np.pi * YAW_ARM))
    starts, steps = line[:-1], np.diff(line, axis=0)
    lengths = np.maximum((steps**2).sum(axis=1), 1e-18)
    nearest = np.zeros((len(points), 7))
    for row, point in enumerate(points):
        share = np.clip(((point - starts) * steps).sum(axis=1) / lengths, 0.0, 1.0)
        at = int(np.argmin(((point - starts - share[:, None] * steps) ** 2).sum(axis=1)))
        before, after = way[at], way[at + 1].copy()
        after[3:] *= np.sign(before[3:] @ after[3:]) or 1.0  # q and -q are the same rotation: take the closer sign
        nearest[row] = before + share[at] * (after - before)
    return _gaps(seen, nearest)


def _flat(poses: Array) -> Array:
    """The coordinates (n, 4) [m] of poses (n, 7): x, y, z, and the unwrapped yaw times YAW_ARM."""
    across = scipy.spatial.transform.Rotation.from_quat(poses[:, 3:]).apply([0.0, 1.0, 0.0])
    yaw = np.unwrap(np.arctan2(-across[:, 0], across[:, 1]))
    return np.column_stack([poses[:, :3], yaw * YAW_ARM])
