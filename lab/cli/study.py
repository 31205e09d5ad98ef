"""`lab study`: run the thesis's tables and our own comparisons."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.options import Json, Seed
from lab.cli.output import console, show


def study_list(as_json: Json = False) -> None:
    """The studies that can be run."""
    rows = [{"name": name, "title": study.title} for name, study in deferred.STUDIES.items()]
    show({"studies": rows}, as_json, lambda d: deferred.table_of(d["studies"], ("name", "title")))


def study_run(
    name: Annotated[
        str,
        typer.Argument(
            help="A study; lab study list names them.", autocompletion=offers("studies"), callback=from_files("studies")
        ),
    ],
    sessions: Annotated[
        int | None,
        typer.Option(
            "--sessions",
            min=1,
            help="Learning sessions for each cell of a table, or orders of the tasks; default: 500 for most studies.",
        ),
    ] = None,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes; the rows are the same.")] = 1,
    dask: Annotated[str | None, typer.Option("--dask", help="The address of a Dask scheduler to work on.")] = None,
    advisor_table: Annotated[
        str | None, typer.Option("--advisor-table", help="The advisors' knowledge: learned (default) or exact values.")
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=0.1, help="transport: for each method on each instance; default: 10."),
    ] = None,
    methods: Annotated[
        str | None,
        typer.Option(
            "--methods",
            help="transport, advicebench: only these methods or rules, separated by commas; a rule of advicebench may be any "
            "gate, also ./mine.py:Gate.",
            callback=from_files("gates"),
        ),
    ] = None,
    problem: Annotated[
        list[str] | None,
        typer.Option(
            "--problem",
            help="advicebench: one of its own problems, a world's file, gym:ID with a model or ./mine.py:Problem instead; it may "
            "be repeated.",
            callback=from_files("problems"),
        ),
    ] = None,
    families_seed: Annotated[
        int | None,
        typer.Option("--families-seed", min=0, help="advicebench: seed of the held-out instances; default: 2026."),
    ] = None,
    advisors: Annotated[
        str | None,
        typer.Option(
            "--advisors",
            help="advicebench: only these advisors, or others such as recorded:DIR or ./mine.py:Advisor, separated by commas.",
            callback=from_files("advisors"),
        ),
    ] = None,
    instances: Annotated[
        list[Path] | None, typer.Option("--instances", help="transport: files or folders of your own instead.")
    ] = None,
    verify: Annotated[
        bool,
        typer.Option(
            "--verify", help="transport: check every schedule against its instance with an independent checker."
        ),
    ] = False,
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for report, rows and sessions; default: NAME-study.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a study and write its report. Results that its folder already holds are not computed again."""
    asked = {
        "advisor_table": advisor_table,
        "seconds": seconds,
        "methods": _listed(methods),
        "problem": problem or None,
        "families_seed": families_seed,
        "advisors": _listed(advisors),
        "instances": instances or None,
        "verify": verify or None,
    }
    reading = {name: value for name, value in asked.items() if value is not None}
    with deferred.counting(console(), f"cells of {name}") as progress:
        job = deferred.Job(sessions or deferred.study_of(name).sessions, seed, workers, dask, progress=progress)
        document = deferred.run_study(name, job, out or Path(f"{name}-study"), reading)
    show(document, as_json, deferred.study_summary)


def study_board(
    files: Annotated[list[Path], typer.Argument(help="Files of scores, as the study advicebench writes them.")],
    plot: Annotated[Path | None, typer.Option("--plot", help="A .png or .svg file for the mean ranks.")] = None,
    as_json: Json = False,
) -> None:
    """Draw a leaderboard from files of scores, one for each member of a study.

    All have to be of one version of the study: the same problems, seeds, advisors, budgets and scores.
    """
    board = deferred.leaderboard(files)
    if plot is not None:
        deferred.draw_board(board, plot)
    show(board, as_json, lambda document: deferred.table_of(document["members"], [*document["members"][0]]))


def _listed(names: str | None) -> list[str] | None:
    return None if names is None else [name.strip() for name in names.split(",")]
