"""`lab teach --advisor terminal` as a person types it: in terminals of all kinds, through a pipe, with Ctrl-C."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pexpect
import pytest

from lab.toolbox.registry import Toolbox

CODE = "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
LISTENING = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "  # background jobs ignore Ctrl-C
INSERT = ("teach", "insert", "--advisor", "terminal")
MAZE = "S....\n.##..\n...#G\n"
WALK = ("teach", "maze.txt", "--advisor", "terminal", "--gate", "always")
QUESTION = "Which way?"
LONGEST_WAIT_S = 60  # for the next output; only a hanging program takes it
COLOUR = re.compile(r"\x1b\[(?:[0-9;]*;)?(?:3[1-7]|38;5;[0-9]+)[;m]")
CODES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b[=>]")


class Terminal:
    """The command in a terminal of its own; `screen` is all that was read of it, without control codes."""

    def __init__(self, folder: Path, root: Path, *words: str, **env: str) -> None:
        kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "COLUMNS", "LINES")}
        ours = {"LAB_TOOLBOX": str(folder / "toolbox"), "PYTHONPATH": str(root), "TERM": "xterm"}
        self.raw = ""
        self._child = pexpect.spawn(
            sys.executable,
            ["-c", CODE, *words],
            cwd=str(folder),
            env={**kept, **ours, **env},
            dimensions=(24, 80),
            encoding="utf-8",
            timeout=LONGEST_WAIT_S,
        )
        self._child.delaybeforesend = None

    @property
    def screen(self) -> str:
        return CODES.sub("", self.raw).replace("\r", "")

    def wait_for(self, pattern: str) -> None:
        """Read until `pattern` comes, whatever control codes stand around it."""
        self._child.expect(pattern)
        self.raw += self._child.before + self._child.after

    def ask(self, keys: str, after: str = r"step \d+") -> None:
        """Wait for the question that comes after this pattern, then type."""
        self.wait_for(after)
        self.wait_for(rf"{re.escape(QUESTION)} \[[^\r\n\]]*\]")
        self.type(keys)

    def type(self, keys: str) -> None:
        """As a person would."""
        self._child.send(keys)

    def end(self) -> int:
        """The exit code, once all is read."""
        self._child.expect(pexpect.EOF)
        self.raw += self._child.before
        self._child.close()
        return int(self._child.exitstatus)

    def close(self) -> None:
        """End what is still running."""
        self._child.close(force=True)


@pytest.fixture
def terminal(tmp_path: Path, root: Path) -> Iterator[Callable[..., Terminal]]:
    started: list[Terminal] = []
    (tmp_path / "maze.txt").write_text(MAZE)

    def start(*words: str, **env: str) -> Terminal:
        started.append(Terminal(tmp_path, root, *words, **env))
        return started[-1]

    yield start
    for each in started:
        each.close()


def test_a_lesson_in_a_terminal(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    teacher = terminal(*INSERT)
    teacher.ask("?\r")
    teacher.ask("sideways\r", after="this list")
    teacher.ask("\x1bOP", after="'sideways' is no direction")  # the key F1
    teacher.ask("why\r", after="'the key f1' is no direction")
    teacher.ask("right\r", after="Advice so far: 0 moves")
    teacher.ask("\x1b[A")  # the arrow key up answers at once
    teacher.ask("skip\r")
    teacher.ask("\r")
    teacher.ask("auto\r")
    assert teacher.end() == 0
    assert COLOUR.search(teacher.raw)
    screen = teacher.screen
    first = re.search(r"Episode (\d+): the learner asks for advice about 'insert at toaster'\.", screen)
    assert first is not None
    assert first.end() < screen.index(QUESTION)
    episode = first[1]
    assert "R robot, G goal, # obstacle, arrow: the learner's own choice" in screen
    assert "The learner is stuck and asks you where to go." in screen
    assert "'sideways' is no direction: type " in screen
    for step, across, before in ((1, 40, 40), (2, 35, 40), (3, 35, 35)):
        where = f"The slice in the fingers is {across} cm left of and {before} cm in front of"
        assert f"Episode {episode}, step {step}\n{where}" in screen
    assert f"Episode {episode}: advice has ended; the learner goes on alone." in screen
    assert re.search(r"asked in 1 episode, 3 helped steps", screen)
    asked = screen[: screen.index("advice has ended")]
    assert max(len(line) for line in asked.splitlines() if QUESTION not in line) <= 80
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["episodes"], row["helped_steps"], row["advisor"]) == (200, 3, "terminal")


def test_an_answer_taken_back_was_never_given(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    teacher = terminal(*WALK, "--episodes", "3")
    teacher.ask("undo\r", after=r"step 1: at \(0, 0\)")
    teacher.ask("down\r", after="nothing to take back")
    teacher.ask("path down\r", after=r"step 2: at \(1, 0\)")
    teacher.ask("undo\r", after=r"step 3: at \(2, 0\)")
    teacher.ask("undo\r", after=r"taken back.*step 2: at \(1, 0\)")
    teacher.ask("4r2d\r", after=r"taken back.*step 1: at \(0, 0\)")
    teacher.ask("undo\r", after=r"Episode 1 reached the goal in 6 steps.*Episode 2, step 1")
    teacher.ask("auto\r", after="nothing to take back")
    assert teacher.end() in (0, 1)  # a learner of three episodes may not know its way
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert row["helped_steps"] == 6


@pytest.mark.parametrize(
    "key", ["\x03", "right\x03", "path rr\x03", "quit\r"], ids=["at once", "in a word", "in a path", "quit"]
)
def test_ctrl_c_in_a_terminal_loses_nothing(terminal: Callable[..., Terminal], tmp_path: Path, key: str) -> None:
    teacher = terminal(*WALK)
    teacher.ask("4r2d\r")
    teacher.ask("rr\r", after="Episode 2, step 1")
    teacher.ask(key, after="step 3")
    assert teacher.end() == 130
    assert "lab: stopped by Ctrl-C after 1 episode of 'maze'; what was learned is kept" in teacher.screen
    assert "Traceback" not in teacher.screen
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert row["episodes"] == 1
    assert row["helped_steps"] == 6  # advice counts once its episode is over
    assert sorted(path.name for path in tmp_path.iterdir()) == ["maze.txt", "toolbox"]


def test_ctrl_c_between_episodes(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    teacher = terminal(*WALK, "--episodes", "1000000")
    teacher.ask("auto\r")
    teacher.wait_for("the learner goes on alone")
    teacher.type("\x03")
    assert teacher.end() == 130
    assert "Traceback" not in teacher.screen
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert row["episodes"] < 1_000_000


def test_ctrl_d_ends_advice_only(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*WALK)
    teacher.ask("\x04")
    assert teacher.end() == 0
    assert "No more answers: the learner goes on alone." in teacher.screen


@pytest.mark.slow
def test_a_run_asks_with_the_bar_out_of_the_way(terminal: Callable[..., Terminal], tmp_path: Path) -> None:
    run = terminal("run", "toast", "--toasts", "1", "--advisor", "terminal")
    for _ in range(2):
        run.ask("forward\r")
    run.ask("\x03")
    assert run.end() == 130
    assert "asks for advice about 'grasp at plate'" in run.screen
    assert re.search(r"The open fingers are .* cm above where they", run.screen)
    assert "from the front" in run.screen
    (journal,) = (tmp_path / "toolbox" / "sessions").glob("grasp-at-plate-1/events.jsonl")
    assert journal.read_text().count('"kind": "answer"') == 2
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["subtask"], row["helped_steps"]) == ("grasp", 0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["maze.txt", "toast-run", "toolbox"]


def test_no_colour_where_none_is_wanted(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*WALK, TERM="xterm-256color", NO_COLOR="1")
    teacher.ask("rr\r")
    teacher.ask("auto\r", after="step 3")
    assert teacher.end() == 0
    assert not COLOUR.search(teacher.raw)


def test_a_dumb_terminal_gets_no_codes_and_takes_arrows(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*WALK, TERM="dumb")
    teacher.ask("\x1b[C\r")
    teacher.ask("auto\r", after=r"step 2: at \(0, 1\)")
    assert teacher.end() == 0
    echoed = teacher.raw.replace("\x1b[C", "")  # by the terminal itself
    assert "\x1b" not in echoed


def test_ctrl_c_in_a_word_at_a_dumb_terminal(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*WALK, TERM="dumb")
    teacher.ask("rig\x03")
    assert teacher.end() == 130
    assert "lab: stopped by Ctrl-C after 0 episodes of 'maze'; what was learned is kept" in teacher.screen


def test_plain_sentences(terminal: Callable[..., Terminal]) -> None:
    teacher = terminal(*WALK, "--plain")
    teacher.ask("rr\r", after=r"right: free\.")
    teacher.ask("auto\r", after=r"The robot is at row 0, column 2\.")
    assert teacher.end() == 0
    asked = teacher.screen[: teacher.screen.index("advice has ended")]
    assert asked.isascii()


# ---- through a pipe -------------------------------------------------------------------------------------------------


@pytest.fixture
def piped(lab: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LAB_TOOLBOX", str(tmp_path / "toolbox"))
    return lambda answers: lab(*INSERT, "--json", stdin=answers)


def test_piped_answers(piped: Callable[[str], Any]) -> None:
    ran = piped("right\nskip\n?\nauto\n")
    assert ran.code == 0
    assert (ran.json["requests"], ran.json["helped_steps"]) == (1, 1)
    assert ran.out.count("\n") == 1
    assert f"{QUESTION} [enter = ↑ forward, ? explains] right\n" in ran.err
    assert ran.err.count(QUESTION) == 4
    assert "\x1b" not in ran.err


@pytest.mark.parametrize("answers", ["", "right\n", "right"])
def test_the_end_of_the_answers_ends_advice(piped: Callable[[str], Any], answers: str) -> None:
    ran = piped(answers)
    assert (ran.code, ran.json["helped_steps"]) == (0, bool(answers))
    assert "No more answers: the learner goes on alone." in ran.err


STRICT = """
name = "strict"
kind = "world"
shape = [3, 5]
start = [0, 0]
goal = [2, 4]
[learner]
max_steps = 20
[gate]
gate = "ccrl"
first_episode = 10
omega = 2
"""


def test_a_bad_adviser_is_told_so_with_the_numbers(lab: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "strict.toml").write_text(STRICT)
    words = ("teach", str(tmp_path / "strict.toml"), "--advisor", "terminal", "--toolbox", str(tmp_path / "toolbox"))
    ran = lab(*words, "--json", stdin="99u\n" * 9)
    assert ran.json["misleads"] == 3
    episode = ran.json["rejected_at_episode"]
    said = " ".join(ran.err.split())
    assert "Your advice did not help in 2 of 2 episodes; it tolerates 2." in said
    assert "↑ up: that leads nowhere: given all the same." in said
    assert "The learner takes no more advice (episodes misled: 3, tolerated: 2)." in said
    assert f"Episode {episode} counted 21 steps, those before it " in said


def test_ctrl_c_at_a_piped_question(tmp_path: Path, root: Path) -> None:
    (tmp_path / "maze.txt").write_text(MAZE)
    env = {**os.environ, "LAB_TOOLBOX": str(tmp_path / "toolbox"), "PYTHONPATH": str(root)}
    with subprocess.Popen(
        [sys.executable, "-c", LISTENING + CODE, *WALK, "--json"],
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
    assert (lab.returncode, json.loads(out)["exit_code"]) == (130, 130)
    assert re.search(r"lab: stopped by Ctrl-C after 0 episodes of 'maze'", (said + rest).decode())
    (row,) = Toolbox(tmp_path / "toolbox").list()
    assert (row["episodes"], row["helped_steps"]) == (0, 0)
