"""Mesh files, OBJ or STL: their vertices, read without a heavy library, and their bytes for a library that reads UTF-8 only."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lab.files import read_limited

Array = NDArray[np.float64]
MAX_BYTES = 20_000_000
SUFFIXES = (".obj", ".stl")
_HEAD, _FACE = 84, 50  # [bytes] of a binary STL: header and count, and each triangle


def vertices(path: Path) -> Array:
    """The vertices (n, 3) of an OBJ or STL file, in its own unit. ValueError when they cannot be read as numbers."""
    data = read_limited(path, MAX_BYTES)
    if path.suffix.lower() == ".stl" and is_binary(data):
        faces = np.frombuffer(data, np.uint8, offset=_HEAD).reshape(-1, _FACE)[:, 12:48]
        return np.ascontiguousarray(faces).view("<f4").reshape(-1, 3).astype(float)
    word = "vertex" if path.suffix.lower() == ".stl" else "v"
    lines = (line.split() for line in _text(data).splitlines())
    return np.array([parts[1:4] for parts in lines if parts[:1] == [word]], dtype=float)


def triangles(path: Path) -> Array:
    """The triangles (n, 3, 3) of an OBJ or STL file, in its own unit. ValueError when they cannot be read as numbers.

    A face of an OBJ file with more corners is taken as a fan.
    """
    corners = vertices(path)
    if path.suffix.lower() == ".stl":
        return corners.reshape(-1, 3, 3)
    fans = []
    for line in _text(read_limited(path, MAX_BYTES)).splitlines():
        words = line.split()
        if words[:1] == ["f"]:
            at = [int(word.partition("/")[0]) for word in words[1:]]
            at = [number - 1 if number > 0 else len(corners) + number for number in at]
            fans += [(at[0], one, other) for one, other in pairwise(at[1:])]
    chosen = np.array(fans, int).reshape(-1, 3)
    if chosen.size and (chosen.min() < 0 or chosen.max() >= len(corners)):
        raise ValueError("a face names a corner that is not there")
    return np.asarray(corners[chosen])


def text_corners(path: Path | None) -> Array | None:
    """The corners (3 n, 3) of the triangles of an STL file in text, one after the other; None if it is no such file."""
    if path is None or path.suffix.lower() != ".stl" or is_binary(read_limited(path, MAX_BYTES)):
        return None
    return vertices(path)


def readable(path: Path) -> bytes:
    """The bytes of an OBJ or STL file, its text in UTF-8. ValueError when it is neither text nor a whole binary STL."""
    data = read_limited(path, MAX_BYTES)
    return data if path.suffix.lower() == ".stl" and is_binary(data) else _text(data).encode()


def _text(data: bytes) -> str:
    """A text in UTF-8, or in Latin-1: only names and comments hold more than ASCII. ValueError when it is no text."""
    if b"\0" in data:
        raise ValueError("it is neither text in UTF-8 or Latin-1 nor a whole binary STL")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def is_binary(data: bytes) -> bool:
    """Whether the bytes of an STL file are a binary one: its length matches its count of triangles."""
    return len(data) >= _HEAD and len(data) == _HEAD + _FACE * _count(data)


def _count(data: bytes) -> int:
    return int.from_bytes(data[80:_HEAD], "little")
