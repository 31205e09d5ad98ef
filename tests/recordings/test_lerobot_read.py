"""Datasets that LeRobot's own writer wrote, read here; and damaged, hostile and old ones, which are refused in one line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import write

BY_LEROBOT = Path(__file__).parent / "data" / "by_lerobot.zip"
DATA, VIDEO = "data/chunk-000/file-000.parquet", "videos/observation.images.top/chunk-000/file-000.mp4"
EPISODES, TASKS = "meta/episodes/chunk-000/file-000.parquet", "meta/tasks.parquet"


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("by-lerobot")
    with ZipFile(BY_LEROBOT) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture
def ours(tmp_path: Path) -> Path:
    """A dataset of two episodes of three steps, with a camera."""
    numbers = np.arange(6, dtype=np.float32).reshape(3, 2)
    pictures = [np.full((16, 16, 3), 40 * step, np.uint8) for step in range(3)]
    episodes = [
        Episode("stack", numbers + e, numbers - e, np.zeros(3, np.bool_), None, {"top": pictures}) for e in (0, 1)
    ]
    write(Recording(10, "arm", ("a", "b"), ("a", "b"), episodes), tmp_path / "ours")
    return tmp_path / "ours"


def test_numbers_and_tasks_are_those_of_lerobots_own_reader(theirs: Path) -> None:
    steps = json.loads((theirs / "lerobot.json").read_text(encoding="utf-8"))
    recording = read(theirs / "lerobot")
    assert (recording.fps, recording.robot) == (15, "so101_follower")
    assert (recording.state_names, recording.action_names) == (("pan", "lift", "gripper"), ("pan", "lift"))
    assert [len(episode) for episode in recording.episodes] == [6, 9, 4, 7, 5]
    rows = [(episode, step) for episode in recording.episodes for step in range(len(episode))]
    for (episode, step), said in zip(rows, steps, strict=True):
        assert episode.task == said["task"]
        assert episode.states[step].tolist() == said["observation.state"]
        assert episode.actions[step].tolist() == said["action"]
        assert bool(episode.corrected[step]) == said["intervention"]
        assert float(episode.extra["next.reward"][step]) == said["next.reward"]
        assert episode.extra["grid"][step].tolist() == said["grid"]
        assert (
            np.float32(episode.extra["observation.environment_state"][step]).tolist()
            == said["observation.environment_state"]
        )
    assert [episode.success for episode in recording.episodes] == [True, False, True, False, True]
    assert [episode.takeovers() for episode in recording.episodes] == [[], [(2, 3)], [(2, 4)], [(2, 5)], [(2, 5)]]


def test_pictures_are_those_of_lerobots_own_reader(theirs: Path) -> None:
    steps = iter(json.loads((theirs / "lerobot.json").read_text(encoding="utf-8")))
    for episode in read(theirs / "lerobot").episodes:
        for top, wrist in zip(episode.pictures["top"], episode.pictures["wrist"], strict=True):
            said = next(steps)
            assert wrist[::8, ::8].tolist() == said["observation.images.wrist"]  # a PNG
            assert np.abs(top[::8, ::8] - np.array(said["observation.images.top"])).max() <= 2  # decoders may round
        for pictures in episode.pictures.values():
            assert np.array_equal(pictures[len(episode) - 2], list(pictures)[-2])
            with pytest.raises(IndexError):
                pictures[len(episode)]


def test_episodes_are_chosen_by_number_and_in_order(theirs: Path) -> None:
    chosen, whole = read(theirs / "lerobot", [4, 1]), read(theirs / "lerobot")
    assert [len(episode) for episode in chosen.episodes] == [5, 9]
    assert np.array_equal(chosen.episodes[1].states, whole.episodes[1].states)
    with pytest.raises(BadInput, match=r"episode 5: '.*lerobot' has 5 episodes, numbered from 0"):
        read(theirs / "lerobot", [0, 5])


# ---- what is not as it should be ------------------------------------------------------------------------------------------


def changed(folder: Path, **fields: Any) -> None:
    path = folder / "meta/info.json"
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | fields), encoding="utf-8")


def feature(folder: Path, name: str, **fields: Any) -> None:
    features = json.loads((folder / "meta/info.json").read_text(encoding="utf-8"))["features"]
    features[name] = features.get(name, {}) | fields
    changed(folder, features=features)


def column(folder: Path, file: str, name: str, values: Any) -> None:
    """Another column instead of the one with this name; None: without it."""
    table = pq.read_table(folder / file)
    at = table.column_names.index(name)
    table = table.remove_column(at) if values is None else table.set_column(at, name, pa.array(values))
    pq.write_table(table, folder / file)


def another_column(folder: Path, name: str, values: Any) -> None:
    """A feature of one number more."""
    feature(folder, name, dtype="bool", shape=[1])
    pq.write_table(pq.read_table(folder / DATA).append_column(name, pa.array(values)), folder / DATA)


LISTS = [[0.0, 1.0]] * 6
Damage = Callable[[Path], object]


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda f: (f / "meta/info.json").unlink(), "no meta/info.json in it; give the folder of a LeRobot dataset"),
        (lambda f: (f / "meta/info.json").write_text("{"), "info.json'"),
        (lambda f: (f / "meta/info.json").write_text("[]"), "wanted a JSON object"),
        (
            lambda f: changed(f, codebase_version="v2.1"),
            "wanted v3.0; LeRobot converts it: python -m lerobot.scripts.conv",
        ),
        (lambda f: changed(f, codebase_version="v2.0"), "codebase_version 'v2.0': wanted v3.0"),
        (lambda f: changed(f, codebase_version="v4.0"), "codebase_version 'v4.0': wanted v3.0"),
        (lambda f: changed(f, fps=0), "fps 0: wanted a whole number, 1 to 10000"),
        (lambda f: changed(f, fps="30"), "fps '30': wanted"),
        (lambda f: changed(f, total_episodes=10**12), "total_episodes 1000000000000: wanted"),
        (lambda f: changed(f, total_episodes=3), "2 episodes, but 3 in info.json"),
        (lambda f: changed(f, total_episodes=1), "more episodes than the 1 in info.json"),
        (
            lambda f: changed(f, data_path="../../x-{file_index}"),
            "'../../x-0': wanted the path of a file in the dataset's",
        ),
        (lambda f: changed(f, data_path="/etc/passwd"), "'/etc/passwd': wanted the path"),
        (lambda f: changed(f, data_path="{0.__class__}"), "'{0.__class__}': wanted the path"),
        (lambda f: changed(f, data_path="{robot}"), "unknown field of a path 'robot'"),
        (lambda f: changed(f, video_path="videos/{video_key}/../../../x.mp4"), "wanted the path of a file"),
        (lambda f: changed(f, video_path=None), "video_path: wanted a file's path"),
        (lambda f: changed(f, features=7), "features: wanted an object"),
        (lambda f: feature(f, "action", shape=[10**9]), "feature 'action': shape [1000000000]: wanted"),
        (lambda f: feature(f, "action", shape=[3]), "column 'action': wanted 3 numbers in each row"),
        (lambda f: feature(f, "action", shape=[1]), "column 'action': more than 1 numbers in a row"),
        (lambda f: feature(f, "action", dtype="image"), "feature 'action': image (2,): wanted a row of numbers"),
        (lambda f: feature(f, "more", dtype="float32", shape=[1]), "unknown column 'more'"),
        (lambda f: changed(f, data_path="x" * 300), "xxx': no such file"),
        (lambda f: changed(f, video_path="x" * 300), "xxx': no such file"),
        (lambda f: (f / DATA).unlink(), "file-000.parquet': no such file"),
        (lambda f: (f / DATA).write_bytes((f / DATA).read_bytes()[:-40]), "no readable Parquet file"),
        (lambda f: (f / EPISODES).unlink(), "no Parquet file in it, but 2 episodes in info.json"),
        (lambda f: (f / TASKS).unlink(), "tasks.parquet': no such file"),
        (lambda f: (f / VIDEO).unlink(), "file-000.mp4': no such file"),
        (lambda f: column(f, DATA, "action", None), "unknown column 'action'"),
        (lambda f: column(f, DATA, "action", [*LISTS[1:], None]), "column 'action': wanted 2 numbers in each row"),
        (lambda f: column(f, DATA, "action", [[0.0], [1.0, 2.0, 3.0], *LISTS[2:]]), "wanted 2 numbers in each row"),
        (lambda f: column(f, DATA, "action", ["word"] * 6), "column 'action': wanted numbers"),
        (lambda f: column(f, DATA, "action", [[0.0, float("nan")]] * 6), "episode 0: actions (episode): wanted finite"),
        (lambda f: column(f, DATA, "observation.state", [[0.0, 1e300]] * 6), "states (episode): wanted finite"),
        (lambda f: column(f, DATA, "episode_index", [0, 1, 0, 1, 0, 1]), "wanted all of them, one after another"),
        (lambda f: column(f, DATA, "episode_index", [0] * 6), "episode 0: 6 of its 3 rows"),
        (
            lambda f: another_column(f, "next.success", [float("nan")] * 6),
            "column 'next.success' of episode 0: wanted finite",
        ),
        (
            lambda f: column(f, DATA, "intervention", [0.0, float("nan")] * 3),
            "column 'intervention' of episode 0: wanted finite",
        ),
        (lambda f: column(f, DATA, "task_index", [7] * 6), "task 7 of episode 0 is not in meta/tasks.parquet"),
        (lambda f: column(f, DATA, "task_index", [0.0, 0.5] * 3), "column 'task_index': wanted whole numbers"),
        (
            lambda f: column(f, DATA, "episode_index", [float("nan")] * 6),
            "column 'episode_index': wanted whole numbers",
        ),
        (lambda f: column(f, EPISODES, "length", [3.0, float("nan")]), "column 'length': wanted whole numbers"),
        (lambda f: column(f, TASKS, "task_index", [10**18]), "column 'task_index': wanted whole numbers"),
        (lambda f: column(f, DATA, "timestamp", [2.0, 1.0, 0.0] * 2), "timestamp: wanted seconds that do not run back"),
        (lambda f: column(f, EPISODES, "length", [3, -3]), "episode 1 of -3 steps"),
        (lambda f: column(f, EPISODES, "episode_index", [0, 0]), "wanted each number once"),
        (lambda f: column(f, EPISODES, "data/file_index", [0, 9]), "file-009.parquet': no such file"),
    ],
)
def test_a_damaged_dataset_is_refused_in_one_line(ours: Path, damage: Damage, said: str) -> None:
    damage(ours)
    with pytest.raises(BadInput) as refused:
        read(ours)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("version", "is_converted"), [("v2.1", True), ("v2.0", False), ("v1.6", False)])
def test_what_lerobot_converts_is_converted_where_it_is_and_not_on_the_hub(
    ours: Path, version: str, is_converted: bool
) -> None:
    """Its script converts v2.1 alone; without --root it takes the Hub's dataset, and by itself it replaces that one."""
    changed(ours, codebase_version=version)
    with pytest.raises(BadInput) as refused:
        read(ours)
    words = str(refused.value).split()
    assert ({"--root=FOLDER", "--push-to-hub=false"} <= {*words}) == is_converted


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda f: (f / VIDEO).write_bytes(b"no video"), "cannot be decoded as a video"),
        (lambda f: (f / VIDEO).write_bytes((f / VIDEO).read_bytes()[:400]), "cannot be decoded as a video"),
        (lambda f: (f / VIDEO).write_bytes((f / VIDEO).read_bytes().replace(b"avc1", b"zzzz")), "of an unknown codec"),
        (
            lambda f: column(f, EPISODES, "videos/observation.images.top/from_timestamp", [0.0, 9.0]),
            "no picture at 9.000 s",
        ),
    ],
)
def test_a_damaged_video_is_refused_when_a_picture_is_asked_for(ours: Path, damage: Damage, said: str) -> None:
    damage(ours)
    episodes = read(ours).episodes
    with pytest.raises(BadInput, match=said):
        list(episodes[1].pictures["top"])


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from([DATA, EPISODES, TASKS, VIDEO, "meta/info.json"]),
    where=st.floats(0, 1),
    byte=st.integers(0, 255),
)
def test_other_bytes_are_read_or_refused(ours: Path, name: str, where: float, byte: int) -> None:
    path = ours / name
    content = path.read_bytes()
    at = int(where * (len(content) - 1))
    path.write_bytes(content[:at] + bytes([byte]) + content[at + 1 :])
    try:
        for episode in read(ours).episodes:
            list(episode.pictures["top"])
    except (BadInput, WorkFailed):
        pass
    finally:
        path.write_bytes(content)


