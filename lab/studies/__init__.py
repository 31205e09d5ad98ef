"""Studies: the tables and figures of the thesis measured again, and comparisons of our own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lab.studies.findings import Findings
    from lab.studies.runner import Job


Run = Callable[["Job", Mapping[str, Any]], "Findings"]


@dataclass(frozen=True)
class Study:
    """A study: its title, and what runs it with a job and a reading (changes to the settings of chapter 9)."""

    title: str
    run: Run


def _chapter(number: int, name: str) -> Run:
    """A study of chapter 7 or 9, by the name of its function."""

    def run(job: "Job", reading: Mapping[str, Any]) -> "Findings":
        from lab.studies.thesis import chapter_7, chapter_9

        findings: Findings = getattr({7: chapter_7, 9: chapter_9}[number], name)(job, reading)
        return findings

    return run


def _table(name: str) -> Run:
    def run(job: "Job", reading: Mapping[str, Any]) -> "Findings":
        from lab.studies.thesis.chapter_9 import best_scores

        return best_scores(job, reading, name)

    return run


def _appendix_iii(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.thesis.appendix_3 import appendix_iii

    return appendix_iii(job, reading)


def _srl_time(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.srl_time_compared import srl_time_study

    return srl_time_study(job, reading)


def _sequencing_speed(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.sequencing_speed import sequencing_speed

    return sequencing_speed(job, reading)


def _flat(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.two_levels.flat_or_two_levels import flat

    return flat(job, reading)


def _advice_budget(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.advice_budget import advice_budget

    return advice_budget(job, reading)


def _advisors(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.several_advisors import advisors

    return advisors(job, reading)


def _speed(job: "Job", reading: Mapping[str, Any]) -> "Findings":
    from lab.studies.ours.learning_speed import speed

    return speed(job)


STUDIES: dict[str, Study] = {
    "table-9.2": Study("Table 9.2: best scores in world I with full view", _table("table-9.2")),
    "table-9.3": Study("Table 9.3: best scores in world I with limited view", _table("table-9.3")),
    "table-9.4": Study("Table 9.4: best scores in world II with full view", _table("table-9.4")),
    "table-9.5": Study("Table 9.5: best scores in world II with limited view", _table("table-9.5")),
    "appendix-v": Study(
        "Appendix V: all methods, parameters and advisors in both worlds and views", _chapter(9, "all_cells")
    ),
    "figure-9.4": Study("Figure 9.4: learning alone with several decay factors", _chapter(9, "decay_factors")),
    "chapter-9": Study("Chapter 9: its tables, Appendix V and figures", _chapter(9, "whole")),
    "readings": Study(
        "Readings of chapter 9: what the thesis leaves open, and what comes nearest", _chapter(9, "readings")
    ),
    "advice-budget": Study("Success against helped steps: every gate with and without memory", _advice_budget),
    "advisors": Study("Several advisors at once, beside the best and the worst of them alone", _advisors),
    "table-7.4": Study("Table 7.4: sequencing case I by session length", _chapter(7, "table_7_4")),
    "table-7.5": Study("Table 7.5: sequencing case II by session length", _chapter(7, "table_7_5")),
    "table-7.6": Study("Table 7.6: sequencing case III by session length", _chapter(7, "table_7_6")),
    "table-iv.1": Study("Table IV.1: SRL with several decay factors", _chapter(7, "table_iv_1")),
    "table-iv.2": Study("Table IV.2: SRL with reward factors of types A and B", _chapter(7, "table_iv_2")),
    "chapter-7": Study("Chapter 7 and Appendix IV: tables and figures", _chapter(7, "whole")),
    "readings-7": Study(
        "Readings of chapter 7: what the thesis leaves open, and what comes nearest", _chapter(7, "readings")
    ),
    "appendix-iii": Study("Appendix III: a flexible manufacturing system", _appendix_iii),
    "srl-time": Study("SRL improved, beside every rival", _srl_time),
    "flat": Study("One flat problem, or two levels: the toast task on a small grid", _flat),
    "sequencing-speed": Study("Speed of the high level: episodes a second, proofs, time to 1 %", _sequencing_speed),
    "speed": Study("Speed: environment steps a second on one core, beside rivals", _speed),
}
