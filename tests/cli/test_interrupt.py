"""Ctrl-C is heard wherever it is pressed."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.cli.interrupt import LOOKS, ctrl_c_is_heard
from lab.interrupts import uninterrupted

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran

CTRL_C = """
import os
import signal

import gymnasium


class Presses:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)


def drops():
    try:
        os.kill(os.getpid(), signal.SIGINT)
        sum(range(1000))
    except BaseException:
        pass


{on_import}


class Door(gymnasium.Env):
    observation_space = action_space = gymnasium.spaces.Discrete(2)
    steps = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return 0, {{}}

    def step(self, action):
        self.steps += 1
        if self.steps == 3:
            {on_step}
        return 1, 1.0, True, False, {{}}


gymnasium.register("LabTestCtrlC-v0", Door)
"""


@pytest.mark.parametrize(
    ("on_import", "on_step"),
    [("drops()", "pass"), ("", "Presses()"), ("", "drops()")],
    ids=["import", "callback", "call"],
)
def test_ctrl_c_that_a_library_drops_is_heard_all_the_same(
    lab: Lab, folder: Path, on_import: str, on_step: str
) -> None:
    """Where it catches everything, while it is imported and later; and in a callback, whose errors Python ignores."""
    import gymnasium

    text = CTRL_C.format(on_import=on_import, on_step=on_step)
    (folder / "lab_test_ctrl_c.py").write_text(text, encoding="utf-8")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it would be ignored
    try:
        ran = lab("teach", "gym:lab_test_ctrl_c:LabTestCtrlC-v0", "--episodes", "50000", "--gate", "never")
    finally:
        signal.signal(signal.SIGINT, before)
        gymnasium.registry.pop("LabTestCtrlC-v0", None)
        sys.modules.pop("lab_test_ctrl_c", None)
    assert (ran.code, ran.out) == (130, "")
    assert ran.err.startswith("lab: stopped by Ctrl-C")


HANGS = """
import os, signal, sys, threading

from lab.cli.interrupt import ctrl_c_is_heard

signal.signal(signal.SIGINT, signal.default_int_handler)


def main():
    with ctrl_c_is_heard():
        try:
            os.kill(os.getpid(), signal.SIGINT)
            {hangs}
        except KeyboardInterrupt:
            print("heard")


main()
"""


@pytest.mark.parametrize("hangs", ["threading.Event().wait()", "while True: pass"])
def test_ctrl_c_is_heard_where_nothing_of_the_lab_runs_any_more(root: Path, hangs: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(root)}
    ran = subprocess.run(
        [sys.executable, "-c", HANGS.format(hangs=hangs)], env=env, capture_output=True, text=True, timeout=60
    )
    assert (ran.stdout, ran.stderr) == ("heard\n", "")


@pytest.fixture
def by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """No check comes by the clock: on a busy machine one came between two that a test makes, and in another frame."""
    monkeypatch.setattr("lab.cli.interrupt.AGAIN_S", 3600.0)


@pytest.mark.usefixtures("by_hand")
def test_another_frame_in_the_place_of_one_that_is_gone_is_no_standstill() -> None:
    """A library calls the same short function again and again: its frames come to lie in one place, and it goes on all the while.

    Ctrl-C was raised in what compiled code called to make a tuple, and the process ended with a segmentation fault.
    """
    scope: dict[str, Any] = {"sys": sys}
    exec(compile("def short(): return sys._getframe()", "<library>", "exec"), scope)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with ctrl_c_is_heard():
            hear: Any = signal.getsignal(signal.SIGINT)
            try:
                for _ in range(50):
                    hear(signal.SIGALRM, scope["short"]())
                    signal.setitimer(signal.ITIMER_REAL, 0.0)
            except KeyboardInterrupt:  # which would end all tests
                pytest.fail("it was taken for a standstill")
            frame = scope["short"]()
            hear(signal.SIGALRM, frame)
            with pytest.raises(KeyboardInterrupt):
                hear(signal.SIGALRM, frame)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("by_hand")
@pytest.mark.parametrize("file", ["llvmlite/binding/ffi.py", "numba/core/dispatcher.py", "lab/handed_out.py"])
def test_what_is_not_to_be_interrupted_is_left_before_it_is_raised(file: str) -> None:
    """However long it takes, and however often it is pressed: a module was freed twice, and orders that were found were lost."""
    scope: dict[str, Any] = {"sys": sys}
    exec(compile("def short(): return sys._getframe()", os.path.join("site-packages", *file.split("/")), "exec"), scope)
    if file.startswith("lab"):
        uninterrupted(scope["short"])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with ctrl_c_is_heard():
            hear: Any = signal.getsignal(signal.SIGINT)
            frame = scope["short"]()
            try:
                for number in (*[signal.SIGALRM] * 2 * LOOKS, signal.SIGINT):
                    hear(number, frame)
                    signal.setitimer(signal.ITIMER_REAL, 0.0)
            except KeyboardInterrupt:  # which would end all tests
                pytest.fail("it was raised there")
            with pytest.raises(KeyboardInterrupt):
                hear(signal.SIGALRM, sys._getframe())
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    finally:
        signal.signal(signal.SIGINT, before)


EARLY = """
import os, signal, sys

signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it would be ignored


class Presses:
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.SIGINT)


sys.meta_path.insert(0, Presses())
from lab.cli import main
sys.argv = ["lab", "task", "show", "world-1"]
main()
"""


@pytest.mark.parametrize(
    "module", ["lab.cli.interrupt", "lab.cli.app", "typer", "lab.errors", "lab.cli.task", "lab.cli.families"]
)
def test_ctrl_c_while_the_command_is_loaded(root: Path, module: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(root)}
    code = EARLY.format(module=module)
    ran = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (130, "lab: stopped by Ctrl-C\n")
