"""The `lab` command: all commands in one table, and how each of them ends. Contract: see the README."""

import sys
from collections.abc import Callable
from functools import wraps
from io import TextIOWrapper
from typing import Annotated, Any, NamedTuple

import typer

from lab import __version__
from lab.cli import (
    compare,
    export,
    new,
    operate,
    replay,
    run,
    see,
    sequence,
    study,
    task,
    teach,
    toolbox,
    toolbox_archive,
    toolbox_evaluate,
    tune,
    view,
)
from lab.cli.families import CommandOfFamilies
from lab.cli.output import begin, end, fail, silence, write
from lab.errors import LabError, out_of_memory

INTERRUPTED = 130
STOPPED = "stopped by Ctrl-C"
GROUPS = {
    "toolbox": "The policies that were learned.",
    "task": "Task files.",
    "study": "The thesis's tables and figures again, and comparisons of our own.",
}


class Command(NamedTuple):
    """What a command calls, an example of its use, and what its help says below that (see `lab.cli.families`)."""

    function: Callable[..., None]
    example: str
    more: str = ""


COMMANDS = {  # what is typed after `lab` -> the command
    "run": Command(run.run, "lab run toast --toasts 3"),
    "operate": Command(operate.operate, "lab operate toast --toasts 2"),
    "teach": Command(teach.teach, "lab teach insert --advisor terminal", "{words of teaching}"),
    "tune": Command(tune.tune, "lab tune world-1 --advisor moderate --trials 100 --workers 2"),
    "replay": Command(replay.replay, "lab replay lesson"),
    "sequence": Command(
        sequence.sequence, "lab sequence toast --case II --toasts 4 --gantt order.svg", "{words of sequencing}"
    ),
    "export": Command(export.export, "lab export toast-run --format jbi", "{words of exporting}"),
    "see": Command(see.see, "lab see overhead.png --task toast"),
    "view": Command(view.view, "lab view toast"),
    "new": Command(new.new, "lab new bakery --part box:0.12x0.015x0.12:2 --machine oven:60"),
    "toolbox list": Command(toolbox.toolbox_list, "lab toolbox list --subtask insert --solved"),
    "toolbox show": Command(toolbox.toolbox_show, "lab toolbox show 'insert at toaster 1a2b3c4d'"),
    "toolbox log": Command(toolbox.toolbox_log, "lab toolbox log 'insert at toaster 1a2b3c4d'"),
    "toolbox promote": Command(toolbox.toolbox_promote, "lab toolbox promote 'insert at toaster 1a2b3c4d' 2"),
    "toolbox rollback": Command(toolbox.toolbox_rollback, "lab toolbox rollback 'insert at toaster 1a2b3c4d'"),
    "toolbox verify": Command(toolbox.toolbox_verify, "lab toolbox verify"),
    "toolbox evaluate": Command(
        toolbox_evaluate.toolbox_evaluate, "lab toolbox evaluate 'insert at toaster 1a2b3c4d' --scenes 50"
    ),
    "toolbox card": Command(
        toolbox_archive.toolbox_card, "lab toolbox card 'insert at toaster 1a2b3c4d' --out insert-card"
    ),
    "toolbox export": Command(toolbox_archive.toolbox_export, "lab toolbox export --out my-skills.zip"),
    "toolbox import": Command(toolbox_archive.toolbox_import, "lab toolbox import my-skills.zip"),
    "toolbox publish": Command(
        toolbox_archive.toolbox_publish, "lab toolbox publish 'insert at toaster 1a2b3c4d' --out insert --license mit"
    ),
    "toolbox remove": Command(toolbox.toolbox_remove, "lab toolbox remove 'insert at toaster 1a2b3c4d'"),
    "toolbox restore": Command(toolbox.toolbox_restore, "lab toolbox restore 'insert at toaster 1a2b3c4d'"),
    "task list": Command(task.task_list, "lab task list"),
    "task show": Command(task.task_show, "lab task show toast"),
    "task convert": Command(
        task.task_convert,
        "lab task convert bilge-ulusoy-jobs.csv --layout bilge-ulusoy-layouts.csv --case 7:1 --robots 2 --out ex71.toml",
        "{words of instances}",
    ),
    "task random": Command(task.task_random, "lab task random 10x10x10 --density 0.06 --seed 7 --out my-world.toml"),
    "task reconstruct": Command(task.task_reconstruct, "lab task reconstruct --seed 0 --out world-2.toml"),
    "task check": Command(task.task_check, "lab task check my-toast.toml"),
    "study list": Command(study.study_list, "lab study list"),
    "study run": Command(study.study_run, "lab study run table-9.2 --workers 2"),
    "study compare": Command(
        compare.study_compare,
        "lab study compare maze.txt --gate ccrl,ia --advisor expert,novice --psi .05,.1 --workers 2",
    ),
}


def guarded(function: Callable[..., None]) -> Callable[..., None]:
    """A command whose errors end it with one line and the exit code of the contract."""

    @wraps(function)
    def run_guarded(*args: Any, **kwargs: Any) -> None:
        try:
            function(*args, **kwargs)
        except LabError as error:
            end(str(error), error.exit_code)
        except KeyboardInterrupt as stopped:
            end(str(stopped) or STOPPED, INTERRUPTED)
        except BrokenPipeError:
            silence()
            end("", 1)
        except OSError as error:  # a full disk, a folder taken away meanwhile
            end(str(error), 1)
        except Exception as error:
            from lab.plugins.sources import blame

            why = blame(error) or out_of_memory(error)
            if why is None:
                raise
            end(str(why), 1)

    return run_guarded


def _version(wanted: bool) -> None:
    if wanted:
        write(f"lab {__version__}\n")
        raise typer.Exit


def _lab(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Teach a robot."""


def made() -> typer.Typer:
    """The command `lab` as the tables say."""
    app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
    groups = {name: typer.Typer(no_args_is_help=True, help=text) for name, text in GROUPS.items()}
    app.callback()(_lab)
    for words, command in COMMANDS.items():
        group, _, name = words.rpartition(" ")
        epilog = "\n\n".join(filter(None, [f"Example: {command.example}", command.more]))
        (groups[group] if group else app).command(name, cls=CommandOfFamilies, epilog=epilog)(guarded(command.function))
    for name, group_app in groups.items():
        app.add_typer(group_app, name=name)
    return app


def called() -> int:
    """Runs the command that `sys.argv` holds; its exit code. typer's own complaints come in one line, too."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as stderr: a name must not end a command
    begin()
    try:
        code = made()(prog_name="lab", standalone_mode=False) or 0
    except Exception as error:
        code = _usage(error)
    if code == INTERRUPTED:  # typer's word for Ctrl-C before the command had begun; a command ends by itself
        raise KeyboardInterrupt
    return int(code)


def _usage(error: Exception) -> int:
    """Say in one line what is wrong with the words of a command; raises again what is no complaint of typer's."""
    if isinstance(error, LabError):  # of a callback: before the command itself
        fail(str(error), error.exit_code)
        return error.exit_code
    explain, context = getattr(error, "format_message", None), getattr(error, "ctx", None)
    if explain is None:
        raise error
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()  # type: ignore[attr-defined]
    else:
        path = context.command_path if context is not None else "lab"
        text = " ".join(str(explain()).split()).rstrip(".")
        fail(f"{text[:1].lower()}{text[1:]} (see {path} --help)", 2)
    return 2
