"""`lab operate`: the operator's console."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.lessons import lesson_seat, teacher_of
from lab.cli.options import Json, Parts, Port, Seed, ShowPage, Toasts, ToolboxPlace
from lab.cli.output import complain, end, show, write
from lab.errors import counted


def operate(
    task: Annotated[
        str | None, typer.Argument(help="A task that ships, or a .toml file.", show_default="toast")
    ] = None,
    toasts: Toasts = None,
    parts: Parts = None,
    page: ShowPage = False,
    port: Port = 0,
    speed: Annotated[
        str | None,
        typer.Option(
            "--speed", help="Simulated seconds per second, or max; default: 4 at a terminal or with --page, else max."
        ),
    ] = None,
    faults: Annotated[
        int | None, typer.Option("--faults", min=0, help="Draw faults for the run with this seed; default: none.")
    ] = None,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Continue the run by hand in this folder from where it ended.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for journal, pictures and replay; default: TASK-run.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a task by hand: order, pause, stop, jog, lead, grasp, learn, in a live console, on a page, or from a pipe."""
    live = sys.stdin.isatty() and sys.stderr.isatty()
    watched = live or page
    speed_now = deferred.pace(speed or ("4" if watched else "max"))
    options = deferred.RunOptions(task or "", toasts, parts, seed=seed, faults=faults)
    if resume is None:
        options = replace(options, task=task or "toast", advisors=deferred.DEFAULT_ADVISORS)
        loaded = deferred.load(options.task)
    else:
        options, loaded = deferred.run_gone_on(options, resume, out, "operate")
    loaded.ordered(options.toasts, options.parts)  # impossible parts are refused before a journal is written
    folder = resume or out or Path(f"{loaded.name}-run")
    deferred.check_out(folder)
    journal = (
        deferred.begun(options, loaded, folder, "operate") if resume is None else deferred.RunJournal.resume(folder)
    )
    try:
        with lesson_seat(options.advisors, page=page, port=port) as seat:
            if live:
                seat.progress.hear = deferred.unheard  # type: ignore[method-assign]  # the panel tells
            teacher = teacher_of(toolbox, options.lessons(), seat)
            desk = deferred.operating_desk(
                options, loaded, teacher, journal, seat.page, speed=speed_now, attended=watched
            )
            operation = desk.operation
            if seat.page is not None:
                shown = seat.page
                operation.on_done.append(lambda done: shown.ran())
                shown.steer(desk, desk.leave)
            try:
                bad = _at_console(desk, live, as_json, stay=page)
            finally:
                document = deferred.kept_operation(operation, folder)
                operation.close()
    finally:
        journal.close()
    show(document, as_json, _summary)
    if bad is not None:
        end(bad.refused or bad.failed, 2 if bad.refused else 1)


def _at_console(desk: "deferred.Desk", live: bool, as_json: bool, stay: bool) -> "deferred.Done | None":
    """The command that ended a pipe, None for none; stay: whether a page keeps the run open after the pipe."""
    if live:
        deferred.OperatorConsole(desk).run()
        return None
    console = deferred.PlainConsole(desk, complain if as_json else lambda line: write(f"{line}\n"))
    return console.run(sys.stdin, stay=stay)


def _summary(document: dict[str, Any]) -> Any:
    """The text at the end of a console's session."""
    made = deferred.delivered_in_words(document["delivered"], document["parts"])
    said = counted(len(document["commands"]), "command")
    return f"{made}; {said} (seed {document['seed']})"
