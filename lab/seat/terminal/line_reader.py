"""Readers of a person's lines: at a terminal with arrow keys, from a plain stream, or from another thread meanwhile."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Protocol, TextIO, cast
from weakref import WeakKeyDictionary

from rich.console import Console
from rich.text import Text

from lab.errors import printable
from lab.lazy import prompt_toolkit
from lab.seat.grid_text import ARROWS, DIRECTIONS

ReadLine = Callable[[str], str]
LOOK_S = 0.5  # longest delay of Ctrl-C on Windows, where nothing interrupts a wait
OTHER_KEYS = ("tab", "pageup", "pagedown", "insert", *(f"f{n}" for n in range(1, 13)))


class Outside:
    """Answers from another thread, such as a page's, to the pending question; safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._open = False
        self._words: list[str] = []
        self._wake: Callable[[], None] | None = None

    @contextmanager
    def question(self) -> Iterator[None]:
        """A context in which a question is pending; answers before and after it have no effect."""
        with self._lock:
            self._open = True
        try:
            yield
        finally:
            with self._lock:
                self._open = False
                self._words.clear()

    @contextmanager
    def waking(self, wake: Callable[[], None]) -> Iterator[None]:
        """A context in which `wake` is called, from any thread, when an answer arrives."""
        with self._lock:
            self._wake = wake
            if self._words:
                wake()
        try:
            yield
        finally:
            with self._lock:
                self._wake = None

    def answer(self, word: str) -> None:
        """Answer the pending question with a word, as if it were typed."""
        with self._lock:
            if not self._open:
                return
            self._words.append(word)
            if self._wake is not None:
                self._wake()

    def taken(self) -> str | None:
        """The word that has arrived, which is then removed; None for none."""
        with self._lock:
            return self._words.pop(0) if self._words else None


def default_reader(
    console: Console,
    stdin: TextIO | None = None,
    *,
    plain: bool = False,
    outside: Outside | None = None,
    moves: bool = True,
) -> "Reader":
    """The reader with arrow keys for a terminal that supports them, else one of plain lines; `plain`: always plain lines.

    `moves`: whether an arrow key answers with a move; otherwise it only edits.
    """
    stream = stdin or sys.stdin
    if plain or not stream.isatty():
        return PlainReader(console, stream, outside)
    if prompt_toolkit.utils.is_dumb_terminal():
        return PlainReader(console, stream, outside)
    return TerminalReader(console, outside=outside, moves=moves)


class Reader(Protocol):
    """Shows a prompt and returns one line, or an answer from another thread; raises EOFError at the end of the input."""

    outside: Outside

    def __call__(self, prompt: str) -> str:
        """One line, with or without its end."""


class PlainReader:
    """Reads lines of a stream, and echoes those that were not typed on the screen."""

    def __init__(self, console: Console, stream: TextIO, outside: Outside | None = None) -> None:
        self.outside = outside or Outside()
        self._console = console
        self._stream = stream
        self._typed = self.confirms = stream.isatty()
        self._bytes: _Stream | None
        try:
            self._bytes = _STREAMS.setdefault(stream, _Stream(stream.fileno()))
        except OSError:  # text in memory
            self._bytes = None

    def __call__(self, prompt: str) -> str:
        """One line with its end."""
        try:
            self._console.print(Text(prompt), end="")
            line, typed = self._next()
        except KeyboardInterrupt:
            self._console.print()  # the next output begins a new line
            raise
        if not typed or not line:
            self._console.print(Text(printable(line.rstrip("\r\n"))), soft_wrap=True)
        if not line:
            raise EOFError
        return line

    def _next(self) -> tuple[str, bool]:
        """The next line, and whether it is on the screen already."""
        if self._bytes is None:
            return self.outside.taken() or self._stream.readline(), False
        with self.outside.waking(self._bytes.wake):
            while (line := self._bytes.line()) is None:
                if (word := self.outside.taken()) is not None:
                    return f"{word}\n", False
        text = line.decode(self._stream.encoding, "replace")
        return text, self._typed and text.endswith("\n")


