"""What the commands that teach share: who is in the room, the teacher that the options describe, a kept session."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lab.cli.output import complain, console
from lab.errors import LabError

if TYPE_CHECKING:
    from lab.advice.advising import Watch
    from lab.production.sequence import Wanted
    from lab.seat.people import Classroom
    from lab.teaching.kept_order import OrderSession
    from lab.teaching.kept_session import KeptSession
    from lab.teaching.teacher import Teacher


@contextmanager
def lesson_room(
    names: Sequence[str], *, page: bool = False, port: int = 0, wait_s: float | None = None, plain: bool = False
) -> Iterator["Classroom"]:
    """Who sits in the lessons of a command: the progress lines, and, when they are wanted, the prompt and the page."""
    from contextlib import ExitStack

    from lab.seat.people import Classroom
    from lab.seat.terminal.prompt import TeachingPrompt
    from lab.view.progress import RunProgress

    progress = RunProgress(console())
    with ExitStack() as stack:
        shown = None
        if page or "web" in names:
            from lab.seat.page.teaching_page import SeatPage

            shown = stack.enter_context(SeatPage(port, wait_s=wait_s))
            progress.console.print(f"page: {shown.url}\nfrom another machine: {shown.hint}", soft_wrap=True)
        prompt = TeachingPrompt(progress.console, plain=plain) if "terminal" in names else None
        room = Classroom(progress, prompt, shown)
        stack.callback(room.leave)
        try:
            yield room
        except LabError as error:
            if shown is not None:
                shown.finished(str(error))
            raise


def teacher_of(
    toolbox: Path | None,
    names: Sequence[str],
    seed: int,
    room: "Classroom",
    asked: str = "together",
    decide: str = "trust-weighted",
) -> "Teacher":
    """The teacher that the options describe; raises BadInput for options and folders that cannot be."""
    from lab.advice.advising import Advising
    from lab.teaching.teacher import Teacher
    from lab.toolbox.registry import Toolbox

    advising = Advising.of(names, room.people(), asked, decide, watch=room.passing)
    for journal in advising.cut_records():
        complain(f"journal '{journal.path}': its last line was cut off and is left out: {journal.cut[:60]!r}")
    teacher = Teacher(Toolbox(toolbox), advising, seed, room)
    teacher.toolbox.check()
    return teacher


def kept_session(
    folder: Path, where: str, *, read_only: bool = False, trusted: Sequence[str] | None = None
) -> "KeptSession":
    """A session that was kept; what was cut off at its end is said."""
    from lab.teaching.kept_session import KeptSession

    kept = KeptSession(folder, where, read_only=read_only, trusted=trusted or ())
    if kept.read.cut:
        complain(f"journal '{kept.read.path}': its last line was cut off and is left out: {kept.read.cut[:60]!r}")
    return kept


def wanted_of(kept: "OrderSession", room: "Classroom", watch: "Watch | None") -> "Wanted":
    """What a session of `lab sequence` asks for, with the people in the room."""
    from lab.production.sequence import Wanted
    from lab.seat.order_text import ORDER

    words = kept.words
    return Wanted(
        words.method,
        words.episodes,
        words.objective,
        words.sessions,
        words.seed,
        words.stochastic,
        words.asked,
        words.gate,
        room.people(),
        keep=lambda cell, objective: kept.keep(Path(words.task).stem, cell, objective),
        hears=lambda event, is_new: room.hears(ORDER, event, is_new),
        watch=watch,
    )


def say_outside(kept: "KeptSession | OrderSession") -> None:
    """Says which files the session has the lab read that are not its own."""
    from lab.teaching import kept_order, lesson

    assert kept.folder is not None
    files = kept_order.outside(kept) if isinstance(kept, kept_order.OrderSession) else lesson.outside(kept)
    if files:
        complain(
            f"journal '{kept.folder / 'events.jsonl'}' names, outside its folder, what is read now: {', '.join(files)}"
        )
