"""Sessions that are replayed without the files that they name: from the copies in their own folder."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.advice.entries import Answer, read_journal
from lab.errors import BadInput
from lab.learning.gates import GATES
from lab.learning.problem import Problem
from lab.learning.requests import AdviceRequest
from lab.mdp import grid
from lab.plugins.code_file import take
from lab.tasks.task_file import load
from lab.teaching import problem_file
from lab.teaching.events import unheard
from lab.teaching.kept_inputs import FILE, INPUTS, TABLE, code_lines, keep_inputs, read_inputs, replaced, version_lines
from lab.teaching.kept_session import KeptSession
from lab.teaching.lesson import replay, teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.named_problems import PROBLEMS
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.version import __version__

MAP = "S.#\n...\n#.G\n"
URDF = (
    '<robot name="cup"><link name="a"><visual><geometry><mesh filename="cup.obj"/></geometry></visual></link></robot>'
)


def own_choice(request: AdviceRequest) -> int:
    return request.own


def held(folder: Path, subtask: str, **more: Any) -> Path:
    """The folder of a short lesson with a person who answers with the learner's own choice."""
    options = LessonOptions(subtask, advisors=("terminal",), gate="always", episodes=2, seed=1, **more)
    teacher = Teacher(Toolbox(str(folder / "toolbox")), options.advising({"terminal": own_choice}), 1)
    teach(subject_of(options), options, teacher, folder / "lesson")
    return folder / "lesson"


def replayed(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """The document of a replay, and what is said about what it stands on."""
    kept = KeptSession(folder, "DIR", read_only=True)
    return replay(kept, subject_of(kept.options, kept), unheard), [*kept.notes]


@pytest.fixture
def world(tmp_path: Path) -> Path:
    path = tmp_path / "small.txt"
    path.write_text(MAP)
    return path


def test_a_world_is_replayed_without_its_file_and_with_another_one(tmp_path: Path, world: Path) -> None:
    lesson = held(tmp_path, str(world))
    before, said = replayed(lesson)
    assert said == []
    assert sum(isinstance(entry, Answer) for entry in read_journal(lesson, "").entries) > 0
    world.unlink()
    assert replayed(lesson) == (before, [f"'{world}' is not here: the session's own copy is used"])
    world.write_text(MAP.replace("#", "."))
    why = "is not the one that the session was learned on: the session's own copy is used"
    assert replayed(lesson) == (before, [f"'{world}' {why}"])


def test_a_skill_of_a_task_file_is_replayed_in_another_folder_without_it(tmp_path: Path) -> None:
    task = tmp_path / "mine.toml"
    task.write_text((Path(str(load("toast")._toml.path))).read_text())  # type: ignore[union-attr]
    lesson = held(tmp_path, "grasp", task=str(task))
    before, _ = replayed(lesson)
    task.unlink()
    moved = lesson.rename(tmp_path / "elsewhere")
    after, said = replayed(moved)
    assert after | {"session": before["session"]} == before
    assert said == [f"'{task}' is not here: the session's own copy is used"]


def test_a_task_is_copied_with_the_files_that_it_names(tmp_path: Path) -> None:
    (tmp_path / "task").mkdir()
    (tmp_path / "task" / "parts").mkdir()
    (tmp_path / "outside.obj").write_text("secret")
    (tmp_path / "task" / "a.toml").write_text('[[parts]]\nlook = "parts/cup.urdf"\nother = "../outside.obj"\n')
    (tmp_path / "task" / "parts" / "cup.urdf").write_text(URDF)
    (tmp_path / "task" / "parts" / "cup.obj").write_text("v 0 0 0\n")
    (tmp_path / "task" / "unnamed.obj").write_text("v 1 1 1\n")
    keep_inputs(tmp_path / "kept", {"task": str(tmp_path / "task" / "a.toml")})
    copies = tmp_path / "kept" / INPUTS / "task"
    found = sorted(path.relative_to(copies).as_posix() for path in copies.rglob("*") if path.is_file())
    assert found == ["a.toml", "parts/cup.obj", "parts/cup.urdf"]


def test_an_own_problem_is_replayed_without_its_code(tmp_path: Path) -> None:
    board = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2))
    PROBLEMS.adopted("mine.board", lambda: board, "here")
    try:
        lesson = held(tmp_path, "mine.board")
        before, _ = replayed(lesson)
        assert (lesson / INPUTS / TABLE).is_file()
    finally:
        del PROBLEMS["mine.board"]
    assert replayed(lesson) == (before, [])
    (lesson / INPUTS / TABLE).unlink()
    with pytest.raises(BadInput, match=r"own copy '.*problem\.safetensors' cannot be read"):
        replayed(lesson)


