"""`lab replay`: a kept session again."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lab.cli.lessons import kept_session, lesson_room, say_outside, teacher_of, wanted_of
from lab.cli.options import Json, Plain, Port, ToolboxFolder, TrustModule
from lab.cli.output import end, show

if TYPE_CHECKING:
    from lab.learning.requests import Request
    from lab.seat.people import Classroom
    from lab.teaching.kept_order import OrderSession


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
    from lab.teaching.kept_order import OrderSession, is_order, kept_order
    from lab.teaching.kept_session import session_rows
    from lab.teaching.lesson import replay as replay_session
    from lab.toolbox.registry import Toolbox
    from lab.view.summary import replay_summary, table_of

    if folder is None:
        rows = session_rows(Toolbox(toolbox))
        show({"sessions": rows}, as_json, lambda d: table_of(d["sessions"], ("session", "problem", "advisor", "state")))
        return
    kept = (
        kept_order(folder, "DIR", Toolbox(toolbox), read_only=True)
        if is_order(folder, "DIR")
        else kept_session(folder, "DIR", read_only=True, trusted=trust_module)
    )
    say_outside(kept)
    try:
        with lesson_room([] if as_json else ["terminal"], page=page, port=port, plain=plain) as room:
            room.replaying(0.0 if as_json else pause)
            if isinstance(kept, OrderSession):
                document = _replayed(kept, room, toolbox)
            else:
                document = replay_session(kept, room, room.watch)
            room.ends(document)
            show(document, as_json, replay_summary)
            room.stay()
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)


def _replayed(kept: "OrderSession", room: "Classroom", toolbox: Path | None) -> dict[str, Any]:
    """Advice on an order again: the session is run once more, and the journal answers for the people."""
    from dataclasses import replace

    from lab.advice.advisors import PEOPLE
    from lab.production.sequence import sequence_named

    def nobody(request: "Request") -> int | None:
        raise KeyboardInterrupt

    wanted = replace(wanted_of(kept, room, room.watch), people=dict.fromkeys(PEOPLE, nobody))
    teacher, words = teacher_of(toolbox, ["expert"], kept.words.seed, room), kept.words
    try:
        found = sequence_named(
            words.task, words.case, words.toasts, wanted, teacher=teacher, listener=room.listener, files={}
        )
        stopped = found["interrupted"]
    except KeyboardInterrupt:  # before an order was found
        stopped = True
    if stopped and (kept.journal is None or kept.journal.folding):  # by Ctrl-C, not by the journal's end
        raise KeyboardInterrupt
    return kept.replayed()
