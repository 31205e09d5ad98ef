"""The grip: chosen from mass and friction, refused where friction cannot hold, and physics fine where it must be."""

from dataclasses import replace
from math import inf

import pytest

from lab.errors import BadInput
from lab.sim.arms.arm_models import arm_of
from lab.sim.parts.holding import Load, check_friction, grip_force_n, needs_fine
from lab.sim.parts.kinds import Kind, kinds_of
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.task import Task
from lab.tasks.task_file import load as load_task


def kinds(task: Task, **fields: float) -> list[Kind]:
    parts = tuple(one.model_copy(update=fields) for one in task.parts)
    return list(kinds_of(task.changed(parts=parts), arm_of(task.robot).gripper).values())


def robot_of(force_n: float | None = None, acceleration_m_s2: float = 2.0) -> RobotSettings:
    return load_task("toast").robot.model_copy(update={"grip_force_n": force_n, "acceleration_m_s2": acceleration_m_s2})


def test_friction_of_two_fingers_holds_weight_and_lifting() -> None:
    """1 kg x (9.81 + 0.6 x 2) m/s2 = 11.01 N, over 2 x 0.5."""
    assert Load("box", 1.0, 0.5).needs_n(2.0) == pytest.approx(11.01)


def test_pads_hold_force_and_moment_of_what_is_swung() -> None:
    """1 kg, its middle 3.3 cm under the tips of pads of 1.1 cm, swung with 4 m/s2: 9.81, 4 and 3 x 4 make 16.01 m/s2."""
    load = Load("box", 1.0, 0.5, lever_m=0.033)
    assert load.needs_swung_n(4.0) == pytest.approx(16.01, abs=0.01)
    check_friction(robot_of(16.1, 4.0), load)
    said = "^robot.grip_force_n = 15.9: box .* would turn or slip between the fingers: it needs 16 N to be swung with"
    with pytest.raises(BadInput, match=said):
        check_friction(robot_of(15.9, 4.0), load)


@pytest.mark.parametrize(
    ("mass_kg", "friction", "force_n"),
    [
        (0.04, 0.8, 25.0),  # needs 0.28 N: as usual
        (0.01, 0.8, 1.5),  # light: 150 N/kg
        (0.1, 0.4, 15.0),  # slippery
        (1.0, 0.5, 6 * 11.01),
        (6.0, 0.2, 200.0),  # needs 165 N: with less of a margin
    ],
)
def test_where_nothing_is_said_the_force_is_chosen(mass_kg: float, friction: float, force_n: float) -> None:
    assert grip_force_n(robot_of(), Load("box", mass_kg, friction)) == pytest.approx(force_n)


@pytest.mark.parametrize(
    ("mass_kg", "friction", "force_n"),
    [
        (5.0, 0.8, 30.0),
        (0.01, 0.8, 1.5),  # light: 150 N/kg
        (0.01, 0.02, 6 * 0.01 * 11.01 / 0.04),  # and slippery
        (0.01, 0.0, 30.0),
    ],
)
def test_a_force_that_the_task_gives_is_the_most(mass_kg: float, friction: float, force_n: float) -> None:
    assert grip_force_n(robot_of(30.0), Load("box", mass_kg, friction)) == pytest.approx(force_n)


@pytest.mark.parametrize(
    ("gyration_m", "friction", "force_n", "usual"),
    [
        (0.0152, 0.8, 20.0, True),  # 0.8 x 1.52 cm are 1.2 cm
        (0.0148, 0.8, 3.0, False),  # 150 N/kg
        (0.0148, 1.0, 20.0, True),
        (0.0152, 0.5, 3.0, False),
    ],
)
def test_a_small_box_is_held_gently_and_finely(gyration_m: float, friction: float, force_n: float, usual: bool) -> None:
    load = Load("lid", 0.02, friction, gyration_m=gyration_m)
    assert grip_force_n(robot_of(), load) == pytest.approx(force_n)
    assert load.is_usual(force_n, 2.0) == usual


