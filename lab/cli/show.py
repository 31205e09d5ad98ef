"""`lab show`: any schedule in 3D with its Gantt chart, as one page."""

from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred, output
from lab.cli.options import Json
from lab.errors import BadInput


def show(
    schedule: Annotated[
        list[Path],
        typer.Argument(
            help="A table (.csv) or .json file: who is worked on where, or carried by whom, from when to when; or the "
            "folder of a run. More files: where stations stand (station,x,y), or the problem of PyJobShop's solution."
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", help="The .html file; default: SCHEDULE.html, here.")] = None,
    as_json: Json = False,
) -> None:
    """Show any schedule in 3D, with its Gantt chart: a page that plays offline in any browser, in one file."""
    output.show(write_page(schedule, out), as_json, lambda document: document["file"])


def write_page(schedule: list[Path], out: Path | None) -> dict[str, Any]:
    """The document of `lab show --json`, after writing the page: its file and its content. BadInput without a schedule."""
    page = Path(f"{schedule[0].stem}.html") if out is None else out
    if page.suffix != ".html":
        raise BadInput(f"page '{page}' (--out): its name must end in .html")
    table = deferred.read_schedule([path / "schedule.csv" if path.is_dir() else path for path in schedule])
    shown = deferred.scene_of(table, schedule[0].stem)
    deferred.replay_html(shown.recording, page, shown.speed, shown.title, shown.story, tracks=shown.tracks)
    rows, measured = table.rows, shown.story.measured
    return {
        "file": str(page),
        "parts": list(dict.fromkeys(row.part for row in rows if row.part)),
        "stations": list(dict.fromkeys(name for row in rows for name in (row.origin, row.target) if name)),
        "vehicles": list(dict.fromkeys(row.vehicle for row in rows if row.vehicle)),
        "rows": len(rows),
        "makespan_s": measured.makespan_s,
    }
