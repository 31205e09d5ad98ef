"""The command line: parse, call one function, render. The only module that prints. Contract: see the README."""

import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from lab.errors import BadInput, LabError

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from lab.classroom import Classroom
    from lab.sessions import KeptSession
    from lab.teaching import Teacher

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help="Teach a robot.")
toolbox_app = typer.Typer(no_args_is_help=True, help="The policies that were learned.")
task_app = typer.Typer(no_args_is_help=True, help="Task files.")
app.add_typer(toolbox_app, name="toolbox")
study_app = typer.Typer(no_args_is_help=True, help="The thesis's tables and figures again, and comparisons of our own.")
app.add_typer(task_app, name="task")
app.add_typer(study_app, name="study")

STOPPED = "stopped by Ctrl-C; what was learned is kept"
MAX_EPISODES = 1_000_000
MAX_SESSIONS = 10_000

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Where all chance comes from.")]
ToolboxFolder = Annotated[
    Path | None,
    typer.Option("--toolbox", envvar="LAB_TOOLBOX", help="Where policies are kept; default: your data folder."),
]
AdvisorNames = Annotated[
    list[str] | None,
    typer.Option(
        "--advisor",
        help="Who advises: expert, moderate, limited, novice, tau=X, tau=X..Y (changing over the episodes), wrong, "
        "terminal, web, recorded:DIR (a session's folder), none; several times for several advisors.",
    ),
]
Asked = Annotated[str, typer.Option("--ask", help="Several advisors are asked: together, in-turn.")]
Decide = Annotated[
    str, typer.Option("--decide", help="Whom of several to follow: majority, best-trusted, trust-weighted.")
]
Plain = Annotated[bool, typer.Option("--plain", help="Plain sentences instead of pictures, as screen readers want.")]
ShowPage = Annotated[
    bool, typer.Option("--page", help="Show the lesson on a page on 127.0.0.1, too, where it can be answered as well.")
]
Port = Annotated[int, typer.Option("--port", min=0, max=65535, help="Of the page; 0: any free one.")]
Wait = Annotated[
    float | None,
    typer.Option(
        "--wait", min=1.0, help="Seconds to wait for an answer of the advisor web; then the learner goes on alone."
    ),
]
Toasts = Annotated[int, typer.Option("--toasts", "-n", help="How many slices, 1 to 50.")]


