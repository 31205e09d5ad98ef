"""A desk's lesson on an order: the session of `lab sequence`, kept in the lesson's folder."""

from pathlib import Path
from typing import Any

from lab.advice.advising import Advising
from lab.advice.entries import FILE, is_unbegun
from lab.classroom.class_lesson import check_own
from lab.files import is_file
from lab.production.order_session import sequenced
from lab.seat.lesson_seat import LessonSeat
from lab.teaching.kept_order import OrderSession, OrderSessionOptions
from lab.teaching.kept_session import check_new, read_session
from lab.teaching.lesson_options import DEFAULT_ADVISORS
from lab.teaching.lesson_plan import Interrupted
from lab.teaching.teacher import Teacher
from lab.toolbox.registry import Toolbox


def order_lesson(options: OrderSessionOptions, folder: Path, toolbox: Toolbox, seat: LessonSeat) -> dict[str, Any]:
    """The document of `lab sequence --json`, after the session in `folder`, which goes on if there is one already.

    A session that is over is run again from its journal, and gives the same document. Raises Interrupted for a session that is
    stopped before its end, BadInput and WorkFailed as `sequenced` does.
    """
    kept = _kept(options, folder, toolbox)
    teacher = Teacher(toolbox, Advising.of(DEFAULT_ADVISORS), kept.options.seed, seat.hear)
    document = sequenced(kept, seat.people(), teacher)
    if document["interrupted"]:
        raise Interrupted("the order is not finished; the journal has all that was said")
    document |= kept.worth()
    seat.lesson_over(document)
    return document


def _kept(options: OrderSessionOptions, folder: Path, toolbox: Toolbox) -> OrderSession:
    path = folder / FILE
    if is_file(path) and not is_unbegun(path):
        read, begun = read_session(folder, "lab class --resume", OrderSessionOptions)
        check_own(begun, options, path)
        return OrderSession(begun, toolbox, read, read_only=read.closed is not None)
    check_new(folder)
    return OrderSession(options, toolbox, out=folder)
