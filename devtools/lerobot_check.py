"""Hold the lab's datasets against LeRobot itself: `python -m devtools.lerobot_check --python PATH`.

PATH is the Python of an environment with LeRobot (`lerobot[dataset]`). A dataset of the lab is read by LeRobot's reader, and
one of LeRobot's writer by the lab: numbers and tasks must be equal, pictures near. Prints figures; exit 1 if they are not.
With `--dataset FOLDER` both read that one.
"""

import json
import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
import typer

from devtools import lerobot_side
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import FileSizes, write

MOST_MEAN, MOST_APART = 3.0, 30  # of 255: largest mean and single difference of a picture that was compressed
SIDE = Path(lerobot_side.__file__)


def by_lerobot(python: Path, what: str, folder: Path, every: int = 1) -> list[dict[str, Any]]:
    """What LeRobot's reader gives for each step of the dataset in a folder, which its writer first makes if `what` is "write"."""
    file = folder.with_suffix(".json")
    environment = {**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(folder.parent / "home")}
    environment.pop("PYTHONPATH", None)
    words = [str(python), str(SIDE), what, str(folder), str(file), str(every)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"LeRobot's side failed:\n{done.stderr[-2000:]}")
    steps: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))
    return steps


def drawn(seed: int) -> Recording:
    """A recording with all that the writer can write."""
    rng, episodes = np.random.default_rng(seed), list[Episode]()
    for number in range(7):
        n = int(rng.integers(1, 40))
        pictures = [lerobot_side.picture(number, step, lerobot_side.WIDTH) for step in range(n)]
        episodes.append(
            Episode(
                f"task {number % 3}",
                rng.normal(size=(n, 6)).astype(np.float32),
                rng.normal(size=(n, 1)).astype(np.float32),
                rng.random(n) < 0.3,
                bool(rng.random() < 0.5),
                {"top": pictures, "side": pictures[::-1]},
                {
                    "next.reward": rng.normal(size=n),
                    "grid": rng.integers(0, 9, (n, 2, 3)),
                    "flag": rng.random((n, 2)) < 0.5,
                    "observation.environment_state": rng.normal(size=(n, 4)).astype(np.float32),
                },
            )
        )
    return Recording(lerobot_side.FPS, "up6", tuple("abcdef"), ("a",), episodes)


def differences(recording: Recording, steps: list[dict[str, Any]]) -> tuple[list[str], float, int]:
    """What is not equal, in words; the mean and the largest difference of pictures, of 255."""
    faults, off, largest, row = list[str](), list[float](), 0, 0
    for number, episode in enumerate(recording.episodes):
        films = {camera: list(pictures) for camera, pictures in episode.pictures.items()}
        for step in range(len(episode)):
            theirs = steps[row]
            row += 1
            ours: dict[str, Any] = {
                "task": episode.task,
                "episode_index": number,
                "frame_index": step,
                "observation.state": episode.states[step],
                "action": episode.actions[step],
                "intervention": episode.corrected[step],
                **{name: values[step] for name, values in episode.extra.items()},
            }
            if episode.success is not None:
                ours["next.success"] = episode.success and step == len(episode) - 1
            for name, value in ours.items():
                if getattr(value, "dtype", None) == np.float64:
                    value = value.astype(np.float32)  # LeRobot's reader gives no others
                if not np.array_equal(np.squeeze(value), np.squeeze(theirs[name])):
                    faults.append(f"episode {number}, step {step}, {name}: {value} here, {theirs[name]} there")
            for camera, pictures in films.items():
                apart = np.abs(pictures[step].astype(int) - np.array(theirs[f"observation.images.{camera}"]))
                off.append(float(apart.mean()))
                largest = max(largest, int(apart.max()))
    if row != len(steps):
        faults.append(f"{row} steps here, {len(steps)} there")
    return faults, float(np.mean(off or [0.0])), largest


def main(
    python: Annotated[Path, typer.Option(help="Python of an environment with LeRobot")],
    seeds: Annotated[int, typer.Option(min=0, help="how many drawn recordings are written here")] = 1,
    dataset: Annotated[Path | None, typer.Option(help="a dataset that both read, and nothing else")] = None,
) -> None:
    """Hold the lab's datasets against LeRobot itself."""
    held = True
    with TemporaryDirectory() as temporary:
        room = Path(temporary)
        tried = []
        if dataset is not None:
            folder = room / "dataset"
            folder.symlink_to(dataset.resolve(), target_is_directory=True)
            tried.append((f"'{dataset}', read by both", read(dataset), by_lerobot(python, "read", folder), dataset))
        for seed in range(seeds if dataset is None else 0):
            recording, folder = drawn(seed), room / f"ours-{seed}"
            write(recording, folder, FileSizes(8_000, 4_000, 2))
            steps = by_lerobot(python, "read", folder)
            tried.append((f"written here, seed {seed}, against what was recorded", recording, steps, folder))
            tried.append((f"written here, seed {seed}, read by both", read(folder), steps, folder))
        if dataset is None:
            folder = room / "theirs"
            steps = by_lerobot(python, "write", folder)
            tried.append(("written by LeRobot, read by both", read(folder), steps, folder))
        for words, recording, steps, folder in tried:
            faults, mean, largest = differences(recording, steps)
            files = [len(list(folder.rglob(pattern))) for pattern in ("data/*/*.parquet", "videos/*/*/*.mp4")]
            typer.echo(
                f"{words}: {len(recording.episodes)} episodes, {len(steps)} steps, {files[0]} data and {files[1]} video files: "
                f"{len(faults)} unequal; pictures {mean:.2f} apart on average, {largest} at most, of 255"
            )
            for fault in faults[:5]:
                typer.echo(f"  {fault}")
            held &= not faults and mean <= MOST_MEAN and largest <= MOST_APART
    if not held:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
