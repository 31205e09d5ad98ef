"""Datasets that are written here: they come back as they were, and are there whole or not at all."""

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import FileSizes, Writer, write


def picture(step: int) -> np.ndarray:
    """A picture (16, 24, 3) that becomes brighter to the right, and with the step."""
    y, x = np.mgrid[:16, :24]
    return np.stack([4 * x + 3 * step, 5 * y + 50, x + y + 2 * step], axis=-1).astype(np.uint8)


def episode(rng: np.random.Generator, steps: int, task: str = "t", **fields: Any) -> Episode:
    states, actions = (rng.normal(size=(steps, width)).astype(np.float32) for width in (3, 1))
    return Episode(task, states, actions, rng.random(steps) < 0.5, **fields)


def recorded(*episodes: Episode) -> Recording:
    return Recording(20, "arm", ("a", "b", "c"), ("a",), episodes)


def equal(one: Episode, other: Episode) -> bool:
    rows = [(getattr(one, name), getattr(other, name)) for name in ("states", "actions", "corrected")]
    rows += [(values, other.extra[name]) for name, values in one.extra.items()]
    same = all(np.array_equal(a, b) and a.dtype == b.dtype for a, b in rows)
    return same and (one.task, one.success, set(one.extra)) == (other.task, other.success, set(other.extra))


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 99), lengths=st.lists(st.integers(1, 9), min_size=1, max_size=6), known=st.booleans())
def test_any_recording_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, seed: int, lengths: list[int], known: bool
) -> None:
    rng, folder = np.random.default_rng(seed), tmp_path_factory.mktemp("any") / "dataset"
    episodes = [
        episode(
            rng,
            steps,
            f"task {rng.integers(3)}",
            success=bool(rng.random() < 0.5) if known else None,
            extra={
                "next.reward": rng.normal(size=steps),
                "observation.environment_state": rng.normal(size=(steps, 2)).astype(np.float32),
                "grid": rng.integers(-9, 9, (steps, 2, 3)),
                "flag": rng.random((steps, 4)) < 0.5,
            },
        )
        for steps in lengths
    ]
    write(recorded(*episodes), folder, FileSizes(data_bytes=3000, files=2))
    found = read(folder)
    assert (found.fps, found.robot, found.state_names, found.action_names) == (20, "arm", ("a", "b", "c"), ("a",))
    assert all(equal(*pair) for pair in zip(episodes, found.episodes, strict=True))


