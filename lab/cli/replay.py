"""`lab replay`: show a kept session or a run again."""

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.lessons import lesson_seat, say_read, teacher_of
from lab.cli.options import Json, Own, Plain, Port, ToolboxPlace, TrustModule
from lab.cli.output import complain, console, end, show
from lab.cli.view import replay_page, serve
from lab.errors import BadInput


def replay(
    folder: Annotated[
        Path | None,
        typer.Argument(
            help="The folder of a session or of a run (--out); without one, the sessions in the toolbox are listed."
        ),
    ] = None,
    pause: Annotated[
        float, typer.Option("--pause", min=0.0, help="Seconds between two answers; default: half a second.")
    ] = 0.5,
    trust_module: TrustModule = None,
    page: Annotated[bool, typer.Option("--page", help="Also show it on a page on 127.0.0.1.")] = False,
    port: Port = 0,
    plain: Plain = False,
    own: Own = None,
    minari: Annotated[
        str | None,
        typer.Option("--minari", help="Save its steps as a Minari dataset of this name, such as lab/mine-v0."),
    ] = None,
    tensorboard: Annotated[
        Path | None, typer.Option("--tensorboard", help="Write its learning curve for TensorBoard into this folder.")
    ] = None,
    movie: Annotated[
        Path | None,
        typer.Option("--movie", help="Draw a run as a movie into this .gif or .webp file; no display is needed."),
    ] = None,
    seconds: Annotated[float, typer.Option("--seconds", min=1.0, help="Length of the movie in seconds.")] = 15.0,
    audit: Annotated[
        bool,
        typer.Option(
            "--audit",
            help="Audit a run again: compare its frames with its task, and list each part's stays and all faults.",
        ),
    ] = False,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Replay a kept teaching session or a run: questions, answers, actions and results."""
    for option, given in (("--movie", movie is not None), ("--audit", audit)):
        if given and (folder is None or not deferred.is_run(folder)):
            where = "" if folder is None else f"'{folder}': "
            raise BadInput(f"{where}{option} goes with the folder of a run (lab run --out)")
    if folder is None:
        rows = deferred.session_rows(deferred.Toolbox(toolbox))
        show(
            {"sessions": rows},
            as_json,
            lambda d: deferred.table_of(d["sessions"], ("session", "problem", "advisor", "state")),
        )
        return
    if audit:
        _audit_run(folder, as_json)
        return
    if deferred.is_run(folder):
        _replay_run(folder, page, port, as_json, movie, seconds)
        return
    deferred.check_libraries(minari, tensorboard)
    box = deferred.Toolbox(toolbox)
    kept: deferred.KeptSession | deferred.OrderSession
    if deferred.read_journal(folder, "DIR").session.command == "sequence":
        kept = deferred.kept_order(folder, "DIR", box, read_only=True)
    else:
        kept = deferred.KeptSession(folder, "DIR", read_only=True, trusted=trust_module or ())
    say_read(kept, "DIR")
    try:
        with lesson_seat([] if as_json else ["terminal"], page=page, port=port, plain=plain) as seat:
            pace = seat.replaying(0.0 if as_json else pause)
            with nullcontext() if as_json else deferred.replay_keys(pace) as has_keys:
                if has_keys:
                    seat.progress.console.print(deferred.KEYS_HELP)
                if isinstance(kept, deferred.OrderSession):
                    document = _replayed(kept, seat, toolbox)
                else:
                    record = deferred.StepRecord()
                    hear = deferred.told_to(seat.hear, record.hear) if minari or tensorboard else seat.hear
                    document = deferred.replay_session(kept, deferred.subject_of(kept.options, kept), hear)
                    if minari or tensorboard:
                        document["files"] = record.written(minari, tensorboard)
            seat.lesson_over(document)
            show(document, as_json, deferred.replay_summary)
            seat.stay()
    except KeyboardInterrupt:
        end("stopped by Ctrl-C", 130)


def _audit_run(folder: Path, as_json: bool) -> None:
    """Print the audit of a run's folder; exit 1 when it has findings."""
    options, task = deferred.kept_task(folder, "DIR")
    audited = deferred.audit(deferred.kept_evidence(folder, task, task.ordered(options.toasts, options.parts)))
    show({"run": str(folder), "task": task.name} | audited.to_json(), as_json, deferred.audit_summary)
    if audited.failure:
        end(audited.failure, 1)


def _replay_run(
    folder: Path, page: bool, port: int, as_json: bool, movie: Path | None = None, seconds: float = 15.0
) -> None:
    """Show a run from its journal; on request write its movie, or serve its replay on a page."""

    document = deferred.replayed_run(folder, "DIR")
    if movie is not None:
        with deferred.counting(console(), "pictures drawn") as progress:
            document["movie"] = deferred.write_movie(replay_page(folder), movie, seconds, progress)
    show(document, as_json, deferred.run_replay_summary)
    if page:
        try:
            serve(
                str(folder),
                None,
                port,
                lambda url, hint: complain(f"{url}\nfrom another machine: {hint}\nCtrl-C ends it"),
            )
        except KeyboardInterrupt:
            end("stopped by Ctrl-C", 130)


def _replayed(kept: "deferred.OrderSession", seat: "deferred.LessonSeat", toolbox: str | None) -> dict[str, Any]:
    """The document of a replayed session on an order: it is run again, and the journal answers for people."""

    def nobody(request: "deferred.Request") -> int | None:
        raise KeyboardInterrupt

    people = dict.fromkeys(kept.options.advisors, nobody)
    lessons = deferred.LessonOptions(advisors=deferred.DEFAULT_ADVISORS, seed=kept.options.seed)
    try:
        stopped = deferred.sequenced(kept, people, teacher_of(toolbox, lessons, seat))["interrupted"]
    except KeyboardInterrupt:  # no order was found before
        stopped = True
    if stopped and (kept.journal is None or kept.journal.folding):  # stopped by Ctrl-C, not by the end of the journal
        raise KeyboardInterrupt
    return kept.replayed()
