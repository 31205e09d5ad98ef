"""A run as a LeRobot dataset: what its steps are, and that a dataset with other numbers is found out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lab.errors import BadInput
from lab.export.lerobot import RunRecord, check, episodes, task_words, write
from lab.export.program import Array, Options, Program
from lab.recordings.episode import Image, Pictures
from lab.recordings.lerobot_read import read

OPTIONS = Options(fps=20)


@dataclass
class Grey:
    """A film of grey pictures that become brighter with time."""

    most: int = 200

    def pictures(self, times_s: Array) -> Pictures:
        pictures: list[Image] = [np.full((16, 16, 3), min(self.most, int(20 * t)), np.uint8) for t in times_s]
        return pictures


def test_an_episode_is_a_transfer_with_its_task_in_words(up6: Program) -> None:
    own = list(episodes(up6, OPTIONS, RunRecord()))
    transfers = up6.carried.transfers
    assert [episode.task for episode in own] == [
        "carry slice 1 from the plate to the toaster",
        "carry slice 1 from the toaster to the butter applier",
    ]
    assert [len(e) for e in own] == [int((t.drop_s - t.leave_s) * 20 + 1e-6) + 1 for t in transfers]
    pallet = transfers[0].model_copy(update={"carries": "pallet"})
    assert task_words(pallet) == "carry the pallet of slice 1 from the plate to the toaster"


def test_a_state_is_where_the_joints_were_driven_and_an_action_the_next_state(up6: Program) -> None:
    for episode, transfer in zip(episodes(up6, OPTIONS, RunRecord()), up6.carried.transfers, strict=True):
        assert np.array_equal(episode.actions[:-1], episode.states[1:])
        for step in range(len(episode)):
            row = int(np.argmin(np.abs(up6.at_s - (transfer.leave_s + step / 20))))
            assert np.abs(episode.states[step, :-1] - up6.joints[row]).max() < 0.01
        assert set(episode.states[:, -1].tolist()) <= {0.0, 1.0}
        assert not episode.corrected.any()
    first = next(episodes(up6, OPTIONS, RunRecord()))
    closes, opens = (action.at_s for action in up6.carried.actions if action.what == "gripper")
    assert first.states[:, -1].tolist() == [float(closes <= step / 20 < opens) for step in range(len(first))]


def test_steps_in_which_a_person_moved_the_arm_are_corrected(up6: Program) -> None:
    first = next(episodes(up6, OPTIONS, RunRecord(by_hand_s=((0.1, 0.2),))))
    assert first.takeovers() == [(2, 4)]


def test_what_is_written_is_read_back_equal(up6: Program, tmp_path: Path) -> None:
    record = RunRecord(Grey(), ((0.1, 0.2),))
    write(up6, OPTIONS, record, tmp_path / "dataset")
    found = check(up6, OPTIONS, record, tmp_path / "dataset")
    recording = read(tmp_path / "dataset")
    assert (found.episodes, found.corrected_steps, found.faults) == (2, 2, ())
    assert found.steps == sum(map(len, recording.episodes))
    assert found.picture_off is not None
    assert found.picture_off < 2.0
    assert recording.state_names == recording.action_names == (*up6.arm.joints, "gripper_closed")
    assert (recording.robot, recording.fps, recording.episodes[0].success) == ("up6", 20, True)


def test_a_dataset_with_other_numbers_is_found_out(up6: Program, tmp_path: Path) -> None:
    write(up6, OPTIONS, RunRecord(Grey()), tmp_path / "dataset")
    found = check(up6, OPTIONS, RunRecord(Grey(), ((0.0, 0.1),)), tmp_path / "dataset")
    assert found.faults == ("episode 0: corrected",)
    found = check(up6, Options(fps=10), RunRecord(), tmp_path / "dataset")
    assert found.faults[:2] == ("2 episodes at 20 steps a second", "episode 0: states")


@dataclass
class Black:
    """A film of black pictures."""

    def pictures(self, times_s: Array) -> Pictures:
        pictures: list[Image] = [np.zeros((16, 16, 3), np.uint8) for _ in times_s]
        return pictures


def test_a_dataset_with_other_pictures_is_found_out(up6: Program, tmp_path: Path) -> None:
    write(up6, OPTIONS, RunRecord(Black()), tmp_path / "dataset")
    faults = check(up6, OPTIONS, RunRecord(Grey()), tmp_path / "dataset").faults
    assert [fault[:37] for fault in faults] == ["episode 1: its first picture is " + faults[0][32:37]]


def test_a_run_without_a_transfer_is_no_dataset(up6: Program, tmp_path: Path) -> None:
    empty = Program(up6.carried.model_copy(update={"transfers": ()}), *list(vars(up6).values())[1:6])
    with pytest.raises(BadInput, match="the run has no transfer"):
        write(empty, OPTIONS, RunRecord(), tmp_path / "dataset")
    assert not list(tmp_path.iterdir())


def test_a_run_of_days_is_refused(up6: Program) -> None:
    late = up6.carried.transfers[0].model_copy(update={"drop_s": 1e6})
    program = Program(up6.carried.model_copy(update={"transfers": (late,)}), *list(vars(up6).values())[1:6])
    with pytest.raises(BadInput, match="--fps 20: more than 1000000 steps"):
        next(episodes(program, OPTIONS, RunRecord()))
