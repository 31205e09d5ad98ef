"""Picture files, PNG and JPEG: written from RGB arrays, and read as such if they are complete and small enough."""

import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput
from lab.files import read_limited
from lab.lazy import cv2

Image = NDArray[np.uint8]  # (H, W, 3), RGB

PNG = b"\x89PNG\r\n\x1a\n"
MAX_BYTES = 64_000_000
MAX_PIXELS = 40_000_000


def check_picture(image: Image, where: str = "picture") -> None:
    """Raise BadInput, naming `where`, unless `image` is an RGB picture: (H, W, 3), uint8."""
    array = np.asarray(image)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3 or min(array.shape) < 1:
        raise BadInput(f"{where}: an array of shape {array.shape} and {array.dtype}: wanted (H, W, 3), RGB, uint8")


def read_picture(path: Path) -> Image:
    """A PNG or JPEG file as an RGB array (H, W, 3).

    Raises BadInput, with the reason, when it cannot be read, is cut off, is neither, or is larger than 64 MB or 40
    million pixels; the size is read from the header, before any memory is spent on the picture.
    """
    try:
        data = read_limited(path, MAX_BYTES)
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
    width, height = _size(data, path)
    if not 0 < width * height <= MAX_PIXELS:
        raise BadInput(f"{path}: {width} x {height} pixels: pictures of 1 to {MAX_PIXELS} pixels are read")
    decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if decoded is None:
        raise BadInput(f"{path}: the picture's data are damaged")
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _size(data: bytes, path: Path) -> tuple[int, int]:
    """The width and height in the header of a PNG or JPEG file. BadInput when the file is neither, or is incomplete."""
    if data.startswith(PNG):
        _check_chunks(data, path)
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if not data.startswith(b"\xff\xd8\xff"):
        raise BadInput(f"{path}: not a picture that can be read: wanted a PNG or JPEG file")
    at, size = 2, (0, 0)
    while at + 9 <= len(data) and data[at] == 0xFF:
        kind, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):  # a frame header
            size = int.from_bytes(data[at + 7 : at + 9], "big"), int.from_bytes(data[at + 5 : at + 7], "big")
        if kind == 0xDA:  # the scan, up to the end mark
            if size == (0, 0) or data.find(b"\xff\xd9", at) < 0:
                break
            return size
        at += 2 + length
    raise BadInput(f"{path}: the JPEG file is cut off")


def _check_chunks(data: bytes, path: Path) -> None:
    """Raise BadInput unless a PNG file's chunks are intact up to its end mark; libpng would print its own message."""
    at, kind = len(PNG), b""
    while kind != b"IEND":
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        end = at + 12 + length
        if end > len(data):
            raise BadInput(f"{path}: the PNG file is cut off")
        if zlib.crc32(data[at + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            raise BadInput(f"{path}: the picture's data are damaged")
        at = end


def write_picture(path: Path, image: Image) -> None:
    """Write an RGB array (H, W, 3) as a PNG or JPEG file, by the name's ending. BadInput for another ending, or no write."""
    check_picture(image, str(path))
    if path.suffix.lower() not in (".png", ".jpg", ".jpeg"):
        raise BadInput(f"{path}: pictures are written as .png, .jpg or .jpeg")
    _, encoded = cv2.imencode(path.suffix, cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    try:
        path.write_bytes(encoded.tobytes())
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from error
