"""What a command writes: its document to stdout, as JSON or as text, and everything else to stderr. Only here is printed."""

import json
import os
import sys
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

from lab.cli import deferred
from lab.errors import LabError, Notice, WorkFailed, escaped

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

_FILE_WIDTH = 200  # characters; where stdout is no terminal, nothing needs to be folded
_PLAIN = str.maketrans("▁▂▃▄▅▆▇█·", "_.-:=+*#.")  # for a stdout that is not Unicode


class Stdout:
    """Whether this command has printed its JSON document: there is one and no more, whatever comes."""

    told = False


def begin() -> None:
    """A command begins: nothing is printed yet."""
    Stdout.told = False
    warnings.showwarning = _warned


def _warned(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """What the lab itself gives notice of is said in one line; any other warning as Python says it."""
    if issubclass(category, Notice):
        complain(str(message))
    else:
        sys.stderr.write(escaped(warnings.formatwarning(message, category, *where[:2])))


def write(text: str) -> None:
    """Text to stdout, at once; what cannot be printed in it, such as an escape code in a file that is shown, as its escape."""
    _print(escaped(text))


def _print(text: str) -> None:
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        silence()
        Stdout.told = True  # what it was is lost, and another document would be as well
        raise WorkFailed(f"what is printed cannot be written to stdout: {error.strerror or error}") from error


def write_json(document: dict[str, Any]) -> None:
    """The command's one document, in one line."""
    Stdout.told = True
    write(json.dumps(document, allow_nan=False) + "\n")


def fail(message: str, code: int) -> None:
    """Say in one line why a command ends; with --json also as its document, unless that has come already."""
    line = LabError(" ".join(message.split()))
    complain(str(line))
    if "--json" in sys.argv[1:] and not Stdout.told:
        try:
            write_json({"error": str(line), "exit_code": code})
        except BrokenPipeError:
            silence()


def end(message: str, code: int) -> NoReturn:
    """End the command so. "": there is nothing to say, or nobody to hear it."""
    if message:
        fail(message, code)
    sys.exit(code)


def complain(message: str) -> None:
    """Write one line to stderr, whatever the message holds."""
    try:
        sys.stderr.write(f"lab: {LabError(' '.join(message.split()))}\n")
        sys.stderr.flush()
    except OSError:  # nobody can hear it: the exit code says it all the same
        silence(sys.stderr)


def silence(stream: TextIO | None = None) -> None:
    """Nobody reads stdout, or this stream, any more: let the interpreter's last flush go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


def console() -> "Console":
    """The terminal that stderr goes to."""
    return deferred.EscapingConsole(stderr=True, highlight=False)


def show(document: dict[str, Any], as_json: bool, render: Callable[[dict[str, Any]], "RenderableType"]) -> None:
    """Print a document as JSON, or as `render` shows it."""
    if as_json:
        write_json(document)
        return
    console = deferred.EscapingConsole(highlight=False, width=None if sys.stdout.isatty() else _FILE_WIDTH)
    with console.capture() as shown:
        console.print(render(document), soft_wrap=not sys.stdout.isatty())
    text = "".join(f"{line.rstrip()}\n" for line in shown.get().splitlines())
    _print(text if console.encoding.lower().startswith("utf") else text.translate(_PLAIN))
