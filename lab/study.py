"""Run a study and write what it found."""

import re
from pathlib import Path
from typing import Any

from lab.errors import BadInput, WorkFailed, unknown
from lab.files import check_out
from lab.record import write_whole
from lab.studies import STUDIES
from lab.studies.runner import STORE, Job, Progress

TABLES = ("learned", "exact")
WITH_ADVISORS = (*(f"table-9.{n}" for n in (2, 3, 4, 5)), "appendix-v", "chapter-9", "advice-budget", "advisors")


def run_study(
    name: str,
    *,
    sessions: int,
    seed: int,
    workers: int,
    dask: str | None,
    advisor_table: str | None,
    out: Path,
    progress: Progress,
) -> dict[str, Any]:
    """Run a study and write its report, rows and sessions to `out`; the document of `lab study run --json`.

    BadInput for an unknown study or advisor table and for a folder that cannot be; WorkFailed when it cannot be written.
    """
    if name not in STUDIES:
        raise unknown("study", name, STUDIES, "STUDY")
    if advisor_table is not None and advisor_table not in TABLES:
        raise unknown("advisor table", advisor_table, TABLES, "--advisor-table")
    if advisor_table is not None and name not in WITH_ADVISORS:
        raise BadInput(f"advisor table '{advisor_table}' (--advisor-table): the study '{name}' has none to choose")
    check_out(out)
    from lab.studies.report import write_report, write_rows

    study = STUDIES[name]
    job = Job(sessions, seed, workers, dask, out, progress)
    try:
        found = study.run(job, {} if advisor_table is None else {"advisor_table": advisor_table})
    except KeyboardInterrupt:
        kept = (
            f"'{out}' keeps what is done, and the same command goes on"
            if (out / STORE).is_file()
            else "nothing is kept"
        )
        raise KeyboardInterrupt(f"stopped by Ctrl-C; {kept}") from None
    summary = {"sessions": sessions, "seed": seed, **found.summary}
    files = {"report": str(out / "report.html"), "rows": str(out / "rows.csv")}
    out.mkdir(parents=True, exist_ok=True)
    write_rows(out / "rows.csv", found.rows)
    write_report(out / "report.html", study.title, name, found.rows, summary, found.figures, found.notes)
    for number, (caption, picture) in enumerate(found.figures.items(), start=1):
        path = out / f"{number:02}-{re.sub(r'[^a-z0-9.]+', '-', caption.lower()).strip('-')[:60]}.svg"
        try:
            write_whole(path, picture.decode())
        except BadInput as error:
            raise WorkFailed(str(error)) from None
        files[caption] = str(path)
    if (out / STORE).is_file():
        files["sessions"] = str(out / STORE)
    notes = list(found.notes)
    return {
        "study": name,
        "seed": seed,
        "sessions": sessions,
        "rows": found.rows,
        "summary": summary,
        "notes": notes,
        "files": files,
    }
