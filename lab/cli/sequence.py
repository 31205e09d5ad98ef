"""`lab sequence`: find an order of transfers, or the shortest cycle."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.lessons import lesson_seat, say_read, teacher_of
from lab.cli.options import (
    Json,
    MethodName,
    Parts,
    PartsPerCycle,
    Plain,
    Port,
    Seed,
    ShowPage,
    ToolboxPlace,
    Wait,
)
from lab.cli.output import end, show
from lab.errors import BadInput

OF_A_CYCLE = ("task", "case", "toasts", "parts", "seed", "layout", "robots")


def cyclic_found(
    given: "deferred.OrderSessionOptions", toolbox: str | None, files: dict[str, Path], parts_per_cycle: int | None
) -> dict[str, Any]:
    """The document of the shortest cycle; BadInput for options of the search for an order, which do not apply to cycles."""
    none = asdict(deferred.OrderSessionOptions())
    for name, value in asdict(given).items():
        if name not in OF_A_CYCLE and value != none[name]:
            said = f"--{name.replace('_', '-')}" + ("" if value is True else f" {value}")
            raise BadInput(
                f"--cyclic beside {said}: the shortest cycle of its parts is found and proven, by its period alone"
            )
    if "plot" in files:
        raise BadInput(f"--cyclic beside --plot {files['plot']}: a cycle has no episodes; --gantt draws it")
    if "schedule" in files:
        raise BadInput(f"--cyclic beside --schedule {files['schedule']}: a cycle has no end: --gantt draws it")
    options = deferred.LessonOptions(advisors=deferred.DEFAULT_ADVISORS, seed=given.seed)
    with lesson_seat(()) as seat, seat.progress:
        teacher = teacher_of(toolbox, options, seat)
        beside = given.beside
        wanted = deferred.CyclicOptions(
            given.case, given.toasts, given.parts, given.seed, beside.layout, beside.robots, parts_per_cycle
        )
        return deferred.cyclic_named(given.task, wanted, teacher, files)


# ---- the command --------------------------------------------------------------------------------------------------------


def sequence(
    task: Annotated[
        str | None,
        typer.Argument(
            help="A task or a cell that ships, a .toml file, or an instance file ({instances}); leave it out with --resume."
        ),
    ] = None,
    case: Annotated[
        str | None,
        typer.Option(
            "--case",
            help="toast: I, II or III of the thesis. A cell: its order by initials, such as RSR. Job sets and layouts as CSV: "
            "SET:LAYOUT, such as 7:1, or EX71.",
        ),
    ] = None,
    layout: Annotated[
        Path | None,
        typer.Option(
            "--layout", help="Beside an instance file: a CSV of travel times, a matrix or rows of from,to,time."
        ),
    ] = None,
    robots: Annotated[
        int | None,
        typer.Option(
            "--robots", min=1, max=50, help="How many robots carry parts, all alike; default: as the file says, or 1."
        ),
    ] = None,
    toasts: Annotated[
        int | None,
        typer.Option("--toasts", "-n", help="How many parts of the only product, or of a task's first kind."),
    ] = None,
    parts: Parts = None,
    method: MethodName = None,
    policy: Annotated[
        Path | None,
        typer.Option(
            "--policy",
            help="The policy of --method carried, or the one that srl-linear begins with: a file, or a name in the toolbox.",
        ),
    ] = None,
    practice: Annotated[
        str | None,
        typer.Option("--practice", help="Further cells that srl-linear learns in, separated by commas."),
    ] = None,
    keep_policy: Annotated[
        str | None,
        typer.Option(
            "--keep-policy",
            help="Keep the policy that srl-linear learned, under a name in the toolbox or in a .json file; --method policy:NAME "
            "decides by it, in any cell.",
        ),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option("--objective", help="{objectives}; default: the file's.", autocompletion=offers("objectives")),
    ] = None,
    episodes: Annotated[
        int | None, typer.Option("--episodes", min=1, help="Session length; default: the file's.")
    ] = None,
    sessions: Annotated[
        int,
        typer.Option("--sessions", min=1, help="The number of sessions, each with its own random numbers."),
    ] = 1,
    stochastic: Annotated[
        bool,
        typer.Option(
            "--stochastic",
            help="Draw processing times (and arrivals), and compare the fixed list with one that reacts.",
        ),
    ] = False,
    advisor: Annotated[
        str,
        typer.Option(
            "--advisor", help="Who srl may ask which part to move: {advisors}.", autocompletion=offers("advisors")
        ),
    ] = "none",
    gate: Annotated[
        str, typer.Option("--gate", help="When srl asks: {order gates}.", autocompletion=offers("order gates"))
    ] = "ccrl",
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", help="End after so many seconds, with the incumbent and its bound."),
    ] = None,
    gap: Annotated[
        float | None,
        typer.Option(
            "--gap", help="End when the gap between the incumbent and the bound is at most this, such as 0.05."
        ),
    ] = None,
    cyclic: Annotated[
        bool,
        typer.Option(
            "--cyclic",
            help="The shortest cycle that the robot can repeat; -n, --parts, --case: the parts of one cycle.",
        ),
    ] = False,
    parts_per_cycle: PartsPerCycle = None,
    resume: Annotated[
        Path | None,
        typer.Option("--resume", help="Continue the session with advice in this folder, with its original options."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="A .png or .svg file for the costs of the episodes.")
    ] = None,
    gantt: Annotated[Path | None, typer.Option("--gantt", help="A .png or .svg file for the Gantt chart.")] = None,
    schedule: Annotated[
        Path | None, typer.Option("--schedule", help="A .csv or .json file for the best order known, as a timed table.")
    ] = None,
    page: ShowPage = False,
    port: Port = 0,
    wait: Wait = None,
    plain: Plain = False,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """The high level alone: find an order of the robot's transfers, and compare it with the proven optimum or bound.

    A person's advice is kept: --resume continues the session, lab replay shows it again.
    """
    given = deferred.OrderSessionOptions(
        task=task or "",
        case=case,
        toasts=toasts,
        method=method,
        objective=objective,
        episodes=episodes,
        sessions=sessions,
        stochastic=stochastic,
        advisor=advisor,
        gate=gate,
        seed=seed,
        parts=parts,
        layout=None if layout is None else str(layout),
        robots=robots,
        policy=None if policy is None else str(policy),
        seconds=seconds,
        gap=gap,
        practice=practice,
        keep_policy=keep_policy,
    )
    asked = {"plot": plot, "gantt": gantt, "schedule": schedule}
    files = {name: path for name, path in asked.items() if path is not None}
    if cyclic:
        if resume is not None:
            raise BadInput(f"--cyclic beside --resume {resume}: nobody is asked about a cycle: leave one of them away")
        show(cyclic_found(given.complete(), toolbox, files, parts_per_cycle), as_json, deferred.cyclic_summary)
        return
    if parts_per_cycle is not None:
        raise BadInput(f"--parts-per-cycle {parts_per_cycle}: only a cycle has as many: add --cyclic")
    box = deferred.Toolbox(toolbox)
    kept = (
        deferred.OrderSession(given.complete(), box) if resume is None else deferred.order_gone_on(given, resume, box)
    )
    if resume is not None:
        say_read(kept, "--resume")
    try:
        with lesson_seat(kept.options.advisors, page=page, port=port, wait_s=wait, plain=plain) as seat, seat.progress:
            lessons = deferred.LessonOptions(advisors=deferred.DEFAULT_ADVISORS, seed=kept.options.seed)
            document = deferred.sequenced(kept, seat.people(), teacher_of(toolbox, lessons, seat), files)
    except KeyboardInterrupt as stopped:
        if kept.journal is None:
            raise
        raise KeyboardInterrupt(f"{str(stopped) or 'stopped by Ctrl-C'}{kept.resume_command(box)}") from None
    show(document | kept.worth(), as_json, deferred.sequence_summary)
    if document["interrupted"]:
        end(f"stopped by Ctrl-C; the best order until then is above{kept.resume_command(box)}", 130)
