"""Every command: exit codes, one document on stdout, one line for what is wrong, nothing written after bad input."""

import os
import subprocess
import sys
from collections.abc import Callable
from inspect import getdoc
from pathlib import Path
from typing import Any

import pytest
from rich.text import Text

from lab import __version__
from lab.cli.app import COMMANDS, Command, loaded
from lab.cli.families import members, offers
from lab.cli.options import Json
from lab.cli.output import show
from lab.errors import WorkFailed

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran


# ---- help ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", COMMANDS)
def test_every_command_has_help_with_an_example(lab: Lab, words: str) -> None:
    ran = lab(*words.split(), "--help")
    assert (ran.code, ran.err) == (0, "")
    assert COMMANDS[words].example.startswith(f"lab {words}")
    assert f"Example: {COMMANDS[words].example}" in " ".join(ran.out.split())
    assert "--json" in ran.out


@pytest.mark.parametrize("words", COMMANDS)
def test_nothing_in_a_help_text_is_taken_for_markup(words: str) -> None:
    """A unit such as [s] is a style to rich, which leaves it out."""
    for param in loaded(words).params:
        text = getattr(param, "help", None) or ""
        assert Text.from_markup(text).plain == text, param.name


def test_the_help_of_a_group_says_of_a_command_what_its_own_help_begins_with() -> None:
    for words, row in COMMANDS.items():
        told = getdoc(loaded(words).callback) or ""
        assert row.help == " ".join(told.partition("\n\n")[0].split()), words


@pytest.mark.parametrize("group", ["", "toolbox"])
def test_the_help_of_a_group_loads_no_command(root: Path, group: str) -> None:
    code = f"""
import sys
from lab.cli import main
sys.argv = ["lab", *{group.split()}, "--help"]
try:
    main()
finally:
    print([name for name in sys.modules if name in {["lab.cli.toolbox", "lab.cli.run", "rich.markdown"]}], file=sys.stderr)
"""
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "[]\n")
    assert "Usage: lab" in ran.stdout


def test_help_names_all_members(lab: Lab) -> None:
    """What is typed behind an option of a family stands in that option's help, and the shell completes it."""
    offered = {
        "teach": ("skills", "learners", "gates", "advisors", "asked", "decisions"),
        "sequence": ("methods", "objectives", "advisors", "order gates"),
        "run": ("advisors", "asked", "decisions"),
    }
    for command, families in offered.items():
        text = " ".join(lab(command, "--help").out.replace("│", " ").split())
        for family in families:
            assert ", ".join(members(family)) in text
    assert not {"{", "}"} & {*text}
    assert offers("learners")("q") == ["q", "q-lambda"]


