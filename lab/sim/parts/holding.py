"""How firmly a gripper holds parts by friction, and how finely physics must be solved so that they do not creep.

Two fingers that press with F hold by friction 2 mu F against the weight and what lifting adds, m (g + a). Swung with a,
a part whose middle is h from the finger tips also turns about them. The force and the moment that
pads of radius r hold together lie within an ellipsoid (Howe and Cutkosky 1996): 2 mu F >= m sqrt(g^2 + a^2 + (a h / r)^2).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, inf

from lab.errors import BadInput
from lab.sim.arms.fingers import PAD_M
from lab.sim.frames import ShapeKind
from lab.sim.parts.kinds import Kind
from lab.tasks.robot_fields import STRONGEST_N, RobotSettings

GRAVITY_M_S2 = 9.81
SLOW = 0.6  # share of the robot's speed and acceleration with which skills lift a part
MARGIN = 6.0  # the chosen force per force that friction needs; measured: with 2.5, parts that touch machines are lost
USUAL_N = 25.0  # the chosen force where friction needs less, and where it is gentle enough for the part
GENTLE_N_KG = 1000.0  # largest force per kilogram: pressed harder, parts creep in physics, or are squeezed out
GENTLER_N_KG = (
    150.0  # the same for round parts, touched in lines and points, and for light, slippery and unsteady boxes
)
STEADY_M = (
    0.012  # friction times the radius of gyration; measured: with 0.010 boxes of 3 cm creep, with 0.014 none does
)
GENTLE_N, USUAL_KG = 50.0, (0.02, 0.35)  # beyond them, physics needs finer steps
STAYS = 2.0  # friction per acceleration with which a part on a pallet counts as far from sliding off
ROUGH = 0.5  # with at least this friction, every part that held in theory has held in physics
USUAL_FRICTION = 0.6  # parts then creep up to 14 mm in 3.6 m in usual steps, with less up to 18; audits allow 25


@dataclass(frozen=True)
class Load:
    """A part in the gripper, or a pallet with what stands on it: its mass, and the friction where the fingers touch it.

    lever_m: from the finger tips up or down to its middle. solid: what the fingers touch, for physics. carries: the
    friction of part and pallet, by which the part stays on it; inf without a part. gyration_m: radius about the axis along
    which the fingers close.
    """

    name: str
    mass_kg: float
    friction: float
    lever_m: float = 0.0
    carries: float = inf
    solid: ShapeKind = "box"
    gyration_m: float = inf

    @classmethod
    def of(cls, kind: Kind) -> "Load":
        """The load of a carried kind."""
        mass_kg, moment, foot_m = 0.0, 0.0, 0.0
        for layer in kind.stack():
            mass_kg += layer.part.mass_kg
            moment += layer.part.mass_kg * (foot_m + layer.shape.foot_m)
            foot_m += layer.height_m
        carries = inf if kind.rider is None else kind.part.friction * kind.rider.part.friction
        lever_m = abs(moment / mass_kg - kind.grip.up_m)
        return cls(kind.name, mass_kg, kind.part.friction, lever_m, carries, kind.shape.solid, kind.gyration_m)

    def needs_n(self, acceleration_m_s2: float) -> float:
        """The least force [N] of each finger with which friction lifts the load; inf without friction."""
        if not self.friction:
            return inf
        return self.mass_kg * (GRAVITY_M_S2 + SLOW * acceleration_m_s2) / (2 * self.friction)

    def needs_swung_n(self, acceleration_m_s2: float) -> float:
        """The least force [N] of each finger with which a swung load neither slips nor turns; inf without friction."""
        if not self.friction:
            return inf
        turning = acceleration_m_s2 * self.lever_m / PAD_M
        return self.mass_kg * hypot(GRAVITY_M_S2, acceleration_m_s2, turning) / (2 * self.friction)

    def held_n(self, asked_n: float, acceleration_m_s2: float) -> float:
        """The force [N] for a requested one: smaller where the load would creep and friction needs less."""
        gentle_n_kg = GENTLE_N_KG if self._is_firm and self.mass_kg >= USUAL_KG[0] else GENTLER_N_KG
        return min(asked_n, max(MARGIN * self.needs_n(acceleration_m_s2), gentle_n_kg * self.mass_kg))

    def chosen_n(self, acceleration_m_s2: float) -> float:
        """The force [N] if none is requested: the usual one, or what friction needs with a margin."""
        usual = max(MARGIN * self.needs_n(acceleration_m_s2), USUAL_N)
        return min(self.held_n(usual, acceleration_m_s2), STRONGEST_N)

    def is_usual(self, force_n: float, acceleration_m_s2: float) -> bool:
        """Whether the load is so uncritical that neither fine physics nor a trial is needed."""
        strong = force_n >= MARGIN * self.needs_n(acceleration_m_s2)
        gentle = USUAL_KG[0] <= self.mass_kg <= USUAL_KG[1] and force_n <= GENTLE_N
        rides = self.carries * GRAVITY_M_S2 >= STAYS * acceleration_m_s2
        rough = self.friction >= USUAL_FRICTION
        return strong and gentle and rides and rough and (self._is_firm or self.solid == "cylinder")

    @property
    def _is_firm(self) -> bool:
        """Whether the load is a box with enough friction and size that pressing makes it neither creep nor turn."""
        return self.solid == "box" and self.friction >= ROUGH and self.friction * self.gyration_m >= STEADY_M


def grip_force_n(robot: RobotSettings, load: Load) -> float:
    """The force [N] with which each finger holds a load: the task's one, unless the load is too light for it."""
    if robot.grip_force_n is None:
        return load.chosen_n(robot.acceleration_m_s2)
    return load.held_n(robot.grip_force_n, robot.acceleration_m_s2)


