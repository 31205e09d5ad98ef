"""Studies: the family, running a study, and writing its report.

A study is a function of a job and a reading (values of its options) that returns its findings. The shipped studies are in the
package `lab_studies`, which adds them by entry points, as any other package can.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, counted, unknown
from lab.files import check_out, code_key
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    from lab.studies.findings import Findings
    from lab.studies.runner import Job

TABLES = ("learned", "exact")  # what simulated advisors draw from: a learned table, or the exact values
ADVISED = ("advisor_table",)


@dataclass(frozen=True)
class Study:
    """A study.

    title: in one line; run: a function of a `Job` and a reading (option -> value) that returns `Findings`.
    reads: the options that the study has, besides those of all studies.
    sessions: the default number per setting; least: the fewest allowed.

        >>> from lab.studies import Study
        >>> from lab.studies.findings import Findings, row
        >>> def run(job, reading):
        ...     return Findings([row({}, "sessions", job.sessions)], {"sessions": job.sessions})
        >>> from lab.testing import check_study
        >>> check_study(Study("Counts its sessions", run))
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
    """The study of that name. Raises BadInput, which lists the known ones."""
    if name not in STUDIES:
        raise unknown("study", name, STUDIES, "STUDY")
    return STUDIES[name]


def run_study(name: str, job: "Job", out: Path, reading: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The document of `lab study run --json`; report, rows and sessions are written to the folder `out`.

    reading: option -> value; "advisor_table" is one of TABLES. Raises BadInput for an unknown study or advisor table, an option
    that the study does not have, too few sessions and an unusable folder; WorkFailed if a file cannot be written.
    """
    return carried_out(checked(name, job, reading or {}), name, job, out, reading)


def checked(name: str, job: "Job", reading: Mapping[str, Any]) -> Study:
    """The study of that name. Raises BadInput as `run_study` does."""
    study = study_of(name)
    if job.sessions < study.least:
        raise BadInput(f"{counted(job.sessions, 'session')} (--sessions): '{name}' takes {study.least} at the least")
    if (table := reading.get("advisor_table", TABLES[0])) not in TABLES:
        raise unknown("advisor table", table, TABLES, "--advisor-table")
    for option in reading:
        if option not in study.reads:
            takes = ", ".join(one for one, other in STUDIES.items() if option in other.reads) or "no study"
            raise BadInput(f"--{option.replace('_', '-')}: the study '{name}' has none to choose; it is for {takes}")
    return study


def carried_out(
    study: Study, name: str, job: "Job", out: Path, reading: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The document of a study that need not be in the table, with a checked reading; see `run_study`."""
    from lab.studies.runner import STORE

    check_out(out)
    try:
        findings = study.run(replace(job, folder=out, code=code_key(*STUDIES.modules_of(name))), reading or {})
    except KeyboardInterrupt:
        can_continue = f"'{out}' keeps what is done, and the same command goes on"
        kept = can_continue if (out / STORE).is_file() else "nothing is kept"
        raise KeyboardInterrupt(f"stopped by Ctrl-C; {kept}") from None
    findings = replace(findings, summary={"sessions": job.sessions, "seed": job.seed, **findings.summary})
    files = _written(study.title, name, findings, out)
    if (out / STORE).is_file():
        files["sessions"] = str(out / STORE)
    document = {"study": name, "seed": job.seed, "sessions": job.sessions, "rows": findings.rows}
    return document | {"summary": findings.summary, "notes": list(findings.notes), "files": files}


def _written(title: str, name: str, findings: "Findings", out: Path) -> dict[str, str]:
    """Writes rows, report, pictures and texts; returns their paths by name."""
    from lab.studies.report import write_file, write_report, write_rows

    files = {"report": str(out / "report.html"), "rows": str(out / "rows.csv")}
    write_rows(out / "rows.csv", findings.rows)
    write_report(out / "report.html", title, name, findings)
    for number, (caption, picture) in enumerate(findings.figures.items(), start=1):
        path = out / f"{number:02}-{re.sub(r'[^a-z0-9.]+', '-', caption.lower()).strip('-')[:60]}.svg"
        write_file(path, picture.decode())
        files[caption] = str(path)
    for file, text in findings.files.items():
        write_file(out / file, text)
        files[file] = str(out / file)
    return files
