"""A desk's own process: a lesson, and its pages on this computer's loopback that the class's server passes on.

The process ends when the other end of its pipe closes, however that happens; the lesson's journal then holds every answer.
"""

import os
import signal
import threading
from _thread import interrupt_main
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from lab.advice.advisors import PAGE_OF
from lab.advice.answer_times import AnswerTimes
from lab.advice.entries import FILE, is_unbegun, read_journal
from lab.classroom.class_lesson import ClassLesson, check_own
from lab.classroom.operate_lesson import operated_lesson
from lab.classroom.order_lesson import order_lesson
from lab.errors import BadInput, LabError
from lab.files import is_file
from lab.learning.session_events import EpisodeEnded
from lab.operating_system import own_session
from lab.plugins.code_file import files_taken
from lab.production.run_journal import RunEnded, is_run, read_run
from lab.production.run_options import RunOptions
from lab.seat.lesson_seat import LessonSeat
from lab.seat.page.teaching_page import SeatPage
from lab.seat.run_progress import RunProgress
from lab.seat.team import Team
from lab.teaching.events import Event, LessonBegan, LessonEvent
from lab.teaching.kept_order import OrderSessionOptions
from lab.teaching.kept_session import KeptSession, check_new, read_session
from lab.teaching.lesson import teach
from lab.teaching.lesson_options import LessonOptions
from lab.teaching.own_members import take_again
from lab.teaching.subjects import subject_of
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox
from lab.view.progress import EscapingConsole

FINISH = "finish"  # what the class sends to finish a run by hand; anything else closes the desk
RESUMED = "lab class --resume"  # where a journal is named, for errors
LAST_S = 10.0  # time for a lesson to end after its pipe has closed
DRAWN_S = 60.0  # time for the document and the pictures of one that is over


@dataclass(frozen=True)
class DeskOrder:
    """What is taught at a desk: the lesson's options, the folder of its session, and the toolbox.

    people: the names of the pupils who teach together, with a page each; () for one alone. In a session that goes on, they are
    those with whom it began.
    files: the members from files that the teacher has named, see `lab.plugins.code_file.files_taken`; modules: those that the
    teacher has named, so that a session that goes on may import them; times: whether the times of the pupil's answers are kept.
    """

    options: ClassLesson
    folder: Path
    toolbox: Path
    files: Mapping[str, tuple[str, str]] = field(default_factory=files_taken)
    modules: tuple[str, ...] = ()
    people: tuple[str, ...] = ()
    times: bool = False


@dataclass(frozen=True)
class _Signals:
    """What the threads of a desk's process tell each other.

    closed: the class closes the desk; finish: the run by hand is to be finished; taught: the last episode has ended.
    """

    closed: threading.Event = field(default_factory=threading.Event)
    finish: threading.Event = field(default_factory=threading.Event)
    taught: threading.Event = field(default_factory=threading.Event)


def sit(order: DeskOrder, pipe: Connection) -> None:
    """Teach the lesson, or go on with it if its folder holds one; the main function of the process.

    Sent through the pipe: ("pages", {name: (port, token)}), the name "" for one pupil alone; then ("over", document),
    ("failed", text) or ("stopped", text).
    """
    own_session()  # Ctrl-C in the terminal is for the class, which ends its desks by closing their pipes
    signal.signal(signal.SIGINT, signal.default_int_handler)
    said: tuple[Any, ...] = ("failed", "ended without a word")
    try:
        with ExitStack() as stack:
            pages = {name: stack.enter_context(SeatPage()) for name in _people(order) or [""]}
            pipe.send(("pages", {name: (page.port, page.token) for name, page in pages.items()}))
            signals = _Signals()
            threading.Thread(target=_until_closed, args=[pipe, signals, order.folder], daemon=True).start()
            said = _taught(order, pages, signals)
            with suppress(OSError):
                pipe.send(said)
            signals.closed.wait()  # the pages go on showing how it ended, until the class closes the desk
    except KeyboardInterrupt:
        pass
    except LabError as error:
        with suppress(OSError):
            pipe.send(("failed", str(error)))


