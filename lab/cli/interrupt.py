"""Ctrl-C: it interrupts a command at any time, also where Python or a library would drop it."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from lab.interrupts import UNINTERRUPTED

TYPE_CHECKING = False  # instead of typing's, which loads slowly; until this module is loaded, Ctrl-C is not handled
if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from types import FrameType

AGAIN_S = 0.002  # interval at which it is checked whether the interrupt can be raised
LOOKS = 500  # checks during a busy library, after which it is raised in any case
COMPILERS = {"llvmlite", "numba"}
OWN = __file__.removesuffix("cli/interrupt.py")


@contextmanager
def ctrl_c_is_heard() -> Iterator[None]:
    """A context in which Ctrl-C raises KeyboardInterrupt, but not where a library may swallow it or is taking a lock.

    It is raised in the lab's own code, or where execution has not moved since the last check, as in a wait; in a library
    that is busy for a second, or on a second Ctrl-C, it is raised there. It is never raised during an import, while numba
    or LLVM compile, or in an `uninterrupted` function. It is raised again when Python has ignored it (in a callback).
    Windows has no interval timer: there it is raised wherever Python handles it.
    """
    has_timer = hasattr(signal, "setitimer")
    if not has_timer or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield  # another handler is set, or Ctrl-C is ignored
        return
    main_frame = sys._getframe(2)
    looks = 0
    looked_at: tuple[FrameType | None, int] = None, 0  # the frame itself, because another one may get the same id

    def stop(number: int, frame: "FrameType | None") -> None:
        nonlocal looks, looked_at
        if frame is None:
            raise KeyboardInterrupt
        is_stuck = frame is looked_at[0] and frame.f_lasti == looked_at[1]
        impatient = looks > LOOKS or (number == signal.SIGINT and looks > 0)
        if not _must_end(frame, main_frame) and (frame.f_code.co_filename.startswith(OWN) or is_stuck or impatient):
            looks, looked_at = 0, (None, 0)
            raise KeyboardInterrupt
        looks, looked_at = looks + 1, (frame, frame.f_lasti)
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)

    def ignored(what: "UnraisableHookArgs") -> None:
        if issubclass(what.exc_type, KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
        else:
            told(what)

    told = sys.unraisablehook
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGALRM)}
    sys.unraisablehook = ignored
    try:
        yield
        if signal.getitimer(signal.ITIMER_REAL)[0]:  # the body ended before the import in which Ctrl-C came
            raise KeyboardInterrupt
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)


def ignore_ctrl_c() -> None:
    """Ctrl-C does nothing from now on: for a process that is about to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _must_end(frame: "FrameType | None", last: "FrameType") -> bool:
    """Whether a frame, or one of its callers up to `last`, must not be interrupted.

    LLVM's modules change their owner in two steps: Ctrl-C between them led to a double free and a segmentation fault. In
    numba's compiler it is turned into another error.
    """
    while frame is not None and frame is not last:
        file = frame.f_code.co_filename
        if file.startswith("<frozen importlib") or COMPILERS.intersection(file.split(os.sep)):
            return True
        if frame.f_code in UNINTERRUPTED:
            return True
        frame = frame.f_back
    return False