@pytest.mark.parametrize(
    ("mass_kg", "friction", "force_n", "fine"),
    [
        (0.04, 0.8, 25.0, False),
        (0.04, 0.8, 60.0, False),  # held with 40 N
        (0.04, 0.8, 1.6, True),  # barely: 6 x 0.28 N are 1.65
        (0.04, 0.4, 25.0, True),  # slippery
        (0.04, 0.58, 25.0, True),  # one crept by 18 mm in usual steps
        (0.019, 0.8, 19.0, True),  # light
        (0.36, 0.8, 25.0, True),  # heavy
        (0.3, 0.8, 51.0, True),
        (0.3, 0.8, 49.0, False),
    ],
)
def test_physics_is_fine_where_it_must_be(mass_kg: float, friction: float, force_n: float, fine: bool) -> None:
    task = load_task("toast")
    assert needs_fine(robot_of(force_n), kinds(task, mass_kg=mass_kg, friction=friction)) == fine


@pytest.mark.parametrize(
    ("load", "force_n", "said"),
    [
        (
            Load("slice", 1.0, 0.8),
            5.0,
            r"= 5: slice of 1 kg, friction 0.8, would slip .*: it needs 6.88 N to be lifted",
        ),
        (
            Load("slice", 6.0, 0.1),
            200.0,
            r"= 200: slice of 6 kg, friction 0.1, .* it needs 330 N .* allowed are up to 200",
        ),
        (
            Load("slice", 0.04, 0.0),
            25.0,
            r"= 25: slice of 0.04 kg, friction 0, would slip .*, however strongly they press$",
        ),
    ],
)
def test_what_friction_cannot_hold_is_refused(load: Load, force_n: float, said: str) -> None:
    with pytest.raises(BadInput, match="^robot.grip_force_n " + said):
        check_friction(robot_of(force_n), load)
    check_friction(robot_of(200.0), replace(load, friction=0.8))


def test_a_refusal_says_whether_the_force_was_chosen() -> None:
    """6 kg x 11.01 m/s2 / (2 x 0.1) = 330 N, and 200 are the most."""
    with pytest.raises(BadInput, match=r"^robot.grip_force_n = 200, chosen for it: slice of 6 kg"):
        check_friction(robot_of(), Load("slice", 6.0, 0.1))


def test_what_slides_off_its_pallet_is_refused() -> None:
    check_friction(robot_of(), Load("sign on pallet", 0.1, 0.8, carries=0.21))
    with pytest.raises(
        BadInput, match=r"^robot.acceleration_m_s2 = 2: sign on pallet would slide: friction 0.2 .* 1.962 m/s2$"
    ):
        check_friction(robot_of(), Load("sign on pallet", 0.1, 0.8, carries=0.2))


def test_a_pallet_weighs_what_it_carries() -> None:
    task = load_task("fms-arm")
    loads = {kind.name: Load.of(kind) for kind in kinds_of(task, arm_of(task.robot).gripper).values()}
    name = next(name for name in loads if " on " in name)
    part, pallet = name.split(" on ")
    assert loads[name].mass_kg == pytest.approx(loads[part].mass_kg + loads[pallet].mass_kg)
    assert loads[name].friction == loads[pallet].friction
    assert loads[name].carries == pytest.approx(0.64)  # 0.8 of each: 6.3 m/s2, and 2 x 2 are asked for
    assert loads[name].is_usual(25.0, 2.0)
    assert not loads[name].is_usual(25.0, 4.0)
    assert loads[part].carries == inf


def test_the_lever_goes_from_the_tips_to_the_middle() -> None:
    """A slice of 12 cm is taken 3 cm below its top."""
    task = load_task("toast")
    assert Load.of(kinds(task)[0]).lever_m == pytest.approx(0.03)


def test_what_pads_touch_in_lines_and_points_is_held_more_gently() -> None:
    held = {solid: Load("part", 0.05, 0.8, solid=solid).chosen_n(2.0) for solid in ("box", "cylinder", "mesh")}
    assert held == {"box": 25.0, "cylinder": pytest.approx(7.5), "mesh": pytest.approx(7.5)}
    assert not Load("part", 0.05, 0.8, solid="mesh").is_usual(7.5, 2.0), "it is always tried"
