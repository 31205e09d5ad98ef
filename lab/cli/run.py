"""`lab run`: the main job."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli.lessons import lesson_seat, teacher_of
from lab.cli.options import AdvisorNames, Asked, Decide, Json, Parts, Port, Seed, ShowPage, Toasts, ToolboxPlace, Wait
from lab.cli.output import end, show


def run(
    task: Annotated[str, typer.Argument(help="A task that ships, or a .toml file.")] = "toast",
    toasts: Toasts = None,
    parts: Parts = None,
    advisor: AdvisorNames = None,
    asked: Asked = "together",
    decide: Decide = "trust-weighted",
    page: ShowPage = False,
    view: Annotated[bool, typer.Option("--view/--no-view", hidden=True)] = False,  # the old word for --page
    port: Port = 0,
    wait: Wait = None,
    override: Annotated[
        int,
        typer.Option("--override", min=10, max=100, help="The arm's speed override [%]; the next plan knows of it."),
    ] = 100,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, replay and JSON; default: TASK-run.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find or learn the skills, time them, find their best order, and carry them out in physics."""
    from dataclasses import replace

    from lab.advice.advisors import PEOPLE
    from lab.files import check_out
    from lab.production.run import run as run_task
    from lab.skills.prepared_scene import prepare
    from lab.tasks import task_file as taskfile
    from lab.teaching.kept_session import kept_by
    from lab.teaching.lesson_options import DEFAULT_ADVISORS, LessonOptions
    from lab.view.summary import delivered_in_words, run_summary

    loaded = taskfile.load(task)
    folder = out or Path(f"{loaded.name}-run")
    check_out(folder)
    names = tuple(advisor or DEFAULT_ADVISORS)
    options = LessonOptions(
        task=task, advisors=names, asked=asked, decide=decide, seed=seed, toasts=toasts, parts=parts
    )
    options.advising()
    prepared = prepare(loaded, loaded.ordered(toasts, parts), seed)
    with lesson_seat(options.advisors, page=page or view, port=port, wait_s=wait) as seat:
        teacher = teacher_of(toolbox, options, seat)
        if any(name in PEOPLE for name in options.advisors):
            teacher = replace(teacher, keep=kept_by(teacher.toolbox, options))
        try:
            with seat.progress:
                report = run_task(prepared, teacher, folder, override=override / 100, viewer=seat.page)
        except KeyboardInterrupt as stopped:
            raise KeyboardInterrupt(str(stopped) or "stopped by Ctrl-C; what was learned is kept") from None
    document = report.to_json()
    show(document, as_json, run_summary)
    if not report.success:
        end(report.outcome.failure or delivered_in_words(document["delivered"], document["parts"]), 1)
