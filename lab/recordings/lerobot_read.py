"""A LeRobot dataset of format v3 as a `Recording`: anybody's, read without LeRobot.

Source: LeRobot 0.6.1, `lerobot.datasets`. Pictures are decoded when they are asked for; all else is read at once.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted, shortened, unknown
from lab.files import is_file
from lab.recordings.episode import Episode, Image, Pictures, Recording
from lab.recordings.lerobot_info import (
    ACTION,
    EPISODES,
    INDICES,
    NUMBERS,
    PICTURES,
    STATE,
    TASKS,
    Info,
    load_info,
)
from lab.recordings.lerobot_tables import ParquetTable, task_texts, whole_numbers
from lab.recordings.video import VideoPictures, decoded_picture

INTERVENTIONS = ("intervention", "complementary_info.is_intervention")  # of its rollout by DAgger; of HIL-SERL
SUCCESS, REWARD, OTHER_STATE = "next.success", "next.reward", "observation.environment_state"
MOST_NUMBERS = 1_000_000_000  # in all chosen episodes


@dataclass(frozen=True)
class _Row:
    """Where an episode is: its steps, data file, and for each video feature the file and the time [s] at which it begins."""

    number: int
    length: int
    file: tuple[int, int]
    videos: Mapping[str, tuple[int, int, float]]


def read(folder: Path, episodes: Sequence[int] | None = None) -> Recording:
    """The episodes of the dataset in a folder, or those with the given numbers, in that order.

    States are "observation.state" (or "observation.environment_state" if a dataset has no other), actions "action", both as
    float32. A step was corrected if "intervention" or "complementary_info.is_intervention" is not 0. An episode was a success
    if "next.success" is true in one of its steps; without that feature, if "next.reward" is 0 or 1 in all chosen episodes and
    1 in one of its steps; otherwise that is not known. The task is that of the first step; `extra` has "task_index" if the
    task changes. All other features of numbers are in `extra`, one of shape (1,) as (n,). Texts, depth pictures and nested
    features are left out. Cameras are named without "observation.images.".
    Raises BadInput for a missing or damaged file, an unknown episode, or more numbers than MOST_NUMBERS.
    """
    info = load_info(folder)
    rows = _rows(info)
    numbers = sorted(rows) if episodes is None else list(episodes)
    for number in numbers:
        if number not in rows:
            raise BadInput(f"episode {number}: '{folder}' has {counted(len(rows), 'episode')}, numbered from 0")
    chosen = [rows[number] for number in dict.fromkeys(numbers)]
    steps = sum(row.length for row in chosen)
    width = sum(feature.width for feature in info.features.values() if feature.dtype in NUMBERS)
    if steps * width > MOST_NUMBERS:
        raise BadInput(
            f"'{folder}': {steps} steps of {width} numbers: choose fewer episodes, allowed are {MOST_NUMBERS}"
        )
    state = next((name for name in (STATE, OTHER_STATE) if name in info.features), STATE)
    for name in (state, ACTION):
        feature = info.features.get(name)
        if feature is None:
            raise unknown("feature", name, info.features, f"which '{info.path}' should have")
        if feature.dtype not in NUMBERS or len(feature.shape) != 1:
            raise BadInput(f"'{info.path}': feature '{name}': {feature.dtype} {feature.shape}: wanted a row of numbers")
    tasks = task_texts(folder / TASKS)
    columns = dict(_columns(info, chosen))
    sparse = REWARD in info.features and all(np.isin(own[0][REWARD], (0, 1)).all() for own in columns.values())
    made = {row.number: _episode(info, row, *columns[row.number], tasks, state, sparse=sparse) for row in chosen}
    names = info.features[state].named("state"), info.features[ACTION].named("action")
    return Recording(info.fps, info.robot, *names, [made[number] for number in numbers])


def _rows(info: Info) -> dict[int, _Row]:
    """The rows of the table of episodes, by the episode's number."""
    paths = sorted((info.folder / EPISODES).glob("*/*.parquet"))
    if not paths and info.episodes:
        raise BadInput(f"'{info.folder / EPISODES}': no Parquet file in it, but {info.episodes} episodes in info.json")
    cameras = [name for name, feature in info.features.items() if feature.dtype == "video" and not feature.is_depth]
    rows: dict[int, _Row] = {}
    for path in paths:
        table = ParquetTable(path)
        if table.rows + len(rows) > info.episodes:
            raise BadInput(f"'{path}': more episodes than the {info.episodes} in info.json")
        wanted = ["episode_index", "length", "data/chunk_index", "data/file_index"]
        places = {camera: [f"videos/{camera}/{what}_index" for what in ("chunk", "file")] for camera in cameras}
        whole = {name: table.whole_numbers(name).tolist() for name in (*wanted, *chain(*places.values()))}
        begins = {camera: table.numbers(f"videos/{camera}/from_timestamp", (1,))[:, 0] for camera in cameras}
        if not all(np.isfinite(times_s).all() for times_s in begins.values()):
            raise BadInput(f"'{path}': from_timestamp of a video: wanted seconds")
        for row in range(table.rows):
            number, length, chunk, file = (whole[name][row] for name in wanted)
            videos = {
                camera: (whole[of_chunk][row], whole[of_file][row], float(begins[camera][row]))
                for camera, (of_chunk, of_file) in places.items()
            }
            if number in rows or number < 0 or length < 0:
                raise BadInput(f"'{path}': episode {number} of {length} steps: wanted each number once, from 0 on")
            rows[number] = _Row(number, length, (chunk, file), videos)
    if len(rows) != info.episodes:
        raise BadInput(f"'{info.folder / EPISODES}': {len(rows)} episodes, but {info.episodes} in info.json")
    return rows


