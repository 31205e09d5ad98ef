"""A task file is checked with its scene and its problems."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.errors import BadInput
from lab.skills import prepared_scene
from lab.tasks.task_file import names_of


def check_task(file: str, toasts: int | None, seed: int) -> list[str]:
    return prepared_scene.check_task(file, toasts, seed)[0]


def test_rewards_that_make_crashing_the_better_choice_are_warned_of(tmp_path: Path, root: Path) -> None:
    """After 11 moves at -0.1 and discount 0.99 walking has cost 1.05; when a surface is covered nothing can be run into."""
    text = (root / "tasks" / "toast.toml").read_text(encoding="utf-8")
    path = tmp_path / "t.toml"
    path.write_text(text)
    assert prepared_scene.check_task(str(path), 1, 0) == ([], [])
    path.write_text(text.replace("rewards = { goal = 1.5,", "rewards = { goal = 1.5, collision = -1.0,"))
    errors, warnings = prepared_scene.check_task(str(path), 1, 0)
    assert errors == []
    assert [slip.split(" = ")[0] for slip in warnings] == [
        f"subtasks.{name}.rewards.collision" for name in ("grasp", "transfer", "insert", "place")
    ]
    assert warnings[0].endswith(
        "-1.0: 11 moves cost as much, so a learner that has strayed longer does better to crash: wanted a lower one; "
        "left out, it is -11.5"
    )
    assert len(prepared_scene.check_task("world-1", None, 0)[1]) == 1  # as printed in the thesis


def test_check_finds_what_is_wrong(tmp_path: Path, root: Path) -> None:
    text = (root / "tasks" / "toast.toml").read_text(encoding="utf-8")
    path = tmp_path / "t.toml"
    path.write_text(text.replace("capacity = 50", "capacity = 2"))
    assert check_task(str(path), 2, 0) == []
    (error,) = check_task(str(path), None, 0)  # its own order
    assert "station 'plate': capacity = 2: 3 slices" in error
    (error,) = check_task(str(path), 3, 0)
    assert error == "3 slices (--toasts, --parts) do not fit on 'plate': its capacity in the task file is 2"
    path.write_text("name =")
    (error,) = check_task(str(path), 3, 0)
    assert error.startswith(f"{path}: not valid TOML: Invalid value (at end of document)")


def test_check_finds_what_is_wrong_with_a_world(tmp_path: Path, root: Path) -> None:
    text = (root / "tasks" / "world-1.toml").read_text(encoding="utf-8")
    assert check_task("world-1", None, 0) == check_task("random:10x10x10:0.06:7", None, 0) == []
    path = tmp_path / "w.toml"
    path.write_text(text.replace("max_steps = 200", "max_steps = 12"))  # the start counts as a step
    (error,) = check_task(str(path), None, 0)
    assert error == "world 'world-1': learner.max_steps = 12: the shortest path has 12 moves and needs 13 steps"
    path.write_text(text.replace("goal = [8, 5, 3]", "goal = [8, 5, 30]"))
    (error,) = check_task(str(path), None, 0)
    assert error == f"{path}: goal (8, 5, 30) is outside the world: allowed are 0..9 x 0..9 x 0..9"


@pytest.mark.parametrize("name", names_of("cell"))
def test_the_cells_that_ship_are_sound(name: str) -> None:
    assert check_task(name, None, 0) == []


def test_check_finds_what_is_wrong_with_a_cell(tmp_path: Path, root: Path) -> None:
    text = (root / "tasks" / "toast-case-1.toml").read_text(encoding="utf-8")
    path = tmp_path / "c.toml"
    path.write_text(text.replace("capacity = 200", "capacity = 3"))
    assert check_task(str(path), None, 0) == check_task(str(path), 3, 0) == []
    (error,) = check_task(str(path), 4, 0)
    assert error == f"{path}: line 17: station 'finished_plate': capacity 3 cannot hold all 4 parts"
    path.write_text(text.replace('"butter_buffer" },', '"buter_buffer" },'))
    (error,) = check_task(str(path), None, 0)
    assert error.startswith(f"{path}: line 28: unknown station 'buter_buffer' (stage 3 of the route): did you mean")
    with pytest.raises(BadInput, match="an order of 201 parts: allowed are 1 to 200"):
        check_task("toast-case-1", 201, 0)
    with pytest.raises(BadInput, match=r"cell 'fms' makes several products: give their order with --case, such as RSR"):
        check_task("fms", 3, 0)


def test_a_bad_cell_ends_the_command_with_2_and_one_line(tmp_path: Path, root: Path, lab: Callable[..., Any]) -> None:
    path = tmp_path / "c.toml"
    text = (root / "tasks" / "fms.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("service_s = 240", "service_s = nan"))
    ran = lab("task", "check", str(path))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(
        f"lab: {path}: line 66: products.1.routes.0.2.service_s of product 'sign': Input should be a finite number"
    )
    assert ran.err.count("\n") == 1
    assert lab("task", "check", "fms").out == "fms is sound\n"
