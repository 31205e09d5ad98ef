"""Files are written whole or not at all, and folders are looked at before anything is made."""

import os
from pathlib import Path
from secrets import token_hex


def write_whole(path: Path, content: bytes) -> None:
    """Writes beside the target, then renames: readers see the old file or the new one, never half of one.

    The folder must be there. Raises OSError when it cannot be written; then nothing is left behind.
    """
    beside = path.with_name(f".{path.name}.{token_hex(4)}.tmp")
    try:
        with beside.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def nearest(folder: Path) -> Path:
    """The folder itself or the next one above it that is there; what is made in `folder` is made in it.

    Raises OSError for a name that cannot be.
    """
    place = folder
    while not place.exists() and place != place.parent:
        place = place.parent
    return place
