"""What is written: whole, whatever stdout can hold."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

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
