"""The keys of a replay in a real terminal: space pauses and goes on, n makes a step, q ends it."""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pexpect
import pytest

LAB = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"


@pytest.fixture
def lesson(tmp_path: Path, lab: Callable[..., Any]) -> Path:
    """A kept lesson whose journal has a hundred answers of a simulated advisor."""
    folder = tmp_path / "lesson"
    assert (
        lab("teach", "world-1", "--advisor", "expert", "--episodes", "60", "--out", str(folder), "--json").json[
            "requests"
        ]
        > 0
    )
    return folder


def test_ctrl_c_ends_a_replay(lesson: Path) -> None:
    child = pexpect.spawn(
        sys.executable, ["-c", LAB, "replay", str(lesson), "--pause", "60"], encoding="utf-8", timeout=60
    )
    try:
        child.expect("Answer: ")
        child.sendcontrol("c")
        child.expect("stopped by Ctrl-C")
        child.expect(pexpect.EOF)
    finally:
        child.close()
    assert child.exitstatus == 130


def test_keys_pause_step_and_end_a_replay(lesson: Path) -> None:
    child = pexpect.spawn(
        sys.executable,
        ["-c", LAB, "replay", str(lesson), "--pause", "0.5"],
        encoding="utf-8",
        timeout=60,
        dimensions=(40, 100),
    )
    try:
        child.expect("space: pause and go on")
        child.expect("Answer: ")
        child.send(" ")
        time.sleep(1.0)
        while child.expect([pexpect.TIMEOUT, "Answer: "], timeout=0.2):
            pass  # what was shown before the key was read
        assert child.expect([pexpect.TIMEOUT, "Answer: "], timeout=1.5) == 0
        child.send("n")
        child.expect("Answer: ")
        assert child.expect([pexpect.TIMEOUT, "Answer: "], timeout=1.5) == 0
        child.send(" ")
        child.expect("Answer: ")
        child.expect("Answer: ")
        child.send("q")
        child.expect(pexpect.EOF)
    finally:
        child.close()
    assert child.exitstatus == 130
