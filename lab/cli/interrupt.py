"""Ctrl-C: heard wherever it is pressed, also where Python or a library would drop it."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from lab.interrupts import UNINTERRUPTED

TYPE_CHECKING = False  # as typing's, which takes longer to load than all else here: Ctrl-C is heard only after that
if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from types import FrameType

AGAIN_S = 0.002  # between two looks whether it can be raised
LOOKS = 500  # at a library that is busy, before it is raised there all the same
COMPILERS = {"llvmlite", "numba"}
OWN = __file__.removesuffix("cli/interrupt.py")


@contextmanager
def ctrl_c_is_heard() -> Iterator[None]:
    """Raises KeyboardInterrupt on Ctrl-C, but not where a library may drop it unseen, or is in the midst of taking a lock.

    It is raised where the lab's own code runs, or where nothing has moved since the last look, as in a wait; in a library
    that is busy for a second, or when it is pressed once more, there. Never while something is being imported, while numba or
    LLVM compile, or in a function that is `uninterrupted`. It is raised again when Python has ignored it (in a callback).
    Windows has no interval timer: there it is raised where Python hears it.
    """
    has_timer = hasattr(signal, "setitimer")
    if (
        not has_timer or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):  # somebody else's, or not wanted
        yield
        return
    main_frame = sys._getframe(2)
    looks = 0
    looked_at: tuple[FrameType | None, int] = None, 0  # the frame itself: another one may come to lie where it lay

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
        if signal.getitimer(signal.ITIMER_REAL)[0]:  # it was all over before the import was
            raise KeyboardInterrupt
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)


def _must_end(frame: "FrameType | None", last: "FrameType") -> bool:
    """Whether something that is not to be interrupted is at work between a frame and one of those that called it.

    What LLVM owns is handed over in two steps: between them Ctrl-C made a module be freed twice, a segmentation fault. In numba's
    compiler it comes out as another error.
    """
    while frame is not None and frame is not last:
        file = frame.f_code.co_filename
        if file.startswith("<frozen importlib") or COMPILERS.intersection(file.split(os.sep)):
            return True
        if frame.f_code in UNINTERRUPTED:
            return True
        frame = frame.f_back
    return False
