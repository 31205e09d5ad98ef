"""The `lab` command: the table of all commands, and the exit codes and error lines of each. Contract: see the README."""

import sys
from collections.abc import Callable
from errno import ENAMETOOLONG
from functools import partial, wraps
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, Any, NamedTuple, cast

import typer
from typer.core import TyperCommand, TyperGroup

from lab.cli.families import CommandOfFamilies
from lab.cli.output import begin, end, fail, silence, write
from lab.errors import BadInput, LabError, out_of_memory, shortened
from lab.lazy import rich
from lab.plugins.family import blame
from lab.version import __version__


class UnloadedCommand(TyperCommand):
    """A command that is not loaded yet: its name, the first line of its help, and the function that loads it."""

    def __init__(self, name: str, help_text: str, load: Callable[[], Any]) -> None:
        super().__init__(name, help=help_text)
        self.load = load


class CommandGroup(TyperGroup):
    """A group of commands, each loaded when it is called; its help looks like typer's, but without rich's Markdown."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The name, the loaded command, and the remaining arguments."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command.load() if isinstance(command, UnloadedCommand) else command, rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help of the group."""
        options = [record for param in self.get_params(ctx) if (record := param.get_help_record(ctx))]
        commands = [(name, command.help or "") for name, command in self.commands.items()]
        console = rich.console.Console(highlight=False)
        usage = self.get_usage(ctx).split(" ", 1)
        console.print(
            rich.padding.Padding(rich.text.Text.assemble((usage[0], "yellow"), f" {usage[1]}"), 1), style="bold"
        )
        console.print(rich.padding.Padding(rich.text.Text(self.help or ""), (0, 1, 1, 1)))
        for title, rows in (("Options", options), ("Commands", commands)):
            table = rich.table.Table(show_header=False, box=None, expand=True, pad_edge=False)
            table.add_column(style="bold cyan", no_wrap=True)
            table.add_column(ratio=1)
            for name, meaning in rows:
                table.add_row(name, rich.text.Text(meaning))
            console.print(rich.panel.Panel(table, title=title, title_align="left", border_style="dim"))


# ---- the table of commands ----------------------------------------------------------------------------------------------


INTERRUPTED = 130
STOPPED = "stopped by Ctrl-C"
GROUPS = {
    "toolbox": "The policies that were learned.",
    "task": "Task files.",
    "study": "The thesis's tables and figures again, comparisons of our own, and studies with people.",
}


class Command(NamedTuple):
    """A row of the table: where a command's function is, and its help."""

    function: (
        str | Callable[..., None]
    )  # or the module of `lab.cli` with the function, which is named after the command, or "module:function"
    help: str  # the first paragraph of its docstring
    example: str
    more: str = ""  # text of the help below the example (see `lab.cli.families`)


