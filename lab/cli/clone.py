"""`lab clone`: a student of demonstrations that asks where its mentor doubts."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.options import Json, Port
from lab.cli.output import console, show
from lab.errors import BadInput, counted, shortened, unknown
from lab.lazy import rich

DEMONSTRATORS = ("scripted", "person")
TEACHERS = ("scripted", "terminal", "page")
UNPROMISED = ("always", "never", "random", "clock")  # rules whose thresholds no rollouts set


def clone(
    skill: Annotated[
        str | None, typer.Argument(help="A skill of the task, or a sub-task: grasp, insert, place, transfer.")
    ] = None,
    task: Annotated[
        str | None, typer.Option("--task", help="A task that ships, or a .toml file; default: toast.")
    ] = None,
    demonstrations: Annotated[
        int | None,
        typer.Option("--demonstrations", min=1, max=10_000, help="Episodes of the teacher at the start; default: 15."),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            help="Begin with the demonstrations in this folder, a LeRobot dataset, in place of the teacher's.",
        ),
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option(
            "--rounds", min=0, max=1000, help="Rounds of asking and learning again, with --resume in all; default: 4."
        ),
    ] = None,
    questions: Annotated[
        int | None,
        typer.Option("--questions", min=1, max=100_000, help="Takeovers in a round, at most; default: 10."),
    ] = None,
    rule: Annotated[
        str | None,
        typer.Option(
            "--rule",
            help="When it asks: {doubts}, or './mine.py:MyRule'; default: progress.",
            autocompletion=offers("doubts"),
            callback=from_files("doubts"),
        ),
    ] = None,
    false_alarms: Annotated[
        float | None,
        typer.Option(
            "--false-alarms", help="Share of the episodes that would succeed in which it may ask; default: 0.2."
        ),
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            "--noise", min=0.0, max=1.0, help="Disturbance of each action, a share of the velocity; default: 0.1."
        ),
    ] = None,
    evaluated: Annotated[
        int | None,
        typer.Option(
            "--evaluated", min=1, max=100_000, help="Episodes by which each round's student is measured; default: 30."
        ),
    ] = None,
    teacher: Annotated[
        str, typer.Option("--teacher", help="Who takes over: scripted, or you at the terminal or on a page.")
    ] = "scripted",
    demonstrator: Annotated[
        str | None,
        typer.Option(
            "--demonstrator",
            help="Who demonstrates at the start: scripted, or person, who also takes over; default: scripted.",
        ),
    ] = None,
    port: Port = 0,
    epochs: Annotated[
        int | None,
        typer.Option("--epochs", min=1, max=100_000, help="Epochs of each student's learning; default: 400."),
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option("--resume", help="Continue the session in this folder, with its own options."),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Seed of all random numbers; default: 0.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for datasets (LeRobot), students, mentors and measurements.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="Picture (.png or .svg) of the success by questions.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Clone a skill from demonstrations: roll the student out in physics, let it ask, learn the corrections, and again.

    A mentor asks where it doubts; the teacher then takes over for a second. Each round's student is measured in episodes that
    nothing else has used.
    """
    if (skill is None) == (resume is None):
        raise BadInput("wanted a skill, or --resume DIR; one of the two")
    if false_alarms is not None and rule in UNPROMISED:
        raise BadInput(f"--false-alarms beside --rule {rule}: no rollouts set when it asks: remove --false-alarms")
    for option, given in (("--demonstrations", demonstrations), ("--demonstrator", demonstrator)):
        if dataset is not None and given is not None:
            raise BadInput(f"{option} beside --dataset: a session begins with all that the dataset shows: remove one")
    if teacher not in TEACHERS:
        raise unknown("teacher", teacher, TEACHERS, "--teacher")
    if demonstrator not in (None, *DEMONSTRATORS):
        raise unknown("demonstrator", demonstrator, DEMONSTRATORS, "--demonstrator")
    if demonstrator == "person" and teacher == "scripted":
        raise BadInput("--demonstrator person beside --teacher scripted: wanted --teacher page, or --teacher terminal")
    if teacher != "scripted" and resume is None and out is None:
        raise BadInput(f"--teacher {teacher} without --out: wanted a folder in which all that you show is kept")
    if plot is not None:
        deferred.check_picture(plot)
    deferred.require_extra("lab clone", "recordings")
    own = {
        "demonstrations": demonstrations,
        "questions": questions,
        "rule": rule,
        "false_alarms": false_alarms,
        "evaluated": evaluated,
        "epochs": epochs,
        "seed": seed,
    }
    shown = None
    if resume is not None:
        kept = deferred.cloning_options_of(resume)
        for name, value in (
            own | {"dataset": dataset, "demonstrator": demonstrator, "task": task, "noise": noise, "out": out}
        ).items():
            if value is not None and not (
                name == "rule" and value == kept.options.rule
            ):  # from a file, it is named again
                option = f"--{name.replace('_', '-')}"
                raise BadInput(
                    f"{option} beside --resume: the session in '{resume}' goes on as it was begun; remove {option}"
                )
        if rounds is not None:
            kept = replace(kept, options=replace(kept.options, rounds=rounds))
    else:
        if out is not None:
            deferred.check_new_cloning(out)
        options = deferred.CloningOptions(**_given(own | {"rounds": rounds}))
        problem = deferred.SkillProblem(**_given({"task": task, "skill": skill, "noise": noise}))
        problem.env  # noqa: B018  # a task or skill that is unknown is refused before anything is written
        if dataset is not None:
            shown = problem.taken(deferred.read_recording(dataset), f"dataset '{dataset}' (--dataset)")
            options, demonstrator = replace(options, demonstrations=len(shown.episodes)), "dataset"
        kept = deferred.KeptCloningOptions(problem, options, demonstrator or "scripted")
    if not as_json:
        console().print(_beginning(kept.options, shown), markup=False)
    folder = resume or out
    measured = list[Any]()
    try:
        with _person(teacher, port, kept) as person:
            for session in deferred.rounds_of(kept, folder, person, shown):
                measured = session.measured
                console().print(_line(measured[-1], kept.options.rule), markup=False)
    finally:
        kept.problem.close()
    if plot is not None:
        title = f"{kept.problem.skill}, asking by {kept.options.rule}"
        asked = [one.questions for one in measured]
        deferred.success_by_questions([one.successes for one in measured], asked, title, plot)
    document = {
        "task": kept.problem.task,
        "skill": kept.problem.skill,
        "rule": kept.options.rule,
        "demonstrator": kept.demonstrator,
        "fps": kept.problem.fps,
        "rounds": [asdict(one) | {"success": one.success} for one in measured],
        "out": None if folder is None else str(folder),
        "plot": None if plot is None else str(plot),
    }
    show(document, as_json, _summary)


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values that were given; the others have the defaults of their records."""
    return {name: value for name, value in values.items() if value is not None}


def _beginning(options: "deferred.CloningOptions", shown: Any) -> str:
    told = {episode.task for episode in shown.episodes if episode.task} if shown is not None else set[str]()
    of = f" of '{shortened(', '.join(sorted(told)), 60)}'" if told else ""
    return (
        f"{counted(options.demonstrations, 'demonstration')}{of}, then rounds: in each up to {options.episodes} episodes with a "
        f"teacher, {options.calibrated} that calibrate the mentor, and {options.evaluated} that measure the student"
    )


@contextmanager
def _person(teacher: str, port: int, kept: Any) -> "Iterator[deferred.PersonRollouts | None]":
    """Who takes over in place of the scripted teacher, as long as the block lasts; None for nobody."""
    steps = kept.options.takeover_steps
    if teacher == "page":
        with deferred.TakeoverPage(port) as page:
            console().print(f"page: {page.url}\nfrom another machine: {page.hint}", soft_wrap=True)
            yield deferred.PersonRollouts(kept.problem, steps, page.ask, page.step)
    elif teacher == "terminal":
        read = deferred.default_reader(console(), moves=False)
        yield deferred.PersonRollouts(kept.problem, steps, deferred.takeover_prompt(read, console()))
    else:
        yield None


def _line(measured: Any, rule: str) -> str:
    failures = measured.successes.count(False)
    successes = len(measured.successes) - failures
    by = f", by '{measured.rule}'," if measured.rule not in ("", rule) else ""
    return (
        f"round {measured.round}: {100 * measured.success:.0f} % of {counted(len(measured.successes), 'episode')} after "
        f"{counted(measured.questions, 'question')}; its mentor{by} doubts in {measured.warned} of "
        f"{counted(failures, 'failure')} and in {measured.false_alarms} of {counted(successes, 'success')}"
    )


def _summary(document: dict[str, Any]) -> "rich.console.RenderableType":
    table = rich.table.Table(box=None, pad_edge=False)
    for number, name in enumerate(
        ("round", "success", "questions", "corrected steps", "failures doubted", "median lead")
    ):
        table.add_column(name, justify="right" if number else "left")
    for one in document["rounds"]:
        leads = one["lead_steps"]
        table.add_row(
            str(one["round"]),
            f"{100 * one['success']:.0f} %",
            str(one["questions"]),
            str(one["corrected_steps"]),
            f"{one['warned']} of {[*one['successes']].count(False)}",
            f"{median(leads) / document['fps']:.1f} s" if leads else "–",
        )
    below = [f"{document['skill']} of {document['task']}, asking by '{document['rule']}'"]
    if document["rule"] not in UNPROMISED and any(one["promise"] is None for one in document["rounds"]):
        below.append("without a promise: too few of the rollouts that calibrate the mentor succeeded")
    others = [one for one in document["rounds"] if one["rule"] not in ("", document["rule"])]
    for other in sorted({one["rule"] for one in others}):
        numbers = ", ".join(str(one["round"]) for one in others if one["rule"] == other)
        below.append(
            f"in {'round' if ',' not in numbers else 'rounds'} {numbers} by '{other}', because '{document['rule']}' learns from "
            "rollouts of which some fail and some succeed"
        )
    if any(one["rejected"] for one in document["rounds"]):
        below.append("it asks no more: the takeovers have not helped")
    if document["out"]:
        below.append(f"in {document['out']}: demonstrations and corrections as LeRobot datasets, students, mentors")
    return rich.console.Group(table, rich.text.Text("\n".join(below)))
