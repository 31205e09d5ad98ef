"""The folder of a cloning session: what a killed session leaves, and how it goes on; in physics, with few short episodes."""

import json
from collections.abc import Generator, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from shutil import copytree, rmtree

import pytest

from lab.cloning.kept_cloning import CORRECTIONS, DEMONSTRATIONS, KeptOptions, check_new, options_of, rounds_of
from lab.cloning.rounds import CloningOptions
from lab.cloning.skill_problem import SkillProblem
from lab.errors import BadInput
from lab.mentor.mentor import Mentor
from lab.recordings.lerobot_read import read

FEW = CloningOptions(
    demonstrations=2,
    rounds=2,
    questions=2,
    calibrated=1,
    episodes=2,
    evaluated=1,
    epochs=5,
    rule="clock",
    every_steps=8,
)


@pytest.fixture(scope="module")
def kept() -> Iterator[KeptOptions]:
    problem = SkillProblem("toast", "grasp", seconds=8.0)
    yield KeptOptions(problem, FEW)
    problem.close()


@pytest.fixture(scope="module")
def session(kept: KeptOptions, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a session that ended."""
    folder = tmp_path_factory.mktemp("cloning") / "grasp"
    assert len([*rounds_of(kept, folder)]) == 3
    return folder


def test_its_data_are_lerobot_datasets_with_the_corrections_marked(session: Path, kept: KeptOptions) -> None:
    shown = read(session / DEMONSTRATIONS)
    assert len(shown.episodes) == 2
    assert shown.state_names == kept.problem.env.state_names
    corrected = read(session / "round-1" / CORRECTIONS)
    assert sum(len(episode.takeovers()) for episode in corrected.episodes) == 2
    assert json.loads((session / "round-2" / "measured.json").read_text())["questions"] == 4
    assert Mentor.load(session / "round-2" / "mentor.safetensors").rule == "clock"


def test_an_interrupted_session_goes_on_to_the_same_end(session: Path, kept: KeptOptions, tmp_path: Path) -> None:
    folder = tmp_path / "stopped"
    rounds = rounds_of(kept, folder)
    next(rounds)
    assert isinstance(rounds, Generator)
    rounds.close()  # as Ctrl-C does
    assert options_of(folder) == kept
    assert [after.measured[-1].round for after in rounds_of(options_of(folder), folder)] == [0, 1, 2]
    for name in ("round-1/student.safetensors", "round-2/student.safetensors", "round-2/measured.json"):
        assert (folder / name).read_bytes() == (session / name).read_bytes()


def test_a_session_that_ended_can_have_more_rounds(session: Path, kept: KeptOptions) -> None:
    assert [after.measured[-1].round for after in rounds_of(kept, session)] == [2]
    more = replace(kept, options=replace(FEW, rounds=3))
    assert [after.measured[-1].round for after in rounds_of(more, session)] == [2, 3]


def test_a_folder_without_one_of_its_rounds_is_refused(session: Path, kept: KeptOptions, tmp_path: Path) -> None:
    folder = tmp_path / "gap"
    copytree(session, folder)
    rmtree(folder / "round-1")
    with pytest.raises(BadInput, match="no 'round-1' before it"):
        next(rounds_of(kept, folder))


def test_another_folder_is_refused(session: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="--resume"):
        check_new(session)
    check_new(tmp_path / "new")
    with pytest.raises(BadInput, match="session"):
        options_of(tmp_path)
    (tmp_path / "session.json").write_text(json.dumps({"problem": {}, "options": asdict(FEW) | {"rounds": "x"}}))
    with pytest.raises(BadInput, match="rounds"):
        options_of(tmp_path)
