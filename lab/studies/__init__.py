"""Studies: how many sessions are run for a question, and what is written of the answer. Packages bring the questions.

A study is a function of a job and a reading (changes to all settings) that returns its findings. Those that ship are in
the package `lab_studies`, which enters the family as any other package does.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, counted, unknown
from lab.files import check_out
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    from lab.studies.findings import Findings
    from lab.studies.runner import Job

TABLES = ("learned", "exact")  # what simulated advisors know: a table that a learner learned, or the exact values
ADVISED = ("advisor_table",)


@dataclass(frozen=True)
class Study:
    """A study: its title, what runs it with a job and a reading, and what it reads: options that only some studies have.

    sessions: as many as it has unless --sessions says otherwise; least: fewer are refused.
    """

    title: str
    run: "Run"
    reads: tuple[str, ...] = ()
    sessions: int = 500
    least: int = 10


Run = Callable[["Job", Mapping[str, Any]], "Findings"]


def _adopted(name: str, thing: Any) -> Study:
    if isinstance(thing, Study):
        return thing
    if isinstance(thing, type) or not takes(thing, "job", "reading"):
        raise wanted(thing, "a function of a job and a reading that gives Findings, or a Study")
    return Study(first_line(thing), thing, sessions=100, least=2)


STUDIES = Family("studies", {}, _adopted)


def study_of(name: str) -> Study:
    """The study called `name`; BadInput lists the known ones."""
    if name not in STUDIES:
        raise unknown("study", name, STUDIES, "STUDY")
    return STUDIES[name]


def run_study(name: str, job: "Job", out: Path, reading: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Run a study and write its report, rows and sessions to `out`; the document of `lab study run --json`.

    reading: the values of such options; "advisor_table" is one of TABLES. BadInput for an unknown study or
    advisor table, a reading that the study has not got, too few sessions and a folder that cannot be; WorkFailed when it cannot
    be written.
    """
    return carried_out(checked(name, job, reading or {}), name, job, out, reading)


def checked(name: str, job: "Job", reading: Mapping[str, Any]) -> Study:
    """The study called `name`; BadInput for what `run_study` refuses."""
    study = study_of(name)
    if job.sessions < study.least:
        raise BadInput(f"{counted(job.sessions, 'session')} (--sessions): '{name}' takes {study.least} at the least")
    if (table := reading.get("advisor_table", TABLES[0])) not in TABLES:
        raise unknown("advisor table", table, TABLES, "--advisor-table")
    for option in reading:
        if option not in study.reads:
            takes = ", ".join(one for one, other in STUDIES.items() if option in other.reads)
            raise BadInput(f"--{option.replace('_', '-')}: the study '{name}' has none to choose; it is for {takes}")
    return study


def carried_out(
    study: Study, name: str, job: "Job", out: Path, reading: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """As `run_study`, of a study that need not be in the table, and with a reading that fits it."""
    from lab.studies.runner import STORE

    check_out(out)
    try:
        found = study.run(replace(job, folder=out), reading or {})
    except KeyboardInterrupt:
        goes_on = f"'{out}' keeps what is done, and the same command goes on"
        kept = goes_on if (out / STORE).is_file() else "nothing is kept"
        raise KeyboardInterrupt(f"stopped by Ctrl-C; {kept}") from None
    found = replace(found, summary={"sessions": job.sessions, "seed": job.seed, **found.summary})
    files = _written(study.title, name, found, out)
    if (out / STORE).is_file():
        files["sessions"] = str(out / STORE)
    document = {"study": name, "seed": job.seed, "sessions": job.sessions, "rows": found.rows}
    return document | {"summary": found.summary, "notes": list(found.notes), "files": files}


def _written(title: str, name: str, found: "Findings", out: Path) -> dict[str, str]:
    """Rows, report, pictures and texts are written; where they are."""
    from lab.studies.report import write_file, write_report, write_rows

    files = {"report": str(out / "report.html"), "rows": str(out / "rows.csv")}
    write_rows(out / "rows.csv", found.rows)
    write_report(out / "report.html", title, name, found)
    for number, (caption, picture) in enumerate(found.figures.items(), start=1):
        path = out / f"{number:02}-{re.sub(r'[^a-z0-9.]+', '-', caption.lower()).strip('-')[:60]}.svg"
        write_file(path, picture.decode())
        files[caption] = str(path)
    for file, text in found.files.items():
        write_file(out / file, text)
        files[file] = str(out / file)
    return files
