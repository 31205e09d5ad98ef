"""A `Recording` as a LeRobot dataset of format v3, which LeRobot's own reader and training take.

Source: LeRobot 0.6.1, `lerobot.datasets`.
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, WorkFailed, shortened
from lab.files import draft, write_whole
from lab.operating_system import replace
from lab.optional import require_extra
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_info import (
    ACTION,
    DATA_PATH,
    EPISODES_PATH,
    INDICES,
    INFO,
    MOST_FPS,
    NUMBERS,
    PICTURES,
    STATE,
    STATS,
    TASKS,
    VIDEO_PATH,
    Feature,
)
from lab.recordings.lerobot_read import INTERVENTIONS, SUCCESS
from lab.recordings.lerobot_stats import PictureStatistics, number_statistics
from lab.recordings.lerobot_tables import NumbersWriter, ParquetTable, RowsWriter, write_tasks
from lab.recordings.video import VideoWriter, features_of_video

INTERVENTION = INTERVENTIONS[0]
KEPT_ROWS = 50  # of the table of episodes that are written together
_NAME = re.compile(r"\w[\w. -]*")
_INDEX_TYPES = {name: Feature("float32" if name == "timestamp" else "int64", (1,), None) for name in INDICES}


@dataclass(frozen=True)
class FileSizes:
    """When the next file begins: after an episode with which the last one has as many bytes. files: in each folder."""

    data_bytes: int = 100 << 20
    video_bytes: int = 200 << 20
    files: int = 1000


class Writer:
    """A new dataset to which episodes are appended, one at a time, and which is in its folder once the block ends.

        with Writer(folder, 30, "up6", ("shoulder",), ("shoulder",)) as writer:
            writer.add(episode)

    The first episode decides the cameras, the sizes of their pictures, the extra features, and whether successes are known;
    it is "next.success" in an episode's last step. Until the block ends the dataset is in a hidden draft folder beside; an
    exception removes it. Pictures are compressed as videos, with some loss; numbers are kept exactly.
    """

    def __init__(
        self,
        folder: Path,
        fps: int,
        robot: str,
        state_names: Sequence[str],
        action_names: Sequence[str],
        sizes: FileSizes | None = None,
    ) -> None:
        """Checks the arguments; writes nothing. Raises BadInput if the folder exists."""
        require_extra("a LeRobot dataset", "recordings")
        check_free(folder)
        if not 1 <= fps <= MOST_FPS:
            raise BadInput(f"fps {fps}: wanted 1 to {MOST_FPS}")
        self.folder, self.fps, self.robot, self.sizes = folder, fps, robot, sizes or FileSizes()
        state, action = (Feature("float32", (len(n),), tuple(n)) for n in (state_names, action_names))
        self._features = {STATE: state, ACTION: action, INTERVENTION: Feature("bool", (1,), None)}
        self._begun = False
        self._cameras: dict[str, str] = {}  # feature -> camera
        self._films: dict[str, Feature] = {}
        self._videos: dict[str, VideoWriter] = {}
        self._seen: dict[str, PictureStatistics] = {}
        self._file_numbers: dict[str, int] = {}
        self._tasks: dict[str, int] = {}
        self._rows: list[dict[str, Any]] = []
        self._data: NumbersWriter | None = None
        self._data_paths: list[Path] = []
        self.episodes = self.frames = 0

    def __enter__(self) -> Self:
        """Creates the draft folder. Raises WorkFailed if that is impossible."""
        self._stack = ExitStack()
        try:
            self.folder.parent.mkdir(parents=True, exist_ok=True)
            self._room = self._stack.enter_context(draft(self.folder.parent)) / "dataset"
            self._room.mkdir()
        except OSError as error:
            raise WorkFailed(f"'{self.folder}' cannot be written: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finishes the files and renames the folder; removes it after an exception."""
        with self._stack:
            try:
                if kind is None and not self.episodes:
                    raise BadInput(f"'{self.folder}': a dataset without an episode: wanted at least one")
                self._close_files(complete=kind is None)
                if kind is None:
                    self._finish()
            except OSError as problem:
                raise WorkFailed(f"'{self.folder}' cannot be written: {problem.strerror or problem}") from problem

    def add(self, episode: Episode) -> None:
        """Appends an episode. Raises BadInput if it is empty, or has other features or picture sizes than the first one."""
        if not len(episode):
            raise BadInput(f"episode {self.episodes}: no steps: wanted at least one")
        if not self._begun:
            self._begin(episode)
        try:
            self._append(episode)
        except OSError as error:
            raise WorkFailed(f"'{self.folder}' cannot be written: {error.strerror or error}") from error

    # ---- one episode ---------------------------------------------------------------------------------------------------

    def _begin(self, episode: Episode) -> None:
        """The features, as the first episode has them."""
        for camera in episode.pictures:
            name = camera if camera.startswith("observation.") else f"{PICTURES}{camera}"
            self._check_name(camera)
            self._cameras[name] = camera
            self._seen[name] = PictureStatistics()
        if episode.success is not None:
            self._features[SUCCESS] = Feature("bool", (1,), None)
        for name, values in episode.extra.items():
            self._check_name(name)
            if name in (*self._features, *self._cameras, SUCCESS, *INDICES) or values.dtype.name not in NUMBERS:
                raise BadInput(
                    f"extra '{name}' of {values.dtype.name}: wanted numbers, and no name of the dataset's own"
                )
            self._features[name] = Feature(values.dtype.name, values.shape[1:] or (1,), None)
        self._features |= _INDEX_TYPES
        self._meta = RowsWriter(self._made(EPISODES_PATH.format(chunk_index=0, file_index=0)))
        self._begun = True

    def _check_name(self, name: str) -> None:
        if not _NAME.fullmatch(name) or ".." in name:
            raise BadInput(f"the name '{shortened(name)}' of a feature: wanted letters, digits, '.', '_' and '-'")

    def _append(self, episode: Episode) -> None:
        columns = self._columns(episode)
        row: dict[str, Any] = {"episode_index": self.episodes, "tasks": [episode.task], "length": len(episode)}
        data = self._data_file()
        row |= _place("data", self._file_numbers["data"], self.sizes)
        row |= {"dataset_from_index": self.frames, "dataset_to_index": self.frames + len(episode)}
        statistics = {name: number_statistics(values) for name, values in columns.items()}
        for name, camera in self._cameras.items():
            first_s, own = self._film(name, episode.pictures[camera], len(episode))
            row |= _place(f"videos/{name}", self._file_numbers[name], self.sizes)
            row[f"videos/{name}/from_timestamp"] = first_s
            row[f"videos/{name}/to_timestamp"] = first_s + len(episode) / self.fps
            statistics[name] = own.statistics()
            self._seen[name].merge(own)
        data.add(columns)
        row |= {f"stats/{name}/{what}": value for name, own in statistics.items() for what, value in own.items()}
        self._rows.append(row | {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0})
        if len(self._rows) >= KEPT_ROWS:
            self._write_rows()
        self.episodes += 1
        self.frames += len(episode)

    def _columns(self, episode: Episode) -> dict[str, NDArray[np.generic]]:
        """The numbers of an episode by feature. Raises BadInput if it has other features than the first one."""
        n, where = len(episode), f"episode {self.episodes}"
        last = np.arange(n) == n - 1
        columns: dict[str, NDArray[np.generic]] = {
            STATE: episode.states,
            ACTION: episode.actions,
            INTERVENTION: episode.corrected,
            **episode.extra,
            "timestamp": (np.arange(n) / self.fps).astype(np.float32),
            "frame_index": np.arange(n, dtype=np.int64),
            "episode_index": np.full(n, self.episodes, np.int64),
            "index": np.arange(self.frames, self.frames + n, dtype=np.int64),
            "task_index": np.full(n, self._tasks.setdefault(episode.task, len(self._tasks)), np.int64),
        }
        if episode.success is not None:
            columns[SUCCESS] = last & episode.success
        if columns.keys() != self._features.keys() or set(episode.pictures) != set(self._cameras.values()):
            other = columns.keys() ^ self._features.keys() or set(episode.pictures) ^ set(self._cameras.values())
            raise BadInput(
                f"{where}: wanted the features of the first one: {', '.join(sorted(other))} is in one of them alone"
            )
        for name, feature in self._features.items():
            values = columns[name]
            if (values.shape[1:] or (1,)) != feature.shape or values.dtype.name != feature.dtype:
                found = f"{values.dtype.name} {values.shape[1:]}"
                raise BadInput(f"{where}: {name} is {found}: wanted {feature.dtype} {feature.shape}")
        return {name: np.ravel(v) if self._features[name].shape == (1,) else v for name, v in columns.items()}

    def _film(self, name: str, pictures: Any, steps: int) -> tuple[float, PictureStatistics]:
        """The time [s] in its video file at which an episode's pictures begin, and their statistics, once they are appended."""
        own, first_s = PictureStatistics(), 0.0
        for number, picture in enumerate(pictures):
            if not number:
                first_s = self._video_file(name, picture.shape).frames / self.fps
            self._videos[name].add(picture)
            own.add(picture)
        if own.pictures != steps:
            raise BadInput(f"episode {self.episodes}: {own.pictures} pictures of '{name}': wanted {steps}")
        return first_s, own

    # ---- files ---------------------------------------------------------------------------------------------------------

    def _made(self, name: str) -> Path:
        path = self._room / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _next(self, name: str, template: str) -> Path:
        self._file_numbers[name] = self._file_numbers.get(name, -1) + 1
        chunk, number = divmod(self._file_numbers[name], self.sizes.files)
        return self._made(template.format(video_key=name, chunk_index=chunk, file_index=number))

    def _data_file(self) -> NumbersWriter:
        if self._data is not None and self._data.bytes >= self.sizes.data_bytes:
            self._data.close()
            self._data = None
        if self._data is None:
            self._data = NumbersWriter(self._next("data", DATA_PATH), self._features)
            self._data_paths.append(self._data.path)
        return self._data

    def _video_file(self, name: str, shape: Sequence[int]) -> VideoWriter:
        video = self._videos.get(name)
        if video is None:
            if len(shape) != 3 or shape[2] != 3 or shape[0] % 2 or shape[1] % 2:
                raise BadInput(f"pictures {tuple(shape)} of '{name}': wanted (height, width, 3), both even")
            self._films[name] = Feature("video", (shape[0], shape[1], 3), ("height", "width", "channels"))
        elif video.bytes < self.sizes.video_bytes:
            return video
        else:
            video.close()
        height, width, _ = self._films[name].shape
        self._videos[name] = VideoWriter(self._next(name, VIDEO_PATH), self.fps, width, height)
        return self._videos[name]

    def _write_rows(self) -> None:
        self._meta.add(self._rows)
        self._rows.clear()

    def _close_files(self, *, complete: bool) -> None:
        """Closes the files that are open; the errors of a dataset that is thrown away do not matter."""
        closing: list[VideoWriter | NumbersWriter | RowsWriter] = [*self._videos.values()]
        closing += [self._data] if self._data is not None else []
        closing += [self._meta] if self._begun else []
        if complete:
            self._write_rows()
        for file in closing:
            try:
                file.close()
            except (WorkFailed, OSError):
                if complete:
                    raise

    def _finish(self) -> None:
        """Writes what is said of the whole dataset, and renames its folder."""
        statistics = {name: number_statistics(values) for name, values in self._whole_columns()}
        statistics |= {name: seen.statistics() for name, seen in self._seen.items()}
        write_tasks(self._made(TASKS), list(self._tasks))
        for name, document in ((INFO, self._info()), (STATS, statistics)):
            write_whole(self._made(name), json.dumps(document, indent=4).encode())
        check_free(self.folder)
        replace(self._room, self.folder)

    def _whole_columns(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """Each feature of numbers with its values in all episodes, one feature after another."""
        tables = [ParquetTable(path) for path in self._data_paths]
        for name, feature in self._features.items():
            yield name, np.concatenate([table.numbers(name, feature.shape) for table in tables])

    def _info(self) -> dict[str, Any]:
        features = {name: self._described(name, feature) for name, feature in (self._features | self._films).items()}
        return {
            "codebase_version": "v3.0",
            "robot_type": self.robot or None,
            "total_episodes": self.episodes,
            "total_frames": self.frames,
            "total_tasks": len(self._tasks),
            "chunks_size": self.sizes.files,
            "data_files_size_in_mb": max(1, self.sizes.data_bytes >> 20),
            "video_files_size_in_mb": max(1, self.sizes.video_bytes >> 20),
            "fps": self.fps,
            "splits": {"train": f"0:{self.episodes}"},
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH if self._cameras else None,
            "features": features,
        }

    def _described(self, name: str, feature: Feature) -> Mapping[str, Any]:
        described: dict[str, Any] = {
            "dtype": feature.dtype,
            "shape": list(feature.shape),
            "names": None if feature.names is None else list(feature.names),
        }
        if feature.dtype == "video":
            described["info"] = features_of_video(self.fps, feature.shape[1], feature.shape[0])
        return described


def _place(of: str, number: int, sizes: FileSizes) -> dict[str, int]:
    chunk, file = divmod(number, sizes.files)
    return {f"{of}/chunk_index": chunk, f"{of}/file_index": file}


def check_free(folder: Path) -> None:
    """Raises BadInput if the folder exists."""
    if folder.exists() or folder.is_symlink():
        raise BadInput(f"'{folder}': it exists already; a dataset is written to a new folder")


def write(recording: Recording, folder: Path, sizes: FileSizes | None = None) -> None:
    """Writes a recording as a dataset to a new folder. Raises as `Writer` does."""
    names = recording.state_names, recording.action_names
    with Writer(folder, recording.fps, recording.robot, *names, sizes) as writer:
        for episode in recording.episodes:
            writer.add(episode)
