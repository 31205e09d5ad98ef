"""`lab run`: a whole task, from learning to a run in physics."""

from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from lab.cli import deferred
from lab.cli.lessons import lesson_seat, teacher_of
from lab.cli.options import (
    AdvisorNames,
    Asked,
    Decide,
    Json,
    MethodName,
    Parts,
    PartsPerCycle,
    Port,
    Seed,
    ShowPage,
    Toasts,
    ToolboxPlace,
    Wait,
)
from lab.cli.output import end, show
from lab.errors import BadInput


def run(
    task: Annotated[
        str | None, typer.Argument(help="A task that ships, or a .toml file.", show_default="toast")
    ] = None,
    toasts: Toasts = None,
    parts: Parts = None,
    advisor: AdvisorNames = None,
    asked: Asked = "together",
    decide: Decide = "trust-weighted",
    page: ShowPage = False,
    speed: Annotated[
        str | None,
        typer.Option("--speed", help="Simulated seconds per second, or max; default: 4 with a page, else max."),
    ] = None,
    port: Port = 0,
    wait: Wait = None,
    override: Annotated[
        int,
        typer.Option(
            "--override", min=10, max=100, help="The arm's speed override [%], which the next plan takes into account."
        ),
    ] = 100,
    faults: Annotated[
        int | None, typer.Option("--faults", min=0, help="Draw faults for the run with this seed; default: none.")
    ] = None,
    order: Annotated[
        str | None, typer.Option("--order", help="The order of the moves by part numbers, such as 1,2,1,1,2,2.")
    ] = None,
    method: MethodName = None,
    cyclic: Annotated[
        bool, typer.Option("--cyclic", help="Repeat the robot's shortest cycle, and measure its period.")
    ] = False,
    parts_per_cycle: PartsPerCycle = None,
    ways: Annotated[
        str,
        typer.Option(
            "--ways", help="How ways become known: learned, or composed of shorter ones where that is possible."
        ),
    ] = "learned",
    seed: Seed = 0,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            min=1,
            help="Processes that survey, time moves and draw; the numbers are the same.",
            show_default="one a core, at most 8",
        ),
    ] = None,
    toolbox: ToolboxPlace = None,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Continue the run in this folder, with its original options.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, replay and JSON; default: TASK-run.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find or learn the skills, time them, find an order for them, and carry them out in physics."""
    with deferred.Workers(workers, first=deferred.load_run) as beside:
        given = deferred.RunOptions(
            *(task or "", toasts, parts, tuple(advisor or ()), asked, decide, override, seed, faults, order, cyclic),
            method=method,
            parts_per_cycle=parts_per_cycle,
            ways=ways,
        )
        if resume is None:
            options = replace(given, task=task or "toast", advisors=given.advisors or deferred.DEFAULT_ADVISORS)
            loaded = deferred.load(options.task)
        else:
            options, loaded = deferred.run_gone_on(given, resume, out)
        composes = options.composes
        wanted, folder = options.by_method(loaded), resume or out or Path(f"{loaded.name}-run")
        deferred.check_out(folder)
        again = f"go on with: lab run --resume {quote(str(folder))}{deferred.named_with(options.advisors)}"
        watched = page or "web" in [deferred.split_praise(name)[0] for name in options.advisors]
        controls = deferred.Controls(deferred.pace(speed or ("4" if watched else "max")))
        lessons = options.lessons()
        lessons.advising()
        prepared = deferred.prepare(wanted, options.ordered(loaded), options.seed, workers=beside)
        journal = deferred.begun(options, loaded, folder) if resume is None else deferred.RunJournal.resume(folder)
        try:
            with lesson_seat(options.advisors, page=page, port=port, wait_s=wait) as seat:
                teacher = teacher_of(toolbox, lessons, seat)
                advice = deferred.RunAdvice(
                    *(teacher.toolbox, lessons, journal, options.order or ""),
                    cyclic=options.cyclic,
                    parts_per_cycle=options.parts_per_cycle,
                )
                teacher = replace(teacher, keep=advice.keep, composes=composes)
                share = options.override / 100
                conditions = deferred.Conditions(
                    share, seat.page, controls, journal, fault_seed=options.faults, advice=advice
                )
                if seat.page is not None:
                    desk = deferred.RunDesk(loaded, prepared.order, controls, journal, seat.hear)
                    conditions = desk.steering(conditions)
                    seat.page.steer(desk)
                with seat.progress:
                    report = deferred.run_task(prepared, teacher, folder, conditions, beside)
        except BadInput:
            if resume is None:
                journal.forget()
            raise
        except KeyboardInterrupt as stopped:
            why = str(stopped) or "stopped by Ctrl-C; what was learned is kept"
            raise KeyboardInterrupt(f"{why}; {again}") from None
        finally:
            journal.close()
    document = report.to_json()
    show(document, as_json, deferred.run_summary)
    if report.outcome.interrupted:
        raise KeyboardInterrupt(f"stopped by Ctrl-C; {again}")
    if not report.success:
        end(report.outcome.failure or deferred.delivered_in_words(document["delivered"], document["parts"]), 1)
    if report.lost:
        end(report.lost, 1)
