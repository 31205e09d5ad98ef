"""Keeps off the terminal the output that a library writes directly to the file descriptors."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from lab.operating_system import flush_c_streams


@contextmanager
def silence() -> Iterator[None]:
    """Keeps PyBullet's banner and warnings off the terminal, which it writes directly to the file descriptors."""
    kept = [os.dup(number) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        flush_c_streams()
        for number in (1, 2):
            os.dup2(nowhere, number)
        yield
    finally:
        flush_c_streams()
        for number, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
