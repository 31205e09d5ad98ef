"""`lab teach insert --advisor terminal` as a person types it: in a terminal, through a pipe, with Ctrl-C."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lab.toolbox import Toolbox

CODE = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
LISTENING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "  # background jobs ignore Ctrl-C
TEACH = ("teach", "insert", "--advisor", "terminal")
QUESTION = "Which way?"
STOPPED = r"lab: stopped by Ctrl-C after (\d+) episodes of 'insert at toaster'; what was learned is kept\s*$"
LONGEST_WAIT_S = 20.0  # for the next output; only a hanging program takes it


class Terminal:
    """The command in a terminal of its own, 80 x 45; `screen` is all it has written, without control codes."""

    def __init__(self, folder: Path, root: Path, *words: str) -> None:
        env = {**os.environ, "LAB_TOOLBOX": str(folder / "toolbox"), "PYTHONPATH": str(root), "TERM": "xterm"}
        self._raw, self._seen = b"", 0
        self._fd, inside = pty.openpty()
        fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 45, 80, 0, 0))
        self._process = subprocess.Popen(
            [sys.executable, "-c", CODE, *words],
            cwd=folder,
            env=env,
            stdin=inside,
            stdout=inside,
            stderr=inside,
            start_new_session=True,
        )
        os.close(inside)

    @property
    def screen(self) -> str:
        text = self._raw.decode("utf-8", "replace")
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b[=>]", "", text).replace("\r", "")

    def _read(self) -> bool:
        if not select.select([self._fd], [], [], LONGEST_WAIT_S)[0]:
            pytest.fail(f"no output for {LONGEST_WAIT_S} s after: {self.screen[-400:]}")
        try:
            more = os.read(self._fd, 65536)
        except OSError:  # the other side is closed
            more = b""
        self._raw += more
        return bool(more)

    def wait_for(self, pattern: str) -> None:
        """Read until `pattern` comes in what was written since the last wait."""
        while not re.search(pattern, self.screen[self._seen :]):
            assert self._read(), self.screen[-2000:]
        self._seen = len(self.screen)

    def ask(self, keys: str, after: str = "The learner itself would go") -> None:
        """Wait for the question that comes after these words, then type."""
        self.wait_for(rf"(?s){re.escape(after)}.*{re.escape(QUESTION)} \[enter = .*, \? explains\]")
        os.write(self._fd, keys.encode())

    def end(self) -> int:
        """The exit code, once all is read."""
        while self._read():
            pass
        return self._process.wait()

    def close(self) -> None:
        """End what is still running."""
        os.close(self._fd)
        self._process.kill()
        self._process.wait()


@pytest.fixture
def terminal(tmp_path: Path, root: Path) -> Iterator[Callable[..., Terminal]]:
    started: list[Terminal] = []

    def start(*words: str) -> Terminal:
        started.append(Terminal(tmp_path, root, *words))
        return started[-1]

    yield start
    for each in started:
        each.close()


def test_a_lesson_in_a_terminal(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    teacher = terminal(*TEACH)
    teacher.ask("?\r")
    teacher.ask("sideways\r", after="it asks no more.")
    teacher.ask("right\r", after="'sideways' is no direction")
    teacher.ask("\x1b[A")  # the arrow key up answers at once
    teacher.ask("skip\r")
    teacher.ask("\r")
    teacher.ask("auto\r")
    assert teacher.end() == 0
    screen = teacher.screen
    first = re.search(r"Episode (\d+): the learner asks for advice about 'insert at toaster'\.", screen)
    assert first is not None
    assert first.end() < screen.index(QUESTION)
    episode = first[1]
    assert "R robot, G goal, # obstacle, arrow: the learner's own choice" in screen
    assert "The learner is stuck and asks you where to go." in screen
    assert "'sideways' is no direction: type " in screen
    assert f"Episode {episode}, step 2: at (2, 1)" in screen
    assert f"Episode {episode}, step 3: at (2, 2)" in screen
    assert f"Episode {episode}: advice has ended; the learner goes on alone." in screen
    assert re.search(r"asked in 1 episodes, 3 helped steps", screen)
    assert max(len(line) for line in screen.splitlines() if QUESTION not in line) <= 80
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["episodes"], row["helped_steps"], row["advisor"]) == (200, 3, "terminal")


@pytest.mark.parametrize("key", ["\x03", "right\x03"], ids=["at once", "in a word"])
def test_ctrl_c_in_a_terminal_loses_nothing(terminal: Callable[..., Terminal], tmp_path: Path, key: str) -> None:
    teacher = terminal(*TEACH)
    teacher.ask("right\r")
    teacher.ask(key)
    assert teacher.end() == 130
    stopped = re.search(STOPPED, teacher.screen)
    assert stopped is not None
    assert "Traceback" not in teacher.screen
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["episodes"], row["solved"]) == (int(stopped[1]), False)
    assert row["helped_steps"] == 0  # advice counts once its episode is over
    assert sorted(path.name for path in tmp_path.iterdir()) == ["toolbox"]


def test_ctrl_d_ends_advice_only(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*TEACH)
    teacher.ask("\x04")
    assert teacher.end() == 0
    assert "No more answers: the learner goes on alone." in teacher.screen


def test_a_run_asks_with_the_bar_out_of_the_way(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    run = terminal("run", "toast", "--toasts", "1", "--advisor", "terminal")
    for _ in range(2):
        run.ask("forward\r")
    run.ask("\x03")
    assert run.end() == 130
    assert "asks for advice about 'grasp at plate'" in run.screen
    assert "g goal, in another plane" in run.screen
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["subtask"], row["helped_steps"]) == ("grasp", 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["toolbox"]


# ---- through a pipe -------------------------------------------------------------------------------------------------


@pytest.fixture
def piped(lab: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    return lambda answers: lab(*TEACH, "--json", stdin=answers)


def test_piped_answers(piped: Callable[[str], Any]) -> None:
    ran = piped("right\nskip\n?\nauto\n")
    assert ran.code == 0
    assert (ran.json["requests"], ran.json["helped_steps"]) == (1, 1)
    assert ran.out.count("\n") == 1
    assert f"{QUESTION} [enter = ← left, ? explains] right\n" in ran.err
    assert ran.err.count(QUESTION) == 4
    assert "\x1b" not in ran.err


@pytest.mark.parametrize("answers", ["", "right\n", "right"])
def test_the_end_of_the_answers_ends_advice(piped: Callable[[str], Any], answers: str) -> None:
    ran = piped(answers)
    assert (ran.code, ran.json["helped_steps"]) == (0, bool(answers))
    assert "No more answers: the learner goes on alone." in ran.err


def test_a_bad_adviser_is_told_so_with_the_numbers(piped: Callable[[str], Any]) -> None:
    ran = piped("left\n" * 2000)
    assert ran.json["misleads"] == 8
    episode = ran.json["rejected_at_episode"]
    said = " ".join(ran.err.split())
    assert "The learner takes no more advice (episodes misled: 8, tolerated: 7)." in said
    assert f"Episode {episode} counted 201 steps, those before it " in said


def test_ctrl_c_at_a_piped_question(tmp_path: Path, root: Path) -> None:
    env = {**os.environ, "LAB_TOOLBOX": str(tmp_path / "toolbox"), "PYTHONPATH": str(root)}
    with subprocess.Popen(
        [sys.executable, "-c", LISTENING + CODE, *TEACH, "--json"],
        cwd=tmp_path,
        env=env,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as lab:
        assert lab.stderr is not None
        assert lab.stdout is not None
        said = b""
        while QUESTION.encode() not in said:
            said += os.read(lab.stderr.fileno(), 4096)
        lab.send_signal(signal.SIGINT)
        out, rest = lab.stdout.read(), lab.stderr.read()
    assert (lab.returncode, out) == (130, b"")
    stopped = re.search(STOPPED, (said + rest).decode())
    assert stopped is not None
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["episodes"], row["helped_steps"]) == (int(stopped[1]), 0)
