"""A kept run seen again: its pictures are those of the scene in physics, and the journal tells a person's motions."""

from pathlib import Path

import numpy as np
import pytest

from lab.audit.tracks import FILE, packed, tracks_of
from lab.errors import BadInput
from lab.production.recorder import Recorder
from lab.production.run_film import RunFilm, by_hand_s
from lab.production.run_journal import Commanded, Moved, RunBegan, RunJournal
from lab.production.run_options import RunOptions
from lab.sim.arms.kinematics import ToolPose
from lab.sim.scene.places import Layout
from lab.sim.scene.scene import Scene
from lab.sim.world import TIME_STEP, World
from lab.skills.camera_grids import overhead_camera
from lab.tasks.record import hash_of
from lab.tasks.task_file import load
from lab.vision import Image

PIXELS = 96
TURNED = ToolPose(0.45, -0.1, 0.25, 0.7)


def journal(folder: Path, name: str, *entries: object) -> None:
    task = load(name)
    kept = RunJournal.begin(folder, RunBegan(RunOptions(name, toasts=1).to_json(), name, hash_of(task)))
    for entry in entries:
        kept.write(entry)  # type: ignore[arg-type]
    kept.close()


def kept_run(folder: Path, name: str = "toast") -> list[Image]:
    """A run's folder with two frames, 0.2 s apart, and the two pictures that the camera took in physics."""
    task = load(name)
    order, pictures = task.ordered(1, None), list[Image]()
    layout = Layout(tuple(obstacle.position_m for obstacle in task.obstacles), ((0.0, 0.0, 0.0),))
    with World() as world:
        scene = Scene(world, task, order, layout)
        recorder = Recorder(world)
        for pose in (ToolPose(0.4, 0.2, 0.3, 0.0), TURNED):
            assert scene.robot.stand(pose)
            world.pass_time(24)
            recorder.take()
            if task.camera is not None:
                pictures.append(overhead_camera(task, PIXELS).picture(world).copy())
            world.pass_time(24)
        journal(folder, name)
        (folder / FILE).write_bytes(packed(tracks_of(recorder.recording)))
    return pictures


def test_its_pictures_are_those_that_the_camera_took_in_physics(tmp_path: Path) -> None:
    first, second = kept_run(tmp_path)
    with RunFilm(tmp_path, PIXELS) as film:
        found = film.pictures(np.array([0.0, 0.1, 0.2, 0.3, 9.0]))
        assert len(found) == 5
        pictures = list(found)
        for own, other in ((first, pictures[0]), (first, pictures[1]), (second, pictures[3]), (second, pictures[4])):
            apart = np.abs(own.astype(int) - other)
            assert (apart > 8).any(
                axis=2
            ).mean() < 0.005  # an edge may fall on the pixel beside: the frames are rounded
        assert np.abs(pictures[2].astype(int) - first).mean() > 0.5  # between the two the arm is on its way
        assert np.array_equal(found[1], pictures[1])


def test_a_task_without_a_camera_has_no_film(tmp_path: Path) -> None:
    journal(tmp_path, "fms-arm")
    with pytest.raises(BadInput, match=r"--pictures 96: task 'fms-arm' has no \[camera\]: wanted --pictures 0"):
        RunFilm(tmp_path, PIXELS)


def test_a_run_without_frames_has_no_film(tmp_path: Path) -> None:
    journal(tmp_path, "toast")
    with pytest.raises(BadInput, match=r"frames.npz' cannot be read"):
        RunFilm(tmp_path, PIXELS)


def test_a_command_by_hand_lasts_until_the_next_line_of_the_journal(tmp_path: Path) -> None:
    journal(
        tmp_path,
        "toast",
        Commanded(0, "jog +x 10", "operator"),
        Commanded(240, "execute grasp at plate", "operator"),  # by a learned skill
        Commanded(480, "jog +q 10", "operator", "no axis"),  # refused
        Commanded(720, "open", "operator"),
        Moved(960, "slice 1", "plate", "toaster", 1.0, 4.0),
        Commanded(1200, "jog -x 10", "operator"),
        Commanded(1200, "pause", "operator"),  # at the same step: the motion was not made
        Commanded(1440, "home", "operator"),
    )
    assert by_hand_s(tmp_path) == ((0.0, 1.0), (3.0, 4.0), (6.0, 2**53 * TIME_STEP))
