"""Faults in a task file: each kind has its own fields, and a slip of the pen is shown on its line."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.task_file import load

TOAST = (tasks_folder() / "toast.toml").read_text(encoding="utf-8")


def with_fault(folder: Path, *lines: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(f"{TOAST}\n[[faults]]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_fault_is_read(tmp_path: Path) -> None:
    path = with_fault(tmp_path, 'what = "part moved"', "at_s = 30", 'part = "slice 1"', "by_m = [0.06, 0.0]")
    (fault,) = load(str(path)).faults
    assert (fault.what, fault.at_s, fault.part, fault.by_m) == ("part moved", 30.0, "slice 1", (0.06, 0.0))


@pytest.mark.parametrize(
    ("lines", "said", "line"),
    [
        (['what = "part moved"', 'station = "toaster"'], "has no station: allowed are at_m, at_s, by_m,", 1),
        (['what = "machine slow"'], "needs station", 1),
        (['what = "machine slow"', 'station = "toster"'], "did you mean 'toaster'?", 2),
        (['what = "machine fails"', 'station = "plate"'], "unknown station 'plate' (fault 1)", 2),
        (['what = "obstacle gone"', 'obstacle = "cubes D"'], "unknown obstacle 'cubes D'", 2),
        (['what = "part gone"', 'part = "loaf 1"'], "unknown part 'loaf 1'", 2),
        (['what = "part gone"', 'when = "carried"'], "wanted 'in machine' or 'standing'", 2),
        (['what = "part goen"'], "(got 'part goen'): did you mean 'part gone'?", 1),
        (['what = "camera blind"', "seconds = -1"], "seconds", 2),
    ],
)
def test_a_slip_is_shown_on_its_line(tmp_path: Path, lines: list[str], said: str, line: int) -> None:
    path = with_fault(tmp_path, *lines)
    with pytest.raises(BadInput) as caught:
        load(str(path))
    first = len(TOAST.splitlines()) + 2  # the line of [[faults]]
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"{path}: line {first + line}: ")
    assert "\n" not in str(caught.value)