def _columns(info: Info, chosen: Sequence[_Row]) -> Iterator[tuple[int, tuple[dict[str, NDArray[Any]], Path, int]]]:
    """By the episode's number: the columns of its steps, the file they are in, and its first row there."""
    features = {name: feature for name, feature in info.features.items() if feature.dtype in NUMBERS}
    features = {name: feature for name, feature in features.items() if name not in ("index", "frame_index")}
    for file, group in groupby(sorted(chosen, key=lambda row: row.file), key=lambda row: row.file):
        table, rows = ParquetTable(info.file(info.data_path, *file)), list(group)
        firsts = _first_rows(table, rows)
        start = min(firsts.values())
        end = max(firsts[row.number] + row.length for row in rows)
        read = {name: table.numbers(name, feature.shape, start, end) for name, feature in features.items()}
        for row in rows:
            first = firsts[row.number]
            own = slice(first - start, first - start + row.length)
            yield row.number, ({name: values[own].copy() for name, values in read.items()}, table.path, first)


def _first_rows(table: ParquetTable, rows: Sequence[_Row]) -> dict[int, int]:
    """The first row of each episode in its file, by the episode's number."""
    owners = table.whole_numbers("episode_index")
    edges = (
        np.flatnonzero(np.concatenate([[True], owners[1:] != owners[:-1], [True]])) if len(owners) else np.zeros(1, int)
    )
    runs: dict[int, list[tuple[int, int]]] = {}
    for first, after in pairwise(edges.tolist()):
        runs.setdefault(int(owners[first]), []).append((first, after - first))
    for row in rows:
        own = runs.setdefault(row.number, [] if row.length else [(0, 0)])
        if [length for _, length in own] != [row.length]:
            found = ", ".join(str(length) for _, length in own[:3]) or "none"
            where = f"'{table.path}': episode {row.number}"
            raise BadInput(f"{where}: {found} of its {row.length} rows: wanted all of them, one after another")
    return {row.number: runs[row.number][0][0] for row in rows}


def _episode(
    info: Info,
    row: _Row,
    columns: dict[str, NDArray[Any]],
    path: Path,
    first: int,
    tasks: Mapping[int, str],
    state: str,
    *,
    sparse: bool,
) -> Episode:
    corrected = np.zeros(row.length, np.bool_)
    for name in (*INTERVENTIONS, SUCCESS):
        if name in columns and not np.isfinite(columns[name]).all():
            raise BadInput(f"'{path}': column '{name}' of episode {row.number}: wanted finite numbers")
    for name in INTERVENTIONS:
        if name in columns:
            corrected |= columns[name].reshape(row.length, -1).any(axis=1)
    success = None
    if SUCCESS in columns:
        success = bool(columns[SUCCESS].any())
    elif sparse:
        success = bool((columns[REWARD] == 1).any())
    numbers = np.zeros(row.length, np.int64)
    if "task_index" in columns:
        numbers = whole_numbers(columns["task_index"].reshape(-1), f"'{path}': column 'task_index'")
    for number in np.unique(numbers).tolist():
        if number not in tasks:
            raise BadInput(f"'{path}': task {number} of episode {row.number} is not in {TASKS}")
    with np.errstate(over="ignore"):
        states, actions = (columns[name].astype(np.float32) for name in (state, ACTION))
    extra = {
        name: values[:, 0] if values.shape[1:] == (1,) else values
        for name, values in columns.items()
        if name not in (state, ACTION, SUCCESS, *INTERVENTIONS, *INDICES)
    }
    if len(np.unique(numbers)) > 1:
        extra["task_index"] = numbers
    try:
        task = tasks[int(numbers[0])] if row.length else ""
        return Episode(task, states, actions, corrected, success, _pictures(info, row, columns, path, first), extra)
    except BadInput as error:
        raise BadInput(f"'{path}': episode {row.number}: {error}") from None


def _pictures(
    info: Info, row: _Row, columns: Mapping[str, NDArray[Any]], path: Path, first: int
) -> dict[str, Pictures]:
    """The pictures of each camera, by its name."""
    times_s = np.arange(row.length) / info.fps
    if "timestamp" in columns:
        times_s = columns["timestamp"][:, 0].astype(np.float64)
        if not np.isfinite(times_s).all() or (np.diff(times_s) < 0).any():
            raise BadInput("timestamp: wanted seconds that do not run back")
    pictures: dict[str, Pictures] = {}
    for name, feature in info.features.items():
        camera = name.removeprefix(PICTURES)
        if feature.is_depth:
            continue
        if feature.dtype == "video":
            chunk, number, from_s = row.videos[name]
            file = info.file(info.video_path or "", chunk, number, name)
            if not is_file(file):
                raise BadInput(f"'{shortened(file, 200)}': no such file")
            pictures[camera] = VideoPictures(file, from_s + times_s, 0.5 / info.fps)
        elif feature.dtype == "image":
            pictures[camera] = _TablePictures(path, name, first, row.length)
    return pictures


@dataclass(frozen=True, eq=False)
class _TablePictures:
    """The pictures of an episode that are kept in the data file itself, each as a PNG or JPEG."""

    path: Path
    column: str
    first: int
    length: int

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, step: int) -> Image:
        return next(self._from(range(self.length)[step]))

    def __iter__(self) -> Iterator[Image]:
        return self._from(0)

    def _from(self, step: int) -> Iterator[Image]:
        table = ParquetTable(self.path)
        for content in table.pictures(self.column, self.first + step, self.first + self.length):
            yield decoded_picture(content, f"'{self.path}': column '{self.column}'")
