"""`lab operate` from a pipe: the document, the exit codes, what is kept."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

COMMAND = [sys.executable, "-c", "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()", "operate"]


def operated(tmp_path: Path, lines: str, *options: str) -> tuple[int, Any, str]:
    """Exit code, document and stderr of `lab operate --json` with these lines in its pipe."""
    ran = subprocess.run(
        [*COMMAND, *options, "--json", "--out", str(tmp_path / "out")],
        input=lines,
        capture_output=True,
        text=True,
        env=os.environ | {"LAB_TOOLBOX": str(tmp_path / "box"), "PYTHONPATH": str(Path.cwd())},
        timeout=300,
        check=False,
    )
    return ran.returncode, json.loads(ran.stdout.splitlines()[0]), ran.stderr


def test_commands_come_from_a_pipe_and_are_kept(tmp_path: Path) -> None:
    code, document, _ = operated(tmp_path, "jog +z 20\nhome\nquit\n", "toast", "--toasts", "1")
    assert code == 0
    assert [row["words"] for row in document["commands"]] == ["jog +z 20", "home"]
    assert (document["task"], document["seed"], document["parts"], document["success"]) == (
        "toast",
        0,
        {"slice": 1},
        False,
    )
    assert document["status"]["parts"][0]["state"] == "waiting"
    kept = [json.loads(line) for line in (tmp_path / "out" / "run.jsonl").read_text().splitlines()]
    assert [line["words"] for line in kept if line["kind"] == "commanded"] == ["jog +z 20", "home"]


@pytest.mark.parametrize(
    ("lines", "options", "why"),
    [
        ("jgo +z 20\n", ("toast",), "did you mean 'jog'?"),
        ("run\n", ("toast",), "there is no plan yet"),
        ("", ("toast", "--speed", "fast"), "speed: 'fast' is no number of times real time, or max"),
        ("", ("toats",), "did you mean 'toast'?"),
    ],
)
def test_what_is_wrong_ends_it_with_exit_code_2(tmp_path: Path, lines: str, options: tuple[str, ...], why: str) -> None:
    code, _, told = operated(tmp_path, lines, *options)
    assert code == 2
    assert why in told.splitlines()[-1]


def test_a_motion_that_fails_ends_it_with_exit_code_1(tmp_path: Path) -> None:
    down = "close\n" + 80 * "jog -z 10\n"
    code, document, told = operated(tmp_path, down, "toast", "--toasts", "1")
    assert code in (1, 2)
    assert not document["success"]
    assert told.splitlines()[-1]
