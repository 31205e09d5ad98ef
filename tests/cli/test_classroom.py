"""`lab class` at the command line: what is refused before anybody can join."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.classroom.class_lesson import ADVISORS
from lab.classroom.roster import FILE, Roster
from lab.teaching.lesson_options import LessonOptions
from tests.classroom.scripted import study_in

Lab = Callable[..., Any]
EXAMPLE = Path(__file__).parents[2] / "examples" / "study_with_people.toml"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "LESSON"),
        (["world-1"], "--out"),
        (["world-9", "--out", "x"], "world-9"),
        (["world-1", "nothing", "--out", "x"], "nothing"),
        (["world-1", "--out", "x", "--resume", "y"], "--resume y"),
        (["operate:toast", "world-1", "--out", "x"], "'operate:toast' beside 1 other(s)"),
        (["operate:", "--out", "x"], "'operate:': a task is missing"),
        (["operate:toats", "--out", "x"], "did you mean 'toast'?"),
        (["operate:toast", "--teams", "2", "--out", "x"], "--teams 2"),
        (["operate:toast", "--gate", "ccrl", "--out", "x"], "--gate with the lesson 'operate:toast'"),
        (["operate:toast", "--turn", "nan", "--out", "x"], "--turn"),
        (["world-1", "--turn", "60", "--out", "x"], "--turn 60"),
        (["--resume", "y"], "holds no class"),
        (["--report", "y"], "(--report) holds no class"),
        (["world-1", "--report", "y"], "beside --report y"),
        (["world-1", "--out", "x", "--pupils", "0"], "--pupils"),
        (["world-1", "--out", "x", "--gate", "ccr"], "ccr"),
        (["order:nothing", "--out", "x"], "nothing"),
        (["order:toast-case-1", "--out", "x", "--learner", "sarsa"], "--learner sarsa"),
        (["order:", "--out", "x"], "nothing to sequence"),
        (["order:world-1", "--out", "x"], "nothing to sequence"),
        (["world-1", "order:toast-case-1", "--out", "x", "--gate", "ia"], "'ia' (--gate)"),
        (["world-1", "--out", "x", "--lan", "0.0.0.0"], "every address"),
        (["world-1", "--out", "x", "--name", "lab.example"], "--lan"),
        (["world-1", "--out", "x", "--lan", "127.0.0.1", "--certificate", "c.pem"], "--key"),
        (["world-1", "--out", "x", "--lan", "127.0.0.1", "--certificate", "c.pem", "--key", "k.pem"], "c.pem"),
        (["world-1", "--out", "x", "--lan", "192.0.2.1"], "192.0.2.1"),
        (["--study", "s.toml", "--out", "x"], "s.toml"),
        (["--study", str(EXAMPLE)], "--out"),
        (["--study", str(EXAMPLE), "--out", "x", "--typed-names"], "--typed-names"),
        (["--study", str(EXAMPLE), "--out", "x", "--gate", "ia"], "--gate"),
        (["--study", str(EXAMPLE), "--out", "x", "--seed", "3"], "--seed"),
        (["world-1", "--study", str(EXAMPLE), "--out", "x"], "LESSON"),
        (["--study", str(EXAMPLE), "--resume", "y"], "--resume y"),
    ],
)
def test_what_is_refused(
    lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = lab("class", *words)
    assert (ran.code, ran.out) == (2, "")
    assert said in ran.err
    assert ran.err.count("\n") == 1
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"subtask": "gym:evil:X-v0"}, "--trust-module evil"), ({"gate": "mine.Gate"}, "--own ./mine.py:Gate")],
)
def test_code_that_is_named_in_the_file_alone_is_not_run(
    lab: Lab, tmp_path: Path, changed: dict[str, str], said: str
) -> None:
    lesson = LessonOptions("world-1", advisors=ADVISORS).to_json() | changed
    roster = Roster.new(tmp_path / "class", [], 0, 3, False)
    roster.write()
    path = tmp_path / "class" / FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | {"lessons": [lesson]}))
    ran = lab("class", "--resume", str(tmp_path / "class"))
    assert (ran.code, ran.out) == (2, "")
    assert said in ran.err


def test_a_report_is_written_of_a_class_that_is_over(lab: Lab, tmp_path: Path) -> None:
    lesson = LessonOptions("world-1", advisors=ADVISORS)
    roster = Roster.new(tmp_path / "class", [lesson], 0, 3, False)
    roster.write()
    roster.join(roster.code)
    ran = lab("class", "--report", str(tmp_path / "class"), "--json")
    assert (ran.code, ran.err) == (0, "")
    files = [*ran.json["files"].values(), *(pupil["hand_out"] for pupil in ran.json["pupils"])]
    assert len(files) == 4
    assert all(Path(file).is_file() for file in files)
    read = lab("class", "--report", str(tmp_path / "class"))
    assert "report.html" in read.out


def test_a_study_whose_protocol_was_changed_does_not_go_on(lab: Lab, tmp_path: Path) -> None:
    study = study_in(tmp_path)
    study.begin()
    study.roster.write()
    path = tmp_path / "study" / "protocol.toml"
    path.write_text(path.read_text() + "\n")
    ran = lab("class", "--resume", str(tmp_path / "study"))
    assert (ran.code, ran.out) == (2, "")
    assert "has been changed" in ran.err
    assert ran.err.count("\n") == 1


def test_a_module_that_a_protocol_names_is_not_imported(lab: Lab, tmp_path: Path) -> None:
    study_in(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(path.read_text().replace("small.txt", "gym:evil:X-v0"))
    ran = lab("class", "--study", str(path), "--out", str(tmp_path / "study"))
    assert (ran.code, ran.out) == (2, "")
    assert "--trust-module evil" in ran.err
    assert "line 16" in ran.err