def test_own_code_that_is_not_here_or_was_changed_is_named_with_its_hash(tmp_path: Path) -> None:
    path = tmp_path / "asking.py"
    path.write_text("import lab\nclass Never(lab.Gate):\n    def opens(self, episode, scores): return False\n")
    (tmp_path / "kept").mkdir()
    name = take(GATES, f"{path}:Never")
    keep_inputs(tmp_path / "kept", {}, members=["ccrl", name])
    inputs = read_inputs(tmp_path / "kept")
    assert inputs is not None
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert (inputs.code[name].file, inputs.code[name].sha256, code_lines(inputs)) == ("asking.py", digest, [])
    path.write_text(path.read_text() + "# changed\n")
    (line,) = code_lines(inputs)
    assert line == f"gate '{name}' is not the one that the session ran: its asking.py had the SHA-256 {digest}"
    elsewhere = replace(inputs, code={"other.Never": inputs.code[name]})
    assert code_lines(elsewhere) == [
        f"gate 'other.Never' is not here: it came from a file asking.py with the SHA-256 {digest}"
    ]


def test_other_versions_are_named_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    keep_inputs(tmp_path / "kept", {})
    inputs = read_inputs(tmp_path / "kept")
    assert inputs is not None
    assert version_lines(inputs) == []
    (line,) = version_lines(replace(inputs, lab="0.0.1", libraries={"numpy": "1.0"}))
    assert line == f"the session was made with lab 0.0.1 ({__version__} here), numpy 1.0 ({np.__version__} here)"


def test_a_problem_is_the_same_from_its_file() -> None:
    problem = Problem(
        "board", "table", grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2), None, ("up", "down", "left", "right"))
    )
    content = problem_file.encode(problem)
    assert content is not None
    read = problem_file.decode(content, "here")
    assert (read.name, read.subtask, read.mdp.signature) == ("board", "table", problem.mdp.signature)
    for damaged in (
        content[:40],
        content.replace(b'"F64"', b'"I64"'),
        b"\x00" * 30,
        content.replace(b"problem-1", b"problem-2"),
    ):
        with pytest.raises(BadInput, match=r"^here: "):
            problem_file.decode(damaged, "here")
    told = problem_file.encode(replace(problem, name="bo\x07rd"))
    assert told is not None
    with pytest.raises(BadInput, match="no text of up to 1000 printable characters"):
        problem_file.decode(told, "here")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"inputs": {"subtask": {"file": "../x.txt", "sha256": {"../x.txt": "0" * 64}}}},
            "'../x.txt' leads out of the",
        ),
        ({"inputs": {"subtask": {"file": "/etc/passwd", "sha256": {"/etc/passwd": "0" * 64}}}}, "leads out of the"),
        (
            {"inputs": {"subtask": {"file": "b.txt", "sha256": {"a.txt": "0" * 64}}}},
            "a file of a session's folder is wanted",
        ),
        ({"inputs": {"subtask": {"file": "small.txt", "sha256": {"small.txt": "0" * 64}}}}, "small.txt' was changed: "),
        (
            {"inputs": {"subtask": {"file": "small.txt", "sha256": {"small.txt": "x"}}}},
            "inputs.subtask.sha256.small.txt = 'x': ",
        ),
        ({"format": "other"}, "format = 'other': "),
    ],
)
def test_a_folder_that_leads_elsewhere_or_was_changed_is_refused(
    tmp_path: Path, world: Path, change: dict[str, Any], said: str
) -> None:
    keep_inputs(tmp_path / "kept", {"subtask": str(world)})
    world.unlink()
    path = tmp_path / "kept" / FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(BadInput) as refused:
        taken(tmp_path / "kept", world)
    assert said in str(refused.value)


def taken(folder: Path, world: Path) -> dict[str, str]:
    """The copies that are used instead of a world that is not here."""
    inputs = read_inputs(folder)
    assert inputs is not None
    return replaced(folder, inputs, {"subtask": str(world)})[0]


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path, world: Path) -> None:
    keep_inputs(tmp_path / "kept", {"subtask": str(world)})
    copy = tmp_path / "kept" / INPUTS / "subtask" / "small.txt"
    copy.unlink()
    copy.symlink_to(world.rename(tmp_path / "moved.txt"))
    with pytest.raises(BadInput, match="leads out of the session's folder"):
        taken(tmp_path / "kept", world)
