"""Places: the interface of the storage of a toolbox, and the place in a local folder."""

import errno
import json
import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, Protocol

from lab import files
from lab.errors import BadInput, WorkFailed
from lab.files import MOST_BYTES, read_limited
from lab.operating_system import lock, opened, replace
from lab.toolbox.names import BEGUN, JOURNAL, SESSIONS

MAX_FILE_BYTES = MOST_BYTES


class FileState(NamedTuple):
    """A file's size, and a stamp that changes with the file; "" if it was modified too recently to tell."""

    size_bytes: int
    stamp: str


class FilePlace(Protocol):
    """The storage of a toolbox: files by name, such as "versions/insert/0001-1a2b3c4d5e6f.safetensors".

    address: as for --toolbox; folder: local, for files that are never remote; cache: local, for files that can be made again;
    alone: whether `lock` excludes all other writers. All methods raise BadInput or WorkFailed, which name the file and the
    reason.
    """

    address: str
    folder: Path
    cache: Path
    alone: bool

    def check(self, to_write: bool = True) -> None:
        """Raises unless files can be written here or, without `to_write`, unless the place can exist; creates nothing."""

    def names(self, under: str = "") -> list[str]:
        """The names of the files directly in a folder of the place, without hidden ones."""

    def files(self, under: str = "") -> dict[str, FileState]:
        """The states of these files by name."""

    def exists(self, name: str) -> bool:
        """Whether the file exists."""

    def tree(self, under: str) -> list[str]:
        """The names, relative to the place, of all files below a folder."""

    def folders(self, under: str) -> list[str]:
        """The names of the folders directly in a folder of the place."""

    def read(self, name: str) -> bytes:
        """The bytes of a file."""

    def read_many(self, states: Mapping[str, FileState]) -> Iterator[tuple[str, bytes | BadInput]]:
        """(name, bytes) of several files with known states; the error instead of the bytes for a file that cannot be read."""

    def write(self, name: str, content: bytes, drafts: str = "") -> None:
        """Writes a file atomically; a draft, if one is visible, is in the folder `drafts`."""

    def move(self, name: str, to: str) -> None:
        """Renames a file, and replaces a file of the new name."""

    def sweep(self, under: str) -> None:
        """Deletes the drafts of killed writers in a folder; the caller holds its lock."""

    def tidy(self, older_s: float) -> list[str]:
        """The names of leftovers of killed commands on this machine, at least so many seconds old, after their removal."""

    def append(self, name: str, line: bytes) -> None:
        """Appends a line to a log."""

    def lines(self, name: str) -> list[bytes]:
        """The lines of a log, [] if it does not exist."""

    def lock(self, name: str) -> AbstractContextManager[None]:
        """A context that excludes other writers of a log and its files, as far as the place can."""

    def where(self, name: str) -> str:
        """The full address of a file."""


def read_file(path: Path) -> bytes:
    """The bytes of a local file. Raises BadInput if it is no regular file, or has more than MAX_FILE_BYTES."""
    try:
        return read_limited(path, MAX_FILE_BYTES)
    except FileNotFoundError:
        raise BadInput("there is no such file") from None
    except OSError as error:
        raise BadInput(error.strerror or str(error)) from error


# ---- the place in a local folder ------------------------------------------------------------------------------------


_NOT_WRITABLE = {
    *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ELOOP),
    *(errno.ENOTDIR, errno.EEXIST, errno.EISDIR, errno.ENAMETOOLONG),
}
_DRAFT = re.compile(r"\..+\.[0-9a-f]{8}\.tmp")  # the name of a draft of `files.write_whole`
_LONGEST_LINE = 1 << 20  # the most bytes of a log's last line that are read
_FRESH_NS = 50_000_000  # a file changed more recently than this may change again with the same times


