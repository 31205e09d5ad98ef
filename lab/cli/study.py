"""`lab study`: the thesis's tables and comparisons of our own."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli.families import offers
from lab.cli.options import Json, Seed
from lab.cli.output import console, show


def study_list(as_json: Json = False) -> None:
    """The studies that can be run."""
    from lab.studies import STUDIES
    from lab.view.summary import table_of

    rows = [{"name": name, "title": study.title} for name, study in STUDIES.items()]
    show({"studies": rows}, as_json, lambda d: table_of(d["studies"], ("name", "title")))


def study_run(
    name: Annotated[str, typer.Argument(help="A study; lab study list names them.", autocompletion=offers("studies"))],
    sessions: Annotated[
        int | None,
        typer.Option(
            "--sessions",
            min=1,
            max=1_000_000,
            help="Learning sessions for each cell of a table, or orders of the tasks; default: 500 for most studies.",
        ),
    ] = None,
    workers: Annotated[int, typer.Option("--workers", min=1, max=256, help="Processes; the rows are the same.")] = 1,
    dask: Annotated[str | None, typer.Option("--dask", help="The address of a Dask scheduler to work on.")] = None,
    advisor_table: Annotated[
        str | None, typer.Option("--advisor-table", help="What advisors know: learned (default) or exact values.")
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for report, rows and sessions; default: NAME-study.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run a study and write its report; sessions of chapter 9 that a folder already holds are not run again."""
    from lab.studies import run_study, study_of
    from lab.studies.runner import Job
    from lab.view.progress import counting
    from lab.view.summary import study_summary

    with counting(console(), f"cells of {name}") as progress:
        job = Job(sessions or study_of(name).sessions, seed, workers, dask, progress=progress)
        document = run_study(name, job, out or Path(f"{name}-study"), advisor_table)
    show(document, as_json, study_summary)
