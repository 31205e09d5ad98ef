"""Every step of a lesson: as data that Minari and TensorBoard read, of a lesson that is taught and of one that is told again."""

import sys
from pathlib import Path

import numpy as np
import pytest

import lab
from lab.errors import BadInput
from lab.learning.requests import AdviceRequest

ROWS = "S..\n.#.\n..G"


def right_then_down(request: AdviceRequest) -> int:
    _, column = request.mdp.state_cell(request.state)
    return request.mdp.action_labels.index("right" if column < 2 else "down")


@pytest.fixture
def lesson() -> lab.LessonResult:
    return lab.teach(lab.world(ROWS), advisor=right_then_down, gate="always", episodes=3, record=True)


def test_the_steps_are_those_that_were_made(lesson: lab.LessonResult) -> None:
    """Three episodes: right, right, down, down; three steps cost 0.1 each, the goal is worth 1.5."""
    down, right = (lesson.problem.mdp.action_labels.index(word) for word in ("down", "right"))
    for episode in lesson.steps.episodes:
        assert episode.states == [0, 1, 2, 5, 8]
        assert episode.actions == [right, right, down, down]
        assert episode.rewards == pytest.approx([-0.1, -0.1, -0.1, 1.5])
        assert (episode.advised, episode.terminated, episode.steps) == ([True] * 4, True, 4)
    assert len(lesson.steps.episodes) == 3


def test_recording_changes_nothing(lesson: lab.LessonResult) -> None:
    plain = lab.teach(lab.world(ROWS), advisor="limited", episodes=40, seed=2)
    recorded = lab.teach(lab.world(ROWS), advisor="limited", episodes=40, seed=2, record=True)
    np.testing.assert_array_equal(plain.q, recorded.q)
    assert sum(len(one.actions) for one in recorded.steps.episodes) == recorded.session.visits.sum()
    assert sum(sum(one.advised) for one in recorded.steps.episodes) == recorded.session.helped_steps
    with pytest.raises(BadInput, match="teach it with record=True"):
        _ = plain.steps


def test_minari_reads_it(lesson: lab.LessonResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import minari

    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    folder = lesson.steps.to_minari("lab/small-v0")
    assert folder == tmp_path / "lab" / "small-v0"
    dataset = minari.load_dataset("lab/small-v0")
    assert (dataset.total_episodes, dataset.total_steps) == (3, 12)
    episode = dataset[0]
    assert episode.observations.tolist() == [0, 1, 2, 5, 8]
    assert episode.terminations.tolist() == [False, False, False, True]
    assert episode.infos["advised"].tolist() == [True, True, True, True, False]
    with pytest.raises(BadInput, match="dataset 'lab/small-v0'"):
        lesson.steps.to_minari("lab/small-v0")


def test_tensorboard_reads_it(lesson: lab.LessonResult, tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    lesson.steps.to_tensorboard(tmp_path / "curves")
    read = EventAccumulator(str(tmp_path / "curves"))
    read.Reload()
    assert [(one.step, one.value) for one in read.Scalars("steps")] == [(1, 4.0), (2, 4.0), (3, 4.0)]
    assert [one.value for one in read.Scalars("return")] == pytest.approx([1.2] * 3)


def test_a_kept_lesson_is_told_again_into_both(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import minari

    command = request.getfixturevalue("lab")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    Path("small.txt").write_text(ROWS)
    taught = command(
        "teach", "small.txt", "--advisor", "expert", "--gate", "always", "--episodes", "5", "--out", "kept"
    )
    assert taught.code == 0
    words = ("--minari", "lab/kept-v0", "--tensorboard", "curves", "--json")
    told = command("replay", "kept", *words)
    assert told.json["files"]["tensorboard"] == "curves"
    assert minari.load_dataset("lab/kept-v0").total_episodes == 5


def test_a_missing_library_is_told_before_anything_is_shown(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = request.getfixturevalue("lab")
    monkeypatch.chdir(tmp_path)
    Path("small.txt").write_text(ROWS)
    command("teach", "small.txt", "--advisor", "none", "--episodes", "2", "--out", "kept")
    monkeypatch.setitem(sys.modules, "minari", None)
    told = command("replay", "kept", "--minari", "lab/kept-v0")
    assert (told.code, told.out, told.err.count("\n")) == (2, "", 1)
    assert "the library 'minari' is not installed" in told.err
