"""Where a toolbox keeps its bytes: a folder here, or (`remote_place`) an address elsewhere, with the same few calls."""

import errno
import fcntl
import os
import stat
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, Protocol

from lab import files
from lab.errors import BadInput, WorkFailed
from lab.toolbox.names import default_address, is_address

MAX_FILE_BYTES = 1 << 30
_NOT_WRITABLE = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EEXIST, errno.EISDIR, errno.ENAMETOOLONG}
_NOT_WRITABLE |= {errno.ELOOP}
_FRESH_NS = 50_000_000  # a file changed so lately may change again without its times telling


class FileState(NamedTuple):
    """A file's size, and a stamp that changes when the file does; "" when that cannot be told yet."""

    size_bytes: int
    stamp: str


class Place(Protocol):
    """Files by name, such as "insert.safetensors" or "versions/insert/0001-1a2b3c4d5e6f.safetensors".

    address: as --toolbox names it; folder: a local one, for what can only be local; alone: whether nobody else writes
    while `lock` is held. All methods raise BadInput or WorkFailed, naming the file and the reason.
    """

    address: str
    folder: Path
    alone: bool

    def check(self) -> None:
        """Raises unless files can be written here; makes nothing."""

    def names(self, under: str = "") -> list[str]:
        """The names of the files right in a folder of the place; hidden ones are left out."""

    def files(self, under: str = "") -> dict[str, FileState]:
        """Those files by name, and how they are now."""

    def exists(self, name: str) -> bool:
        """Whether there is such a file."""

    def folders(self, under: str) -> list[str]:
        """The names of the folders right in a folder of the place."""

    def read(self, name: str) -> bytes:
        """All bytes of a file."""

    def write(self, name: str, content: bytes, drafts: str = "") -> None:
        """Writes a file whole or not at all; where half-written ones are seen, they are seen in the folder `drafts`."""

    def move(self, name: str, to: str) -> None:
        """Gives a file another name, in place of one that has it."""

    def append(self, name: str, line: bytes) -> None:
        """Adds a line to a log."""

    def lines(self, name: str) -> list[bytes]:
        """The lines of a log; none where there is none."""

    def lock(self, name: str) -> AbstractContextManager[None]:
        """Keeps others from what goes with a log."""

    def where(self, name: str) -> str:
        """A file's whole address."""


def place_of(where: Path | str | None) -> Place:
    """The place that a folder or an address names, by default the user's own."""
    text = default_address() if where is None else str(where)
    if text.startswith("file://"):
        text = text.removeprefix("file://")
    if is_address(text):
        from lab.toolbox.remote_place import RemotePlace

        return RemotePlace(text)
    return FolderPlace(Path(text))


class FolderPlace:
    """A local folder, made when something is first written. Symbolic links in it are not followed out of it."""

    alone = True

    def __init__(self, folder: Path) -> None:
        self.folder, self.address = folder, str(folder)

    def check(self) -> None:
        try:
            place = files.nearest(self.folder)
        except OSError as error:
            raise BadInput(f"toolbox {self.folder}: {error.strerror}") from error
        if not place.is_dir():
            raise BadInput(f"toolbox {self.folder}: '{place}' is a file, a folder is needed")
        if not os.access(place, os.R_OK | os.W_OK | os.X_OK):
            raise BadInput(f"toolbox {self.folder}: '{place}' cannot be written")

    def names(self, under: str = "") -> list[str]:
        return [entry.name for entry in self._entries(under)]

    def files(self, under: str = "") -> dict[str, FileState]:
        found, fresh = {}, time.time_ns() - _FRESH_NS
        for entry in self._entries(under):
            with suppress(OSError):  # gone meanwhile, or a link to nothing
                at = entry.stat()
                stamp = f"{at.st_mtime_ns}-{at.st_ctime_ns}-{at.st_ino}" if at.st_ctime_ns < fresh else ""
                found[entry.name] = FileState(at.st_size, stamp)
        return found

    def exists(self, name: str) -> bool:
        return os.path.lexists(self.folder / name)

    def folders(self, under: str) -> list[str]:
        return sorted(entry.name for entry in self._entries(under) if entry.is_dir(follow_symlinks=False))

    def _entries(self, under: str) -> list["os.DirEntry[str]"]:
        folder = self.folder / under
        try:
            if self.folder.exists() and not self.folder.is_dir():
                raise BadInput(f"toolbox {self.folder}: it is a file, a folder is needed")
            self._inside(folder)
            with os.scandir(folder) as entries:
                return [entry for entry in entries if not entry.name.startswith(".")]
        except FileNotFoundError:
            return []
        except OSError as error:
            raise _refused("read", folder, error) from error

    def read(self, name: str) -> bytes:
        path = self.folder / name
        self._inside(path)
        return read_file(path)

    def write(self, name: str, content: bytes, drafts: str = "") -> None:
        path, beside = self.folder / name, self.folder / drafts if drafts else None
        try:
            for folder in {path.parent, beside or path.parent}:
                self._made(folder)
            files.write_whole(path, content, beside)
        except OSError as error:
            raise _refused("write", path, error) from error

    def move(self, name: str, to: str) -> None:
        path, target = self.folder / name, self.folder / to
        try:
            self._inside(path.parent)
            self._made(target.parent)
            os.replace(path, target)
        except OSError as error:
            raise _refused("move", path, error) from error

    def append(self, name: str, line: bytes) -> None:
        path = self.folder / name
        try:
            self._made(path.parent)
            handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o644)
            try:
                size = os.fstat(handle).st_size
                cut = size > 0 and os.pread(handle, 1, size - 1) != b"\n"  # by a crash: begin a new line
                os.write(handle, b"\n" * cut + line + b"\n")
            finally:
                os.close(handle)
        except OSError as error:
            raise _refused("write", path, error) from error

    def lines(self, name: str) -> list[bytes]:
        path = self.folder / name
        self._inside(path)
        return read_file(path).splitlines() if path.exists() else []

    @contextmanager
    def lock(self, name: str) -> Iterator[None]:
        path = self.folder / name
        try:
            self._made(path.parent)
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        except OSError as error:
            raise _refused("write", path, error) from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
            yield
        finally:
            os.close(handle)

    def where(self, name: str) -> str:
        return str(self.folder / name)

    def _made(self, folder: Path) -> None:
        """Makes a folder in the place; what is written into it stays in the place."""
        folder.mkdir(parents=True, exist_ok=True)
        self._inside(folder)

    def _inside(self, path: Path) -> None:
        """Raises BadInput when a name or a symbolic link leads out of the place."""
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise BadInput(f"{path}: it leads out of the toolbox {self.folder}")


def read_file(path: Path) -> bytes:
    """All bytes of a local file. Raises BadInput for anything but a file, and for more than 1 GiB."""
    try:
        at = path.stat()
        if not stat.S_ISREG(at.st_mode):
            raise BadInput("it is not a file")
        if at.st_size > MAX_FILE_BYTES:
            raise BadInput(f"it has {at.st_size} bytes, allowed {MAX_FILE_BYTES}")
        return path.read_bytes()
    except FileNotFoundError:
        raise BadInput("there is no such file") from None
    except OSError as error:
        raise BadInput(error.strerror or str(error)) from error


def _refused(verb: str, path: Path, error: OSError) -> BadInput | WorkFailed:
    reason = f"cannot {verb} {path}: {error.strerror or error}"
    return BadInput(reason) if error.errno in _NOT_WRITABLE or verb == "read" else WorkFailed(reason)
