"""What is written: whole, whatever stdout can hold."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lab.advice.entries import FILE, SessionEntry, line_of
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
MakePolicy = Callable[..., Policy]


@pytest.mark.parametrize(
    ("words", "code", "lines"),
    [("task show toast", 1, 0), ("--version", 1, 0), ("task show toas --json", 2, 1), ("rnu --json", 2, 1)],
)
def test_a_reader_that_leaves_early_is_no_drama(root: Path, words: str, code: int, lines: int) -> None:
    script = f"import sys; from lab.cli import main; sys.argv = ['lab', *{words.split()}]; main()"
    read, write = os.pipe()
    os.close(read)
    ran = subprocess.run(
        [sys.executable, "-c", script], cwd=root, stdout=write, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write)
    assert (ran.returncode, ran.stderr.count("\n"), "Traceback" in ran.stderr) == (code, lines, False)


@pytest.mark.parametrize(
    ("redirected", "words", "code", "said"),
    [
        (">/dev/full", "toolbox list --json", 1, "cannot be written to stdout: No space left on device"),
        ("2>/dev/full", "toolbox show nosuch", 2, ""),
        ("2>&-", "toolbox show nosuch", 2, ""),
        (">&-", "toolbox list", 0, ""),
        ("<&- >&- 2>&-", "task random 8x8x8 --out world.toml", 0, ""),
    ],
)
def test_where_nobody_can_hear_it_the_exit_code_is_right(
    root: Path, folder: Path, redirected: str, words: str, code: int, said: str
) -> None:
    script = f"import sys; from lab.cli import main; sys.argv = ['lab', *{words.split()}]; main()"
    shell = ["sh", "-c", f'exec "$@" {redirected}', "sh", sys.executable, "-c", script]
    env = {**os.environ, "PYTHONPATH": str(root)}
    ran = subprocess.run(shell, cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, said in ran.stderr) == (code, True)
    assert ran.stderr.count("\n") == bool(said)
    if "--out" in words:
        assert (folder / "world.toml").read_text().startswith("#") or "shape" in (folder / "world.toml").read_text()


def test_a_library_that_does_not_fit_is_said_in_a_line(root: Path, folder: Path) -> None:
    script = """
import sys, types
class Full:
    def find_spec(self, name, path=None, target=None):
        if name == "lab.cli.app":
            raise ImportError("libx.so: failed to map segment from shared object")
sys.meta_path.insert(0, Full())
sys.argv = ["lab", "toolbox", "list"]
from lab.cli import main
main()
"""
    env = {**os.environ, "PYTHONPATH": str(root)}
    ran = subprocess.run(
        [sys.executable, "-c", script], cwd=folder, env=env, capture_output=True, text=True, check=False
    )
    line = "lab: there is not enough memory: libx.so: failed to map segment from shared object\n"
    assert (ran.returncode, ran.stderr) == (1, line)


def test_a_name_that_ascii_cannot_hold_does_not_end_a_command(root: Path, folder: Path, policy: MakePolicy) -> None:
    Toolbox(folder / "toolbox").save(policy("grüße ▁█"))
    code = "import sys; from lab.cli import main; sys.argv = ['lab', 'toolbox', 'list']; main()"
    env = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "PYTHONPATH": str(root)}
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert r"gr\xfc\xdfe _#" in ran.stdout


def test_json_is_one_line_and_finite(lab: Lab) -> None:
    ran = lab("task", "show", "toast", "--json")
    assert ran.out.count("\n") == 1
    json.loads(ran.out, parse_constant=lambda text: pytest.fail(text))


HOSTILE = "\x1b[31mred\x1b]0;title\x07"


@pytest.mark.parametrize("words", ["toolbox list", "toolbox show {name}", "toolbox log {name}", "replay"])
def test_no_escape_code_of_a_file_reaches_the_terminal(
    lab: Lab, folder: Path, policy: MakePolicy, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    """A policy's sub-task and task, and the words of a journal, with colours on as on a terminal."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    hostile = replace(policy("grasp"), subtask=f"grasp {HOSTILE}", task=HOSTILE)
    box = Toolbox(folder / "toolbox")
    box.save(hostile)
    keep(folder / "toolbox" / "sessions" / "maze-1", HOSTILE)
    ran = lab(*words.format(name="grasp").split())
    assert ran.code == 0
    for code in ("\x1b[31m", "\x1b]", "\x07"):
        assert code not in ran.out + ran.err
    assert r"\x1b[31mred" in ran.out or words.startswith("toolbox log")


def keep(folder: Path, advisor: str) -> None:
    """The journal of a session that has only begun."""
    folder.mkdir(parents=True)
    head = SessionEntry({"subtask": "maze.toml", "advisors": [advisor]}, "maze", "0a", "0.1")
    (folder / FILE).write_text(line_of(head) + "\n", encoding="utf-8")


def test_a_file_that_is_shown_is_shown_as_text(lab: Lab, folder: Path) -> None:
    (folder / "world.txt").write_text("S.\x1b[2J\n.G\n")
    ran = lab("task", "show", "world.txt")
    assert "\x1b" not in ran.out + ran.err