class _Stream:
    """The lines of a file descriptor, read by a thread: on Windows, only a thread can wait for a line and an answer at once.

    It reads when a line is requested. A line that arrives after an answer from outside is kept for the next request.
    """

    def __init__(self, file: int) -> None:
        self._file, self._left, self._reads = file, b"", False
        self._arrived: SimpleQueue[bytes | None] = SimpleQueue()  # None: somebody has woken it

    def wake(self) -> None:
        """Make `line` return; called from any thread."""
        self._arrived.put(None)

    def line(self) -> bytes | None:
        """The next line with its end, the last one without, b"" after that; None when it was woken."""
        while b"\n" not in self._left:
            if not self._reads:
                self._reads = True
                Thread(target=self._read, daemon=True).start()
            try:
                more = self._arrived.get(timeout=LOOK_S)
            except Empty:
                continue
            if more is None:
                return None
            self._reads = False
            self._left += more
            if not more:
                line, self._left = self._left, b""
                return line
        line, end, self._left = self._left.partition(b"\n")
        return line + end

    def _read(self) -> None:
        try:
            more = os.read(self._file, 65536)
        except OSError:  # it was closed
            more = b""
        self._arrived.put(more)


_STREAMS: "WeakKeyDictionary[TextIO, _Stream]" = WeakKeyDictionary()


class TerminalReader:
    """Line editing with history; with `moves`, an arrow key on an empty line answers at once, after "path" it draws an arrow.

    confirms: a person types here, who agrees to what was understood of a sentence before it counts.
    """

    confirms = True

    def __init__(
        self,
        console: Console,
        keys: "prompt_toolkit.input.Input | None" = None,
        screen: "prompt_toolkit.output.Output | None" = None,
        outside: Outside | None = None,
        *,
        moves: bool = True,
    ) -> None:
        self.outside = outside or Outside()
        output = screen or prompt_toolkit.output.create_output(stdout=cast(TextIO, console.file))
        if isinstance(output, prompt_toolkit.output.vt100.Vt100_Output):
            output.enable_cpr = (
                False  # one line needs no cursor position, and over a slow link the reply would come too late
            )
        self._session: prompt_toolkit.PromptSession[str] = prompt_toolkit.PromptSession(
            input=keys, output=output, key_bindings=_keys() if moves else None
        )

    def __call__(self, prompt: str) -> str:
        """One line without its end."""
        with ExitStack() as stack:
            return self._session.prompt(prompt, pre_run=lambda: self._listen(stack))

    def _listen(self, stack: ExitStack) -> None:
        """Let an answer from another thread end the prompt, until the prompt ends."""
        from asyncio import get_running_loop

        loop, app = get_running_loop(), self._session.app

        def wake() -> None:
            with suppress(RuntimeError):  # the loop has ended: the answer is kept for the next line, if there is one
                loop.call_soon_threadsafe(self._deliver, app)

        stack.enter_context(self.outside.waking(wake))

    def _deliver(self, app: "prompt_toolkit.application.Application[str]") -> None:
        if app.is_done:
            return  # it is answered already
        word = self.outside.taken()
        if word is not None:
            _enter(app, word)


def _enter(app: "prompt_toolkit.application.Application[str]", word: str) -> None:
    """Put a word on the line and press enter."""
    app.current_buffer.text = word
    app.current_buffer.validate_and_handle()


def _keys() -> "prompt_toolkit.key_binding.KeyBindings":
    bindings = prompt_toolkit.key_binding.KeyBindings()
    is_empty = prompt_toolkit.filters.Condition(lambda: not prompt_toolkit.application.get_app().current_buffer.text)
    is_path = prompt_toolkit.filters.Condition(
        lambda: prompt_toolkit.application.get_app().current_buffer.text.startswith("path ")
    )

    def bind(key: str, word: str) -> None:
        @bindings.add(key, filter=is_empty)
        def _answer(event: "prompt_toolkit.key_binding.KeyPressEvent") -> None:
            _enter(event.app, word)

    def insert(key: str, arrow: str) -> None:
        @bindings.add(key, filter=is_path)
        def _insert(event: "prompt_toolkit.key_binding.KeyPressEvent") -> None:
            event.current_buffer.insert_text(arrow)

    for key, arrow in zip(DIRECTIONS, ARROWS, strict=True):
        bind(key, arrow)
        insert(key, arrow)
    for key in OTHER_KEYS:
        bind(key, f"the key {key}")
    return bindings
