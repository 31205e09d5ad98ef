"""`lab sequence`: the high level alone."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli.lessons import lesson_seat, teacher_of
from lab.cli.options import MAX_EPISODES, MAX_SESSIONS, Json, Plain, Port, Seed, ShowPage, ToolboxFolder, Wait
from lab.cli.output import end, show


def sequence(
    task: Annotated[str, typer.Argument(help="A task or a cell that ships, or a .toml file.")],
    case: Annotated[
        str | None,
        typer.Option("--case", help="toast: I, II or III of the thesis. A cell: its order by initials, such as RSR."),
    ] = None,
    toasts: Annotated[int | None, typer.Option("--toasts", "-n", help="How many parts of the only product.")] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", help="srl (as printed), srl-time, mc, random, fifo, ga, exact, ...; default: the file's."
        ),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            "--objective", help="makespan, mean-tardiness, tardy-parts, robot-idle, machine-idle; default: the file's."
        ),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option("--episodes", min=1, max=MAX_EPISODES, help="Session length; default: the file's."),
    ] = None,
    sessions: Annotated[
        int, typer.Option("--sessions", min=1, max=MAX_SESSIONS, help="How many sessions, each with its own chance.")
    ] = 1,
    stochastic: Annotated[
        bool,
        typer.Option("--stochastic", help="Draw processing times (and arrivals): the list as it is, and reacting."),
    ] = False,
    advisor: Annotated[
        str,
        typer.Option(
            "--advisor",
            help="Who srl may ask which part to move: expert, moderate, limited, novice, tau=X, wrong, terminal, web.",
        ),
    ] = "none",
    gate: Annotated[str, typer.Option("--gate", help="When srl asks: ccrl, always, never.")] = "ccrl",
    plot: Annotated[
        Path | None, typer.Option("--plot", help="A .png or .svg file for the costs of the episodes.")
    ] = None,
    gantt: Annotated[Path | None, typer.Option("--gantt", help="A .png or .svg file for the Gantt chart.")] = None,
    page: ShowPage = False,
    port: Port = 0,
    wait: Wait = None,
    plain: Plain = False,
    seed: Seed = 0,
    toolbox: ToolboxFolder = None,
    as_json: Json = False,
) -> None:
    """The high level alone: the order of the robot's transfers, beside the proven optimum."""
    from lab.production.sequence import Wanted, sequence_named
    from lab.teaching.lesson_options import DEFAULT_ADVISORS, LessonOptions
    from lab.view.summary import sequence_summary

    with lesson_seat([advisor], page=page, port=port, wait_s=wait, plain=plain) as seat:
        teacher = teacher_of(toolbox, LessonOptions(advisors=DEFAULT_ADVISORS, seed=seed), seat)
        wanted = Wanted(method, episodes, objective, sessions, seed, stochastic, advisor, gate, seat.orderers())
        files = {name: path for name, path in (("plot", plot), ("gantt", gantt)) if path is not None}
        with seat.progress:
            document = sequence_named(task, case, toasts, wanted, teacher=teacher, files=files)
    show(document, as_json, sequence_summary)
    if document["interrupted"]:
        end("stopped by Ctrl-C; the best order until then is above", 130)
