"""What a command writes: its document to stdout, as JSON or as text, and everything else to stderr."""

import json
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from lab.errors import LabError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

_FILE_WIDTH = 200  # characters; where stdout is no terminal, nothing needs to be folded
_PLAIN = str.maketrans("▁▂▃▄▅▆▇█·", "_.-:=+*#.")  # for a stdout that is not Unicode


def end(message: str, code: int) -> NoReturn:
    if message:
        complain(message)
    raise typer.Exit(code)


def complain(message: str) -> None:
    """Write one line to stderr, whatever the message holds."""
    sys.stderr.write(f"lab: {LabError(' '.join(message.split()))}\n")


def silence() -> None:
    """Nobody reads stdout any more: let the interpreter's last flush go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def console() -> "Console":
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def show(document: dict[str, Any], as_json: bool, render: Callable[[dict[str, Any]], "RenderableType"]) -> None:
    if as_json:
        print(json.dumps(document, allow_nan=False))
        return
    from rich.console import Console

    console = Console(highlight=False, width=None if sys.stdout.isatty() else _FILE_WIDTH)
    with console.capture() as shown:
        console.print(render(document), soft_wrap=not sys.stdout.isatty())
    text = "\n".join(line.rstrip() for line in shown.get().splitlines())
    print(text if console.encoding.lower().startswith("utf") else text.translate(_PLAIN))