def test_pictures_come_back_in_several_files_nearly_as_they_were(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    films = {"top": [picture(step) for step in range(12)], "side": [picture(20 - step) for step in range(12)]}
    episodes = [
        episode(rng, steps, pictures={name: film[:steps] for name, film in films.items()}) for steps in (12, 5, 1, 7)
    ]
    write(recorded(*episodes), tmp_path / "dataset", FileSizes(video_bytes=300, files=2))
    files = sorted(path.parent.name for path in (tmp_path / "dataset/videos").rglob("*.mp4"))
    assert "chunk-001" in files
    for own, other in zip(episodes, read(tmp_path / "dataset").episodes, strict=True):
        for name in films:
            apart = np.abs(np.array(own.pictures[name], int) - np.array(list(other.pictures[name])))
            assert (apart.mean() < 3.0, apart.max() < 16) == (True, True)
            assert np.array_equal(other.pictures[name][len(own) - 1], list(other.pictures[name])[-1])


def test_the_same_recording_gives_the_same_files(tmp_path: Path) -> None:
    one = recorded(episode(np.random.default_rng(3), 6, pictures={"top": [picture(step) for step in range(6)]}))
    for name in ("a", "b"):
        write(one, tmp_path / name)
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file()]
    assert len(files) == 6
    assert all((tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes() for file in files)


def test_what_is_said_of_it_by_hand(tmp_path: Path) -> None:
    """Four steps in two episodes: the state is 0, 1, 2, 3; the only picture is grey, of level 51, which is 0.2."""
    grey = [np.full((2, 2, 3), 51, np.uint8)] * 2
    rows = np.arange(4, dtype=np.float32)[:, None]
    episodes = [
        Episode(t, rows[i], rows[i], np.array([False, True]), True, {"top": grey})
        for t, i in (("u", [0, 1]), ("v", [2, 3]))
    ]
    write(Recording(10, "", ("a",), ("a",), episodes), tmp_path / "dataset")
    info, statistics = (json.loads((tmp_path / f"dataset/meta/{name}.json").read_text()) for name in ("info", "stats"))
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, 4, 2)
    assert (info["codebase_version"], info["fps"], info["robot_type"], info["splits"]) == (
        "v3.0",
        10,
        None,
        {"train": "0:2"},
    )
    assert info["features"]["intervention"] == {"dtype": "bool", "shape": [1], "names": None}
    state = statistics["observation.state"]
    assert (state["min"], state["max"], state["mean"], state["count"], state["q50"]) == ([0], [3], [1.5], [4], [1.5])
    assert state["std"] == pytest.approx([np.sqrt(1.25)])
    assert statistics["intervention"]["mean"] == [0.5]
    assert statistics["next.success"]["mean"] == [0.5]  # in the last of two steps
    seen = statistics["observation.images.top"]
    assert (seen["mean"], seen["q99"], seen["count"]) == ([[[0.2]]] * 3, [[[0.2]]] * 3, [4])


# ---- what is not written -------------------------------------------------------------------------------------------------


def test_an_existing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="it exists already; a dataset is written to a new folder"):
        write(recorded(episode(np.random.default_rng(0), 2)), tmp_path)


FIRST: dict[str, Any] = {"pictures": {"top": [picture(0)] * 2}, "extra": {"x": np.zeros(2)}}
ODD = {"top": [np.zeros((15, 24, 3), np.uint8)] * 2}


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        (
            [{"pictures": ODD}],
            r"pictures \(15, 24, 3\) of 'observation.images.top': wanted \(height, width, 3\), both even",
        ),
        ([{"extra": {"../x": np.zeros(2)}}], r"the name '../x' of a feature: wanted letters"),
        (
            [{"extra": {"action": np.zeros(2)}}],
            "extra 'action' of float64: wanted numbers, and no name of the dataset's own",
        ),
        ([{"extra": {"word": np.array(["a", "b"])}}], "extra 'word' of str"),
        (
            [FIRST, FIRST | {"pictures": {}}],
            "episode 1: wanted the features of the first one: top is in one of them alone",
        ),
        ([FIRST, FIRST | {"extra": {}}], "episode 1: wanted the features of the first one: x is in one"),
        ([FIRST, FIRST | {"extra": {"x": np.zeros((2, 2))}}], r"episode 1: x is float64 \(2,\): wanted float64 \(1,\)"),
        ([FIRST, FIRST | {"success": True}], "next.success is in one of them alone"),
        ([FIRST, FIRST | {"pictures": {"top": ODD["top"]}}], r"a picture \(15, 24, 3\) uint8: wanted \(16, 24, 3\)"),
        ([], "a dataset without an episode"),
    ],
)
def test_what_cannot_be_written_leaves_nothing(tmp_path: Path, fields: list[dict[str, Any]], said: str) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(BadInput, match=said):
        write(recorded(*(episode(rng, 2, **own) for own in fields)), tmp_path / "room" / "dataset")
    assert not list((tmp_path / "room").iterdir())


def test_a_broken_off_block_leaves_nothing(tmp_path: Path) -> None:
    one = episode(np.random.default_rng(0), 2, **FIRST)
    with suppress(KeyboardInterrupt), Writer(tmp_path / "dataset", 20, "arm", "abc", "a") as writer:
        writer.add(one)
        assert list(tmp_path.iterdir())
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())
