"""`lab operate`: the operator's console."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lab.cli.lessons import lesson_seat, teacher_of
from lab.cli.options import Json, Parts, Port, Seed, ShowPage, Toasts, ToolboxPlace
from lab.cli.output import complain, end, show, write

if TYPE_CHECKING:
    from lab.production.operation.at_once import Done
    from lab.production.operation.desk import Desk
    from lab.production.operation.operation import Operation


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
        Path | None, typer.Option("--resume", help="Go on with what was done by hand in this folder, from there.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for journal, pictures and replay; default: TASK-run.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a task by hand: order, pause, stop, jog, lead, grasp, learn, in a live console, on a page, or from a pipe."""
    import sys
    from dataclasses import replace

    from lab.files import check_out
    from lab.production.conditions import Conditions
    from lab.production.controls import Controls
    from lab.production.operation.commands import pace
    from lab.production.operation.desk import Desk
    from lab.production.operation.operation import Operation
    from lab.production.run_journal import RunJournal
    from lab.production.run_options import RunOptions, begun, gone_on
    from lab.tasks.task_file import load
    from lab.teaching.events import unheard
    from lab.teaching.lesson_options import DEFAULT_ADVISORS

    live = sys.stdin.isatty() and sys.stderr.isatty()
    watched = live or page
    speed_now = pace(speed or ("4" if watched else "max"))
    options = RunOptions(task or "", toasts, parts, seed=seed, faults=faults)
    if resume is None:
        options = replace(options, task=task or "toast", advisors=DEFAULT_ADVISORS)
        loaded = load(options.task)
    else:
        options, loaded = gone_on(options, resume, out, "operate")
    order, folder = loaded.ordered(options.toasts, options.parts), resume or out or Path(f"{loaded.name}-run")
    check_out(folder)
    journal = begun(options, loaded, folder, "operate") if resume is None else RunJournal.resume(folder)
    try:
        with lesson_seat(options.advisors, page=page, port=port) as seat:
            if live:
                seat.progress.hear = unheard  # type: ignore[method-assign]  # the panel tells
            teacher = teacher_of(toolbox, options.lessons(), seat)
            conditions = Conditions(1.0, seat.page, Controls(speed_now), journal, fault_seed=options.faults)
            operation = Operation(loaded, order, options.seed, teacher, conditions)
            desk = Desk(operation, attended=watched, known=journal.known)
            if seat.page is not None:
                shown = seat.page
                operation.on_done.append(lambda done: shown.ran())
                shown.steer(desk, desk.leave)
            try:
                bad = _at_console(desk, live, as_json, stay=page)
            finally:
                document = _kept(operation, folder)
                operation.close()
    finally:
        journal.close()
    show(document, as_json, _summary)
    if bad is not None:
        end(bad.refused or bad.failed, 2 if bad.refused else 1)


def _at_console(desk: "Desk", live: bool, as_json: bool, stay: bool) -> "Done | None":
    """The command that ended a pipe, None for none; stay: beside a page, which goes on when the pipe has ended."""
    import sys

    if live:
        from lab.seat.terminal.console_app import OperatorConsole

        OperatorConsole(desk).run()
        return None
    from lab.seat.terminal.console_plain import PlainConsole

    console = PlainConsole(desk, complain if as_json else lambda line: write(f"{line}\n"))
    return console.run(sys.stdin, stay=stay)


def _kept(operation: "Operation", folder: Path) -> dict[str, Any]:
    """Write the files of the run, where one was carried out, and the document of what was done."""
    from dataclasses import asdict

    from lab.production.report import write_files
    from lab.production.run import remember
    from lab.production.run_journal import RunEnded

    scene, report = operation.scene, operation.report()
    document = {
        "task": scene.task.name,
        "seed": scene.seed,
        "parts": {kind: scene.order.count(kind) for kind in dict.fromkeys(scene.order)},
        "success": False,
        "delivered": 0,
        "failure": None,
        "files": {},
    }
    if report is not None and report.outcome.schedule.robot:
        write_files(report, folder)
        if not report.outcome.interrupted:
            remember(report, scene.teacher)
            scene.journal.tell(RunEnded(len(report.outcome.delivered), report.outcome.failure or ""))
    if report is not None:
        document |= report.to_json()
    said = {"commands": [asdict(done) for done in operation.done], "demonstrations": scene.demonstrations}
    return document | said | {"status": operation.now().to_json()}


def _summary(document: dict[str, Any]) -> Any:
    """The end of a console's session."""
    from lab.errors import counted
    from lab.view.summary import delivered_in_words

    made = delivered_in_words(document["delivered"], document["parts"])
    said = counted(len(document["commands"]), "command")
    return f"{made}; {said} (seed {document['seed']})"
