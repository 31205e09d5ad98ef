"""What a run's folder keeps of the robot's program, and what is said of a folder that has none, or a damaged one."""

import json
import re
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.export.program import PROGRAM, TRAJECTORY, Program


def test_a_program_comes_back(up6: Program, folder: Path) -> None:
    back = Program.load(folder)
    assert back.carried == up6.carried
    for name in ("at_s", "joints", "closed", "seen_at_s", "seen"):
        assert getattr(back, name) == pytest.approx(getattr(up6, name), abs=1e-6), name
    assert back.arm.name == "up6"


def test_a_saved_program_is_the_same_bytes_each_time(up6: Program, tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        up6.save(tmp_path / name)
    for file in (PROGRAM, TRAJECTORY):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_its_transfers_in_words(up6: Program) -> None:
    first, second = up6.carried.transfers
    assert (first.words, first.waits_for) == ("slice 1: plate to toaster", None)
    assert (second.words, second.waits_for) == ("slice 1: toaster to butter_applier", "toaster")
    assert second.model_copy(update={"carries": "pallet"}).words == "pallet of slice 1: toaster to butter_applier"


def test_its_tools_turn_without_jumps(up6: Program) -> None:
    """The last two motions each turn by a quarter, the second one over half a turn."""
    *_, third, last = up6.motions
    yaws = np.concatenate([up6.tools(motion.first, motion.last)[:, 3] for motion in (third, last)])
    assert abs(np.diff(yaws)).max() < 0.1
    assert yaws[-1] - yaws[0] == pytest.approx(np.pi, abs=1e-3)


@pytest.mark.parametrize("file", [PROGRAM, TRAJECTORY])
def test_a_folder_without_a_program_says_which_file_is_missing(folder: Path, file: str) -> None:
    (folder / file).unlink()
    with pytest.raises(BadInput, match=rf"\(RUN\): no {file} in it; give the folder of a `lab run`"):
        Program.load(folder)


def damaged(folder: Path, **change: Any) -> None:
    path = folder / PROGRAM
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | change), encoding="utf-8")


def test_a_damaged_document_names_its_field(up6: Program, folder: Path) -> None:
    rows = [action.model_dump() for action in up6.carried.actions]
    ways = [transfer.model_dump() for transfer in up6.carried.transfers]
    for change, said in (
        ({"version": 2}, "version: Input should be 1"),
        ({"seed": "none"}, "seed: Input should be a valid integer"),
        ({"more": 1}, "more: Extra inputs are not permitted"),
        ({"actions": [rows[0] | {"last": 10_000}]}, "motion 1 counts rows that its trajectory does not have"),
        ({"actions": [rows[0] | {"what": "dance"}]}, "actions.0: Input tag 'dance'"),
        ({"transfers": [ways[0] | {"waits_for": "oven"}]}, "transfer 1 waits for 'oven', which is no machine of it"),
        ({"robot": {"model": "panda", "start": "plate"}}, "its trajectory is not of the arm 'panda' with 7 joints"),
    ):
        up6.save(folder)
        damaged(folder, **change)
        with pytest.raises(BadInput, match=re.escape(said)):
            Program.load(folder)


def test_a_damaged_trajectory_is_refused(up6: Program, folder: Path) -> None:
    path = folder / TRAJECTORY
    with np.load(path) as stored:
        arrays = dict(stored)
    for change, said in (
        ({"joints": arrays["joints"][:-1]}, "the columns of its trajectory are not equally long"),
        ({"joints": arrays["joints"].ravel()}, "'joints' is not an array of 2 dimensions of finite numbers"),
        ({"seen": np.full_like(arrays["seen"], np.nan)}, "'seen' is not an array of 2 dimensions of finite numbers"),
        ({"at_s": np.array([{}], object)}, "not a run's trajectory: "),  # a pickle
    ):
        np.savez(path, **(arrays | change))
        with pytest.raises(BadInput, match=re.escape(said)):
            Program.load(folder)
    path.write_bytes(b"PK nothing")
    with pytest.raises(BadInput, match=r"trajectory\.npz': not a run's trajectory"):
        Program.load(folder)


def _zipped(folder: Path, arrays: dict[str, bytes]) -> None:
    with ZipFile(folder / TRAJECTORY, "w", ZIP_DEFLATED) as archive:
        for name, content in arrays.items():
            archive.writestr(f"{name}.npy", content)


def _array(shape: tuple[int, ...], content: int) -> bytes:
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(content)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (_array((25_000_000, 2), 400_000_000), "unpacked it has 400000128 bytes, allowed are 200000000"),
        (_array((10**7,), 1000), "'at_s.npy' does not hold an array of (10000000,)"),
        (_array((10**8,), 1000), "'at_s.npy' holds 100000000 numbers, allowed are 25000000"),
        (_array((-1,), 0), "'at_s.npy' does not hold an array of (-1,)"),
        (b"\x93NUMPY\x07\x00", "not a run's trajectory"),
        (b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f8',", "not a run's trajectory"),
        (b"no array", "not a run's trajectory"),
    ],
)
def test_a_trajectory_that_unpacks_to_more_than_it_may_is_refused(folder: Path, content: bytes, said: str) -> None:
    _zipped(folder, {"at_s": content})
    with pytest.raises(BadInput) as refused:
        Program.load(folder)
    assert said in str(refused.value)


@given(st.binary(max_size=300), st.integers(0, 2000))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_trajectory_with_other_bytes_is_refused_or_read(folder: Path, content: bytes, at: int) -> None:
    path = folder / TRAJECTORY
    sound = path.read_bytes()
    path.write_bytes(sound[:at] + content + sound[at + len(content) :])
    with suppress(BadInput):  # and nothing else
        Program.load(folder)
    path.write_bytes(sound)
