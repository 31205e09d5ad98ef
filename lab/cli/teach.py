"""`lab teach`: one teaching session."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.lessons import lesson_seat, say_read, teacher_of
from lab.cli.options import (
    AdvisorNames,
    Asked,
    Decide,
    GateName,
    Json,
    LearnerName,
    Plain,
    Port,
    Seed,
    ShowPage,
    Times,
    ToolboxPlace,
    TrustModule,
    Wait,
)
from lab.cli.output import end, show
from lab.errors import BadInput, counted


def teach(
    subtask: Annotated[
        str | None,
        typer.Argument(
            help="{skills}, one skill by its full name; a world: its name, a .toml file, a .txt grid, random:SHAPE:DENSITY:SEED; "
            "a Gymnasium environment: gym:ID, such as gym:FrozenLake-v1; ./mine.py:Problem; a problem that packages add (one "
            "with instances as NAME:NUMBER): {problems}.",
            autocompletion=offers("skills", "problems"),
            callback=from_files("problems"),
        ),
    ] = None,
    task: Annotated[
        str | None, typer.Option("--task", help="A task that ships, or a .toml file; default: toast. None for a world.")
    ] = None,
    learner: LearnerName = None,
    gate: GateName = None,
    memory: Annotated[
        bool | None,
        typer.Option(
            "--memory/--no-memory",
            help="Whether the learner memorizes advice and repeats it unasked; default: the task's.",
        ),
    ] = None,
    advisor: AdvisorNames = None,
    asked: Asked = "together",
    decide: Decide = "trust-weighted",
    peers: Annotated[
        int | None,
        typer.Option(
            "--peers",
            min=2,
            max=16,
            help="So many learners of the problem at once, each of which asks the others; the best policy is kept.",
        ),
    ] = None,
    peer_tasks: Annotated[
        list[str] | None,
        typer.Option(
            "--peer-task",
            help="A further task, as for --task, whose sub-task is learned at the same time, such as with another arm: by one "
            "peer, or by so many as --peers says. It may be repeated.",
        ),
    ] = None,
    episodes: Annotated[
        int | None, typer.Option("--episodes", min=1, help="Session length; default: the task's.")
    ] = None,
    save: Annotated[str | None, typer.Option("--save", help="Name of the policy in the toolbox.")] = None,
    sight: Annotated[
        str | None,
        typer.Option(
            "--sight",
            help="Where in a world the advisor sees the robot: full, or limited to the region in its file; default: full.",
        ),
    ] = None,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Continue the session in this folder, with its original options.")
    ] = None,
    trust_module: TrustModule = None,
    page: ShowPage = False,
    port: Port = 0,
    wait: Wait = None,
    plain: Plain = False,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    times: Times = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for the session's journal, receipt, learning curve (and value map)."),
    ] = None,
    as_json: Json = False,
) -> None:
    """One teaching session: learn one sub-task, a world or a Gymnasium environment with an advisor, and keep the policy.

    Each session keeps a journal: --resume continues an interrupted session, lab replay shows it again.
    """
    if peers is not None or peer_tasks:
        deferred.check_peers_alone(
            {
                "--advisor": advisor,
                "--sight": sight,
                "--resume": resume,
                "--trust-module": trust_module,
                "--page": page,
                "--port": port,
                "--wait": wait,
                "--plain": plain,
                "--times": times,
            }
        )
    who = (tuple(advisor or ()), asked, decide)
    given = deferred.LessonOptions(subtask or "", task, sight, learner, gate, memory, *who, episodes, seed, save)
    kept = None if resume is None else deferred.KeptSession(resume, "--resume", trusted=trust_module or ())
    if kept is not None and out is not None:
        raise BadInput(f"--out {out} beside --resume {resume}: a session goes on in its own folder: leave it away")
    options = given.complete() if kept is None else kept.same(given)
    if kept is not None:
        say_read(kept, "--resume")
    options.advising()
    if out is not None:
        deferred.check_new(out)
    subject = deferred.subject_of(options, kept)
    subjects = deferred.peer_subjects(
        subject, peer_tasks or (), lambda other: deferred.subject_of(replace(options, task=other))
    )
    folder = out if kept is None else kept.folder
    if folder is not None:
        deferred.check_out(folder)
    with lesson_seat(options.advisors, page=page, port=port, wait_s=wait, plain=plain, times=times) as seat:
        teacher = teacher_of(toolbox, options, seat)
        teacher.toolbox.check()
        if peers is not None or peer_tasks:
            document = deferred.teach_peers(subjects, teacher, peers or 1, save, out)
        else:
            document = deferred.teach_session(subject, options, teacher, folder, kept)
            seat.lesson_over(document)
    show(document, as_json, deferred.lesson_summary)
    for one in (document, *document.get("others", ())):
        _end_unless_learned(one)


def _end_unless_learned(document: dict[str, Any]) -> None:
    """Ends the command with an error if the skill failed in physics, misses its goal, or lacks a picture."""
    if document["failure"] is not None:
        end(document["failure"], 1)
    if document["final_steps"] is None and "final_return" not in document:
        end(
            f"'{document['skill']}' does not reach its goal after {counted(document['episodes'], 'episode')}: "
            "try another advisor, more --episodes or another --learner",
            1,
        )
    if "missing" in document:
        end(f"'{document['saved_as']}' is kept, but {'; '.join(document['missing'])}", 1)
