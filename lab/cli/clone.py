"""`lab clone`: a student of demonstrations that asks where its mentor doubts."""

from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json, Seed
from lab.cli.output import console, show
from lab.errors import BadInput, counted
from lab.lazy import rich


def clone(
    skill: Annotated[
        str | None, typer.Argument(help="A skill of the task, or a sub-task: grasp, insert, place, transfer.")
    ] = None,
    task: Annotated[str, typer.Option("--task", help="A task that ships, or a .toml file.")] = "toast",
    demonstrations: Annotated[
        int, typer.Option("--demonstrations", min=1, max=10_000, help="Episodes of the teacher at the start.")
    ] = 5,
    rounds: Annotated[int, typer.Option("--rounds", min=0, max=1000, help="Rounds of asking and learning again.")] = 4,
    questions: Annotated[
        int, typer.Option("--questions", min=1, max=100_000, help="Takeovers in a round, at most.")
    ] = 10,
    rule: Annotated[
        str, typer.Option("--rule", help="When it asks: {doubts}.", autocompletion=offers("doubts"))
    ] = "distance",
    false_alarms: Annotated[
        float, typer.Option("--false-alarms", help="Share of the episodes that would succeed in which it may ask.")
    ] = 0.2,
    noise: Annotated[
        float, typer.Option("--noise", min=0.0, max=1.0, help="Standard deviation of the disturbance of each action.")
    ] = 0.1,
    evaluated: Annotated[
        int, typer.Option("--evaluated", min=1, max=100_000, help="Episodes by which each round's student is measured.")
    ] = 30,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Continue the session in this folder, with its options; more --rounds.")
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for datasets (LeRobot), students, mentors and measurements.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Clone a skill from demonstrations: roll the student out in physics, let it ask, learn the corrections, and again.

    A mentor asks where it doubts; the teacher then takes over for a second. Each round's student is measured in episodes that
    nothing else has used.
    """
    if (skill is None) == (resume is None):
        raise BadInput("wanted a skill, or --resume DIR; one of the two")
    if resume is not None:
        if out is not None:
            raise BadInput(f"--out beside --resume: the session stays in '{resume}'")
        kept = deferred.cloning_options_of(resume)
        kept = replace(kept, options=replace(kept.options, rounds=max(rounds, kept.options.rounds)))
    else:
        if rule not in deferred.DOUBTS:
            raise deferred.unknown("rule", rule, tuple(deferred.DOUBTS), "--rule")
        if not 0.0 < false_alarms < 1.0:
            raise BadInput(f"--false-alarms {false_alarms:g}: wanted a share above 0 and below 1")
        if out is not None:
            deferred.check_new_cloning(out)
        options = deferred.CloningOptions(
            demonstrations=demonstrations,
            rounds=rounds,
            questions=questions,
            rule=rule,
            false_alarms=false_alarms,
            evaluated=evaluated,
            seed=seed,
        )
        kept = deferred.KeptOptions(deferred.SkillProblem(task, str(skill), noise), options)
        kept.problem.env  # noqa: B018  # a task or skill that is unknown is refused before anything is written
    folder = resume or out
    session = None
    try:
        for session in _sessions(folder, kept):
            console().print(_line(session.measured[-1]), markup=False)
    finally:
        kept.problem.close()
    measured = session.measured if session is not None else deferred.measured_in(folder)
    document = {
        "task": kept.problem.task,
        "skill": kept.problem.skill,
        "rule": kept.options.rule,
        "rounds": [asdict(one) | {"success": one.success} for one in measured],
        "out": None if folder is None else str(folder),
    }
    show(document, as_json, _summary)
