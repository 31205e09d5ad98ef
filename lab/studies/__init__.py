"""Studies: the tables and figures of the thesis measured again, and comparisons of our own.

A study is a function of a file in `thesis` or `ours` that takes a job and a reading (changes to all settings) and
returns its findings, and a row of STUDIES. The files are loaded when a study is run: what they need takes a second.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lab.errors import BadInput, counted, unknown
from lab.plugins.family import Family, first_line, takes, wanted

if TYPE_CHECKING:
    from lab.studies.findings import Findings
    from lab.studies.runner import Job

TABLES = ("learned", "exact")  # what advisors know: see `thesis.chapter_9_sessions`
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


def _chapter_7(name: str, *of: str) -> Run:
    def run(job: "Job", reading: Mapping[str, Any]) -> "Findings":
        from lab.studies.thesis import chapter_7

        found: Findings = getattr(chapter_7, name)(job, reading, *of)
        return found

    return run


def _chapter_9(name: str, *of: str) -> Run:
    def run(job: "Job", reading: Mapping[str, Any]) -> "Findings":
        from lab.studies.thesis import chapter_9

        found: Findings = getattr(chapter_9, name)(job, reading, *of)
        return found

    return run


def _appendix_iii(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.thesis.appendix_3 import appendix_iii

    return appendix_iii(job, reading)


def _advice_budget(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.advice_budget import advice_budget

    return advice_budget(job, reading)


def _advice_worth(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.advice_worth import advice_worth

    return advice_worth(job, reading)


def _advice_bench(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.advice_bench.advice_bench import advice_bench

    return advice_bench(job, reading)


def _mentor(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.mentor import mentor

    return mentor(job, reading)


def _whom_to_believe(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.whom_to_believe import whom_to_believe

    return whom_to_believe(job, reading)


def _advisors(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.several_advisors import advisors

    return advisors(job, reading)


def _srl_time(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.srl_time_compared import srl_time_study

    return srl_time_study(job, reading)


def _flat(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.two_levels.flat_or_two_levels import flat

    return flat(job, reading)


def _carried_over(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.carried_over import carried_over

    return carried_over(job, reading)


def _changed_scenes(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.changed_scenes_study import changed_scenes

    return changed_scenes(job, reading)


def _grips(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.grips import grips

    return grips(job, reading)


def _faults(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.faults import faults

    return faults(job, reading)


def _reuse(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.reuse import reuse

    return reuse(job, reading)


def _transport(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.transport import transport

    return transport(job, reading)


def _reacting(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.reacting import reacting

    return reacting(job, reading)


def _mountain_car(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.mountain_car import mountain_car

    return mountain_car(job, reading)


def _sequencing_speed(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.sequencing_speed import sequencing_speed

    return sequencing_speed(job, reading)


def _tiles_speed(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.tiles_speed import tiles_speed

    return tiles_speed(job, reading)


def _speed(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.learning_speed import speed

    return speed(job, reading)


def _adopted(name: str, thing: Any) -> Study:
    if isinstance(thing, Study):
        return thing
    if isinstance(thing, type) or not takes(thing, "job", "reading"):
        raise wanted(thing, "a function of a job and a reading that gives Findings, or a Study")
    return Study(first_line(thing), thing, sessions=100, least=2)


_SHIPPED: dict[str, Study] = {
    "table-9.2": Study(
        "Table 9.2: best scores in world I with full view", _chapter_9("best_scores", "table-9.2"), ADVISED
    ),
    "table-9.3": Study(
        "Table 9.3: best scores in world I with limited view", _chapter_9("best_scores", "table-9.3"), ADVISED
    ),
    "table-9.4": Study(
        "Table 9.4: best scores in world II with full view", _chapter_9("best_scores", "table-9.4"), ADVISED
    ),
    "table-9.5": Study(
        "Table 9.5: best scores in world II with limited view", _chapter_9("best_scores", "table-9.5"), ADVISED
    ),
    "appendix-v": Study(
        "Appendix V: all methods, parameters and advisors in both worlds and views", _chapter_9("appendix_v"), ADVISED
    ),
    "figure-9.4": Study("Figure 9.4: learning alone with several decay factors", _chapter_9("figure_9_4")),
    "chapter-9": Study("Chapter 9: its tables, Appendix V and figures", _chapter_9("chapter_9"), ADVISED),
    "readings": Study(
        "Readings of chapter 9: what the thesis leaves open, and what comes nearest", _chapter_9("readings")
    ),
    "advice-budget": Study("Success against helped steps: every gate with and without memory", _advice_budget, ADVISED),
    "advice-worth": Study("What an advisor's help is worth over nobody's, for every skill of toast", _advice_worth),
    "advicebench": Study(
        "AdviceBench: rules of when to ask, whatever the advisor, the budget and the problem",
        _advice_bench,
        ("methods", "problem", "advisors"),
        sessions=100,
        least=2,
    ),
    "mentor": Study(
        "A mentor for other people's policies: when they should ask, at equal questions", _mentor, sessions=40, least=2
    ),
    "whom-to-believe": Study(
        "Whom to believe: is a panel of seven ranked rightly, and are three limited advisors better than nobody?",
        _whom_to_believe,
        sessions=100,
        least=2,
    ),
    "advisors": Study("Several advisors at once, beside the best and the worst of them alone", _advisors, ADVISED),
    "mountain-car": Study(
        "Mountain Car: when a teacher should speak, at equal budgets", _mountain_car, sessions=30, least=2
    ),
    "table-7.4": Study("Table 7.4: sequencing case I by session length", _chapter_7("best_results", "I")),
    "table-7.5": Study("Table 7.5: sequencing case II by session length", _chapter_7("best_results", "II")),
    "table-7.6": Study("Table 7.6: sequencing case III by session length", _chapter_7("best_results", "III")),
    "table-iv.1": Study("Table IV.1: SRL with several decay factors", _chapter_7("table_iv_1")),
    "table-iv.2": Study("Table IV.2: SRL with reward factors of types A and B", _chapter_7("table_iv_2")),
    "chapter-7": Study("Chapter 7 and Appendix IV: tables and figures", _chapter_7("chapter_7")),
    "readings-7": Study(
        "Readings of chapter 7: what the thesis leaves open, and what comes nearest", _chapter_7("readings")
    ),
    "appendix-iii": Study("Appendix III: a flexible manufacturing system", _appendix_iii),
    "srl-time": Study("srl-time, Q-learning from a bound of the full model on, beside every rival", _srl_time),
    "faults": Study("Runs of drawn faults: delivered, stopped with a true reason, or wrong", _faults, least=1),
    "flat": Study("One flat problem, or two levels: the toast task on a small grid", _flat),
    "changed-scenes": Study(
        "Skills in changed scenes: used as they are, adapted or learned, beside learning all anew", _changed_scenes
    ),
    "grips": Study("Parts that others made: which can be gripped, and whether they arrive", _grips),
    "reuse": Study(
        "Tasks in several orders, all in one toolbox: does a lab that has lived longer learn less?",
        _reuse,
        sessions=10,
        least=1,
    ),
    "carried-over": Study(
        "A policy learned on small cells orders larger ones, beside every dispatching rule", _carried_over, sessions=240
    ),
    "reacting": Study(
        "Drawn times, breakdowns, late parts: a list, policies that react, hindsight", _reacting, sessions=50
    ),
    "sequencing-speed": Study("Speed of the high level: episodes a second, proofs, time to 1 %", _sequencing_speed),
    "transport": Study(
        "Orders of work: every method on the field's own instances, beside the best known and the printed",
        _transport,
        ("seconds", "methods", "instances", "verify"),
        sessions=1,
        least=1,
    ),
    "tiles-speed": Study(
        "Speed on tiles: steps of Mountain Car a second, beside Gymnasium's loop", _tiles_speed, sessions=50, least=1
    ),
    "speed": Study("Speed: environment steps a second on one core, beside rivals", _speed),
}
STUDIES = Family("studies", _SHIPPED, _adopted)


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
    from lab.files import check_out
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
    """Rows, report and pictures are written; where they are."""
    from lab.studies.report import write_file, write_report, write_rows

    files = {"report": str(out / "report.html"), "rows": str(out / "rows.csv")}
    write_rows(out / "rows.csv", found.rows)
    write_report(out / "report.html", title, name, found)
    for number, (caption, picture) in enumerate(found.figures.items(), start=1):
        path = out / f"{number:02}-{re.sub(r'[^a-z0-9.]+', '-', caption.lower()).strip('-')[:60]}.svg"
        write_file(path, picture.decode())
        files[caption] = str(path)
    return files
