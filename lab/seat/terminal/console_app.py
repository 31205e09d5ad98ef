"""The operator's console at a terminal: a live panel, keys that act at once, and a line for commands."""

import sys
from contextlib import suppress
from io import StringIO
from threading import Thread

from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import WordCompleter
from prompt_toolkit.filters import Condition
from prompt_toolkit.formatted_text import ANSI
from prompt_toolkit.input import Input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import BufferControl, FormattedTextControl, HSplit, Layout, Window
from prompt_toolkit.layout.processors import BeforeInput
from prompt_toolkit.output import Output, create_output
from rich.text import Text

from lab.errors import printable
from lab.production.operation.commands import COMMANDS, Done, help_lines
from lab.production.operation.desk import Desk
from lab.seat.terminal.console_view import plain_lines, view
from lab.seat.terminal.screen import folded
from lab.view.progress import EscapingConsole

STEP_MM, TURN_DEGREES = 10, 15
ESCAPE_S = 0.025  # after Esc, until it cannot be the beginning of an arrow key's sequence
REFRESH_S = 0.2
MOST_LOG, LOG_LINES = 200, 6
STOPS = ("escape", "c-x")  # keys that stop the run at any time
KEYS = {  # on an empty line
    " ": "pause, go on",
    "s": "step",
    "r": "reset",
    "left": f"jog -x {STEP_MM}",
    "right": f"jog +x {STEP_MM}",
    "up": f"jog +y {STEP_MM}",
    "down": f"jog -y {STEP_MM}",
    "pageup": f"jog +z {STEP_MM}",
    "pagedown": f"jog -z {STEP_MM}",
    "[": f"rotate -{TURN_DEGREES}",
    "]": f"rotate {TURN_DEGREES}",
    "o": "open",
    "c": "close",
    "h": "home",
    "g": "grasp",
}
HINTS = (
    "Esc ^X stop | space pause, go | s step | r reset | a command, or help | ^C leave",
    f"arrows PgUp PgDn jog {STEP_MM} mm | [ ] turn | o open | c close | h home | g grasp",
)
LETTER_S = 0.4  # a letter followed by nothing for this time is a key, otherwise the first letter of a command


