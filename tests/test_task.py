"""The commands about task files."""

from pathlib import Path

from lab.task import check_task


def test_check_finds_what_is_wrong(tmp_path: Path, root: Path) -> None:
    text = (root / "tasks" / "toast.toml").read_text(encoding="utf-8")
    path = tmp_path / "t.toml"
    path.write_text(text.replace("capacity = 50", "capacity = 2"))
    assert check_task(str(path), None, 0) == []
    (error,) = check_task(str(path), 3, 0)
    assert error == "3 toasts (--toasts) do not fit on 'plate': its capacity in the task file is 2"
    path.write_text("name =")
    (error,) = check_task(str(path), 3, 0)
    assert error.startswith(f"{path}: not valid TOML: Invalid value (at end of document)")


def test_check_finds_what_is_wrong_with_a_world(tmp_path: Path, root: Path) -> None:
    text = (root / "tasks" / "world-1.toml").read_text(encoding="utf-8")
    assert check_task("world-1", None, 0) == check_task("random:10x10x10:0.06:7", None, 0) == []
    path = tmp_path / "w.toml"
    path.write_text(text.replace("max_steps = 200", "max_steps = 12"))  # the start counts as a step
    (error,) = check_task(str(path), None, 0)
    assert error == "world 'world-1': learner.max_steps = 12: the shortest way has 12 moves and needs 13 steps"
    path.write_text(text.replace("goal = [8, 5, 3]", "goal = [8, 5, 30]"))
    (error,) = check_task(str(path), None, 0)
    assert error == f"{path}: goal (8, 5, 30) is outside the world: allowed are 0..9 x 0..9 x 0..9"
