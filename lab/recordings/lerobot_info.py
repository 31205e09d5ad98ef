"""What a LeRobot dataset of format v3 says of itself in `meta/info.json`: its features, and where its files are."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path, PurePosixPath
from typing import Any

from lab.errors import BadInput, shortened, unknown
from lab.files import is_file, json_of, read_limited

INFO, STATS, TASKS, EPISODES = "meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/episodes"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = EPISODES + "/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
MOST_INFO_BYTES, MOST_FPS, MOST_FEATURES = 10_000_000, 10_000, 1_000
MOST_EPISODES, MOST_FRAMES = 1_000_000, 100_000_000
NUMBERS = ("float16", "float32", "float64", "bool", *(f"{u}int{bits}" for u in ("", "u") for bits in (8, 16, 32, 64)))
STATE, ACTION, PICTURES = "observation.state", "action", "observation.images."
INDICES = ("timestamp", "frame_index", "episode_index", "index", "task_index")  # features that every dataset has
# in place; without its last two options it converts what the Hub has, and replaces it there
_CONVERT = "python -m lerobot.scripts.convert_dataset_v21_to_v30 --repo-id=USER/NAME --root=FOLDER --push-to-hub=false"
_FIELD = re.compile(r"\{(\w+)(?::0?(\d))?d?\}")


@dataclass(frozen=True)
class Feature:
    """One feature: its type ("video", "image", "string" or a number's), its shape in each step, and its numbers' names."""

    dtype: str
    shape: tuple[int, ...]
    names: tuple[str, ...] | None
    is_depth: bool = False

    @property
    def width(self) -> int:
        """How many numbers it has in each step."""
        return prod(self.shape)

    def named(self, beginning: str) -> tuple[str, ...]:
        """The names of its numbers; "state 1" and so on, by `beginning`, if the dataset does not name each."""
        if self.names is not None and len(self.names) == self.width:
            return self.names
        return tuple(f"{beginning} {number}" for number in range(1, self.width + 1))


@dataclass(frozen=True)
class Info:
    """The checked content of `info.json`. video_path: None if no feature is a video."""

    folder: Path
    fps: int
    robot: str
    features: Mapping[str, Feature]
    episodes: int
    frames: int
    data_path: str
    video_path: str | None

    @property
    def path(self) -> Path:
        """The file, for error messages."""
        return self.folder / INFO

    def file(self, template: str, chunk: int, number: int, camera: str = "") -> Path:
        """The path of a data or video file. BadInput if its name would lead out of the dataset's folder.

        A file may be a link that leads elsewhere: so the Hub's cache keeps them.
        """
        values: dict[str, int | str] = {"chunk_index": chunk, "file_index": number, "video_key": camera}

        def value(field: re.Match[str]) -> str:
            if field[1] not in values:
                raise unknown("field of a path", field[1], values, f"'{self.path}'")
            return str(values[field[1]]).zfill(int(field[2] or 0))

        name = _FIELD.sub(value, template)
        parts = PurePosixPath(name)
        if not name or any(sign in name for sign in "{}\\\0:") or parts.is_absolute() or ".." in parts.parts:
            raise BadInput(f"'{self.path}': '{shortened(name)}': wanted the path of a file in the dataset's folder")
        return self.folder / parts


def load_info(folder: Path) -> Info:
    """The info of the dataset in a folder. BadInput if there is none, or says what is wrong with it."""
    path = folder / INFO
    if not is_file(path):
        raise BadInput(f"'{folder}': no {INFO} in it; give the folder of a LeRobot dataset of format v3.0")
    try:
        document = json_of(read_limited(path, MOST_INFO_BYTES))
    except (OSError, ValueError) as error:
        raise BadInput(f"'{path}': {getattr(error, 'strerror', None) or error}") from None
    if not isinstance(document, dict):
        raise BadInput(f"'{path}': wanted a JSON object")
    version = document.get("codebase_version")
    if not isinstance(version, str) or not re.fullmatch(r"v?3\.\d+(\.\d+)?", version):
        hint = f"; LeRobot converts it: {_CONVERT}" if version in ("v2.1", "2.1") else ""
        raise BadInput(f"'{shortened(path)}': codebase_version {shortened(repr(version))}: wanted v3.0{hint}")
    return _checked(document, folder, path)


def _checked(document: Mapping[str, Any], folder: Path, path: Path) -> Info:
    def count(name: str, least: int, most: int) -> int:
        number = document.get(name)
        whole = isinstance(number, int | float) and not isinstance(number, bool) and number == int(number)
        if not whole or not least <= number <= most:  # type: ignore[operator]
            raise BadInput(f"'{path}': {name} {shortened(repr(number))}: wanted a whole number, {least} to {most}")
        return int(number)  # type: ignore[arg-type]

    features = document.get("features")
    if not isinstance(features, dict) or len(features) > MOST_FEATURES:
        raise BadInput(f"'{path}': features: wanted an object with at most {MOST_FEATURES} features")
    read = {name: _feature(name, content, path) for name, content in features.items()}
    robot, paths = document.get("robot_type"), (document.get("data_path"), document.get("video_path"))
    if not isinstance(paths[0], str) or not isinstance(paths[1], str | None):
        raise BadInput(f"'{path}': data_path, video_path: wanted a file's path as text")
    if paths[1] is None and any(feature.dtype == "video" for feature in read.values()):
        raise BadInput(f"'{path}': video_path: wanted a file's path, because a feature is a video")
    return Info(
        folder,
        count("fps", 1, MOST_FPS),
        robot if isinstance(robot, str) else "",
        read,
        count("total_episodes", 0, MOST_EPISODES),
        count("total_frames", 0, MOST_FRAMES),
        paths[0],
        paths[1],
    )


def _feature(name: str, content: Any, path: Path) -> Feature:
    where = f"'{path}': feature '{shortened(name)}'"
    if not isinstance(content, dict) or not isinstance(content.get("dtype"), str):
        raise BadInput(f"{where}: wanted an object with dtype and shape")
    shape = content.get("shape")
    if content["dtype"] not in (*NUMBERS, "image", "video"):
        return Feature(content["dtype"], (1,), None)  # text, and what is nested: not read
    edges = isinstance(shape, list) and all(type(edge) is int and 0 < edge <= MOST_FRAMES for edge in shape)
    if not edges or not shape or len(shape) > 5 or prod(shape) > MOST_FRAMES:
        raise BadInput(f"{where}: shape {shortened(repr(shape))}: wanted one to five whole numbers above 0")
    about = {**(content.get("video_info") or {}), **(content.get("info") or {})} if _objects(content) else {}
    is_depth = bool(about.get("is_depth_map") or about.get("video.is_depth_map"))
    return Feature(content["dtype"], tuple(shape), _names(content.get("names")), is_depth)


def _objects(content: Mapping[str, Any]) -> bool:
    return all(isinstance(content.get(name), dict | None) for name in ("video_info", "info"))


def _names(names: Any) -> tuple[str, ...] | None:
    """The names of a feature's numbers: a list, an object of lists such as {"motors": [...]}, or one of name and number."""
    if isinstance(names, dict):
        rows = list(names.values())
        if all(isinstance(row, list) for row in rows):
            names = [name for row in rows for name in row]
        elif all(type(row) is int for row in rows):
            names = sorted(names, key=lambda name: int(names[name]))
    if isinstance(names, list) and names and all(isinstance(name, str) for name in names):
        return tuple(names)
    return None