class OperatorConsole:
    """The console: `run` returns when the operator leaves; the simulation runs in a thread of its own."""

    def __init__(self, desk: Desk, keys: Input | None = None, screen: Output | None = None) -> None:
        self._desk = desk
        self._log: list[tuple[str, str]] = []
        self._answer = 0  # number of log lines in the answer to the last command
        self._error: BaseException | None = None
        desk.operation.on_done.append(self._done)
        self._app = self._made(keys, screen)

    def run(self) -> None:
        """Show the panel and take keys and commands. Raises what the simulation raised, KeyboardInterrupt for Ctrl-C."""
        worker = Thread(target=self._simulate, name="simulation", daemon=True)
        worker.start()
        try:
            self._app.run()
        finally:
            self._desk.leave()
            worker.join()
        if self._error is not None:
            raise self._error

    def _simulate(self) -> None:
        try:
            self._desk.serve()
        except Exception as error:  # raised again in the thread of the console
            self._error = error
        finally:
            loop = self._app.loop
            if loop is not None:
                loop.call_soon_threadsafe(self._leave)

    def _leave(self) -> None:
        if self._app.is_running and not self._app.is_done:
            self._app.exit()

    # ---- commands and their results ----------------------------------------------------------------------------------

    def say(self, line: str) -> None:
        """Carry out a typed line, or the command of a key."""
        word = line.split()[0].lower() if line.split() else ""
        before = len(self._log)
        match word:
            case "":
                return
            case "quit":
                self._leave()
            case "help":
                self._log += [(text, "") for text in help_lines()]
            case "status":
                self._log += [(text, "") for text in plain_lines(self._desk.now())]
            case _:
                self._desk.say(line)
        self._answer = len(self._log) - before
        del self._log[:-MOST_LOG]

    def _done(self, done: Done) -> None:
        """Show the result of a command; called in any thread."""
        if done.refused:
            self._log.append((f"{done.words}: refused: {done.refused}", "yellow"))
        elif done.failed:
            self._log.append((f"{done.words}: {done.failed}", "bold red"))
        else:
            self._log.append((f"{done.words}: {done.said or 'done'}", "green"))
        loop = self._app.loop
        if loop is not None:
            with suppress(RuntimeError):  # it has just ended
                loop.call_soon_threadsafe(self._app.invalidate)

    # ---- the screen and its keys -------------------------------------------------------------------------------------

    def _made(self, keys: Input | None, screen: Output | None) -> Application[None]:
        def entered(buffer: Buffer) -> bool:
            self.say(buffer.text.removeprefix(":"))
            return False

        line = Buffer(multiline=False, accept_handler=entered, completer=WordCompleter([*COMMANDS]))
        panel = FormattedTextControl(lambda: ANSI(self._drawn()))
        below = Window(BufferControl(line, [BeforeInput("> ")]), height=1)
        app: Application[None] = Application(
            Layout(HSplit([Window(panel, always_hide_cursor=True), below]), focused_element=below),
            key_bindings=self._bindings(line),
            full_screen=True,
            input=keys,
            output=screen or create_output(stdout=sys.stderr),  # stdout is for the document
            refresh_interval=REFRESH_S,
        )
        app.ttimeoutlen = app.timeoutlen = ESCAPE_S
        return app

    def _bindings(self, line: Buffer) -> KeyBindings:
        bindings, is_empty = KeyBindings(), Condition(lambda: not line.text)

        def bind(key: str, words: str) -> None:
            def act() -> None:
                if key == " ":
                    self._pause()
                else:
                    self.say(words)

            def alone() -> None:
                if line.text == key:
                    line.reset()
                    act()

            @bindings.add(key, filter=is_empty)
            def _pressed(event: KeyPressEvent) -> None:
                if not key.isalpha() or len(key) > 1:
                    act()
                    return
                line.insert_text(key)
                assert event.app.loop is not None
                event.app.loop.call_later(LETTER_S, alone)

        for key, words in KEYS.items():
            bind(key, words)
        for key in STOPS:

            @bindings.add(key, eager=True)
            def _stop(event: KeyPressEvent) -> None:
                self._desk.say("stop")

        @bindings.add("c-c")
        def _interrupted(event: KeyPressEvent) -> None:
            event.app.exit(exception=KeyboardInterrupt("stopped by Ctrl-C; what was done is kept"))

        @bindings.add("c-d", filter=is_empty)
        def _over(event: KeyPressEvent) -> None:
            event.app.exit()

        @bindings.add("tab")
        def _complete(event: KeyPressEvent) -> None:
            line.complete_next() if line.complete_state else line.start_completion(insert_common_part=True)

        return bindings

    def _pause(self) -> None:
        """The space bar: pause, or continue."""
        self._desk.say("pause" if self._desk.operation.controls.held is None else "go")

    def _drawn(self) -> str:
        size = self._app.output.get_size()
        width, height = size.columns, size.rows - 1
        log = self._log[-self._log_room(height) :]
        told = [line for text, style in log for line in folded([printable(text)], width, style)][
            -self._log_room(height) :
        ]
        hints = [Text(hint, "dim") for hint in HINTS]
        room = max(height - len(hints) - len(told), 0)
        lines = view(self._desk.now(), self._desk.busy, width, room)
        lines += [Text()] * (room - len(lines))
        return _ansi([*lines, *told, *hints], width)

    def _log_room(self, height: int) -> int:
        """The number of lines for results of commands: a long answer is shown whole until the next command."""
        return max(LOG_LINES, min(self._answer, height - len(HINTS)))


def _ansi(lines: list[Text], width: int) -> str:
    """The lines as text with escape codes for their colours."""
    out = StringIO()
    console = EscapingConsole(file=out, force_terminal=True, color_system="standard", width=width, legacy_windows=False)
    for number, line in enumerate(lines):
        line.truncate(width)
        console.print(line, end="\n" if number < len(lines) - 1 else "", no_wrap=True, overflow="crop", crop=True)
    return out.getvalue()
