"""A desk's own process: one pupil's lesson, and a page on this computer's loopback that the class's server passes on.

The process ends when the other end of its pipe closes, however that happens; the lesson's journal then holds every answer.
"""

import os
import signal
import threading
from _thread import interrupt_main
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from lab.advice.answer_times import AnswerTimes
from lab.advice.entries import FILE
from lab.errors import LabError
from lab.files import is_file
from lab.operating_system import own_session
from lab.plugins.code_file import files_taken
from lab.seat.lesson_seat import LessonSeat
from lab.seat.page.teaching_page import SeatPage
from lab.seat.run_progress import RunProgress
from lab.teaching.kept_session import KeptSession, check_new
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.own_members import take_again
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole

LAST_S = 10.0  # time for a lesson to end after its pipe has closed


@dataclass(frozen=True)
class DeskOrder:
    """What is taught at a desk: the lesson's options, the folder of its session, and the pupil's own toolbox.

    files: the members from files that the teacher has named, see `lab.plugins.code_file.files_taken`; modules: those that the
    teacher has named, so that a session that goes on may import them; times: whether the times of the pupil's answers are kept.
    """

    options: LessonOptions
    folder: Path
    toolbox: Path
    files: Mapping[str, tuple[str, str]] = field(default_factory=files_taken)
    modules: tuple[str, ...] = ()
    times: bool = False


def sit(order: DeskOrder, pipe: Connection) -> None:
    """Teach the lesson, or go on with it if its folder holds one; the main function of the process.

    Sent through the pipe: ("page", port, token), then ("over", document), ("failed", text) or ("stopped", text).
    """
    own_session()  # Ctrl-C in the terminal is for the class, which ends its desks by closing their pipes
    signal.signal(signal.SIGINT, signal.default_int_handler)
    said: tuple[Any, ...] = ("failed", "ended without a word")
    try:
        with SeatPage() as page:
            pipe.send(("page", page.port, page.token))
            closed = threading.Event()
            threading.Thread(target=_until_closed, args=[pipe, closed], daemon=True).start()
            said = _taught(order, page)
            with suppress(OSError):
                pipe.send(said)
            closed.wait()  # the page goes on showing how it ended, until the class closes the desk
    except KeyboardInterrupt:
        pass
    except LabError as error:
        with suppress(OSError):
            pipe.send(("failed", str(error)))


def _taught(order: DeskOrder, page: SeatPage) -> tuple[Any, ...]:
    try:
        return "over", _lesson(order, page)
    except KeyboardInterrupt as stopped:  # Interrupted, too, which is one
        return "stopped", str(stopped)
    except LabError as error:
        page.finished(str(error))
        return "failed", str(error)


def _lesson(order: DeskOrder, page: SeatPage) -> Mapping[str, Any]:
    """The document of `lab teach --json`."""
    take_again(order.files)
    kept = None
    if is_file(order.folder / FILE):
        kept = KeptSession(order.folder, "lab class --resume", trusted=order.modules)
    else:
        check_new(order.folder)
    options = order.options if kept is None else kept.options
    times = AnswerTimes() if order.times else None
    seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), None, page, times=times)
    try:
        subject = subject_of(options, kept)
        teacher = Teacher(Toolbox(str(order.toolbox)), options.advising(seat.people()), options.seed, seat.hear)
        document = teach(subject, options, teacher, order.folder, kept)
        seat.lesson_over(document)
    finally:
        seat.clear_scene()
        if times is not None:
            times.close()
    return document


def _until_closed(pipe: Connection, closed: threading.Event) -> None:
    """Interrupt the lesson when the pipe closes; if it does not end within a few seconds, end the process."""
    with suppress(EOFError, OSError):
        pipe.recv()
    closed.set()
    interrupt_main()
    threading.Event().wait(LAST_S)
    os._exit(1)
