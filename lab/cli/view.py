"""`lab view`: a scene or a replay on a page."""

from typing import Annotated

import typer

from lab.cli.options import Json, Seed, Toasts
from lab.cli.output import end, write, write_json


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
            write_json({"url": url, "hint": hint})
        else:
            write(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it\n")

    try:
        show(what, toasts, seed, port, tell)
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)