def command(group: typer.Typer, name: str, example: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Register a command whose errors end it with one line and the exit code of the contract."""

    def register(function: Callable[..., None]) -> Callable[..., None]:
        @wraps(function)
        def guarded(*args: Any, **kwargs: Any) -> None:
            try:
                function(*args, **kwargs)
            except LabError as error:
                _end(str(error), error.exit_code)
            except KeyboardInterrupt as stopped:
                _end(str(stopped) or STOPPED, 130)
            except BrokenPipeError:
                _silence()
                _end("", 1)
            except OSError as error:  # a full disk, a folder taken away meanwhile
                _end(str(error), 1)

        group.command(name, epilog=f"Example: {example}")(guarded)
        return guarded

    return register


_FILE_WIDTH = 200  # characters; where stdout is no terminal, nothing needs to be folded
_PLAIN = str.maketrans("▁▂▃▄▅▆▇█·", "_.-:=+*#.")  # for a stdout that is not Unicode


def _end(message: str, code: int) -> NoReturn:
    if message:
        _complain(message)
    raise typer.Exit(code)


def _complain(message: str) -> None:
    """Write one line to stderr, whatever the message holds."""
    sys.stderr.write(f"lab: {LabError(' '.join(message.split()))}\n")


def _silence() -> None:
    """Nobody reads stdout any more: let the interpreter's last flush go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _console() -> "Console":
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def _show(document: dict[str, Any], as_json: bool, render: Callable[[dict[str, Any]], "RenderableType"]) -> None:
    if as_json:
        print(json.dumps(document, allow_nan=False))
        return
    from rich.console import Console

    console = Console(highlight=False, width=None if sys.stdout.isatty() else _FILE_WIDTH)
    with console.capture() as shown:
        console.print(render(document), soft_wrap=not sys.stdout.isatty())
    text = "\n".join(line.rstrip() for line in shown.get().splitlines())
    print(text if console.encoding.lower().startswith("utf") else text.translate(_PLAIN))


@contextmanager
def _seat(
    names: Sequence[str], *, page: bool = False, port: int = 0, wait_s: float | None = None, plain: bool = False
) -> Iterator["Classroom"]:
    """Who sits in the lessons of a command: the progress lines, and, when they are wanted, the prompt and the page."""
    from contextlib import ExitStack

    from lab.classroom import Classroom
    from lab.view.progress import RunProgress
    from lab.view.terminal import TeachingPrompt

    progress = RunProgress(_console())
    with ExitStack() as stack:
        shown = None
        if page or "web" in names:
            from lab.view.seat import SeatPage

            shown = stack.enter_context(SeatPage(port, wait_s=wait_s))
            progress.console.print(f"page: {shown.url}\nfrom another machine: {shown.hint}", soft_wrap=True)
        prompt = TeachingPrompt(progress.console, plain=plain) if "terminal" in names else None
        room = Classroom(progress, prompt, shown, plain=plain)
        stack.callback(room.leave)
        try:
            yield room
        except LabError as error:
            if shown is not None:
                shown.finished(str(error))
            raise


def _teacher(
    toolbox: Path | None,
    names: Sequence[str],
    seed: int,
    room: "Classroom",
    asked: str = "together",
    decide: str = "trust-weighted",
) -> "Teacher":
    """The teacher that the options describe; raises BadInput for options and folders that cannot be."""
    from lab.advice.counsel import Counsel
    from lab.teaching import Teacher
    from lab.toolbox import Toolbox

    counsel = Counsel(tuple(names), room.people(), asked, decide, watch=room.passing)
    counsel.check()
    for journal in counsel.cut_records():
        _complain(f"journal '{journal.path}': its last line was cut off and is left out: {journal.cut[:60]!r}")
    teacher = Teacher(Toolbox(toolbox), counsel, seed, room)
    teacher.toolbox.check()
    return teacher


def _kept(folder: Path, where: str, *, read_only: bool = False) -> "KeptSession":
    """A session that was kept; what was cut off at its end is said."""
    from lab.sessions import KeptSession

    kept = KeptSession(folder, where, read_only=read_only)
    if kept.read.cut:
        _complain(f"journal '{kept.read.path}': its last line was cut off and is left out: {kept.read.cut[:60]!r}")
    return kept


@command(app, "run", "lab run toast --toasts 3")
def run(
    task: Annotated[str, typer.Argument(help="A task that ships, or a .toml file.")] = "toast",
    toasts: Toasts = 3,
    advisor: AdvisorNames = None,
    asked: Asked = "together",
    decide: Decide = "trust-weighted",
    view: Annotated[bool, typer.Option("--view/--no-view", help="Stream the scene to a page on 127.0.0.1.")] = False,
    port: Port = 0,
    wait: Wait = None,
    seed: Seed = 0,
    toolbox: ToolboxFolder = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, replay and JSON; default: TASK-run.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find or learn the skills, time them, find their best order, and carry them out in physics."""
    from dataclasses import replace

    from lab import taskfile
    from lab.advice.advisors import PEOPLE
    from lab.advice.counsel import Counsel
    from lab.report import check_out
    from lab.run import prepare
    from lab.run import run as run_task
    from lab.sessions import Words, kept_by
    from lab.view.summary import run_summary

    loaded = taskfile.load(task)
    folder = out or Path(f"{loaded.name}-run")
    check_out(folder)
    names = advisor or ["expert"]
    Counsel(tuple(names), asked=asked, decide=decide).check()
    prepared = prepare(loaded, toasts, seed)
    with _seat(names, page=view, port=port, wait_s=wait) as room:
        teacher = _teacher(toolbox, names, seed, room, asked, decide)
        if any(name in PEOPLE for name in names):
            words = Words(task=task, advisors=tuple(names), asked=asked, decide=decide, seed=seed)
            teacher = replace(teacher, keep=kept_by(teacher.toolbox, words))
        with room.progress:
            report = run_task(prepared, teacher, folder, listener=room.listener, viewer=room.viewer)
    _show(report.to_json(), as_json, run_summary)
    if not report.success:
        _end(report.outcome.failure or f"{len(report.outcome.delivered)} of {toasts} toasts were delivered", 1)


@command(app, "teach", "lab teach insert --advisor terminal")
def teach(
    subtask: Annotated[
        str | None,
        typer.Argument(
            help="transfer, grasp, insert, butter, place, one skill by its full name; a world: its name, a .toml file, a "
            ".txt grid, random:SHAPE:DENSITY:SEED; a Gymnasium environment: gym:ID, such as gym:FrozenLake-v1."
        ),
    ] = None,
    task: Annotated[
        str | None, typer.Option("--task", help="A task that ships, or a .toml file; default: toast. None for a world.")
    ] = None,
    learner: Annotated[
        str | None,
        typer.Option(
            "--learner",
            help="q, sarsa, q-lambda, sarsa-lambda, monte-carlo, afterstate; default: the task's.",
        ),
    ] = None,
    gate: Annotated[
        str | None,
        typer.Option(
            "--gate",
            help="When it asks: ccrl, ia, combined, cq, always, never, random, importance, uncertainty; default: the task's.",
        ),
    ] = None,
    memory: Annotated[
        bool | None,
        typer.Option("--memory/--no-memory", help="Remember advice and use it again unasked; default: the task's."),
    ] = None,
    advisor: AdvisorNames = None,
    asked: Asked = "together",
    decide: Decide = "trust-weighted",
    episodes: Annotated[
        int | None,
        typer.Option("--episodes", min=1, max=MAX_EPISODES, help="Session length; default: the task's."),
    ] = None,
    save: Annotated[str | None, typer.Option("--save", help="Name of the policy in the toolbox.")] = None,
    view: Annotated[
        str | None,
        typer.Option("--view", help="Of a world: full, or limited to the region that its file gives; default: full."),
    ] = None,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Go on with the session in this folder, as it was begun.")
    ] = None,
    page: ShowPage = False,
    port: Port = 0,
    wait: Wait = None,
    plain: Plain = False,
    seed: Seed = 0,
    toolbox: ToolboxFolder = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for the session's journal, receipt, learning curve (and value map)."),
    ] = None,
    as_json: Json = False,
) -> None:
    """One teaching session: learn one sub-task, a world or a Gymnasium environment with an advisor, and keep the policy.

    Each session keeps a journal: --resume goes on with one that was broken off, lab replay shows it again.
    """
    from lab.lesson import check
    from lab.lesson import teach as teach_session
    from lab.report import check_out
    from lab.sessions import Words
    from lab.view.summary import lesson_summary

    advisors = tuple(advisor or ())
    given = Words(subtask or "", task, view, learner, gate, memory, advisors, asked, decide, episodes, seed, save)
    kept = None if resume is None else _kept(resume, "--resume")
    words = given.complete() if kept is None else kept.same(given)
    if kept is not None and out is not None:
        raise BadInput(f"--out {out} beside --resume {resume}: a session goes on in its own folder: leave it away")
    check(words)
    folder = out if kept is None else kept.folder
    if folder is not None:
        check_out(folder)
    with _seat(words.advisors, page=page, port=port, wait_s=wait, plain=plain) as room:
        teacher = _teacher(toolbox, words.advisors, words.seed, room, words.asked, words.decide)
        document = teach_session(words, teacher, folder, kept)
        room.ends(document)
    _show(document, as_json, lesson_summary)
    if document["failure"] is not None:
        _end(document["failure"], 1)
    if document["final_steps"] is None:
        _end(
            f"'{document['skill']}' does not reach its goal after {document['episodes']} episodes: "
            "try another advisor, more --episodes or another --learner",
            1,
        )


@command(app, "replay", "lab replay lesson")
def replay(
    folder: Annotated[
        Path | None,
        typer.Argument(help="The folder of a session (--out of lab teach); none: lists those in the toolbox."),
    ] = None,
    pause: Annotated[
        float, typer.Option("--pause", min=0.0, max=3600.0, help="Seconds between two answers; default: half a second.")
    ] = 0.5,
    page: ShowPage = False,
    port: Port = 0,
    plain: Plain = False,
    toolbox: ToolboxFolder = None,
    as_json: Json = False,
) -> None:
    """Show a kept teaching session again: each question, what was answered, what came of it, and what it was worth."""
    from lab.lesson import replay as replay_session
    from lab.sessions import session_rows
    from lab.toolbox import Toolbox
    from lab.view.summary import replay_summary, table_of

    if folder is None:
        rows = session_rows(Toolbox(toolbox))
        _show(
            {"sessions": rows}, as_json, lambda d: table_of(d["sessions"], ("session", "problem", "advisor", "state"))
        )
        return
    kept = _kept(folder, "DIR", read_only=True)
    with _seat(["terminal"], page=page, port=port, plain=plain) as room:
        document = replay_session(kept, room.replaying(0.0 if as_json else pause), room.watch)
        room.ends(document)
        _show(document, as_json, replay_summary)
        with suppress(KeyboardInterrupt):  # that ends it, and nothing is lost
            room.stay()


@command(app, "sequence", "lab sequence toast --case II --toasts 4 --gantt order.svg")
def sequence(
    task: Annotated[str, typer.Argument(help="A task or a cell that ships, or a .toml file.")],
    case: Annotated[
        str | None,
        typer.Option("--case", help="toast: I, II or III of the thesis. A cell: its order by initials, such as RSR."),
    ] = None,
    toasts: Annotated[int | None, typer.Option("--toasts", help="How many parts of the only product.")] = None,
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
    from lab.view.summary import sequence_summary

    with _seat([advisor], page=page, port=port, wait_s=wait, plain=plain) as room:
        teacher = _teacher(toolbox, ["expert"], seed, room)
        wanted = Wanted(method, episodes, objective, sessions, seed, stochastic, advisor, gate, room.orderers())
        files = {name: path for name, path in (("plot", plot), ("gantt", gantt)) if path is not None}
        with room.progress:
            document = sequence_named(task, case, toasts, wanted, teacher=teacher, listener=room.listener, files=files)
    _show(document, as_json, sequence_summary)
    if document["interrupted"]:
        _end("stopped by Ctrl-C; the best order until then is above", 130)


@command(app, "see", "lab see overhead.png --task toast")
def see(
    image: Annotated[Path, typer.Argument(help="A PNG or JPEG picture from above, with round markers.")],
    grid: Annotated[str | None, typer.Option("--grid", help="Rows x columns; default: 12x12, or the task's.")] = None,
    task: Annotated[
        str | None, typer.Option("--task", help="Taken by this task's camera; else the frame is the grid.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="A .png file for the picture with the grid drawn on it.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Picture to grid: find the gripper (magenta), the toaster (cyan) and the obstacles (green)."""
    from lab.look import see_picture
    from lab.view.summary import grid_summary

    _show(see_picture(image, grid, task, out), as_json, grid_summary)


@command(app, "view", "lab view toast")
def view(
    what: Annotated[
        str, typer.Argument(help="A task (its scene is shown) or the folder of a run (its replay is served).")
    ],
    toasts: Toasts = 3,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="0: any free one.")] = 0,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Look at a task's scene or at a run's replay, on a page on 127.0.0.1, until Ctrl-C."""
    from lab.look import show

    def tell(url: str, hint: str) -> None:
        if as_json:
            print(json.dumps({"url": url, "hint": hint}), flush=True)
        else:
            print(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it", flush=True)

    try:
        show(what, toasts, seed, port, tell)
    except KeyboardInterrupt:
        _end("stopped by Ctrl-C", 130)


@command(toolbox_app, "list", "lab toolbox list")
def toolbox_list(toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """The policies in the toolbox."""
    from lab.toolbox import Toolbox
    from lab.view.summary import toolbox_summary

    box = Toolbox(toolbox)
    _show({"folder": str(box.folder), "policies": box.list()}, as_json, toolbox_summary)


@command(toolbox_app, "show", "lab toolbox show 'insert at toaster 1a2b3c4d'")
def toolbox_show(name: str, toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """All that is known of one policy."""
    from lab.toolbox import Toolbox
    from lab.view.summary import policy_summary

    _show(Toolbox(toolbox).show(name), as_json, policy_summary)


@command(toolbox_app, "verify", "lab toolbox verify")
def toolbox_verify(toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """Check every file: whole, finite, of the right shape. Exit 1 when one is not."""
    from lab.toolbox import Toolbox
    from lab.view.summary import verify_summary

    box = Toolbox(toolbox)
    rows = [{"file": str(path), "ok": ok, "reason": reason} for path, ok, reason in box.verify()]
    damaged = [row for row in rows if not row["ok"]]
    document = {"folder": str(box.folder), "files": rows, "damaged": len(damaged)}
    _show(document, as_json, verify_summary)
    if damaged:
        _end(f"{len(damaged)} of {len(rows)} files in the toolbox are damaged", 1)


@command(toolbox_app, "remove", "lab toolbox remove 'insert at toaster 1a2b3c4d'")
def toolbox_remove(name: str, toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """Delete one policy."""
    from lab.toolbox import Toolbox

    _show({"removed": str(Toolbox(toolbox).remove(name))}, as_json, lambda d: f"removed {d['removed']}")


@command(task_app, "list", "lab task list")
def task_list(as_json: Json = False) -> None:
    """The tasks, the cells for lab sequence and the grid worlds that ship."""
    from lab import taskfile
    from lab.view.summary import table_of

    kinds = taskfile.shipped()
    rows = [{"name": name, "kind": kind} for name, kind in kinds.items()]
    _show({"tasks": list(kinds), "kinds": kinds}, as_json, lambda _: table_of(rows, ("name", "kind")))


@command(task_app, "show", "lab task show toast")
def task_show(task: str, as_json: Json = False) -> None:
    """The text of a task file, of a task, a cell or a world: copy it, change it, use it."""
    from lab.task import describe

    text, document = describe(task)
    print(json.dumps(document) if as_json else text, end="\n" if as_json else "")


@command(task_app, "random", "lab task random 10x10x10 --density 0.06 --seed 7 --out my-world.toml")
def task_random(
    shape: Annotated[str, typer.Argument(help="Cells along 2 or 3 axes, each 1 to 100: 12x12, 10x10x10.")],
    out: Annotated[Path, typer.Option("--out", help="The .toml file to write.")],
    density: Annotated[float, typer.Option("--density", help="The share of cells that are obstacles, 0 to 0.6.")] = 0.1,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Write a random grid world as a task file; a way always leads from its start to its goal."""
    from lab.task import write_random

    def told(d: dict[str, Any]) -> str:
        return (
            f"{d['file']}: {d['obstacles']} obstacles, the shortest way takes {d['optimal_steps']} moves (seed {seed})"
        )

    _show(write_random(shape, density, seed, out), as_json, told)


@command(task_app, "reconstruct", "lab task reconstruct --seed 0 --out world-2.toml")
def task_reconstruct(
    out: Annotated[Path, typer.Option("--out", help="The .toml file to write.")], seed: Seed = 0, as_json: Json = False
) -> None:
    """Look for a world like the thesis's world II, of which only a picture is printed; takes a few minutes."""
    from lab.task import reconstruct_world
    from lab.view.progress import counting

    with counting(_console(), "layouts and views compared") as progress:
        document = reconstruct_world(seed, out, progress)
    _show(document, as_json, lambda d: f"{d['file']}: {d['title']}")


@command(study_app, "list", "lab study list")
def study_list(as_json: Json = False) -> None:
    """The studies that can be run."""
    from lab.studies import STUDIES
    from lab.view.summary import table_of

    rows = [{"name": name, "title": study.title} for name, study in STUDIES.items()]
    _show({"studies": rows}, as_json, lambda d: table_of(d["studies"], ("name", "title")))


@command(study_app, "run", "lab study run table-9.2 --workers 2")
def study_run(
    name: Annotated[str, typer.Argument(help="A study; lab study list names them.")],
    sessions: Annotated[
        int, typer.Option("--sessions", min=10, max=1_000_000, help="Learning sessions for each cell of a table.")
    ] = 500,
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
    from lab.study import run_study
    from lab.view.progress import counting
    from lab.view.summary import study_summary

    with counting(_console(), f"cells of {name}") as progress:
        document = run_study(
            name,
            sessions=sessions,
            seed=seed,
            workers=workers,
            dask=dask,
            advisor_table=advisor_table,
            out=out or Path(f"{name}-study"),
            progress=progress,
        )
    _show(document, as_json, study_summary)


@command(task_app, "check", "lab task check my-toast.toml")
def task_check(
    file: str,
    toasts: Annotated[
        int | None,
        typer.Option(
            "--toasts", "-n", help="How many slices, 1 to 50; default: 3, if they fit. Of a cell: parts, 1 to 200."
        ),
    ] = None,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """Check a task file: its text, its reach, and that a way exists for every sub-task, or through the world. Exit 2 when not.

    Of a cell: that its order can be made, with the line of what is wrong. With --json the document comes in both cases.
    """
    from lab.task import check_task

    errors = check_task(file, toasts, seed)
    if as_json or not errors:
        _show({"valid": not errors, "errors": errors}, as_json, lambda _: f"{file} is sound")
    if errors:
        raise BadInput(errors[0])


def main() -> None:
    """The `lab` command; typer's own complaints come in one line, too."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as stderr: a name must not end a command
    try:
        code = app(prog_name="lab", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        _complain(STOPPED)
        code = 130
    except Exception as error:
        code = _usage(error)
    sys.exit(code if isinstance(code, int) else 0)


def _usage(error: Exception) -> int:
    """Say in one line what is wrong with the words of a command; raises again what is no complaint of typer's."""
    explain, context = getattr(error, "format_message", None), getattr(error, "ctx", None)
    if explain is None:
        raise error
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()  # type: ignore[attr-defined]
    else:
        path = context.command_path if context is not None else "lab"
        text = " ".join(str(explain()).split()).rstrip(".")
        _complain(f"{text[:1].lower()}{text[1:]} (see {path} --help)")
    return 2
