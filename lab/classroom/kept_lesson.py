"""What a class keeps of a finished lesson, beside its journal: its document, and the last state of its page."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from lab.errors import LabError
from lab.files import is_file, json_of, read_limited

KEPT = "lesson.json"
MOST_BYTES = 1 << 24


def kept_lesson(folder: Path) -> dict[str, Any] | None:
    """{"document": as `lab teach --json` or `lab sequence --json` gives it, "page": its parts}; None if none can be read."""
    path = folder / KEPT
    if not is_file(path):
        return None
    with suppress(LabError, OSError, ValueError, KeyError, TypeError):
        kept = json_of(read_limited(path, MOST_BYTES))
        if isinstance(kept["document"], dict) and isinstance(kept["page"], dict):
            return dict(kept)
    return None