class FolderPlace:
    """A local folder, created when something is first written. Symbolic links that lead out of it are not followed."""

    alone = True

    def __init__(self, folder: Path) -> None:
        self.folder = self.cache = folder
        self.address = str(folder)

    def check(self, to_write: bool = True) -> None:
        try:
            place = files.nearest(self.folder)
        except OSError as error:
            raise BadInput(f"toolbox {self.folder}: {error.strerror}") from error
        if not place.is_dir():
            raise BadInput(f"toolbox {self.folder}: '{place}' is a file, a folder is needed")
        if to_write and not os.access(place, os.R_OK | os.W_OK | os.X_OK):
            raise BadInput(f"toolbox {self.folder}: '{place}' cannot be written")

    def names(self, under: str = "") -> list[str]:
        return [entry.name for entry in self._entries(under)]

    def files(self, under: str = "") -> dict[str, FileState]:
        stamps, fresh = {}, time.time_ns() - _FRESH_NS
        for entry in self._entries(under):
            try:
                at = entry.stat()
            except OSError:  # gone meanwhile, or a link to nothing
                continue
            stamp = f"{at.st_mtime_ns}-{at.st_ctime_ns}-{at.st_ino}" if at.st_ctime_ns < fresh else ""
            stamps[entry.name] = FileState(at.st_size, stamp)
        return stamps

    def exists(self, name: str) -> bool:
        return os.path.lexists(self.folder / name)

    def tree(self, under: str) -> list[str]:
        return [f"{under}/{name}/{file}" for name in self.folders(under) for file in self.names(f"{under}/{name}")]

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

    def read_many(self, states: Mapping[str, FileState]) -> Iterator[tuple[str, bytes | BadInput]]:
        for name in states:
            try:
                yield name, self.read(name)
            except BadInput as error:
                yield name, error

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
            replace(path, target)
        except OSError as error:
            raise _refused("move", path, error) from error

    def sweep(self, under: str) -> None:
        for left in (self.folder / under).glob(".*.tmp"):
            with suppress(PermissionError):  # Windows cannot remove an open file
                left.unlink(missing_ok=True)

    def tidy(self, older_s: float) -> list[str]:
        """Removes drafts, also those of linked sessions, and folders of sessions that never began; see `FilePlace.tidy`."""
        gone, until_s = [], time.time() - older_s
        leftovers = list[Path]()
        with suppress(OSError):  # a folder may be removed meanwhile
            leftovers = [*self.folder.glob("**/.*.tmp"), *self.folder.glob(f"{SESSIONS}/*/.*.tmp")]
        for left in dict.fromkeys(leftovers):
            is_draft = _DRAFT.fullmatch(left.name) is not None and left.is_file() and not left.is_symlink()
            with suppress(OSError):  # another command has removed it
                if is_draft and left.stat().st_mtime <= until_s:
                    left.unlink()
                    gone.append(str(left))
        with suppress(OSError):
            leftovers = [*self.folder.glob(f"{SESSIONS}/*")]
        for folder in leftovers:
            with suppress(OSError):  # a folder with something else in it stays
                if folder.is_symlink() or not folder.is_dir() or folder.stat().st_mtime > until_s or _is_begun(folder):
                    continue
                (folder / JOURNAL).unlink(missing_ok=True)
                shutil.rmtree(folder / BEGUN, ignore_errors=True)
                folder.rmdir()
                gone.append(str(folder))
        return gone

    def append(self, name: str, line: bytes) -> None:
        path = self.folder / name
        try:
            self._made(path.parent)
            handle = opened(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, follow=False)
            try:
                size = os.fstat(handle).st_size
                os.lseek(handle, max(0, size - _LONGEST_LINE), os.SEEK_SET)
                cut = _cut_line(os.read(handle, _LONGEST_LINE))
                if cut and not _is_whole(cut):  # an incomplete line, left by a crash, does not count
                    os.ftruncate(handle, size - len(cut))
                _write_all(handle, b"\n" * _is_whole(cut) + line + b"\n")
            finally:
                os.close(handle)
        except OSError as error:
            raise _refused("write", path, error) from error

    def lines(self, name: str) -> list[bytes]:
        path = self.folder / name
        self._inside(path)
        content = read_file(path) if path.exists() else b""
        cut = _cut_line(content)
        return (content if _is_whole(cut) else content.removesuffix(cut)).splitlines()

    @contextmanager
    def lock(self, name: str) -> Iterator[None]:
        path = self.folder / name
        try:
            self._made(path.parent)
            handle = opened(path, os.O_RDWR | os.O_CREAT, follow=False)
        except OSError as error:
            raise _refused("write", path, error) from error
        try:
            lock(handle)
            yield
        finally:
            os.close(handle)

    def where(self, name: str) -> str:
        return str(self.folder / name)

    def _made(self, folder: Path) -> None:
        """Creates a folder in the place. Raises BadInput if it leads out of the place."""
        folder.mkdir(parents=True, exist_ok=True)
        self._inside(folder)

    def _inside(self, path: Path) -> None:
        """Raises BadInput if a name or a symbolic link leads out of the place."""
        if not path.resolve().is_relative_to(self.folder.resolve()):
            raise BadInput(f"{path}: it leads out of the toolbox {self.folder}")


def _is_begun(folder: Path) -> bool:
    """Whether the folder of a session holds a journal with a complete line."""
    path = folder / JOURNAL
    if not path.exists():
        return False
    with path.open("rb") as file:
        return file.readline().endswith(b"\n")


def _cut_line(content: bytes) -> bytes:
    """The bytes after the last line break."""
    return content[content.rfind(b"\n") + 1 :]


def _is_whole(cut: bytes) -> bool:
    """Whether a line is complete except for its line break."""
    try:
        return isinstance(json.loads(cut), dict)
    except (ValueError, RecursionError):
        return False


def _write_all(handle: int, content: bytes) -> None:
    while content:
        content = content[os.write(handle, content) :]


def _refused(verb: str, path: Path, error: OSError) -> BadInput | WorkFailed:
    reason = f"cannot {verb} {path}: {error.strerror or error}"
    return BadInput(reason) if error.errno in _NOT_WRITABLE or verb == "read" else WorkFailed(reason)
