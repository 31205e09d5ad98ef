"""The output of commands: a document to stdout, as JSON or as text, and everything else to stderr. Only this file prints."""

import json
import os
import sys
import warnings
from collections.abc import Callable
from typing import Any, NoReturn, TextIO

from lab.cli import deferred
from lab.errors import LabError, Notice, WorkFailed, escaped
from lab.lazy import rich

_FILE_WIDTH = 200  # characters; used when stdout is no terminal, so that lines are not wrapped
_PLAIN = str.maketrans("▁▂▃▄▅▆▇█·", "_.-:=+*#.")  # replacements for a stdout without Unicode


class Stdout:
    """Whether this command has printed its JSON document, of which there is exactly one."""

    told = False


def begin() -> None:
    """Mark the beginning of a command: nothing is printed yet."""
    Stdout.told = False
    warnings.showwarning = _warned


def _warned(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Print the lab's own notices in one line, and other warnings as Python does."""
    if issubclass(category, Notice):
        complain(str(message))
    else:
        sys.stderr.write(escaped(warnings.formatwarning(message, category, *where[:2])))


def write(text: str) -> None:
    """Write text to stdout immediately; unprintable characters, as in a file that is shown, are escaped."""
    _print(escaped(text))


def _print(text: str) -> None:
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        silence()
        Stdout.told = True  # this output is lost, and another document would be lost as well
        raise WorkFailed(f"what is printed cannot be written to stdout: {error.strerror or error}") from error


def write_json(document: dict[str, Any]) -> None:
    """Print the command's only JSON document, in one line."""
    Stdout.told = True
    write(json.dumps(document, allow_nan=False) + "\n")


def fail(message: str, code: int) -> None:
    """Report in one line why a command ends; with --json also as its document, unless one was printed already."""
    line = LabError(" ".join(message.split()))
    complain(str(line))
    if "--json" in sys.argv[1:] and not Stdout.told:
        try:
            write_json({"error": str(line), "exit_code": code})
        except BrokenPipeError:
            silence()


def end(message: str, code: int) -> NoReturn:
    """End the command with a message and an exit code; "": no message."""
    if message:
        fail(message, code)
    sys.exit(code)


def complain(message: str) -> None:
    """Write one line to stderr, whatever characters the message contains."""
    try:
        sys.stderr.write(f"lab: {LabError(' '.join(message.split()))}\n")
        sys.stderr.flush()
    except OSError:  # stderr is closed; the exit code remains
        silence(sys.stderr)


def silence(stream: TextIO | None = None) -> None:
    """Redirect a stream (stdout by default) that nobody reads any more to nowhere, for the interpreter's last flush."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


def console() -> "rich.console.Console":
    """The console of stderr."""
    return deferred.EscapingConsole(stderr=True, highlight=False)


def show(
    document: dict[str, Any], as_json: bool, render: Callable[[dict[str, Any]], "rich.console.RenderableType"]
) -> None:
    """Print a document as JSON, or as text made by `render`."""
    if as_json:
        write_json(document)
        return
    console = deferred.EscapingConsole(highlight=False, width=None if sys.stdout.isatty() else _FILE_WIDTH)
    with console.capture() as shown:
        console.print(render(document), soft_wrap=not sys.stdout.isatty())
    text = "".join(f"{line.rstrip()}\n" for line in shown.get().splitlines())
    _print(text if console.encoding.lower().startswith("utf") else text.translate(_PLAIN))
