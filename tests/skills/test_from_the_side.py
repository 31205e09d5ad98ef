"""A station under a hood: parts are brought in, and taken out, through its open side."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.learning.problem import Problem
from lab.sim.urdf_writer import Link, Model, urdf
from lab.sim.urdf_writer import Part as Piece
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
    text, _ = urdf(Model("hood", [Link("hood", 5.0, [Piece(GREY, size, at) for size, at in boxes])]))
    (folder / "hood.urdf").write_text(text)
    shipped = (tasks_folder() / "breakfast.toml").read_text()
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
