"""The list of the sessions in a toolbox; damaged ones have rows, too."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from lab.advice.entries import FILE, read_journal
from lab.errors import BadInput
from lab.teaching.kept_order import OrderSessionOptions
from lab.teaching.lesson_options import LessonOptions
from lab.toolbox.names import SESSIONS
from lab.toolbox.registry import Toolbox

_OPTIONS = (LessonOptions, OrderSessionOptions)


def session_rows(toolbox: Toolbox) -> list[dict[str, Any]]:
    """A row per session in a toolbox, the last changed first: folder, problem, advisors, state, and why it is damaged.

    Sessions in folders elsewhere are links; links to removed folders are left out. Raises BadInput if the toolbox is a file.
    """
    if toolbox.folder.exists() and not toolbox.folder.is_dir():
        raise BadInput(f"toolbox {toolbox.folder}: it is a file, a folder is needed")
    changed: dict[Path, float] = {}
    for path in (toolbox.folder / SESSIONS).glob(f"*/{FILE}"):
        with suppress(OSError, RuntimeError):  # it has been removed, or links form a loop
            folder = path.resolve()
            changed[folder] = folder.stat().st_mtime
    return [_row(path) for path in sorted(changed, key=lambda path: changed[path], reverse=True)]


def _row(path: Path) -> dict[str, Any]:
    """The row of one journal."""
    row = {"session": str(path.parent), "problem": "", "advisor": "", "state": "damaged", "why": ""}
    try:
        read = read_journal(path, "toolbox")
        kind = next((kind for kind in _OPTIONS if kind.command == read.session.command), LessonOptions)
        options = kind.from_json(read.session.words, f"journal '{path}' (toolbox)")
    except BadInput as error:
        return row | {"why": str(error)}
    state = "not over" if read.closed is None else "solved" if read.closed.solved else "over"
    return row | {"problem": read.session.problem, "advisor": " + ".join(options.advisors), "state": state}
