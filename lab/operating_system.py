"""The differences between Linux, macOS and Windows: only this module imports what one of them lacks."""

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

    _windows: Any = msvcrt  # typed as Any, because its types exist on Windows only
else:
    import fcntl

_BINARY: int = getattr(os, "O_BINARY", 0)  # without it Windows translates line endings
_NO_FOLLOW: int = getattr(os, "O_NOFOLLOW", 0)
# A lock on Windows keeps others from reading and writing the locked bytes, so the one that is locked lies beyond any file's end.
_LOCKED_BYTE = (1 << 31) - 2
_AGAIN_S, _BUSY_S = 0.01, 2.0  # the pause between two attempts; how long attempts on a file that is in use go on


def opened(path: Path, flags: int, *, follow: bool = True) -> int:
    """The descriptor of a file, opened in binary mode; a created file has the mode 0o644.

    Raises OSError, with ELOOP for a symbolic link if `follow` is false.
    """
    if not follow and not _NO_FOLLOW and path.is_symlink():
        raise OSError(ELOOP, os.strerror(ELOOP), str(path))
    return os.open(path, flags | _BINARY | (0 if follow else _NO_FOLLOW), 0o644)


def lock(file: int, *, wait: bool = True) -> None:
    """Takes the exclusive lock of an open file; closing the file, or the end of the process, releases it.

    Raises BlockingIOError if another process holds it and `wait` is false, OSError where files cannot be locked.
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


def own_session() -> None:
    """Makes this process independent of the terminal's Ctrl-C, where the system can (not on Windows)."""
    if not WINDOWS:
        os.setsid()


@contextmanager
def lock_file(path: Path, *, wait: bool = True) -> Iterator[None]:
    """Holds the lock of a file that is created for it and removed afterwards. Raises what `lock` raises."""
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
        os.close(file)  # its previous holder has removed the file, so another one has to be created
    try:
        yield
    finally:
        if WINDOWS:  # an open file cannot be removed there; one that another process has opened meanwhile stays
            os.close(file)
        with suppress(OSError):
            path.unlink()
        if not WINDOWS:
            os.close(file)


def replace(source: Path, target: Path) -> None:
    """Renames as `os.replace`; on Windows, which refuses while either file is open, it tries for two seconds."""
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
    """Renames the open file `source`, then closes it, which releases its lock; on Windows it has to be closed first."""
    if WINDOWS:
        os.close(file)
        replace(source, target)
        return
    try:
        os.replace(source, target)
    finally:
        os.close(file)


def flush_c_streams() -> None:
    """Flushes the output buffers of C libraries."""
    import ctypes

    ctypes.CDLL("ucrtbase" if WINDOWS else None).fflush(None)


def keep_port(own: "socket") -> None:
    """Sets a socket up, before `bind`, so that a port just released can be bound again, but a port in use can never be shared."""
    import socket

    option: int = getattr(
        socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR
    )  # on Windows SO_REUSEADDR would share a port in use
    own.setsockopt(socket.SOL_SOCKET, option, 1)


def most_descriptors() -> int | None:
    """How many files and connections this process may have open at a time; None if there is no limit."""
    if WINDOWS:
        return None
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return None if soft == resource.RLIM_INFINITY else soft


def is_own_folder(path: Path) -> bool:
    """Whether the path is a folder of this user and no link; False on Windows, where owners are not known. Raises OSError."""
    status = path.lstat()
    return not WINDOWS and S_ISDIR(status.st_mode) and status.st_uid == os.getuid()


def is_gone(process: int) -> bool:
    """Whether the process has ended; False on Windows, where asking with a signal would end it. Raises OSError."""
    if WINDOWS or process < 1:
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return False
