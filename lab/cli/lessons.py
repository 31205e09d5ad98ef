"""The shared code of the commands that teach: the seat, the teacher, and the notices of a kept session."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from lab.cli import deferred
from lab.cli.output import complain, console
from lab.errors import LabError
from lab.files import is_file


@contextmanager
def lesson_seat(
    names: Sequence[str],
    *,
    page: bool = False,
    port: int = 0,
    wait_s: float | None = None,
    plain: bool = False,
    times: bool = False,
) -> Iterator["deferred.LessonSeat"]:
    """The seat of a command's lessons: the progress lines, and on request the prompt, the page and language models.

    times: whether the times of people's answers are kept beside their journals.
    """
    names = [deferred.split_praise(name)[0] for name in names]
    progress, asked = deferred.RunProgress(console()), [name for name in names if name.startswith(deferred.MODEL)]
    models = deferred.language_models(asked) if asked else {}
    with ExitStack() as stack:
        shown = None
        if page or "web" in names:
            shown = stack.enter_context(deferred.SeatPage(port, wait_s=wait_s))
            progress.console.print(f"page: {shown.url}\nfrom another machine: {shown.hint}", soft_wrap=True)
            if not {"web", "terminal"} & {*names}:
                shown.asks_nobody()
        several = [name for name in names if name.startswith(deferred.PAGE_OF)]
        pages = {name: stack.enter_context(deferred.SeatPage(wait_s=wait_s)) for name in several}
        for name, one in pages.items():
            progress.console.print(f"page of {name.removeprefix(deferred.PAGE_OF)}: {one.url}", soft_wrap=True)
        team = stack.enter_context(deferred.Team(pages)) if pages else None
        prompt = deferred.TeachingPrompt(progress.console, plain=plain) if "terminal" in names else None
        kept = deferred.AnswerTimes() if times else None
        if kept is not None:
            stack.callback(kept.close)
        seat = deferred.LessonSeat(progress, prompt, shown, models, team, kept)
        stack.callback(seat.clear_scene)
        try:
            yield seat
            for model in models.values():
                progress.console.print(str(model), soft_wrap=True)
        except LabError as error:
            for one in (*([] if shown is None else [shown]), *pages.values()):
                one.finished(str(error))
            raise


def teacher_of(
    toolbox: str | None, options: "deferred.LessonOptions", seat: "deferred.LessonSeat"
) -> "deferred.Teacher":
    """The teacher that the options describe; raises BadInput for impossible options.

    Whether the toolbox can be written is checked just before a policy is learned, so that commands that learn nothing need
    no write access.
    """
    box = deferred.Toolbox(toolbox)
    box.check(to_write=False)
    advising = replace(options.advising(seat.people()), toolbox=box)
    for journal in advising.cut_records():
        _say_cut(journal)
    return deferred.Teacher(box, advising, options.seed, seat.hear)


def _say_cut(read: "deferred.Read") -> None:
    complain(f"journal '{read.path}': its last line was cut off and is left out: {read.cut[:60]!r}")


def say_read(kept: "deferred.KeptSession | deferred.OrderSession", where: str) -> None:
    """Report, for a session that is continued or replayed, a line that was cut off, and files outside its folder."""
    assert kept.read is not None
    if kept.read.cut:
        _say_cut(kept.read)
    for line in kept.notes:
        complain(f"session '{kept.read.path.parent}': {line}")
    options = kept.options
    named: list[object] = [getattr(options, "subtask", None), options.task]
    if str(named[0]).startswith("gym:"):
        named = list(deferred.parse_name(str(named[0]), where).options.values())
    files = [word for word in named if isinstance(word, str) and deferred.is_path(word) and is_file(word)]
    advisors = [deferred.AdvisorName.of(name) for name in options.advisors]
    files += [str(file) for name in advisors for file in (name.folder, name.answers) if file is not None]
    here = kept.read.path.parent.resolve()
    if outside := [name for name in files if not Path(name).resolve().is_relative_to(here)]:
        complain(f"journal '{kept.read.path}' names, outside its folder, what is read now: {', '.join(outside)}")
