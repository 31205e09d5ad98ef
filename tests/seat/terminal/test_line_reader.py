"""Reading a line: a terminal's keys, plain lines, and words from another thread."""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO, TextIOWrapper

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from rich.console import Console

from lab.seat.terminal import line_reader as reader
from lab.seat.terminal.line_reader import Outside, PlainReader, Reader, TerminalReader, default_reader


def console() -> Console:
    return Console(file=StringIO(), width=100)


def said(console: Console) -> str:
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


@contextmanager
def keys(typed: str) -> Iterator[TerminalReader]:
    with create_pipe_input() as pipe:
        pipe.send_text(typed)
        yield TerminalReader(console(), pipe, DummyOutput())


@contextmanager
def piped(*, console: Console) -> Iterator[tuple[PlainReader, int]]:
    """A reader of one end of a pipe, and the other end."""
    ours, theirs = os.pipe()
    with TextIOWrapper(os.fdopen(ours, "rb"), encoding="utf-8") as stream:
        yield PlainReader(console, stream), theirs


# ---- a terminal's keys ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("down\r", "down"),
        ("\x1b[A", "↑"),  # an arrow key answers at once
        ("\x1b[D", "←"),
        ("\r", ""),
        ("x\x7fu\r", "u"),
        ("ab\x1b[Dc\r", "acb"),  # in a word it moves
        ("path \x1b[C\x1b[C\x1b[A\r", "path →→↑"),  # and after "path" it draws
        ("\x1bOP", "the key f1"),
        ("\x1b[5~", "the key pageup"),
        ("\t", "the key tab"),
    ],
)
def test_keys(typed: str, line: str) -> None:
    with keys(typed) as read:
        assert read("?") == line


def test_where_a_key_is_no_move_it_edits() -> None:
    with create_pipe_input() as pipe:
        pipe.send_text("\x1b[A\x1b[Dab\x1b[Dc\r")
        assert TerminalReader(console(), pipe, DummyOutput(), moves=False)("?") == "acb"


def test_typing_ahead_answers_the_next_question() -> None:
    with keys("\x1b[Aright\r") as read:
        assert [read("?"), read("?")] == ["↑", "right"]


def test_ctrl_d_and_ctrl_c() -> None:
    with keys("\x04") as read, pytest.raises(EOFError):
        read("?")
    with keys("in a word\x03") as read, pytest.raises(KeyboardInterrupt):
        read("?")


# ---- plain lines ----------------------------------------------------------------------------------------------------


def test_plain_lines_are_shown_after_their_question() -> None:
    shown = console()
    read = PlainReader(shown, StringIO("right\nup\x1b[2J"))
    assert [read("A? "), read("B? ")] == ["right\n", "up\x1b[2J"]
    with pytest.raises(EOFError):
        read("C? ")
    assert said(shown) == "A? right\nB? up\\x1b[2J\nC? \n"


def test_lines_of_a_pipe_come_whole() -> None:
    shown = console()
    with piped(console=shown) as (read, other):
        os.write(other, b"re")
        os.write(other, "chts\nüber\nrest".encode())
        os.close(other)
        assert [read("? "), read("? "), read("? ")] == ["rechts\n", "über\n", "rest"]
        with pytest.raises(EOFError):
            read("? ")
    assert said(shown) == "? rechts\n? über\n? rest\n? \n"


def test_the_reader_fits_the_input(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tty(StringIO):
        def isatty(self) -> bool:
            return True

    def at_terminal(console: Console, outside: Outside | None, moves: bool) -> Reader:
        return PlainReader(console, StringIO("with keys\n" if moves else "edited\n"), outside)

    monkeypatch.setattr(reader, "TerminalReader", at_terminal)
    monkeypatch.setenv("TERM", "xterm")
    assert default_reader(console(), Tty())("?") == "with keys\n"
    assert default_reader(console(), Tty(), moves=False)("?") == "edited\n"
    assert default_reader(console(), Tty("typed\n"), plain=True)("?") == "typed\n"
    monkeypatch.setenv("TERM", "dumb")
    assert default_reader(console(), Tty("typed\n"))("?") == "typed\n"
    monkeypatch.setattr("sys.stdin", StringIO("piped\n"))
    assert default_reader(console())("?") == "piped\n"


# ---- words from outside ---------------------------------------------------------------------------------------------


def test_a_word_from_outside_counts_only_while_a_question_waits() -> None:
    outside = Outside()
    outside.answer("early")
    with outside.question():
        assert outside.taken() is None
        outside.answer("right")
        outside.answer("up")
        assert outside.taken() == "right"
    assert outside.taken() is None
    outside.answer("late")
    with outside.question():
        assert outside.taken() is None


def test_a_word_from_another_thread_ends_a_terminals_prompt() -> None:
    """The thread speaks when the prompt listens; afterwards the keyboard is read as before."""
    with create_pipe_input() as pipe:
        read = TerminalReader(console(), pipe, DummyOutput())
        assert _answered(read, lambda: read("?"), "right") == "right"
        pipe.send_text("left\r")
        assert read("?") == "left"


def test_what_was_half_typed_gives_way_to_a_word_from_outside() -> None:
    with create_pipe_input() as pipe:
        read = TerminalReader(console(), pipe, DummyOutput())
        pipe.send_text("lef")
        assert _answered(read, lambda: read("?"), "up") == "up"


def test_a_word_that_came_before_the_prompt_ends_it() -> None:
    with create_pipe_input() as pipe:
        read = TerminalReader(console(), pipe, DummyOutput())
        with read.outside.question():
            read.outside.answer("right")
            assert read("?") == "right"


def test_a_word_from_another_thread_ends_a_read_of_a_pipe() -> None:
    shown = console()
    with piped(console=shown) as (read, other):
        os.write(other, b"le")  # of a line that is not whole yet
        assert _answered(read, lambda: read("? "), "right") == "right\n"
        os.write(other, b"ft\n")
        assert read("? ") == "left\n"
        os.close(other)
    assert said(shown) == "? right\n? left\n"


def test_what_comes_after_a_word_from_outside_is_there_for_the_next_reader_of_the_stream() -> None:
    shown = console()
    with piped(console=shown) as (read, other):
        assert _answered(read, lambda: read("? "), "right") == "right\n"
        os.write(other, b"left\nup\n")
        assert read("? ") == "left\n"
        assert PlainReader(shown, read._stream)("? ") == "up\n"
        os.close(other)


def _answered(read: TerminalReader | PlainReader, ask: Callable[[], str], word: str) -> str:
    """What a question returns that another thread answers as soon as somebody reads."""
    listens = threading.Event()
    waking = read.outside.waking

    @contextmanager
    def noticed(wake: Callable[[], None]) -> Iterator[None]:
        with waking(wake):
            listens.set()
            yield

    read.outside.waking = noticed  # type: ignore[method-assign]

    def speak() -> None:
        listens.wait()
        read.outside.answer(word)

    thread = threading.Thread(target=speak)
    thread.start()
    with read.outside.question():
        try:
            return ask()
        finally:
            thread.join()
            del read.outside.waking
