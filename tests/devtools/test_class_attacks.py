"""The harness's part `class`: one attack on a class, and what its judge notices."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from devtools.class_attacks import Taught, fault_of

SAID = "pupils: http://127.0.0.1:1/?code=x\nAda (1) has a desk: lesson 1\nAda (1), lesson 1: over\n"
QUIET = Taught(0, {"Ada": "1", "Emmy": "2"}, SAID, 0.02, 0.05, 90.0, 80.0, 700.0)


@pytest.mark.slow
def test_a_class_does_not_notice_requests_without_a_right(tmp_path: Path, root: Path) -> None:
    words = ["class", "--count", "1", "--workers", "1", "--out", str(tmp_path)]
    ended = subprocess.run(
        [sys.executable, "-m", "devtools", *words],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(root)},
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (row,) = json.loads((tmp_path / "scoreboard.json").read_text())["class"]["rows"]
    assert row["broke"] == 0
    assert row["tries"] > 100


@pytest.mark.parametrize(
    ("ended", "inside", "said"),
    [
        (QUIET, [], ""),
        (QUIET, ["GET /class.json: 200"], "got in, the first: GET /class.json: 200"),
        (replace(QUIET, code=1), [], "exit 1 instead of 0"),
        (replace(QUIET, stderr=SAID + "Exception in callback"), [], "stderr says 'Exception in callback'"),
        (replace(QUIET, stderr=SAID + "Ada (1), lesson 1: lost"), [], "stderr says"),
        (replace(QUIET, journals={"Ada": "1", "Emmy": "1"}), [], "journals differ: ['Emmy']"),
        (replace(QUIET, journals={"Ada": "1"}), [], "journals differ: ['Emmy']"),
        (replace(QUIET, peak_mb=1000.0), [], "1000 MB"),
        (replace(QUIET, desk_mb=500.0), [], "a desk of 500 MB"),
        (replace(QUIET, disk_kb=99999.0), [], "99999 KB"),
    ],
)
def test_what_is_wrong_with_an_attacked_class(ended: Taught, inside: list[str], said: str) -> None:
    assert said in fault_of(ended, QUIET, inside)
    assert bool(said) == bool(fault_of(ended, QUIET, inside))