def with_force(robot: RobotSettings, load: Load) -> str:
    """The first words of an error: the field, its value and origin, and the load that it must hold."""
    force_n, given_n = grip_force_n(robot, load), robot.grip_force_n
    said = f"{force_n:.3g}, chosen for it" if given_n is None else f"{given_n:.3g}"
    if given_n is not None and force_n < given_n:
        said += f", for it {force_n:.3g}: pressed harder, it would creep"
    return f"robot.grip_force_n = {said}: {load.name} of {load.mass_kg:g} kg, friction {load.friction:g}"


def needs_fine(robot: RobotSettings, kinds: Iterable[Kind]) -> bool:
    """Whether physics must be solved finely, with pads that hold as areas, because one of the kinds is unusual."""
    loads = [Load.of(kind) for kind in kinds]
    return not all(load.is_usual(grip_force_n(robot, load), robot.acceleration_m_s2) for load in loads)


def check_friction(robot: RobotSettings, load: Load) -> None:
    """Raises BadInput, with the needed force, if friction cannot hold a moving load or keep it on its pallet."""
    if load.carries * GRAVITY_M_S2 < robot.acceleration_m_s2:
        raise BadInput(
            f"robot.acceleration_m_s2 = {robot.acceleration_m_s2:g}: {load.name} would slide: friction {load.carries:.3g} "
            f"between the two allows up to {load.carries * GRAVITY_M_S2:.4g} m/s2"
        )
    lifted_n, swung_n = load.needs_n(robot.acceleration_m_s2), load.needs_swung_n(robot.acceleration_m_s2)
    force_n, says = grip_force_n(robot, load), with_force(robot, load)
    if lifted_n == inf:
        raise BadInput(f"{says}, would slip from between the fingers, however strongly they press")
    for needed_n, goes, moved in ((lifted_n, "slip from", "lifted"), (swung_n, "turn or slip", "swung")):
        if force_n < needed_n:
            raise BadInput(
                f"{says}, would {goes} between the fingers: it needs {needed_n:.3g} N to be {moved} with acceleration_m_s2 "
                f"= {robot.acceleration_m_s2:g}, allowed are up to {STRONGEST_N:g}"
            )
