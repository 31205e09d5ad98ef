"""`lab export`: what it writes and says, and what it refuses."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.export.program import PROGRAM, TRAJECTORY
from lab.export.recorder import MotionRecorder
from lab.sequencing.cell.schedule import Move
from lab.sim.arms.arm_models import arm_of
from lab.sim.arms.kinematics import ToolPose
from lab.sim.arms.robot import RobotArm
from lab.sim.world import World
from lab.tasks.task_file import load

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
FIELDS = {"files", "poses", "max_deviation_m", "max_deviation_rad", "deviation_at_rest_m", "deviation_at_rest_rad"} | {
    *(
        "task",
        "arm",
        "format",
        "transfers",
        "motions",
        "within_1_mm_and_1_degree",
        "run_off_target_m",
        "warnings",
        "moves",
    )
}


def carried_out(folder: Path, task_name: str) -> None:
    """A run's folder with what `lab export` needs: one way down, and the gripper closed."""
    task, high = load(task_name), ToolPose(0.5, 0.1, 0.3, 0.0)
    with World() as world:
        robot = RobotArm(world, arm_of(task.robot), 0.5, 2.0, 25.0)
        robot.stand(high)
        recorder = MotionRecorder(robot)
        for motion in (robot.follow([high.shifted(dz=-0.1)]), robot.grip()):
            for _ in motion:
                world.step()
        move = Move(1, "plate", "plate", "toaster", 0.0, 0.0, 0.1, world.time_s)
        folder.mkdir()
        recorder.program(task, 0, [move], "slice {}".format).save(folder)


@pytest.fixture
def run(folder: Path) -> Path:
    carried_out(folder / "toast-run", "toast")
    return Path("toast-run")


def test_job_files_are_written_checked_and_told(lab: Lab, run: Path) -> None:
    ran = lab("export", str(run), "--format", "jbi", "--json")
    assert ran.code == 0, ran.err
    assert ran.json.keys() == FIELDS
    assert sorted(path.name for path in (run / "jbi").iterdir()) == ["CLOSE.JBI", "M001.JBI", "OPEN.JBI", "TOAST.JBI"]
    assert {Path(path) for path in ran.json["files"]} == {*(run / "jbi").iterdir()}
    assert 0.0 < ran.json["max_deviation_m"] < 1e-3
    assert (ran.json["within_1_mm_and_1_degree"], ran.json["motions"], ran.json["transfers"]) == (True, 1, 1)
    assert ran.json["moves"] == 1
    assert ran.err == "".join(f"lab: {warning}\n" for warning in ran.json["warnings"])
    assert (run / "jbi" / "M001.JBI").read_bytes().endswith(b"WAIT IN#(2)=OFF\r\nEND\r\n")


def test_people_are_told_in_two_lines(lab: Lab, run: Path) -> None:
    first, second = lab("export", str(run), "--format", "csv", "--out", "there").out.splitlines()
    assert first == "toast, up6: 1 transfer as 1 file in there"
    assert second.startswith("read back and played in physics: at most 0.")
    assert [path.name for path in Path("there").iterdir()] == ["trajectory.csv"]


def test_a_dataset_is_written_read_back_and_told(lab: Lab, run: Path) -> None:
    ran = lab("export", str(run), "--format", "lerobot", "--fps", "10", "--json")
    assert ran.code == 0, ran.err
    assert ran.err == "lab: 'toast-run' (RUN): no journal in it: the dataset has no pictures\n"
    assert {name: ran.json[name] for name in ("task", "arm", "format", "folder", "episodes", "fps")} == {
        "task": "toast",
        "arm": "up6",
        "format": "lerobot",
        "folder": str(run / "lerobot"),
        "episodes": 1,
        "fps": 10,
    }
    assert (ran.json["equal"], ran.json["faults"], ran.json["corrected_steps"], ran.json["pictures"]) == (
        True,
        [],
        0,
        False,
    )
    assert json.loads((run / "lerobot/meta/info.json").read_text(encoding="utf-8"))["total_frames"] == ran.json["steps"]
    ran = lab("export", str(run), "--format", "lerobot", "--pictures", "0")
    assert (ran.code, ran.err) == (
        2,
        f"lab: '{run / 'lerobot'}': it exists already; a dataset is written to a new folder\n",
    )
    ran = lab("export", str(run), "--format", "lerobot", "--pictures", "0", "--out", "there")
    assert ran.out.splitlines()[1] == "read back: states, actions and tasks equal; no pictures"


def test_pulses_are_written_when_they_are_asked_for(lab: Lab, run: Path) -> None:
    assert lab("export", str(run), "--format", "jbi", "--positions", "pulse").code == 0
    assert "///POSTYPE PULSE" in (run / "jbi" / "M001.JBI").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "toast-run --format jbii",
            "unknown format 'jbii' (--format): did you mean 'jbi'? known: csv, jbi, json, lerobot, urscript",
        ),
        (
            "toast-run --format jbi --positions puls",
            "unknown sort of positions 'puls' (--positions): did you mean 'pulse'?",
        ),
        ("toast-run --format lerobot --pictures 64", "'toast-run' (RUN): no journal in it"),
        ("nowhere --format jbi", f"'nowhere' (RUN): no {PROGRAM} in it; give the folder of a `lab run` (its --out)"),
        (f"toast-run --format jbi --out toast-run/{PROGRAM}", f"'toast-run/{PROGRAM}' is a file; give a folder"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_written(lab: Lab, run: Path, words: str, said: str) -> None:
    ran = lab("export", *words.split())
    assert (ran.code, ran.gave_nothing) == (2, True)
    assert said in ran.err
    assert ran.err.count("\n") == 1
    assert sorted(path.name for path in run.iterdir()) == [PROGRAM, TRAJECTORY]


def test_an_arm_with_seven_axes_has_no_urscript(lab: Lab, folder: Path) -> None:
    carried_out(folder / "panda-run", "toast-panda")
    ran = lab("export", "panda-run", "--format", "urscript", "--json")
    assert ran.code == 2
    assert ran.json["error"] == "--format urscript: arm 'panda' has 7 axes; URScript is for arms with 6"


def test_a_tool_that_is_off_ends_it_with_1(lab: Lab, run: Path) -> None:
    """The run's own tool is written down 2 mm too high: what is played is off it."""
    with np.load(run / TRAJECTORY) as stored:
        arrays = dict(stored)
    arrays["seen"][:, 2] += 0.002
    np.savez(run / TRAJECTORY, **arrays)
    ran = lab("export", str(run), "--format", "json", "--json")
    assert ran.code == 1
    assert json.loads(ran.out)["max_deviation_m"] == pytest.approx(0.002, abs=2e-4)
    said = "more than 1 mm or 1 degree off the run's; in the run it was itself up to 2.0 mm off where it was driven to"
    assert said in ran.err