COMMANDS = {  # words after `lab` -> the command
    "run": Command(
        "run",
        "Find or learn the skills, time them, find an order for them, and carry them out in physics.",
        "lab run toast --toasts 3",
    ),
    "operate": Command(
        "operate",
        "Run a task by hand: order, pause, stop, jog, lead, grasp, learn, in a live console, on a page, or from a pipe.",
        "lab operate toast --toasts 2",
    ),
    "teach": Command(
        "teach",
        "One teaching session: learn one sub-task, a world or a Gymnasium environment with an advisor, and keep the policy.",
        "lab teach insert --advisor terminal",
        more="{words of teaching}",
    ),
    "class": Command(
        "classroom:hold_class",
        "A class in browsers: each pupil teaches a learner of their own, and the teacher looks on and helps.",
        "lab class world-1 insert --gate ccrl --out monday",
    ),
    "find": Command(
        "find",
        "Find sub-tasks, such as the doorways between rooms, in a learner's own moves; learn the ways to them, and keep them.",
        "lab find four-rooms",
    ),
    "tune": Command(
        "tune",
        "Tune settings to a problem with Optuna, and measure the gain over the problem's own on seeds that no trial used.",
        "lab tune world-1 --advisor moderate --trials 100 --workers 2",
    ),
    "replay": Command(
        "replay",
        "Replay a kept teaching session or a run: questions, answers, actions and results.",
        "lab replay lesson",
    ),
    "sequence": Command(
        "sequence",
        "The high level alone: find an order of the robot's transfers, and compare it with the proven optimum or bound.",
        "lab sequence toast --case II --toasts 4 --gantt order.svg",
        more="{words of sequencing}",
    ),
    "export": Command(
        "export",
        "Write what the robot did in a run as job files or trajectories, which are read back and played, or as a dataset.",
        "lab export toast-run --format jbi",
        more="{words of exporting}",
    ),
    "clone": Command(
        "clone",
        "Clone a skill from demonstrations: roll the student out in physics, let it ask, learn the corrections, and again.",
        "lab clone grasp --rounds 3 --out grasp-clone",
    ),
    "mentor": Command(
        "mentor",
        "Compare where rules would have asked with where a person took over in a recording, or keep a mentor for your policy.",
        "lab mentor my-dataset --report report.html",
    ),
    "see": Command(
        "see",
        "Picture to grid: find the gripper (magenta), the machine's marker (cyan) and the obstacles (green).",
        "lab see overhead.png --task toast",
    ),
    "view": Command(
        "view",
        "Look at a task's scene, at a grid world in 3D or at a run's replay, on a page on 127.0.0.1, until Ctrl-C.",
        "lab view toast",
    ),
    "show": Command(
        "show",
        "Show any schedule in 3D, with its Gantt chart: a page that plays offline in any browser, in one file.",
        "lab show plan.csv --out plan.html",
    ),
    "new": Command(
        "new",
        "Write a task file that runs: parts go from an input through machines to an output, laid out around the arm.",
        "lab new bakery --part box:0.12x0.015x0.12:2 --machine oven:60",
    ),
    "toolbox list": Command("toolbox", "The policies in the toolbox.", "lab toolbox list --subtask insert --solved"),
    "toolbox show": Command(
        "toolbox",
        "One policy: its origin, its versions and its history.",
        "lab toolbox show 'insert at toaster 1a2b3c4d'",
    ),
    "toolbox log": Command(
        "toolbox",
        "The history of the policies of a name: learned, put in use, evaluated, removed.",
        "lab toolbox log 'insert at toaster 1a2b3c4d'",
    ),
    "toolbox promote": Command(
        "toolbox", "Put a kept version of a policy in use.", "lab toolbox promote 'insert at toaster 1a2b3c4d' 2"
    ),
    "toolbox rollback": Command(
        "toolbox",
        "Put the previously used version of a policy back in use; repeat for the one before that.",
        "lab toolbox rollback 'insert at toaster 1a2b3c4d'",
    ),
    "toolbox verify": Command(
        "toolbox",
        "Check every file: whole, finite, of the right shape; versions by their hash. Exit 1 when one is not.",
        "lab toolbox verify",
    ),
    "toolbox evaluate": Command(
        "toolbox",
        "Measure a policy's success rate in physics, in scenes drawn from the seed, and record it in the policy's log.",
        "lab toolbox evaluate 'insert at toaster 1a2b3c4d' --scenes 50",
    ),
    "toolbox card": Command(
        "toolbox",
        "A policy's card: what it does, where and with whose advice it was learned, its curve and its values as pictures.",
        "lab toolbox card 'insert at toaster 1a2b3c4d' --out insert-card",
    ),
    "toolbox export": Command(
        "toolbox",
        "Write policies to one archive; the same policies give the same bytes.",
        "lab toolbox export --out my-skills.zip",
    ),
    "toolbox import": Command(
        "toolbox",
        "Import policies from others: every policy is checked before the first is kept, and either all are kept or none.",
        "lab toolbox import my-skills.zip",
    ),
    "toolbox publish": Command(
        "toolbox",
        "Write a folder for the Hugging Face Hub: model card, safetensors, metadata, pictures. Nothing is uploaded.",
        "lab toolbox publish 'insert at toaster 1a2b3c4d' --out insert --license mit",
    ),
    "toolbox remove": Command(
        "toolbox",
        "Remove one policy; lab toolbox restore brings it back.",
        "lab toolbox remove 'insert at toaster 1a2b3c4d'",
    ),
    "toolbox restore": Command(
        "toolbox",
        "Restore the policy that was removed last under this name.",
        "lab toolbox restore 'insert at toaster 1a2b3c4d'",
    ),
    "task list": Command(
        "task", "The tasks, the cells for lab sequence and the grid worlds that ship.", "lab task list"
    ),
    "task show": Command(
        "task",
        "The text of a task file, of a task, a cell or a world: copy it, change it, use it.",
        "lab task show toast",
    ),
    "task convert": Command(
        "task",
        "Read an instance in a common format, and write it as the lab's own cell file (TOML), or as PyJobShop's JSON.",
        "lab task convert bilge-ulusoy-jobs.csv --layout bilge-ulusoy-layouts.csv --case 7:1 --robots 2 --out ex71.toml",
        more="{words of instances}",
    ),
    "task schema": Command(
        "task",
        "The keys that a task, cell or world file may have, as a JSON Schema that editors complete with, or as a page.",
        "lab task schema --out task-schema.json",
    ),
    "task random": Command(
        "task",
        "Write a random grid world as a task file; a path always leads from its start to its goal.",
        "lab task random 10x10x10 --density 0.06 --seed 7 --out my-world.toml",
    ),
    "task check": Command(
        "task",
        "Check a task file: its text, its reach, and that every sub-task, or the world, has a path. Exit 2 if not.",
        "lab task check my-toast.toml",
    ),
    "study list": Command("study", "The studies that can be run.", "lab study list"),
    "study run": Command(
        "study",
        "Run a study and write its report. Results that its folder already holds are not computed again.",
        "lab study run table-9.2 --workers 2",
    ),
    "study board": Command(
        "study",
        "Draw a leaderboard from files of scores, one for each member of a study.",
        "lab study board advicebench-study/scores/*.csv",
    ),
    "study export": Command(
        "people",
        "Write a class or a study with people as tables for statistics: a lesson a row, an answer a row, and their dictionary.",
        "lab study export who-asks --out who-asks-data --parquet",
    ),
    "study people": Command(
        "people",
        "Compare the arms of a study with people: mixed-effects model, rank tests, sizes of effects, figures, and a report.",
        "lab study people who-asks-data --out who-asks-report",
    ),
    "study compare": Command(
        "compare",
        "Compare settings: every combination of the options' values, separated by commas, in many sessions each.",
        "lab study compare maze.txt --gate ccrl,ia --advisor expert,novice --psi .05,.1 --workers 2",
    ),
}


