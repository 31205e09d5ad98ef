"""A task file from before there were kinds of parts is read as what it says today."""

from pathlib import Path

from lab.tasks.task_file import load


def test_the_old_toast_file_is_the_one_that_ships_field_by_field() -> None:
    """`first_form.toml` is tasks/toast.toml as it was: slices, one route, the insert grid, the butter sub-task."""
    old = load(str(Path(__file__).parent / "first_form.toml")).model_dump()
    new = load("toast").model_dump()
    assert old.keys() == new.keys()
    assert {name: old[name] for name in new if old[name] != new[name]} == {}
