"""LeRobot's own side of the check: its writer and its reader, as a script that imports nothing of the lab.

It runs in an environment in which LeRobot is installed: `python lerobot_side.py write FOLDER VALUES EVERY` lets LeRobot write
a dataset; `python lerobot_side.py read FOLDER VALUES EVERY` lets it read one. Both write what its reader gives to VALUES, as
JSON: for each step, by feature, a number or lists of numbers; of a picture every EVERY-th pixel and row.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

HEIGHT, WIDTH, FPS = 32, 48, 15
LENGTHS = (6, 9, 4, 7, 5)
RESUMED_AFTER = 2
TASKS = ("put the cube in the box", "open the drawer")


def picture(episode: int, step: int, width: int) -> "np.ndarray[Any, Any]":
    """A picture (HEIGHT, width, 3) that changes slowly from left to right, and with the step."""
    y, x = np.mgrid[:HEIGHT, :width]
    rows = (2 * x + 4 * step, 3 * y + 20 * episode, x + y)
    return np.stack([row % 250 for row in rows], axis=-1).astype(np.uint8) // 2 + 60


def write(folder: Path) -> None:
    """Let LeRobot write a dataset of several tasks, episodes, files and chunks."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset  # type: ignore[import-not-found]

    features = {
        "observation.state": {"dtype": "float32", "shape": (3,), "names": ["pan", "lift", "gripper"]},
        "action": {"dtype": "float32", "shape": (2,), "names": {"motors": ["pan", "lift"]}},
        "observation.environment_state": {"dtype": "float64", "shape": (2,), "names": None},
        "observation.images.top": {
            "dtype": "video",
            "shape": (HEIGHT, WIDTH, 3),
            "names": ["height", "width", "channels"],
        },
        "observation.images.wrist": {
            "dtype": "image",
            "shape": (HEIGHT, 32, 3),
            "names": ["height", "width", "channels"],
        },
        "intervention": {"dtype": "bool", "shape": (1,), "names": None},
        "next.reward": {"dtype": "float32", "shape": (1,), "names": None},
        "next.success": {"dtype": "bool", "shape": (1,), "names": None},
        "grid": {"dtype": "int64", "shape": (2, 3), "names": None},
    }
    dataset = LeRobotDataset.create("check/check", fps=FPS, features=features, root=folder, robot_type="so101_follower")
    dataset.meta.update_chunk_settings(chunks_size=2, data_files_size_in_mb=0.01, video_files_size_in_mb=0.001)
    rng = np.random.default_rng(7)
    for episode, length in enumerate(LENGTHS):
        for step in range(length):
            last, done = step == length - 1, episode % 2 == 0
            dataset.add_frame(
                {
                    "observation.state": rng.normal(size=3).astype(np.float32),
                    "action": rng.normal(size=2).astype(np.float32),
                    "observation.environment_state": rng.normal(size=2),
                    "observation.images.top": picture(episode, step, WIDTH),
                    "observation.images.wrist": picture(episode, step, 32),
                    "intervention": np.array([2 <= step < 2 + episode]),
                    "next.reward": np.array([float(last and done)], np.float32),
                    "next.success": np.array([last and done]),
                    "grid": rng.integers(0, 9, (2, 3)),
                    "task": TASKS[episode % 2],
                }
            )
        dataset.save_episode()
        if episode == RESUMED_AFTER:  # which begins new files of data and of episodes
            dataset.finalize()
            dataset = LeRobotDataset.resume("check/check", root=folder)
    dataset.finalize()


def values(folder: Path, every: int) -> list[dict[str, Any]]:
    """What LeRobot's reader gives for each step."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("check/check", root=folder)
    steps = []
    for number in range(len(dataset)):
        step: dict[str, Any] = {}
        for name, value in dataset[number].items():
            if name in dataset.meta.camera_keys:
                value = (value.permute(1, 2, 0) * 255).round().int()[::every, ::every]
            step[name] = value if isinstance(value, str) else value.tolist()
        steps.append(step)
    return steps


def main() -> None:
    """Write or read, as the arguments say."""
    what, folder, file, every = sys.argv[1:]
    if what == "write":
        write(Path(folder))
    Path(file).write_text(json.dumps(values(Path(folder), int(every))), encoding="utf-8")


if __name__ == "__main__":
    main()
