"""A station under a hood: parts are brought in, and taken out, through its open side, by a tool that hangs, or is level."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.learning.problem import Problem
from lab.sim.arms.kinematics import ToolPose
from lab.sim.models import Link, UrdfModel, urdf
from lab.sim.models import LinkShape as Piece
from lab.sim.scene.blocked_cells import Surveyor
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import TABLE, Scene
from lab.sim.world import World
from lab.skills.prepared_scene import prepare
from lab.skills.skill import SETTLE_STEPS
from lab.skills.trial import carry_out
from lab.tasks.task import Task
from lab.tasks.task_file import load
from lab.toolbox.policy import Policy

GREY = (0.5, 0.5, 0.55, 1.0)
FLOOR, BACK, ROOF = ((0.30, 0.30, 0.03), (0.03, 0, 0.015)), ((0.02, 0.30, 0.55), (0.17, 0, 0.275)), 0.56
SIDES = [((0.20, 0.02, 0.55), (0.08, side * 0.14, 0.275)) for side in (-1, 1)]
HOOD = """[[stations]]
name = "coffee_machine"
kind = "machine"
pose = [0.80, -0.45, -0.5]
capacity = 1
processing_s = 35.0
body = "hood.urdf"
floor_m = 0.03
approach = "{approach}"

"""


def cell(folder: Path, approach: str, roof_m: float = ROOF) -> Task:
    """Breakfast with its coffee machine under a hood that is open towards the arm, and no tank behind it."""
    boxes = [FLOOR, BACK, *SIDES, ((0.20, 0.30, 0.02), (0.08, 0, roof_m))]
    text, _ = urdf(UrdfModel("hood", [Link("hood", 5.0, [Piece(GREY, size, at) for size, at in boxes])]))
    (folder / "hood.urdf").write_text(text)
    shipped = (tasks_folder() / "breakfast.toml").read_text()
    shipped = shipped.replace('model = "up6"', 'model = "up6"\ntool = "hanging"')
    begin = shipped.index('[[stations]]\nname = "coffee_machine"')
    end = shipped.index("[[stations]]", begin + 1)
    file = folder / "hood.toml"
    file.write_text(shipped[:begin] + HOOD.format(approach=approach) + shipped[end:])
    task = load(str(file))
    return task.changed(obstacles=tuple(o for o in task.obstacles if o.name != "water tank"))


@pytest.mark.parametrize("name", ["place cup at coffee_machine", "grasp cup at coffee_machine"])
def test_a_cup_goes_in_and_out(tmp_path: Path, optimal: Callable[[Problem], Policy], name: str) -> None:
    prepared = prepare(cell(tmp_path, "side"), ("cup",), 0, name)
    problem = prepared.problems[name]
    assert {"in", "out", "lower", "higher"} <= set(problem.mdp.action_labels)
    done = carry_out(prepared, prepared.skillset.skills[name], optimal(problem))
    assert done.failure is None
    assert done.sim_s > SETTLE_STEPS / 240


def test_from_above_its_roof_is_in_the_way(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="coffee_machine"):
        prepare(cell(tmp_path, "above"), ("cup",), 0, "place cup at coffee_machine")


def test_a_hood_that_is_too_low_for_the_arm_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"place cup at coffee_machine: .*in the way: coffee_machine"):
        prepare(cell(tmp_path, "side", roof_m=0.25), ("cup",), 0, "place cup at coffee_machine")


# ---- a level tool --------------------------------------------------------------------------------------------------


def furnace(folder: Path, changes: dict[str, str]) -> Task:
    """The shipped furnace with texts of its file changed."""
    text = (tasks_folder() / "furnace.toml").read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "furnace.toml").write_text(text)
    return load(str(folder / "furnace.toml"))


@pytest.mark.parametrize("name", ["grasp at input", "place at furnace", "grasp at furnace", "place at output"])
def test_a_crucible_goes_under_a_roof(optimal: Callable[[Problem], Policy], name: str) -> None:
    task = load("furnace")
    assert task.robot.tool == "level"
    prepared = prepare(task, task.order(1), 0, name)
    done = carry_out(prepared, prepared.skillset.skills[name], optimal(prepared.problems[name]))
    assert done.failure is None


@pytest.mark.parametrize("name", ["transfer input to furnace with crucible", "transfer output to input"])
def test_a_level_tool_goes_through_the_workspace(optimal: Callable[[Problem], Policy], name: str) -> None:
    task = load("furnace")
    prepared = prepare(task, task.order(2), 0, name)
    done = carry_out(prepared, prepared.skillset.skills[name], optimal(prepared.problems[name]))
    assert done.failure is None


def test_a_level_wrist_keeps_off_the_table() -> None:
    """The iiwa's is 6.9 cm thick below the axis of its tool."""
    with World() as world:
        surveyor = Surveyor(Scene(world, load("furnace"), (), Layout((), ())), None, clearance=0.01)
        causes = [surveyor.cause(ToolPose(0.75, 0.0, z)) for z in (0.06, 0.075, 0.1, 0.2)]
    assert causes == [TABLE, TABLE, "", ""]


SHELF, SIZE, ARM = "size_m = [0.10, 0.34, 0.12]", "size_m = [0.040, 0.090]", 'model = "iiwa"'


def test_a_hanging_tool_does_not_come_under_the_roof(tmp_path: Path) -> None:
    hangs = {ARM: f'{ARM}\ntool = "hanging"', SHELF: "size_m = [0.18, 0.36, 0.12]"}
    hangs |= {"pose = [0.95": "pose = [0.68", "0.60, -0.50": "0.48, -0.40", "0.60, 0.50": "0.48, 0.40"}
    task = furnace(tmp_path, hangs)
    with pytest.raises(BadInput, match=r"place at furnace: no room .*in the way: furnace"):
        prepare(task, task.order(1), 0, "place at furnace")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {ARM: 'model = "up6"', SIZE: "size_m = [0.034, 0.090]"},
            "station 'input' is out of reach",
        ),  # its wrist ends first
        ({"color = [0.75": "grip = { yaw = 0.0, up_m = 0.04 }\ncolor = [0.75"}, "grip is for a tool that hangs"),
        ({SIZE: "size_m = [0.060, 0.090]"}, "cannot be gripped level, along its x axis: it is 0.060 m wide"),
        ({SIZE: "size_m = [0.040, 0.020]"}, "too flat for the fingers of a level tool"),
        ({"title =": 'perception = "camera"\ntitle ='}, "perception = 'camera' is for a tool that hangs"),
    ],
)
def test_what_cannot_be_done_level_is_said(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    task = furnace(tmp_path, changes)
    with pytest.raises(BadInput) as refused:
        prepare(task, task.order(3), 0)
    assert said in str(refused.value)
    assert len(str(refused.value).removeprefix(str(tmp_path))) < 300
