"""The `lab` command: all commands in one table, and how each of them ends. Contract: see the README."""

import sys
from collections.abc import Callable
from functools import wraps
from io import TextIOWrapper
from typing import Any

import typer

from lab.cli import replay, run, see, sequence, study, task, teach, toolbox, view
from lab.cli.output import complain, end, silence
from lab.errors import LabError

STOPPED = "stopped by Ctrl-C; what was learned is kept"
GROUPS = {
    "toolbox": "The policies that were learned.",
    "task": "Task files.",
    "study": "The thesis's tables and figures again, and comparisons of our own.",
}
COMMANDS: dict[str, tuple[Callable[..., None], str]] = {  # what is typed after `lab` -> what it calls, an example
    "run": (run.run, "lab run toast --toasts 3"),
    "teach": (teach.teach, "lab teach insert --advisor terminal"),
    "replay": (replay.replay, "lab replay lesson"),
    "sequence": (sequence.sequence, "lab sequence toast --case II --toasts 4 --gantt order.svg"),
    "see": (see.see, "lab see overhead.png --task toast"),
    "view": (view.view, "lab view toast"),
    "toolbox list": (toolbox.toolbox_list, "lab toolbox list"),
    "toolbox show": (toolbox.toolbox_show, "lab toolbox show 'insert at toaster 1a2b3c4d'"),
    "toolbox verify": (toolbox.toolbox_verify, "lab toolbox verify"),
    "toolbox remove": (toolbox.toolbox_remove, "lab toolbox remove 'insert at toaster 1a2b3c4d'"),
    "task list": (task.task_list, "lab task list"),
    "task show": (task.task_show, "lab task show toast"),
    "task random": (task.task_random, "lab task random 10x10x10 --density 0.06 --seed 7 --out my-world.toml"),
    "task reconstruct": (task.task_reconstruct, "lab task reconstruct --seed 0 --out world-2.toml"),
    "task check": (task.task_check, "lab task check my-toast.toml"),
    "study list": (study.study_list, "lab study list"),
    "study run": (study.study_run, "lab study run table-9.2 --workers 2"),
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
            end(str(stopped) or STOPPED, 130)
        except BrokenPipeError:
            silence()
            end("", 1)
        except OSError as error:  # a full disk, a folder taken away meanwhile
            end(str(error), 1)

    return run_guarded


def made() -> typer.Typer:
    """The command `lab` as the tables say."""
    app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help="Teach a robot.")
    groups = {name: typer.Typer(no_args_is_help=True, help=text) for name, text in GROUPS.items()}
    for words, (function, example) in COMMANDS.items():
        group, _, name = words.rpartition(" ")
        (groups[group] if group else app).command(name, epilog=f"Example: {example}")(guarded(function))
    for name, group_app in groups.items():
        app.add_typer(group_app, name=name)
    return app


def main() -> None:
    """The `lab` command; typer's own complaints come in one line, too."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as stderr: a name must not end a command
    try:
        code = made()(prog_name="lab", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        complain(STOPPED)
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
        complain(f"{text[:1].lower()}{text[1:]} (see {path} --help)")
    return 2
