"""Trials in physics, before any work, of whether the fingers hold a part: it is taken up, swung, turned and set down.

The part is carried at least as far as in the task, because a part that creeps between the fingers does so along the whole path.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, hypot, pi
from typing import NamedTuple

from lab.errors import BadInput, WorkFailed
from lab.sim.arms.arm import Arm
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm
from lab.sim.parts.holding import SLOW, Load, check_friction, grip_force_n, needs_fine, with_force
from lab.sim.parts.kinds import Kind, Spot
from lab.sim.world import World
from lab.tasks.robot_fields import RobotSettings

LIFT_M, SWING_M, CORNER_M, TURN_RAD = 0.1, 0.25, 0.2, pi / 4
LAP_M = 1.2  # least length of a lap from side to side
BLEND_M = 0.1  # radius of its corner, as in transfers
OUT = (0.5, 0.62, 0.75, 0.4, 0.9, 0.3)  # [m] distances ahead of the arm; the first that it reaches everywhere is taken
OFF = (0.002, 0.002, 0.04)  # [m], [rad] error of the part's pose under the fingers, as after some transfers
FOOT_M = 0.1  # [m] height of the part's foot above the table
SLIPPED_M, TILTED = 0.008, 0.96  # limits of a held part: its shift in the fingers, and the cosine of its tilt
NEAR_M = 0.012  # largest error of the place where a part is set down
SETTLE_STEPS, HELD_STEPS = 60, 240  # physics steps before and after a trial; steps in which the part hangs in the air
GENTLER = (0.5, 0.25, 0.12)  # shares of a force with which a part is lost that are tried next
BLOCK, RGBA = "block", (0.8, 0.8, 0.8, 1.0)
BESIDE_M = 0.03  # [m] margin of the block around the foot
ABOVE_M = 0.0005  # [m] initial gap between bodies that stand on one another


def held(
    robot: RobotSettings, arm: Arm, kinds: Sequence[Kind], way_m: float = 0.0, turn_rad: float = TURN_RAD
) -> RobotSettings:
    """The robot with a grip force that holds all kinds: smaller than the chosen one if parts creep; a given force is kept.

    Only unusual kinds are tried. way_m: the longest path of a carried part [m]; turn_rad: the turn of the tool with it.
    BadInput if friction cannot hold a part, or if a part is lost in a trial; it names a smaller force that holds, if any.
    """
    for kind, went in _lost(robot, arm, kinds, way_m, turn_rad):
        gentler = _gentler(robot, arm, kinds, way_m, turn_rad)
        if gentler is not None and robot.grip_force_n is None:
            return gentler
        hint = "another mass_kg, friction or acceleration_m_s2 may do"
        if robot.grip_force_n is not None:
            hint = f"without grip_force_n a force is chosen, or {hint}"
        if gentler is not None:
            hint = f"pressed less it holds: grip_force_n = {gentler.grip_force_n:g}"
        raise BadInput(f"{with_force(robot, Load.of(kind))}, is not held: in a trial {went}; {hint}")
    return robot


def _lost(
    robot: RobotSettings, arm: Arm, kinds: Sequence[Kind], way_m: float, turn_rad: float
) -> Iterator[tuple[Kind, str]]:
    """The kinds that are lost in a trial, with the failure in words; BadInput for those that friction cannot hold."""
    fine, laps = needs_fine(robot, kinds), max(1, ceil(way_m / LAP_M))
    loads = [Load.of(kind) for kind in kinds]
    for load in loads:
        check_friction(robot, load)
    for kind, load in zip(kinds, loads, strict=True):
        force_n = grip_force_n(robot, load)
        if load.is_usual(force_n, robot.acceleration_m_s2) and not robot.is_file:
            continue
        if went := tried(HoldTrial(arm, kind, force_n, robot.speed_m_s, robot.acceleration_m_s2, fine, laps, turn_rad)):
            yield kind, went


def _gentler(
    robot: RobotSettings, arm: Arm, kinds: Sequence[Kind], way_m: float, turn_rad: float
) -> RobotSettings | None:
    """The robot with a smaller force that holds all kinds, or None: a part that is pressed too hard creeps out of the fingers."""
    now_n = max(grip_force_n(robot, Load.of(kind)) for kind in kinds)
    for share in GENTLER:
        gentler = robot.model_copy(update={"grip_force_n": float(f"{share * now_n:.2g}")})
        with suppress(BadInput):
            if not any(_lost(gentler, arm, kinds, way_m, turn_rad)):
                return gentler
    return None


class HoldTrial(NamedTuple):
    """A trial of a kind, a grip force [N], and the speed [m/s] and acceleration [m/s2] of its task.

    laps: how often it is carried from side to side, round a corner, and turned, by turn_rad.
    """

    arm: Arm
    kind: Kind
    force_n: float
    speed_m_s: float
    acceleration_m_s2: float
    fine: bool = False
    laps: int = 1
    turn_rad: float = TURN_RAD


@lru_cache(maxsize=64)
def tried(trial: HoldTrial) -> str:
    """The failure in words of a trial in its own world; "" if it succeeds or the arm has no room for it."""
    place = _place(trial)
    if place is None:
        return ""
    with World() as world:
        robot = RobotArm(world, trial.arm, trial.speed_m_s, trial.acceleration_m_s2, trial.force_n, trial.fine)
        bodies = _built(world, trial.kind, place)
        hand = _Hand(world, robot, trial.kind, bodies[0])
        robot.stand(_way(trial, place)[0])
        for _ in range(SETTLE_STEPS):
            world.step()
        try:
            for _ in _motion(hand, _way(trial, place), trial.laps):
                world.step()
        except WorkFailed as error:
            return str(error)
        return _ended(world, trial.kind, bodies, place)


def _place(trial: HoldTrial) -> Spot | None:
    """The spot ahead of the arm from which it reaches the whole path of the trial, or None."""
    for out in OUT:
        spot = Spot(out, 0.0, FOOT_M, 0.0)
        if all(trial.arm.inverse(pose) is not None for pose in _way(trial, spot)):
            return spot
    return None


def _way(trial: HoldTrial, spot: Spot) -> list[ToolPose]:
    """The tool poses of the trial: at the part, above it, to one side, to the other, around a corner, and turned above it."""
    at = trial.kind.held_at(spot)
    up = at.shifted(dz=LIFT_M)
    side = up.shifted(dy=-SWING_M)
    return [at, up, up.shifted(dy=SWING_M), side, side.shifted(dx=CORNER_M), up.shifted(dyaw=trial.turn_rad), up]


def _built(world: World, kind: Kind, spot: Spot) -> list[str]:
    """Builds the part, with its rider, on a block larger than its foot, and returns their names from the foot upwards."""
    along, across = (2 * (half + BESIDE_M) for half in kind.footprint_m())
    world.box(BLOCK, (along, across, spot.z), (spot.x, spot.y, spot.z / 2), RGBA)
    names, foot_m = [], spot.z + ABOVE_M
    for own in kind.stack():
        names.append(own.name)
        at = (spot.x + OFF[0], spot.y + OFF[1], foot_m + own.shape.foot_m)
        world.part(own.name, own.shape, own.part.mass_kg, own.part.friction, at, spot.yaw + OFF[2])
        foot_m += own.height_m + ABOVE_M
    return names


@dataclass
class _Hand:
    """The fingers and the part between them."""

    world: World
    robot: RobotArm
    kind: Kind
    body: str
    low_m: float = 0.0  # [m] depth of the part's middle under the tool when it was gripped

    def took(self) -> None:
        self.low_m = self._low_m()

    def check(self, doing: str) -> None:
        """Raises WorkFailed if the part is no longer where the fingers gripped it."""
        tool = self.robot.tool()
        position, (x, y, *_) = self.world.pose(self.body)
        spot = self.kind.foot_at(tool)
        off = hypot(float(position[0]) - spot.x, float(position[1]) - spot.y, self._low_m() - self.low_m)
        if not self.robot.touches(self.body):
            raise WorkFailed(f"it is lost while {doing}")
        if off > SLIPPED_M:
            raise WorkFailed(f"it slips by {1000 * off:.0f} mm while {doing}")
        if 1.0 - 2.0 * float(x * x + y * y) < TILTED:
            raise WorkFailed(f"it tilts while {doing}")

    def _low_m(self) -> float:
        return self.robot.tool().z - float(self.world.pose(self.body)[0][2])


def _motion(hand: _Hand, way: Sequence[ToolPose], laps: int) -> Iterator[None]:
    at, up, start, corner, end, turned, above = way
    robot = hand.robot
    yield from robot.grip()
    hand.took()
    yield from robot.follow([up], slow=SLOW)
    hand.check("it is lifted")
    for _ in range(laps):
        yield from robot.follow([start])
        hand.check("it is swung")
        yield from robot.follow([corner, end], blend=BLEND_M)
        hand.check("it is swung round a corner")
        for pose in (turned, above):
            yield from robot.follow([pose])
            hand.check("it is swung")
    yield from robot.rest(HELD_STEPS)
    hand.check("it hangs")
    yield from robot.follow([at], slow=SLOW)
    yield from robot.release()
    yield from robot.follow([up], slow=SLOW)
    yield from robot.rest(SETTLE_STEPS)


def _ended(world: World, kind: Kind, bodies: Sequence[str], spot: Spot) -> str:
    """The error in words of the part's pose after it was set down; "" if there is none."""
    foot_m = spot.z
    for body, own in zip(bodies, kind.stack(), strict=True):
        position, (x, y, *_) = world.pose(body)
        if 1.0 - 2.0 * float(x * x + y * y) < TILTED or abs(float(position[2]) - foot_m - own.shape.foot_m) > NEAR_M:
            return "it falls over when it is set down" if body == bodies[0] else f"{body} falls off it"
        if hypot(float(position[0]) - spot.x, float(position[1]) - spot.y) > NEAR_M:
            return "it is not set down where it should be"
        foot_m += own.height_m
    return ""
