"""Ctrl-C: heard wherever it is pressed, also where Python or a library would drop it."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

TYPE_CHECKING = False  # as typing's, which takes longer to load than all else here: Ctrl-C is heard only after that
if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from types import FrameType

AGAIN_S = 0.002  # between two looks whether an import is over


@contextmanager
def ctrl_c_is_heard() -> Iterator[None]:
    """Raises KeyboardInterrupt on Ctrl-C, but not while a library is being imported: there it may be dropped unseen.

    It is raised as soon as that import is over, and again when Python has ignored it (in a callback).
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:  # somebody else's, or not wanted
        yield
        return
    main_frame = sys._getframe(2)

    def stop(number: int, frame: "FrameType | None") -> None:
        while frame is not None and frame is not main_frame:
            if frame.f_code.co_filename.startswith("<frozen importlib"):
                signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
                return
            frame = frame.f_back
        raise KeyboardInterrupt

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
