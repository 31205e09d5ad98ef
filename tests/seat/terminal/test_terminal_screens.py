"""What a screen of some size holds of a question: the real command in tmux, at sizes that people have."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pexpect
import pytest

CODE = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
QUESTION = "Which way?"
LONGEST_WAIT_S = 60  # for the next output; only a hanging program takes it
Started = tuple[Any, Callable[[], str]]
_numbers = count()


@pytest.fixture
def tmux(tmp_path: Path, root: Path) -> Iterator[Callable[..., Started]]:
    """Starts the command in a tmux of a size; returns the keyboard and what stands on the screen now."""
    if shutil.which("tmux") is None:
        pytest.skip("no tmux: install it to see what a screen holds")
    started: list[tuple[str, Any]] = []

    def start(width: int, height: int, *words: str, **env: str) -> Started:
        name = f"lab-{os.getpid()}-{next(_numbers)}"
        settings = tmp_path / "tmux.conf"
        settings.write_text("set -g status off\nset -g default-terminal screen-256color\n")
        ours = {"LAB_TOOLBOX": str(tmp_path / "toolbox"), "PYTHONPATH": str(root), **env}
        inside = ["env", *(f"{key}={value}" for key, value in ours.items()), sys.executable, "-c", CODE, *words]
        outside = {
            key: value for key, value in os.environ.items() if key not in ("TMUX", "COLUMNS", "LINES", "NO_COLOR")
        }
        child = pexpect.spawn(
            "tmux",
            ["-L", name, "-f", str(settings), "-u", "new-session", "-x", str(width), "-y", str(height), *inside],
            cwd=str(tmp_path),
            env={**outside, "TERM": "xterm-256color"},
            dimensions=(height, width),
            encoding="utf-8",
            timeout=LONGEST_WAIT_S,
        )
        started.append((name, child))

        def screen() -> str:
            done = subprocess.run(
                ["tmux", "-L", name, "capture-pane", "-p"], capture_output=True, text=True, check=True
            )
            return done.stdout

        return child, screen

    yield start
    for name, child in started:
        subprocess.run(["tmux", "-L", name, "kill-server"], capture_output=True, check=False)
        child.close(force=True)


LARGE = "random:100x100:0.1:3"


@pytest.mark.parametrize(
    ("world", "width", "height"),
    [("world-1", 80, 24), ("world-1", 34, 20), (LARGE, 80, 24), (LARGE, 120, 40), (LARGE, 40, 15)],
)
def test_a_question_stands_whole_on_the_screen(
    tmux: Callable[..., Started], world: str, width: int, height: int
) -> None:
    """Picture, chances, averages and prompt, at the first question and after a path."""
    child, screen = tmux(width, height, "teach", world, "--advisor", "terminal", "--gate", "always")
    child.expect(re.escape(QUESTION))
    for step in (1, 3):
        lines = screen().rstrip().splitlines()
        (head,) = (n for n, line in enumerate(lines) if re.search(rf"[Ss]tep {step}: at", line))
        shown = lines[head:]
        assert shown[-1].startswith(QUESTION)
        assert sum(" R" in line and "robot" not in line for line in shown) == 1
        assert sum("%" in line for line in shown) >= 1
        assert "Too few episodes" in " ".join(shown)
        if step == 1:
            child.send("2r\r" if world == "world-1" else "right right\r")
            child.expect("tep 3: at")
            child.expect(re.escape(QUESTION))


def test_the_readme_shows_what_the_command_prints(tmux: Callable[..., Started], root: Path) -> None:
    """The first question of the README's lesson, line by line, on a screen of 80 x 24."""
    told = (root / "README.md").read_text(encoding="utf-8")
    command = ("teach", "insert", "--advisor", "terminal", "--out", "lesson")
    _, found, block = told.partition(f"```sh\nlab {' '.join(command)}\n```\n\n```\n")
    assert found
    child, screen = tmux(80, 24, *command)
    child.expect(re.escape(QUESTION))
    child.expect("explains")
    assert block.partition("\n```")[0] in "\n".join(line.rstrip() for line in screen().splitlines())
