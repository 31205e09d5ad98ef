"""`lab tune`: tune settings of learner and gate to a problem."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli import deferred
from lab.cli.compare import listed
from lab.cli.families import from_files, offers
from lab.cli.options import GateName, Json, LearnerName, ProblemName, Seed, SightInWorld, TaskOfSkill
from lab.cli.output import console, show


def tune(
    problem: ProblemName,
    advisor: Annotated[
        str,
        typer.Option(
            "--advisor",
            help="Who advises: {advisors}.",
            autocompletion=offers("advisors"),
            callback=from_files("advisors"),
        ),
    ] = "expert",
    learner: LearnerName = None,
    gate: GateName = None,
    over: Annotated[
        str | None,
        typer.Option(
            "--over",
            help="Settings that are tuned, separated by commas; default: alpha, trace, exploration, beta, lambda_threshold, "
            "omega.",
        ),
    ] = None,
    trials: Annotated[int, typer.Option("--trials", min=1, help="Combinations that are tried.")] = 100,
    sessions: Annotated[int, typer.Option("--sessions", min=2, help="Sessions of each trial that is not pruned.")] = 45,
    task: TaskOfSkill = None,
    sight: SightInWorld = None,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes; the result is the same.")] = 1,
    seed: Seed = 0,
    out: Annotated[Path, typer.Option("--out", help="Folder for report, rows, sessions and settings.toml.")] = Path(
        "tuned"
    ),
    as_json: Json = False,
) -> None:
    """Tune settings to a problem with Optuna, and measure the gain over the problem's own on seeds that no trial used.

    The objective is the mean steps of a session's episodes (the area under the learning curve), where a failed episode counts
    as the step limit + 1; a session that is not solved at its end counts as the step limit + 1. The best settings are written to
    settings.toml, for the problem's file. Results in the folder are not computed again: the same command continues after an
    interruption, or with more --trials.
    """
    held = {name: value for name, value in (("learner", learner), ("gate", gate)) if value is not None}
    names = deferred.USUAL if over is None else [name.replace("-", "_") for name in listed("over", over)]
    what = deferred.Tuning(problem, advisor, held, tuple(names), trials, task, sight)
    study = deferred.Study(f"Tuned: {problem}", lambda job, reading: deferred.tuned(what, job), least=2)
    with deferred.counting(console(), f"trials in {problem}") as progress:
        document = deferred.carried_out(study, "tune", deferred.Job(sessions, seed, workers, progress=progress), out)
    document["files"]["settings"] = str(out / deferred.FILE)
    show(document, as_json, deferred.study_summary)
