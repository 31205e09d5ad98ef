"""The student: what it learns from, what it plans, and its file."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lab.cloning.student import CHUNK, Student, _pairs
from lab.errors import BadInput
from lab.recordings.episode import Episode, Recording
from tests.cloning.conftest import RollOut


def episode(actions: list[float], corrected: list[bool] | None = None, success: bool | None = True) -> Episode:
    n = len(actions)
    column = np.array(actions, np.float32)[:, None]
    return Episode("go", column + 100.0, column, np.array(corrected or [False] * n), success)


def test_each_step_is_paired_with_the_actions_from_it_on() -> None:
    states, chunks = _pairs([(episode([1, 2, 3, 4, 5]), np.ones(5, bool))])
    assert CHUNK == 4
    assert states[:, 0].tolist() == [101, 102, 103, 104, 105]
    assert chunks[:, :, 0].tolist() == [[1, 2, 3, 4], [2, 3, 4, 5], [3, 4, 5, 5], [4, 5, 5, 5], [5, 5, 5, 5]]


def test_a_chunk_ends_with_its_stretch() -> None:
    _, chunks = _pairs([(episode([1, 2, 3, 4, 5]), np.array([True, True, False, True, True]))])
    assert chunks[:, :, 0].tolist() == [[1, 2, 2, 2], [2, 2, 2, 2], [4, 5, 5, 5], [5, 5, 5, 5]]


def test_a_plan_is_the_mean_of_the_networks() -> None:
    weights = np.array([[[1.0, 2.0]], [[3.0, 6.0]]])  # of two networks, from one number to two actions
    student = Student(np.array([5.0]), np.array([2.0]), [weights], [np.array([[0.0, 1.0], [0.0, 3.0]])], chunk=2)
    assert student.plan([7.0]).tolist() == [[2.0], [6.0]]  # (7 - 5) / 2 = 1
    assert student.plan([[[7.0], [9.0]]])[0, 1].tolist() == [[4.0], [10.0]]


def test_a_file_of_other_axes_is_refused(tmp_path: Path) -> None:
    Student(np.zeros(1), np.ones(1), [np.ones((1, CHUNK))], [np.zeros(CHUNK)]).save(tmp_path / "student")
    with pytest.raises(BadInput, match="axes"):
        Student.load(tmp_path / "student")


def test_it_does_as_was_demonstrated_and_corrected(roll_out: RollOut, shown: Recording) -> None:
    student = Student.learn(shown, seed=1)
    assert student([0.3])[0] > 0.9
    assert roll_out(student, 9).success
    line = np.linspace(3.0, 4.0, 50, dtype=np.float32)[:, None]
    back = Episode("go", line, np.full_like(line, -1.0), np.ones(50, bool), False)
    assert Student.learn(shown, [back], seed=1)([3.5])[0] < -0.8
    own = Episode("go", line, np.full_like(line, -1.0), np.zeros(50, bool), False)
    assert Student.learn(shown, [own], seed=1)([3.5])[0] == student([3.5])[0]  # what it did itself teaches nothing


def test_a_failed_demonstration_teaches_nothing(shown: Recording) -> None:
    with pytest.raises(BadInput, match="student"):
        Student.learn(Recording(10, "point", ("x",), ("speed",), [episode([1, 2], success=False)]))


def test_the_same_seed_learns_the_same(shown: Recording) -> None:
    first, again, other = (Student.learn(shown, seed=seed) for seed in (3, 3, 4))
    assert [w.tolist() for w in first.weights] == [w.tolist() for w in again.weights]
    assert first.weights[0].tolist() != other.weights[0].tolist()


def test_a_file_gives_the_student_back(shown: Recording, tmp_path: Path) -> None:
    student = Student.learn(shown, epochs=2)
    student.save(tmp_path / "student")
    back = Student.load(tmp_path / "student")
    assert back.plan([[0.1], [0.9]]).tolist() == student.plan([[0.1], [0.9]]).tolist()
    assert back.planned(shown.episodes[0]).extra["chunk"].shape == (len(shown.episodes[0]), CHUNK, 1)
    back.save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == (tmp_path / "student").read_bytes()
    with pytest.raises(BadInput, match="nothing"):
        Student.load(tmp_path / "nothing")


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 1199), st.integers(0, 255))
def test_a_damaged_file_is_refused_or_harmless(at: int, value: int) -> None:
    layer = np.full((1, 1, CHUNK), 0.5)
    student = Student(np.zeros(1), np.ones(1), [layer], [np.zeros((1, CHUNK))])
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "student")
        student.save(path)
        content = bytearray(path.read_bytes())
        content[at % len(content)] = value
        path.write_bytes(content)
        with suppress(BadInput):
            Student.load(path)
