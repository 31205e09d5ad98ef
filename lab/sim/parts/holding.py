"""How firmly a gripper holds parts by friction, and how finely physics must be solved so that they do not creep.

Two fingers that press with F hold by friction 2 mu F against the weight and what lifting adds, m (g + a).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf

from lab.errors import BadInput
from lab.sim.parts.kinds import Kind
from lab.tasks.robot_fields import STRONGEST_N, RobotSettings

GRAVITY_M_S2 = 9.81
SLOW = 0.6  # of the robot's speed and acceleration, as skills rise with a part
MARGIN = 6.0  # times what friction needs a force is chosen; measured: with 2.5 parts are lost where they touch machines
USUAL_N = 25.0  # chosen where friction needs less, unless a part is lighter than this is gentle to
GENTLE_N_KG = 1000.0  # newtons of grip for each kilogram that physics holds still in a usual step
GENTLE_N, USUAL_KG = 50.0, (0.02, 0.35)  # with a stronger grip, or others, forces are not found in a usual step
STAYS = 2.0  # times the acceleration friction holds a part on a pallet that is far from sliding off
ROUGH = 0.5  # friction from which on what holds by the numbers has always held


@dataclass(frozen=True)
class Load:
    """A part in the gripper, or a pallet with what stands on it: its mass, and the friction where the fingers touch it.

    carries: the friction, of both, by which the part stays on its pallet; endless where nothing rides.
    """

    name: str
    mass_kg: float
    friction: float
    carries: float = inf

    @classmethod
    def of(cls, kind: Kind) -> "Load":
        """What is held when a kind is carried."""
        stack = [one.part for one in kind.stack()]
        carries = inf if kind.rider is None else kind.part.friction * kind.rider.part.friction
        return cls(kind.name, sum(part.mass_kg for part in stack), kind.part.friction, carries)

    def needs_n(self, acceleration_m_s2: float) -> float:
        """The least force [N] of each finger that friction needs to lift it; endless for what has none."""
        if not self.friction:
            return inf
        return self.mass_kg * (GRAVITY_M_S2 + SLOW * acceleration_m_s2) / (2 * self.friction)

    def is_usual(self, force_n: float, acceleration_m_s2: float) -> bool:
        """Whether it is so far from what may go wrong that physics need not be fine, and nobody has to try it."""
        strong = force_n >= MARGIN * self.needs_n(acceleration_m_s2)
        gentle = USUAL_KG[0] <= self.mass_kg <= USUAL_KG[1] and force_n <= min(GENTLE_N, GENTLE_N_KG * self.mass_kg)
        rides = self.carries * GRAVITY_M_S2 >= STAYS * acceleration_m_s2
        return strong and gentle and rides and self.friction >= ROUGH


@dataclass(frozen=True)
class Holding:
    """The force of each finger [N]; fine: physics is solved finely, and a finger's pad holds as an area does, no point."""

    force_n: float
    fine: bool = False


def holding(robot: RobotSettings, kinds: Iterable[Kind]) -> Holding:
    """How a robot holds all that it may have to carry: with the force that its task gives, or one chosen for its parts."""
    loads = [Load.of(kind) for kind in kinds]
    force_n = robot.grip_force_n or min(_chosen_n(loads, robot.acceleration_m_s2), STRONGEST_N)
    usual = all(load.is_usual(force_n, robot.acceleration_m_s2) for load in loads)
    return Holding(force_n, fine=not usual)


def check_friction(robot: RobotSettings, load: Load, force_n: float) -> None:
    """BadInput where friction cannot hold a load that is lifted, with the force it needs, or cannot keep it on its pallet."""
    if load.carries * GRAVITY_M_S2 < robot.acceleration_m_s2:
        raise BadInput(
            f"robot.acceleration_m_s2 = {robot.acceleration_m_s2:g}: {load.name} would slide: friction {load.carries:.3g} "
            f"between the two allows up to {load.carries * GRAVITY_M_S2:.4g} m/s2"
        )
    needed_n = load.needs_n(robot.acceleration_m_s2)
    if force_n >= needed_n:
        return
    says = (
        f"robot.grip_force_n = {force_n:g}: {load.name} of {load.mass_kg:g} kg, friction {load.friction:g}, would slip"
    )
    if needed_n == inf:
        raise BadInput(f"{says} from between the fingers, however strongly they press")
    raise BadInput(
        f"{says} from between the fingers: it needs {needed_n:.3g} N to be lifted with acceleration_m_s2 = "
        f"{robot.acceleration_m_s2:g}, allowed are up to {STRONGEST_N:g}"
    )


def _chosen_n(loads: Sequence[Load], acceleration_m_s2: float) -> float:
    """As firmly as friction needs with a margin, otherwise as usual, and gentler with what is light."""
    needed = max(load.needs_n(acceleration_m_s2) for load in loads)
    lightest = min(load.mass_kg for load in loads)
    return max(MARGIN * needed, min(USUAL_N, GENTLE_N_KG * lightest))
