"""`lab replay`: a kept session again."""

from pathlib import Path
from typing import Annotated

import typer

from lab.cli.lessons import kept_session, lesson_seat, say_outside, subject_of
from lab.cli.options import Json, Plain, Port, ToolboxFolder, TrustModule
from lab.cli.output import end, show


def replay(
    folder: Annotated[
        Path | None,
        typer.Argument(help="The folder of a session (--out of lab teach); none: lists those in the toolbox."),
    ] = None,
    pause: Annotated[
        float, typer.Option("--pause", min=0.0, max=3600.0, help="Seconds between two answers; default: half a second.")
    ] = 0.5,
    trust_module: TrustModule = None,
    page: Annotated[bool, typer.Option("--page", help="Show it on a page on 127.0.0.1, too.")] = False,
    port: Port = 0,
    plain: Plain = False,
    toolbox: ToolboxFolder = None,
    as_json: Json = False,
) -> None:
    """Show a kept teaching session again: each question, what was answered, what came of it, and what it was worth."""
    from lab.teaching.kept_session import session_rows
    from lab.teaching.lesson import replay as replay_session
    from lab.toolbox.registry import Toolbox
    from lab.view.summary import replay_summary, table_of

    if folder is None:
        rows = session_rows(Toolbox(toolbox))
        show({"sessions": rows}, as_json, lambda d: table_of(d["sessions"], ("session", "problem", "advisor", "state")))
        return
    kept = kept_session(folder, "DIR", read_only=True, trusted=trust_module)
    say_outside(kept)
    try:
        with lesson_seat([] if as_json else ["terminal"], page=page, port=port, plain=plain) as seat:
            document = replay_session(
                kept, subject_of(kept.options, kept), seat.replaying(0.0 if as_json else pause).hear
            )
            seat.lesson_over(document)
            show(document, as_json, replay_summary)
            seat.stay()
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)