def _people(order: DeskOrder) -> list[str]:
    """The names of the pupils who teach together."""
    begun = order.folder / FILE
    if not (order.people and is_file(begun)) or is_unbegun(begun):
        return [*order.people]
    _, options = read_session(order.folder, RESUMED, LessonOptions)
    return [name.removeprefix(PAGE_OF) for name in options.advisor_names]


def _taught(order: DeskOrder, pages: Mapping[str, SeatPage], signals: _Signals) -> tuple[Any, ...]:
    """What is sent through the pipe at the end."""
    try:
        return "over", _lesson(order, pages, signals)
    except KeyboardInterrupt as stopped:  # Interrupted, too, which is one
        return "stopped", str(stopped)
    except LabError as error:
        for page in pages.values():
            page.finished(str(error))
        return "failed", str(error)


def _lesson(order: DeskOrder, pages: Mapping[str, SeatPage], signals: _Signals) -> Mapping[str, Any]:
    """The document of `lab teach --json`, of `lab sequence --json` for a lesson on an order, or of `lab operate --json`."""
    take_again(order.files)
    with ExitStack() as stack:
        team = (
            stack.enter_context(Team({PAGE_OF + name: page for name, page in pages.items()})) if order.people else None
        )
        times = AnswerTimes() if order.times else None
        if times is not None:
            stack.callback(times.close)
        seat = LessonSeat(RunProgress(EscapingConsole(quiet=True)), None, pages.get(""), team=team, times=times)
        stack.callback(seat.clear_scene)
        toolbox = Toolbox(str(order.toolbox))
        if isinstance(order.options, RunOptions):
            return operated_lesson(order.options, order.folder, toolbox, seat, pages[""], signals.finish)
        if isinstance(order.options, OrderSessionOptions):
            return order_lesson(order.options, order.folder, toolbox, seat)
        options = order.options if team is None else replace(order.options, advisors=tuple(team.pages))
        return _table_lesson(order, options, toolbox, seat, signals.taught)


def _table_lesson(
    order: DeskOrder, options: LessonOptions, toolbox: Toolbox, seat: LessonSeat, taught: threading.Event
) -> Mapping[str, Any]:
    """The document of `lab teach --json`; a lesson that is over, whose document was lost, is run again from its journal."""
    kept = None
    if is_file(order.folder / FILE):
        if not is_unbegun(order.folder / FILE):
            check_own(read_session(order.folder, RESUMED, LessonOptions)[1], options, order.folder / FILE)
        kept = KeptSession(order.folder, RESUMED, read_only=is_over(order.folder), trusted=order.modules)
        options = kept.options
    else:
        check_new(order.folder)
    subject = subject_of(options, kept)
    last = 0  # the number of the last episode

    def hear(event: Event) -> None:
        nonlocal last
        seat.hear(event)
        match event:
            case LessonBegan():
                last = event.plan.learner.episodes
            case LessonEvent(event=EpisodeEnded(episode=episode)) if episode >= last:
                taught.set()

    teacher = Teacher(toolbox, options.advising(seat.people()), options.seed, hear)
    document = teach(subject, options, teacher, order.folder, kept)
    seat.lesson_over(document)
    return document


def is_over(folder: Path) -> bool:
    """Whether the session, or the run by hand, in a folder has ended."""
    with suppress(BadInput):
        if is_run(folder):
            _, entries, _ = read_run(folder, RESUMED)
            return any(isinstance(entry, RunEnded) for entry in entries[-1:])
        journal = folder / FILE
        return is_file(journal) and not is_unbegun(journal) and read_journal(folder, RESUMED).closed is not None
    return False


def _until_closed(pipe: Connection, signals: _Signals, folder: Path) -> None:
    """Interrupt the lesson in a folder when the pipe closes, unless it has been taught and its document is about to come.

    If it does not end within a few seconds, end the process.
    """
    with suppress(EOFError, OSError):
        while pipe.recv() == FINISH:
            signals.finish.set()
    signals.closed.set()
    if signals.taught.is_set() or signals.finish.is_set() or is_over(folder):
        threading.Event().wait(DRAWN_S)
    interrupt_main()
    threading.Event().wait(LAST_S)
    os._exit(1)
