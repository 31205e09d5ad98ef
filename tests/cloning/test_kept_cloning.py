"""The folder of a cloning session: what a killed session leaves, and how it goes on; in physics, with few short episodes."""

import json
from collections.abc import Callable, Generator, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from shutil import copytree, rmtree

import numpy as np
import pytest

from lab.cloning.kept_cloning import CORRECTIONS, DEMONSTRATIONS, KeptOptions, check_new, options_of, rounds_of
from lab.cloning.rounds import CloningOptions
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.errors import BadInput
from lab.mentor.mentor import Mentor
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import write

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


def rewritten(path: Path, **more: object) -> None:
    """A JSON object with other values."""
    path.write_text(json.dumps(json.loads(path.read_text()) | more))


def of_another_robot(folder: Path) -> None:
    """The demonstrations of a cart."""
    rmtree(folder / DEMONSTRATIONS)
    still = Episode("wait", np.zeros((4, 1), np.float32), np.zeros((4, 1), np.float32), np.zeros(4, bool))
    write(Recording(10, "cart", ("x",), ("dx",), [still]), folder / DEMONSTRATIONS)


def student_of_a_cart(folder: Path) -> None:
    states = np.linspace(0.0, 1.0, 8, dtype=np.float32)[:, None]
    shown = Recording(10, "cart", ("x",), ("dx",), [Episode("go", states, states, np.zeros(8, bool), True)])
    Student.learn(shown, epochs=1).save(max(folder.glob("round-*")) / "student.safetensors")


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda f: rewritten(f / "round-0/measured.json", successes=[]), "round-0': successes: none"),
        (lambda f: rewritten(f / "round-0/measured.json", questions=-4), "round-0': questions -4"),
        (lambda f: rewritten(f / "round-0/measured.json", round=7), "it holds round 7"),
        (of_another_robot, "demonstrations': its states have 'x'"),
        (student_of_a_cart, "student.safetensors': of 1 states and 1 actions"),
    ],
)
def test_a_damaged_or_foreign_part_is_named_in_one_line(
    session: Path, kept: KeptOptions, tmp_path: Path, damage: Callable[[Path], None], said: str
) -> None:
    folder = tmp_path / "damaged"
    copytree(session, folder)
    damage(folder)
    with pytest.raises(BadInput) as refused:
        next(rounds_of(kept, folder))
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("problem", "said"),
    [
        ({"noise": 7.0}, "noise 7.0"),
        ({"skill": "grap"}, "did you mean 'grasp"),
        ({"task": "toas"}, "toas"),
    ],
)
def test_what_a_session_file_says_is_checked_and_the_session_named(
    session: Path, tmp_path: Path, problem: dict[str, object], said: str
) -> None:
    begun = json.loads((session / "session.json").read_text())
    (tmp_path / "session.json").write_text(json.dumps(begun | {"problem": begun["problem"] | problem}))
    with pytest.raises(BadInput) as refused:
        options_of(tmp_path)
    assert str(refused.value).startswith(f"session '{tmp_path}' (--resume): ")
    assert said in str(refused.value)


def test_another_folder_is_refused(session: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="--resume"):
        check_new(session)
    check_new(tmp_path / "new")
    with pytest.raises(BadInput, match="session"):
        options_of(tmp_path)
    (tmp_path / "session.json").write_text(json.dumps({"problem": {}, "options": asdict(FEW) | {"rounds": "x"}}))
    with pytest.raises(BadInput, match="rounds"):
        options_of(tmp_path)
