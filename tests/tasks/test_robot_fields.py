"""The robot of a task file: which words are taken for an arm, and what is said of others."""

from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.task_file import load

TEXT = (tasks_folder() / "toast.toml").read_text()


def refused(folder: Path, robot: str) -> str:
    path = folder / "mine.toml"
    path.write_text(TEXT.replace("[robot]\n", f"[robot]\n{robot}\n"))
    with pytest.raises(BadInput) as caught:
        load(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ('model = "pandas"', "unknown arm 'pandas' (robot.model): did you mean 'panda'?"),
        ('model = "mine.urdf"', "model 'mine.urdf' is a URDF: tool_link must say where its gripper is"),
        ('model = "panda"\ntip_m = 0.1', "tip_m is for a URDF file: the arm 'panda' knows its own"),
        ("opening_m = -0.1", "robot.opening_m"),
        ("base_up_m = 100.0", "robot.base_up_m"),
        ("hand = 1", "robot.hand: there is no such key"),
        ('tool = "up"', "robot.tool"),
    ],
)
def test_words_that_mean_no_arm_are_refused(tmp_path: Path, robot: str, said: str) -> None:
    assert said in refused(tmp_path, robot)


def test_a_task_knows_the_folder_that_its_arm_lies_in(tmp_path: Path) -> None:
    own = 'model = "own.urdf"\ntool_link = "tool0"\nfingers = ["left", "right"]\ntip_m = 0.09'
    (tmp_path / "mine.toml").write_text(TEXT.replace("[robot]\n", f"[robot]\n{own}\n"))
    task = load(str(tmp_path / "mine.toml"))
    assert (task.folder, task.robot.model, task.robot.is_file) == (tmp_path, "own.urdf", True)
    assert load("toast").robot.model == "up6"
