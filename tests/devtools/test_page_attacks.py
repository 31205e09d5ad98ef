"""The harness's part `requests`: one attack on a lesson's page, and what its judge notices."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from devtools.page_attacks import LessonResult, fault_of

QUIET = LessonResult(0, "as the quiet one", "page: http://", 0.01, 1.0, 100.0)


@pytest.mark.slow
def test_a_lesson_does_not_notice_requests_without_a_right(tmp_path: Path, root: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "devtools",
        "requests",
        "--count",
        "1",
        "--workers",
        "1",
        "--out",
        str(tmp_path),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(root)})
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (row,) = json.loads((tmp_path / "scoreboard.json").read_text())["requests"]["rows"]
    assert row["broke"] == 0
    assert row["tries"] > 1000


@pytest.mark.parametrize(
    ("taught", "inside", "said"),
    [
        (QUIET, [], ""),
        (QUIET, ["GET / token None: 200"], "got in, the first: GET / token None: 200"),
        (replace(QUIET, code=1, stderr="Too many open files"), [], "exit 1 instead of 0: Too many open files"),
        (replace(QUIET, stderr="Exception in callback"), [], "stderr"),
        (replace(QUIET, learned="another table"), [], "table or the steps"),
        (replace(QUIET, peak_mb=1000.0), [], "1000 MB"),
    ],
)
def test_what_is_wrong_with_an_attacked_lesson(taught: LessonResult, inside: list[str], said: str) -> None:
    assert said in fault_of(taught, QUIET, inside)
    assert bool(said) == bool(fault_of(taught, QUIET, inside))
