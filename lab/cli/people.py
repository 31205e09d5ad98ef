"""`lab study export` and `lab study people`: a study with people as tables, and its arms compared."""

from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, Seed
from lab.cli.output import show
from lab.errors import counted
from lab.lazy import rich


def study_export(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder of a class or of a study (lab class --out).")
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder for the tables, their dictionary and export.json.")],
    parquet: Annotated[
        bool, typer.Option("--parquet", help="Write the tables as Parquet files, too (extra people).")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write a class or a study with people as tables for statistics: a lesson a row, an answer a row, and their dictionary.

    participants.csv has a row for each lesson of a participant, with the answers of questionnaires; answers.csv has a row for
    each answer; dictionary.csv says what each column means.
    """
    show(deferred.export(folder, out, parquet), as_json, _exported)


def study_people(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder of an export (lab study export), or of a study itself.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder for the report and its figures.")],
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure",
            help="A column of participants.csv to compare; it may be repeated; default: the usual ones, and the raw task load.",
        ),
    ] = None,
    model: Annotated[
        bool, typer.Option("--model/--no-model", help="Whether the mixed-effects model is fitted (extra people).")
    ] = True,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Compare the arms of a study with people: mixed-effects model, rank tests, sizes of effects, figures, and a report.

    Within participants: Friedman's and Wilcoxon's tests; between them: Kruskal-Wallis and Mann-Whitney; pairs by Holm's method.
    """
    about, rows = deferred.exported(folder)
    show(deferred.people_compared(rows, about, out, measure or (), seed, model), as_json, _compared)


def _exported(document: dict[str, Any]) -> Any:
    counts = f"{counted(document['participants'], 'participant')}, {counted(document['lessons'], 'lesson')}, "
    gone = f", {document['withdrawn']} withdrawn" if document["withdrawn"] else ""
    return f"{counts}{counted(document['answers'], 'answer')}{gone}; files: {', '.join(document['files'].values())}"


def _compared(document: dict[str, Any]) -> Any:
    rows = [
        {
            "measure": measure["name"],
            "pair": f"{pair['second']} - {pair['first']}",
            "n": pair["n"],
            "difference": _text(pair["difference"]),
            "95 %": "" if pair["difference_ci95"] is None else " to ".join(map(_text, pair["difference_ci95"])),
            "p (Holm)": _text(pair["p_holm"]),
        }
        for measure in document["measures"]
        for pair in measure["pairs"]
    ]
    lines = ["", *document["notes"], f"report: {document['files']['report']}"]
    return rich.console.Group(deferred.table_of(rows, [*rows[0]] if rows else ()), *map(rich.text.Text, lines))


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"
