"""Picture files: written, read back, and refused when they are cut off, damaged, huge or something else."""

import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.vision import MARKERS, picture_files, read_picture, see, write_picture

PICTURE = np.full((240, 240, 3), (180, 150, 110), dtype=np.uint8)
for kind, middle in (("gripper", (10, 230)), ("toaster", (190, 50)), ("obstacle", (110, 110))):
    cv2.circle(PICTURE, middle, 7, MARKERS[kind].rgb, -1)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.JPEG"])
def test_a_written_picture_is_read_back(tmp_path: Path, name: str) -> None:
    image = PICTURE
    write_picture(tmp_path / name, image)
    back = read_picture(tmp_path / name)
    assert np.abs(back.astype(int) - image).mean() < (0.1 if name.endswith("png") else 3)
    assert see(back).obstacles == ((5, 5),)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize("keep", [0.1, 0.5, 0.98])
def test_a_cut_off_file_is_refused(tmp_path: Path, suffix: str, keep: float) -> None:
    path = tmp_path / f"whole{suffix}"
    write_picture(path, PICTURE)
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data))])
    with pytest.raises(BadInput, match=r"whole.*the (PNG|JPEG) file is cut off"):
        read_picture(path)


def test_a_damaged_picture_is_refused_and_nothing_else_is_said(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.png"
    write_picture(path, PICTURE)
    data = bytearray(path.read_bytes())
    data[60:90] = bytes(30)
    path.write_bytes(data)
    with pytest.raises(BadInput, match="damaged"):
        read_picture(path)
    assert capfd.readouterr() == ("", "")


def test_files_that_are_no_pictures_are_refused(tmp_path: Path) -> None:
    text = tmp_path / "a.png"
    text.write_text("hello")
    with pytest.raises(BadInput, match=r"a\.png: not a picture that can be read: wanted a PNG or JPEG"):
        read_picture(text)
    with pytest.raises(BadInput, match="it is no regular file"):
        read_picture(tmp_path)
    with pytest.raises(BadInput, match=r"b\.png: cannot be read: No such file"):
        read_picture(tmp_path / "b.png")


def test_a_huge_picture_is_refused_by_its_header(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.png"
    write_picture(path, PICTURE)
    data = bytearray(path.read_bytes())
    data[16:20] = (2**31 - 1).to_bytes(4, "big")
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    path.write_bytes(data)
    with pytest.raises(BadInput, match="2147483647 x 240 pixels"):
        read_picture(path)
    monkeypatch.setattr(picture_files, "MAX_BYTES", 10)
    with pytest.raises(BadInput, match="bytes, allowed are 10"):
        read_picture(path)


@example(b"\x89PNG\r\n\x1a\n", b"IEND")
@example(b"\xff\xd8\xff", b"\xff\xda\xff\xd9")
@given(st.sampled_from([b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0"]), st.binary(max_size=300))
def test_no_bytes_do_worse_than_bad_input(tmp_path_factory: pytest.TempPathFactory, head: bytes, tail: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "random.bin"
    path.write_bytes(head + tail)
    with pytest.raises(BadInput):
        read_picture(path)


def test_a_picture_is_written_only_as_what_can_be_read(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"written as \.png, \.jpg"):
        write_picture(tmp_path / "a.tiff", PICTURE)
    with pytest.raises(BadInput, match="cannot be written: No such file"):
        write_picture(tmp_path / "missing" / "a.png", PICTURE)