def test_a_command_is_one_row(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its row in the table a function is in the help, is called, and ends as all commands do."""

    def greet(name: str, as_json: Json = False) -> None:
        """Greets somebody."""
        if name == "nobody":
            raise WorkFailed("nobody to greet")
        show({"greeted": name}, as_json, lambda document: f"hello {document['greeted']}")

    monkeypatch.setitem(COMMANDS, "greet", Command(greet, "Greets somebody.", "lab greet you"))
    assert "Greets somebody." in lab("--help").out
    assert "Example: lab greet you" in lab("greet", "--help").out
    assert lab("greet", "you").out == "hello you\n"
    assert lab("greet", "you", "--json").json == {"greeted": "you"}
    assert (lab("greet", "nobody").code, lab("greet", "nobody").err) == (1, "lab: nobody to greet\n")


def test_the_version_is_told(lab: Lab) -> None:
    ran = lab("--version")
    assert (ran.code, ran.out, ran.err) == (0, f"lab {__version__}\n", "")


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("t", ["teach", "tune", "toolbox", "task"]),
        ("teach --gate c", ["ccrl", "combined", "cq"]),
        ("study run table-9.4", ["table-9.4"]),
    ],
)
def test_the_shell_completes(root: Path, typed: str, completed: list[str]) -> None:
    """As the script of `lab --show-completion` asks for it."""
    code = "from lab.cli import main; main()"
    words = f"lab {typed}"
    asked = {"_LAB_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    env = {**os.environ, **asked, "PYTHONPATH": str(root)}
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout.split(), ran.stderr) == (0, completed, "")


def test_a_page_is_answered_only_where_somebody_asks(lab: Lab) -> None:
    for command, answered in (("run", True), ("teach", True), ("sequence", True), ("replay", False)):
        text = " ".join(lab(command, "--help").out.replace("│", " ").split())
        assert "on a page on 127.0.0.1" in text
        assert ("can be answered" in text) == answered


@pytest.mark.parametrize("command", ["run", "view", "sequence", "task check"])
def test_toasts_have_one_short_name(lab: Lab, command: str) -> None:
    assert lab(*command.split(), "toast", "-n", "0").err == "lab: 0 toasts (--toasts): allowed are 1 to 50\n"


def test_no_words_give_help(lab: Lab) -> None:
    for words in ([], ["toolbox"], ["task"]):
        ran = lab(*words)
        assert ran.code == 2
        assert "Usage: lab" in ran.out + ran.err


def test_help_loads_nothing_heavy(root: Path) -> None:
    heavy = (
        "numpy",
        "scipy",
        "pydantic",
        "matplotlib",
        "cv2",
        "trimesh",
        "meshcat",
        "numba",
        "pybullet",
        "safetensors",
        "ortools",
    )
    code = f"""
import sys
from lab.cli import main
sys.argv = ["lab", "--help"]
try:
    main()
finally:
    print([name for name in {heavy} if name in sys.modules], file=sys.stderr)
"""
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "[]\n")


# ---- exit codes 0, 1, 130 -----------------------------------------------------------------------------------------


def test_a_failed_piece_of_work_ends_with_1(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise WorkFailed("the arm is stuck\nat the table")

    monkeypatch.setattr("lab.skills.prepared_scene.prepare", fail)
    ran = lab("run", "--json")
    why = r"the arm is stuck\nat the table"
    assert (ran.code, ran.json, ran.err) == (1, {"error": why, "exit_code": 1}, f"lab: {why}\n")


@pytest.mark.parametrize(
    ("words", "where", "said"),
    [
        ("run", "lab.skills.prepared_scene.prepare", ""),
        ("run", "lab.production.run.run", "; what was learned is kept; go on with: lab run --resume toast-run"),
        ("teach insert", "lab.teaching.skill_subject.load", ""),
        ("view toast", "lab.api.scenes.load_any", ""),
    ],
)
def test_ctrl_c_ends_with_130(lab: Lab, monkeypatch: pytest.MonkeyPatch, words: str, where: str, said: str) -> None:
    """What was learned is spoken of once there may be something."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(where, stop)
    ran = lab(*words.split(), "--json")
    why = f"stopped by Ctrl-C{said}"
    assert (ran.code, ran.json, ran.err) == (130, {"error": why, "exit_code": 130}, f"lab: {why}\n")


def test_what_the_system_refuses_is_one_line(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "x")

    monkeypatch.setattr("lab.skills.prepared_scene.prepare", full)
    ran = lab("run")
    assert (ran.code, ran.out, ran.err) == (1, "", "lab: [Errno 28] No space left on device: 'x'\n")


@pytest.mark.parametrize(
    "words", ["mentor {}", "mentor . --report {}/x.html", "clone grasp --dataset {}", "run {}/x.toml"]
)
def test_a_longer_name_than_a_file_can_have_is_a_wrong_input(lab: Lab, folder: Path, words: str) -> None:
    ran = lab(*words.format("x" * 300).split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "xxxxxxxxxx" in ran.err


def test_what_was_told_is_the_only_document(lab: Lab, folder: Path) -> None:
    """A lesson that fails to reach its goal has its own document, and no second one for the error."""
    (folder / "w.txt").write_text("S" + "." * 30 + "G\n")
    ran = lab("teach", "w.txt", "--advisor", "none", "--episodes", "1", "--json")
    assert (ran.code, ran.out.count("\n"), ran.json["final_steps"]) == (1, 1, None)
    assert "does not reach its goal after 1 episode:" in ran.err


@pytest.mark.parametrize("words", ["teach world-1", "sequence fms --method fifo --gantt order.svg"])
def test_what_is_not_simulated_loads_no_simulator(root: Path, folder: Path, words: str) -> None:
    code = f"""
import sys
from lab.cli import main
sys.argv = ["lab", *{words.split()}, "--json"]
try:
    main()
finally:
    print("pybullet" in sys.modules, file=sys.stderr)
"""
    env = {**os.environ, "PYTHONPATH": str(root)}
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr.splitlines()[-1]) == (0, "False")
