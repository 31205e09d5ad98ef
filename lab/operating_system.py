"""What differs between Linux, macOS and Windows. Only this module imports what one of them lacks."""

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import EAGAIN, ELOOP
from pathlib import Path
from stat import S_ISDIR
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from socket import socket

WINDOWS: bool = sys.platform == "win32"
if WINDOWS:
    import msvcrt

    _windows: Any = msvcrt  # of which the types are known on Windows only
else:
    import fcntl

_BINARY: int = getattr(os, "O_BINARY", 0)  # without it Windows writes other line ends
_NO_FOLLOW: int = getattr(os, "O_NOFOLLOW", 0)
# On Windows nobody else can read or write what is locked: it is a byte beyond the end of any file.
_LOCKED_BYTE = (1 << 31) - 2
_AGAIN_S, _BUSY_S = 0.01, 2.0  # between two tries; for how long a file that somebody else has open is tried


def opened(path: Path, flags: int, *, follow: bool = True) -> int:
    """The descriptor of a file of bytes; a new one has the mode 0o644. Raises OSError: ELOOP for a link with `follow` false."""
    if not follow and not _NO_FOLLOW and path.is_symlink():
        raise OSError(ELOOP, os.strerror(ELOOP), str(path))
    return os.open(path, flags | _BINARY | (0 if follow else _NO_FOLLOW), 0o644)


def lock(file: int, *, wait: bool = True) -> None:
    """Take the lock of an open file, which ends when the file is closed, at the latest with this process.

    Raises BlockingIOError when another holds it and `wait` is false, OSError where nothing can be locked.
    """
    if not WINDOWS:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        return
    before = os.lseek(file, 0, os.SEEK_CUR)
    try:
        while True:
            os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
            try:
                _windows.locking(file, _windows.LK_NBLCK, 1)
                return
            except PermissionError:
                if not wait:
                    raise BlockingIOError(EAGAIN, os.strerror(EAGAIN)) from None
            time.sleep(_AGAIN_S)
    finally:
        os.lseek(file, before, os.SEEK_SET)


@contextmanager
def lock_file(path: Path, *, wait: bool = True) -> Iterator[None]:
    """Holds the lock of a file that serves nothing else: it is made for it, and gone in the end. Raises as `lock` does."""
    while True:
        file = opened(path, os.O_RDWR | os.O_CREAT, follow=False)
        try:
            lock(file, wait=wait)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file), path.stat()):
                    break
        except BaseException:
            os.close(file)
            raise
        os.close(file)  # whoever held it before has removed it: the next one makes another
    try:
        yield
    finally:
        if WINDOWS:  # where no open file can be removed; one that another has opened meanwhile stays
            os.close(file)
        with suppress(OSError):
            path.unlink()
        if not WINDOWS:
            os.close(file)


def replace(source: Path, target: Path) -> None:
    """As `os.replace`; tried for two seconds where Windows refuses because somebody has one of the two open."""
    until_s = time.monotonic() + _BUSY_S
    while True:
        try:
            os.replace(source, target)
            return
        except PermissionError:
            if not WINDOWS or time.monotonic() > until_s:
                raise
        time.sleep(_AGAIN_S)


def replace_and_close(file: int, source: Path, target: Path) -> None:
    """Rename the open file `source` and close it: in this order, so that it is locked until then, but on Windows closed first."""
    if WINDOWS:
        os.close(file)
        replace(source, target)
        return
    try:
        os.replace(source, target)
    finally:
        os.close(file)


def flush_c_streams() -> None:
    """Write out what libraries in C hold back of their output."""
    import ctypes

    ctypes.CDLL("ucrtbase" if WINDOWS else None).fflush(None)


def keep_port(own: "socket") -> None:
    """Before `bind`: a port that was just given up is to be had again, one that somebody has is not, nor is it taken from us."""
    import socket

    how: int = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)  # Windows shares a reused one
    own.setsockopt(socket.SOL_SOCKET, how, 1)


def most_descriptors() -> int | None:
    """How many files and connections this process may have open at a time; None where there is no limit."""
    if WINDOWS:
        return None
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return None if soft == resource.RLIM_INFINITY else soft


def is_own_folder(path: Path) -> bool:
    """Whether it is a folder of this user, and no link; False on Windows, where that is not known. Raises OSError."""
    seen = path.lstat()
    return not WINDOWS and S_ISDIR(seen.st_mode) and seen.st_uid == os.getuid()


def is_gone(process: int) -> bool:
    """Whether there is no such process any more; False on Windows, where to ask would end it. Raises OSError."""
    if WINDOWS or process < 1:
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False