def guarded(function: Callable[..., None]) -> Callable[..., None]:
    """The command, whose errors end it with one line and the contract's exit code."""

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
        except OSError as error:  # a full disk, a folder that was removed meanwhile
            if error.errno == ENAMETOOLONG:
                end(
                    f"path '{shortened(error.filename or error)}': its name is longer than a file's may be",
                    BadInput.exit_code,
                )
            end(str(error), 1)
        except Exception as error:
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


def made() -> CommandGroup:
    """The command `lab`, built from the tables; a row's function is loaded when its command is called."""
    app = typer.Typer(cls=CommandGroup, no_args_is_help=True)
    app.callback()(_lab)
    top: Any = typer.main.get_command(app)
    groups = {name: CommandGroup(name=name, help=text, no_args_is_help=True) for name, text in GROUPS.items()}
    for words, row in COMMANDS.items():
        group, _, name = words.rpartition(" ")
        (groups[group] if group else top).add_command(UnloadedCommand(name, row.help, partial(loaded, words)))
    for made_group in groups.values():
        top.add_command(made_group)
    return cast(CommandGroup, top)


def loaded(words: str) -> Any:
    """The loaded command of these words, with its parameters."""

    row = COMMANDS[words]
    function = row.function
    if isinstance(function, str):
        module, _, name = function.partition(":")
        function = getattr(import_module(f"lab.cli.{module}"), name or words.replace(" ", "_"))
    app = typer.Typer(add_completion=False)
    epilog = "\n\n".join(filter(None, [f"Example: {row.example}", row.more]))
    app.command(words.rpartition(" ")[2], cls=CommandOfFamilies, epilog=epilog)(guarded(function))
    return typer.main.get_command(app)


def called() -> int:
    """The exit code of the command in `sys.argv`, after running it; typer's errors come in one line as well."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(
            errors="backslashreplace"
        )  # as for stderr: a name that cannot be encoded must not end a command
    begin()
    try:
        code = made()(prog_name="lab", standalone_mode=False) or 0
    except Exception as error:
        code = _usage(error)
    if code == INTERRUPTED:  # typer's result for Ctrl-C before the command has begun; a command handles it itself
        raise KeyboardInterrupt
    return int(code)


def _usage(error: Exception) -> int:
    """The exit code after reporting a usage error in one line; raises other errors again."""
    if isinstance(error, LabError):  # raised by a callback, before the command itself
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
        refused: Any = getattr(error.__cause__, "errors", list)()  # by pydantic: typer's own words leave out the value
        for row in refused:
            text = text.replace(row["msg"], f"{shortened(repr(row['input']))}: {row['msg']}", 1)
        fail(f"{text[:1].lower()}{text[1:]} (see {path} --help)", 2)
    return 2
