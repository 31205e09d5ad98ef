"""The console with its keys: what each says, letters that begin a command, and the stop whatever is typed."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from threading import Thread

import pytest
from prompt_toolkit.data_structures import Size
from prompt_toolkit.input import PipeInput, create_pipe_input
from prompt_toolkit.output import DummyOutput

from lab.production.composer import Conditions
from lab.production.operation.desk import Desk
from lab.production.operation.operation import Operation
from lab.seat.terminal.console_app import HINTS, LETTER_S, OperatorConsole
from lab.seat.terminal.console_view import PlainConsole
from lab.tasks.task_file import load
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox

PATIENCE_S = 30.0


class Small(DummyOutput):
    """A screen of 80 x 24."""

    def get_size(self) -> Size:
        return Size(rows=24, columns=80)


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    task = load("toast")
    operation = Operation(task, task.order(1), 0, Teacher(Toolbox(tmp_path)), Conditions())
    yield Desk(operation)
    operation.close()


def until(what: Callable[[], object]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < end_s, "it does not come"
        time.sleep(0.005)


@contextmanager
def at_keys(desk: Desk, typed: Callable[[PipeInput, OperatorConsole], None]) -> Iterator[None]:
    """The console at work while another thread types; it leaves at the end."""
    with create_pipe_input() as pipe:
        console = OperatorConsole(desk, pipe, Small())
        failed: list[BaseException] = []

        def type_all() -> None:
            try:
                desk.settle()
                typed(pipe, console)
            except BaseException as error:
                failed.append(error)
            finally:
                pipe.send_text("\x15quit\r")  # after whatever is on the line

        hands = Thread(target=type_all)
        hands.start()
        console.run()
        hands.join()
        if failed:
            raise failed[0]
        yield


def said(desk: Desk) -> list[str]:
    return [done.words for done in desk.operation.done]


def test_keys_act_and_letters_begin_a_command(desk: Desk) -> None:
    def typed(pipe: PipeInput, console: OperatorConsole) -> None:
        for key in ("\x1b[A", "\x1b[6~", "]", "o", "g"):
            count = len(said(desk))
            pipe.send_text(key)
            until(lambda count=count: len(said(desk)) > count)  # type: ignore[misc]
        pipe.send_text("open\r")  # its first letter is a key
        until(lambda: len(said(desk)) > 5)
        pipe.send_text(":jog +x 5\r")
        until(lambda: len(said(desk)) > 6)

    with at_keys(desk, typed):
        assert said(desk) == ["jog +y 10", "jog -z 10", "rotate 15", "open", "grasp", "open", "jog +x 5"]


@pytest.mark.parametrize("key", ["\x18", "\x1b"])
def test_the_stop_is_heard_whatever_is_typed(desk: Desk, key: str) -> None:
    def typed(pipe: PipeInput, console: OperatorConsole) -> None:
        pipe.send_text("order 1 2")
        pipe.send_text(key)
        until(lambda: desk.now().held)
        assert desk.now().held.kind == "emergency"  # type: ignore[union-attr]
        pipe.send_text("\x15")
        pipe.send_text(" ")  # go on: not after an emergency stop
        until(lambda: len(said(desk)) == 2)
        assert "reset it first" in desk.operation.done[-1].refused
        pipe.send_text("r")
        until(lambda: len(said(desk)) == 3)
        assert desk.now().held.kind == "pause"  # type: ignore[union-attr]

    with at_keys(desk, typed):
        assert said(desk) == ["stop", "go", "reset"]


def test_the_screen_shows_the_run_and_every_line_of_help(desk: Desk) -> None:
    def typed(pipe: PipeInput, console: OperatorConsole) -> None:
        drawn = console._drawn()
        assert "toaster" in drawn
        assert all(len(hint) <= 80 for hint in HINTS)
        assert len(drawn.splitlines()) == 23
        pipe.send_text(":help\r")
        until(lambda: "quit" in console._drawn())
        assert len(console._drawn().splitlines()) == 23
        pipe.send_text(":opne\r")
        until(lambda: "did you mean 'open'?" in console._drawn())

    with at_keys(desk, typed):
        assert not desk.operation.done[-1].well


def test_a_letter_waits_no_longer_than_a_person_notices() -> None:
    assert LETTER_S <= 0.5


# ---- from a pipe -----------------------------------------------------------------------------------------------------


def test_lines_of_a_pipe_are_carried_out_in_turn(desk: Desk) -> None:
    out = StringIO()
    lines = ["jog +z 20\n", "\n", "status\n", "pause\n", "go\n", "quit\n", "open\n"]
    assert PlainConsole(desk, lambda line: print(line, file=out)).run(lines) is None
    assert said(desk) == ["jog +z 20", "pause", "go"]
    assert out.getvalue().splitlines()[0] == "jog +z 20: done"
    assert "part slice 1: waiting at plate" in out.getvalue()


def test_a_pipe_goes_on_after_a_command_that_is_refused_and_remembers_it(desk: Desk) -> None:
    told: list[str] = []
    bad = PlainConsole(desk, told.append).run(["run\n", "pause\n", "go\n"])
    assert bad is not None
    assert bad.refused == "there is no plan yet: policy finds one"
    assert told[0] == "run: refused: there is no plan yet: policy finds one"
    assert said(desk)[-2:] == ["pause", "go"]
