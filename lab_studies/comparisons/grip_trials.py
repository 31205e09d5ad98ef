"""Trials of one part in a cell with two places half a metre apart: it is grasped, carried and placed as in a task."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, hypot, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lab.errors import BadInput, WorkFailed
from lab.files import write_whole
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.parts.grip import Grip
from lab.sim.parts.kinds import Spot, kinds_of
from lab.sim.parts.part_shape import shape_of
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import World
from lab.skills.place import let_go, release_pose
from lab.skills.skill import NOT_OFF, SETTLE_STEPS, UPRIGHT, Bench
from lab.tasks.part_fields import PartFields
from lab.tasks.robot_fields import RobotSettings
from lab.tasks.task import Task, part_name
from lab.tasks.task_file import load
from lab_studies.comparisons.grip_models import MODELS, part_of_model

CARRY_M, OVER_M = 0.5, 0.15  # how far a part is carried, and how high it is lifted
NEAR_M, ROLLED_M = 0.015, 0.030  # the largest distance from its place at the end; for what rolls
REST_STEPS = 240  # of physics after the fingers have opened
SLOW = 0.6  # the share of the speed near a part, as in skills
HEADINGS = 72  # the headings over half a turn at which a width is measured

ARM = RobotSettings(model="up6", start="to")
TASK = """
name = "grips"
[robot]
model = "{arm}"
start = "to"
[workspace]
lower_m = [0.0, -0.8, 0.24]
cell_m = [0.12, 0.12, 0.12]
shape = [10, 14, 3]
[[parts]]
name = "{name}"
shape = "mesh"
file = "{file}"
scale = {scale!r}
hull = {hull}
stands = [{stands[0]!r}, {stands[1]!r}]
mass_kg = {mass_kg!r}
friction = {friction!r}
routes = [["from", "to"]]
[[stations]]
name = "from"
kind = "storage"
pose = [{begin[0]!r}, {begin[1]!r}, {begin[2]!r}]
capacity = 1
[[stations]]
name = "to"
kind = "storage"
pose = [{end[0]!r}, {end[1]!r}, {end[2]!r}]
capacity = 1
"""

Place = tuple[float, float, float]  # x, y [m], yaw [rad]


@dataclass(frozen=True)
class Setting:
    """A model by its name, the number of its random poses, and their seed."""

    model: str
    poses: int
    seed: int


@dataclass(frozen=True)
class Outcome:
    """The results of a model's poses.

    refused: the error of its task if it is not graspable, else "". failures: why each pose failed, "" if it did not.
    edges_m: the extents of the model as it stands. widths_m: its widths at HEADINGS headings over half a turn.
    """

    refused: str
    failures: tuple[str, ...]
    off_m: tuple[float, ...]
    edges_m: tuple[float, ...]
    widths_m: tuple[float, ...]
    grip: Grip | None


def model_outcome(setting: Setting) -> Outcome:
    """The outcome of a model in all its poses; without poses if its grip is rejected."""
    model = next(known for known in MODELS if known.name == setting.model)
    rng = np.random.default_rng([setting.seed, MODELS.index(model)])
    with TemporaryDirectory(prefix="lab-grips-") as name:
        folder = Path(name)
        part = part_of_model(model, folder)
        edges, widths = edges_and_widths(part, folder)
        try:
            tasks = [_task(part, folder, rng) for _ in range(setting.poses)]
            grip = kinds_of(tasks[0], arm_of(ARM).gripper)[part.name].grip
        except BadInput as error:
            return Outcome(str(error), (), (), edges, widths, None)
        trials = [carrying_trial(task, model.rolls) for task in tasks]
        return Outcome("", tuple(why for why, _ in trials), tuple(off for _, off in trials), edges, widths, grip)


def edges_and_widths(part: PartFields, folder: Path) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A part's extents as it stands (3,), and its widths (HEADINGS,) over half a turn [m]."""
    shape = shape_of(part, folder)
    yaws = np.arange(HEADINGS) * pi / HEADINGS
    across = shape.hull[:, :2] @ np.stack([-np.sin(yaws), np.cos(yaws)])
    return tuple((shape.high - shape.low).tolist()), tuple(np.ptp(across, axis=0).tolist())


def _task(part: PartFields, folder: Path, rng: np.random.Generator) -> Task:
    """The task of carrying a part between two random places with random yaws, both within the arm's reach."""
    begin, end = random_places(rng)
    write_whole(folder / "grips.toml", _text(part, begin, end).encode())
    return load(str(folder / "grips.toml"))


def _text(part: PartFields, begin: Place, end: Place) -> str:
    fields = part.model_dump() | {"hull": str(part.hull).lower()}
    return TASK.format(**fields, arm=ARM.model, begin=begin, end=end)


def random_places(rng: np.random.Generator) -> tuple[Place, Place]:
    """Two random places CARRY_M apart, 0.5 to 1.05 m from the arm's axis and ahead of it."""
    while True:
        x, y = float(rng.uniform(0.35, 0.9)), float(rng.uniform(-0.6, 0.6))
        way, yaw, turn = (float(number) for number in rng.uniform([-pi, -pi, -pi / 2], [pi, pi, pi / 2]))
        there = x + CARRY_M * cos(way), y + CARRY_M * sin(way)
        if all(0.5 < hypot(*at) < 1.05 and at[0] > 0.3 for at in ((x, y), there)):
            return (x, y, yaw), (*there, yaw + turn)


def carrying_trial(task: Task, rolls: bool) -> tuple[str, float]:
    """Carry the part of a task; return why that failed, or "", and its distance [m] from its place at the end."""
    with World() as world:
        kind = task.parts[0].name
        bench = Bench(Scene(world, task, (kind,), Layout((), (NOT_OFF,))))
        body = bench.scene.body_of(part_name((kind,), 1), kind)
        for _ in range(SETTLE_STEPS):
            world.step()
        try:
            for _ in _motion(bench, body):
                world.step()
        except WorkFailed as error:
            return str(error), float("nan")
        goal = bench.scene.kind_of[body].held_at(_goal(bench))
        at = bench.part_pose(body, goal.yaw)
        off = hypot(at.x - goal.x, at.y - goal.y)
        if not rolls and bench.upright(body) <= UPRIGHT:
            return "it fell over", off
        return ("" if off <= (ROLLED_M if rolls else NEAR_M) else f"it is {off:.3f} m off its place"), off


def _goal(bench: Bench) -> Spot:
    return bench.scene.places.spots(bench.scene.task.station("to"))[0]


def _motion(bench: Bench, body: str) -> Iterator[None]:
    """Come from above, close, lift, carry, set down as it hangs, open, rise, wait."""
    robot, goal = bench.scene.robot, bench.part_pose(body)
    high = goal.z + OVER_M
    yield from robot.follow([ToolPose(goal.x, goal.y, high, goal.yaw)])
    yield from robot.follow([goal], slow=SLOW)
    yield from robot.grip()
    yield from robot.follow([ToolPose(goal.x, goal.y, high, goal.yaw)], slow=SLOW)
    bench.held = body
    if not bench.holds(body):
        raise WorkFailed("it is not in the gripper after lifting")
    spot = _goal(bench)
    above = bench.scene.kind_of[body].held_at(spot)
    yield from robot.follow([ToolPose(above.x, above.y, high, above.yaw)])
    if not bench.holds(body):
        raise WorkFailed("the gripper lost it on the way")
    let = release_pose(bench, body, spot)
    yield from robot.follow([let], slow=SLOW)
    yield from let_go(bench, [ToolPose(let.x, let.y, high, let.yaw)])
    yield from robot.rest(REST_STEPS)
