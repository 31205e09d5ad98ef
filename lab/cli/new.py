"""`lab new`: write a new task file."""

from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json
from lab.cli.output import console, show
from lab.errors import counted


def new(
    name: Annotated[str, typer.Argument(help="The task's name; the file is NAME.toml.")],
    part: Annotated[
        list[str] | None,
        typer.Option(
            "--part",
            help="A kind of part, SHAPE:SIZE:COUNT in metres: box:XxYxZ:COUNT or cylinder:DIAMETERxHEIGHT:COUNT, "
            "with NAME= before it if you like; several times for several kinds.",
        ),
    ] = None,
    machine: Annotated[
        list[str] | None,
        typer.Option(
            "--machine",
            help="A machine that all parts go to, NAME:SECONDS; several times: in this order. Default: none.",
        ),
    ] = None,
    mass: Annotated[
        list[str] | None,
        typer.Option("--mass", help="The mass of a kind of part, PART=KG, such as pin=0.05; default: that of wood."),
    ] = None,
    friction: Annotated[
        list[str] | None,
        typer.Option("--friction", help="A kind's coefficient of friction, PART=NUMBER, 0 to 5; default: 0.8."),
    ] = None,
    capacity: Annotated[
        list[str] | None,
        typer.Option(
            "--capacity",
            help="How many parts a station holds, STATION=NUMBER, such as oven=2: a machine (by default 1), "
            "a MACHINE_buffer (2), input or output (all parts).",
        ),
    ] = None,
    batch: Annotated[
        list[str] | None,
        typer.Option(
            "--batch", help="A machine that works on all parts in it together, such as oven; with --capacity."
        ),
    ] = None,
    arm: Annotated[str | None, typer.Option("--arm", help="The robot: {arms}.", autocompletion=offers("arms"))] = None,
    buffer: Annotated[bool, typer.Option("--buffer", help="A buffer before each machine.")] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Ask nothing and take the defaults: three boxes, one press.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Write a task file that runs: parts go from an input through machines to an output, laid out around the arm.

    Without options it asks for them; with any option it asks nothing.
    """
    path, task_name = deferred.file_of(name)
    changes = deferred.Changes(mass or (), friction or (), capacity or (), batch or ())
    if part or machine or arm or buffer or any(changes):
        wanted = deferred.new_task(task_name, arm or "up6", part or (), machine or (), buffer, changes)
    elif yes:
        wanted = deferred.new_task(task_name, "up6", (), (deferred.MACHINE,), False)
    else:
        wanted = deferred.ask(task_name, deferred.default_reader(console(), moves=False), console())
    text, task = deferred.new_cell(wanted, path)
    deferred.write_text(path, text)

    def told(d: dict[str, Any]) -> str:
        there = f"{counted(d['parts'], 'part')} and {counted(d['stations'], 'station')} around the arm {wanted.arm}"
        return (
            f"{d['file']}: {there}\nlook at it: lab task check {d['file']} --plot cell.png\nrun it: lab run {d['file']}"
        )

    document = {"file": str(path), "arm": wanted.arm, "parts": wanted.count, "stations": len(task.stations)}
    show(document, as_json, told)
