"""The options that several commands share."""

from typing import Annotated

import typer

from lab.cli.families import from_files, offers

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of all random numbers.")]
ToolboxPlace = Annotated[
    str | None,
    typer.Option(
        "--toolbox",
        envvar="LAB_TOOLBOX",
        help="Where policies are kept: a folder, or an address such as s3://bucket/lab; default: your data folder.",
    ),
]
LearnerName = Annotated[
    str | None,
    typer.Option(
        "--learner",
        help="{learners}; default: the problem's.",
        autocompletion=offers("learners"),
        callback=from_files("learners"),
    ),
]
GateName = Annotated[
    str | None,
    typer.Option(
        "--gate",
        help="The rule for asking: {gates}, or your own, ./mine.py:MyGate, whose code runs; default: the problem's.",
        autocompletion=offers("gates"),
        callback=from_files("gates"),
    ),
]
MethodName = Annotated[
    str | None,
    typer.Option(
        "--method",
        help="The method that finds the order: {methods}; default: as the file says.",
        autocompletion=offers("methods"),
        callback=from_files("methods"),
    ),
]
ProblemName = Annotated[
    str,
    typer.Argument(
        help="A world: its name, a .toml file, a .txt grid, random:SHAPE:DENSITY:SEED; gym:ID; ./mine.py:Problem; a problem "
        "that packages add: {problems}; or a sub-task of --task.",
        callback=from_files("problems"),
    ),
]
TaskOfSkill = Annotated[str | None, typer.Option("--task", help="The task that a sub-task is of; default: toast.")]
SightInWorld = Annotated[
    str | None, typer.Option("--sight", help="Where in a world the advisor sees the robot: full or limited.")
]
AdvisorNames = Annotated[
    list[str] | None,
    typer.Option(
        "--advisor",
        help="Who advises: {advisors} (X..Y: changing over the episodes; accuracy: the share of optimal answers; "
        "DIR: a session's folder; FILE: answers as JSON; NAME: a policy in the toolbox, also of another world; URL: a language "
        "model's server, such as http://127.0.0.1:8080/v1#MODEL; WHO: an advisor who judges the learner's moves); "
        "several times for several advisors.",
        autocompletion=offers("advisors"),
        callback=from_files("advisors"),
    ),
]
Asked = Annotated[
    str, typer.Option("--ask", help="Several advisors are asked: {asked}.", autocompletion=offers("asked"))
]
Decide = Annotated[
    str,
    typer.Option(
        "--decide", help="Which of several advisors to follow: {decisions}.", autocompletion=offers("decisions")
    ),
]
Plain = Annotated[bool, typer.Option("--plain", help="Plain sentences instead of pictures, as screen readers want.")]
ShowPage = Annotated[
    bool, typer.Option("--page", help="Also show it on a page on 127.0.0.1, where questions can be answered as well.")
]
Port = Annotated[int, typer.Option("--port", min=0, max=65535, help="The page's port; 0: any free one.")]
Wait = Annotated[
    float | None,
    typer.Option(
        "--wait", min=1.0, help="Seconds to wait for an answer of the advisor web; then the learner goes on alone."
    ),
]
Times = Annotated[
    bool,
    typer.Option(
        "--times",
        help="Also keep when and how each answer was given, and what was seen, in times.jsonl of the session.",
    ),
]
TrustModule = Annotated[
    list[str] | None,
    typer.Option(
        "--trust-module", help="A module that the session names (gym:MODULE:ID) may be imported: its code runs."
    ),
]
Own = Annotated[
    list[str] | None,
    typer.Option(
        "--own",
        help="A gate, learner, advisor or problem of your own that what is kept names, ./mine.py:MyGate; its code runs.",
        callback=from_files("gates", "learners", "advisors", "problems"),
    ),
]
Toasts = Annotated[
    int | None,
    typer.Option("--toasts", "-n", help="How many parts of the task's first kind, 1 to 50; default: as its file says."),
]
Parts = Annotated[
    str | None, typer.Option("--parts", help="How many parts of each kind, such as slice=2,cup=1; others: none.")
]
PartsPerCycle = Annotated[
    int | None,
    typer.Option(
        "--parts-per-cycle",
        help="Most parts of a cycle: their mix once, twice, ...; default: up to 4, while 1 % could be gained.",
    ),
]
