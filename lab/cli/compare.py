"""`lab study compare`: compare settings of learner, gate and advisor on a problem of the user's choice."""

from collections.abc import Callable
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.options import Json, ProblemName, Seed, SightInWorld, TaskOfSkill
from lab.cli.output import console, show
from lab.errors import BadInput
from lab.learning.settings import SETTINGS

FAMILIES = {"learner": "learners", "gate": "gates", "selection": "selections"}
SWITCHES = {"true": True, "false": False}


def _with_settings(function: Callable[..., None]) -> Callable[..., None]:
    """The command with an option for each setting of learner and gate in place of **values."""
    shown = signature(function)
    own = [parameter for parameter in shown.parameters.values() if parameter.kind is not Parameter.VAR_KEYWORD]
    more = []
    for name, setting in SETTINGS.items():
        family = FAMILIES.get(name)
        which = f": {{{family}}}" if family else f" ({setting.allowed})"
        meaning = f"{setting.meaning[:1].upper()}{setting.meaning[1:]}"
        option = typer.Option(
            f"--{name.replace('_', '-')}",
            help=f"{meaning}{which}; several separated by commas; default: the problem's.",
            autocompletion=offers(family) if family else None,
            callback=from_files(family) if family else None,
        )
        kind = Annotated[str | None, option]
        more.append(Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=kind))
    function.__signature__ = shown.replace(parameters=[*own, *more])  # type: ignore[attr-defined]
    function.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *more)}
    return function


@_with_settings
def study_compare(
    problem: ProblemName,
    *,
    advisor: Annotated[
        str,
        typer.Option(
            "--advisor",
            help="Who advises: {advisors}; several separated by commas.",
            callback=from_files("advisors"),
        ),
    ] = "expert",
    task: TaskOfSkill = None,
    sight: SightInWorld = None,
    sessions: Annotated[int, typer.Option("--sessions", min=2, help="Sessions for each setting.")] = 100,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes; the rows are the same.")] = 1,
    dask: Annotated[str | None, typer.Option("--dask", help="The address of a Dask scheduler to work on.")] = None,
    seed: Seed = 0,
    out: Annotated[Path, typer.Option("--out", help="Folder for report, rows and sessions.")] = Path("compared"),
    as_json: Json = False,
    **values: str | None,
) -> None:
    """Compare settings: every combination of the options' values, separated by commas, in many sessions each.

    Same seed, same rows. What the folder already holds is not run again.
    """
    given = {name: parsed(name, text) for name, text in values.items() if text is not None}
    what = deferred.Compared(problem, listed("advisor", advisor), given, task, sight)
    study = deferred.Study(f"Compared: {problem}", lambda job, reading: deferred.compared(what, job), least=2)
    with deferred.counting(console(), f"settings in {problem}") as progress:
        document = deferred.carried_out(
            study, "compare", deferred.Job(sessions, seed, workers, dask, progress=progress), out
        )
    show(document, as_json, deferred.study_summary)


def listed(name: str, text: str) -> list[str]:
    """The values of an option, separated by commas; BadInput for an empty one."""
    words = [word.strip() for word in text.split(",")]
    if not all(words):
        raise BadInput(f"--{name.replace('_', '-')} '{text}': wanted one value, or several with commas between")
    return words


def parsed(name: str, text: str) -> list[Any]:
    """The values of a setting's option, converted to its type; BadInput for an invalid one."""
    kind = type(SETTINGS[name].default)

    def one(word: str) -> Any:
        try:
            return SWITCHES[word.lower()] if kind is bool else kind(word)
        except (KeyError, ValueError):
            allowed = {bool: "true or false", int: "whole numbers", float: "numbers"}[kind]
            raise BadInput(f"--{name.replace('_', '-')} '{word}': allowed are {allowed}") from None

    return [one(word) for word in listed(name, text)]
