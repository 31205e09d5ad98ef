"""Where a toolbox keeps its bytes: the few calls that a local folder and an address elsewhere both have."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple, Protocol

from lab.errors import BadInput
from lab.files import MOST_BYTES, read_limited

MAX_FILE_BYTES = MOST_BYTES


class FileState(NamedTuple):
    """A file's size, and a stamp that changes when the file does; "" when that cannot be told yet."""

    size_bytes: int
    stamp: str


class Place(Protocol):
    """Files by name, such as "insert.safetensors" or "versions/insert/0001-1a2b3c4d5e6f.safetensors".

    address: as --toolbox names it; folder, cache: local ones, for what can only be local, and for what can be made again;
    alone: whether nobody else writes while `lock` is held. All methods raise BadInput or WorkFailed, naming the file and
    the reason.
    """

    address: str
    folder: Path
    cache: Path
    alone: bool

    def check(self, to_write: bool = True) -> None:
        """Raises unless files can be written here, or, without `to_write`, unless there can be such a place; makes nothing."""

    def names(self, under: str = "") -> list[str]:
        """The names of the files right in a folder of the place; hidden ones are left out."""

    def files(self, under: str = "") -> dict[str, FileState]:
        """Those files by name, and how they are now."""

    def exists(self, name: str) -> bool:
        """Whether there is such a file."""

    def tree(self, under: str) -> list[str]:
        """The names of all files below a folder of the place, as they are in the place."""

    def folders(self, under: str) -> list[str]:
        """The names of the folders right in a folder of the place."""

    def read(self, name: str) -> bytes:
        """All bytes of a file."""

    def read_many(self, states: Mapping[str, FileState]) -> Iterator[tuple[str, bytes | BadInput]]:
        """The bytes of several files whose states are known; of one that cannot be read, the error."""

    def write(self, name: str, content: bytes, drafts: str = "") -> None:
        """Writes a file whole or not at all; where half-written ones are seen, they are seen in the folder `drafts`."""

    def move(self, name: str, to: str) -> None:
        """Gives a file another name, in place of one that has it."""

    def sweep(self, under: str) -> None:
        """Deletes what writers that were killed left half written in a folder, for who holds its lock."""

    def tidy(self, older_s: float) -> list[str]:
        """Removes what commands that were killed have left in a folder of this machine, so many seconds old; what it was."""

    def append(self, name: str, line: bytes) -> None:
        """Adds a line to a log."""

    def lines(self, name: str) -> list[bytes]:
        """The lines of a log; none where there is none."""

    def lock(self, name: str) -> AbstractContextManager[None]:
        """Keeps others from what goes with a log."""

    def where(self, name: str) -> str:
        """A file's whole address."""


def read_file(path: Path) -> bytes:
    """All bytes of a local file. Raises BadInput for anything but a file, and for more than MAX_FILE_BYTES."""
    try:
        return read_limited(path, MAX_FILE_BYTES)
    except FileNotFoundError:
        raise BadInput("there is no such file") from None
    except OSError as error:
        raise BadInput(error.strerror or str(error)) from error