def test_names_in_groups_or_none_are_understood(ours: Path) -> None:
    feature(ours, "action", names={"left": ["x"], "right": ["y"]})
    feature(ours, "observation.state", names=None)
    recording = read(ours)
    assert (recording.state_names, recording.action_names) == (("state 1", "state 2"), ("x", "y"))
    feature(ours, "action", names={"second": 1, "first": 0})
    assert read(ours).action_names == ("first", "second")


def test_a_sparse_reward_says_whether_it_was_a_success_and_others_do_not(tmp_path: Path) -> None:
    for number, last in enumerate((1.0, 0.5)):
        rows = np.zeros((2, 1), np.float32)
        extras = [{"next.reward": np.array([0.0, end])} for end in (0.0, last)]
        episodes = [Episode("t", rows, rows, np.zeros(2, np.bool_), None, {}, extra) for extra in extras]
        write(Recording(10, "arm", ("a",), ("a",), episodes), tmp_path / str(number))
    assert [episode.success for episode in read(tmp_path / "0").episodes] == [False, True]
    assert [episode.success for episode in read(tmp_path / "1").episodes] == [None, None]


def test_hil_serls_interventions_are_corrections(tmp_path: Path) -> None:
    rows, name = np.zeros((3, 1), np.float32), "complementary_info.is_intervention"
    extra = {name: np.array([0.0, 1.0, 1.0], np.float32)}
    recording = Recording(10, "arm", ("a",), ("a",), [Episode("t", rows, rows, np.zeros(3, np.bool_), None, {}, extra)])
    write(recording, tmp_path / "hil")
    (episode,) = read(tmp_path / "hil").episodes
    assert (episode.takeovers(), list(episode.extra)) == ([(1, 3)], [])


def test_a_dataset_of_links_is_read_as_the_hub_keeps_them(ours: Path, tmp_path: Path) -> None:
    for path in [path for path in ours.rglob("*") if path.is_file()]:
        link = tmp_path / "snapshot" / path.relative_to(ours)
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(path)
    assert len(read(tmp_path / "snapshot").episodes) == 2
