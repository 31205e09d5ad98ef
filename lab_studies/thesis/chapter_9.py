"""The studies of chapter 9: their cells, pictures and notes."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lab.studies.findings import Findings, Row, agreement, marked, share_row, those
from lab.studies.runner import Job
from lab_studies.thesis import chapter_9_figures as figures
from lab_studies.thesis.chapter_9_cells import BEST_BETA, TABLES, appendix, beta_rows, table
from lab_studies.thesis.chapter_9_sessions import LEARNED_SEED
from lab_studies.thesis.used_to_choose import SAYS

Reading = Mapping[str, Any]
RANKED = ("ranks as printed", "ranks", "ranks as printed by chance", "pairs in the printed order")  # of a summary
AGREEMENT = "Each value is the share of Appendix V's cells of world I that agree with the printed ones under a reading."
BY_BETA = "Figure 9.4 (bands: 95 % intervals)"
SYMBOLS = (
    "SP: sessions whose last episode takes the shortest path; HS: steps of a session in which advice was followed; AR: episodes "
    "in which advice was asked for; score: eq. 9.4, success against effort. β: how fast the learner's softmax cools; τ: the "
    "advisor's temperature, .01 for an expert, 1 for a novice; Λ: the improvement below which CCRL asks; Ω: the misleads that "
    "it tolerates; Ψ: the range of values below which IA asks."
)
RECONSTRUCTED = (
    "The thesis prints world II only as a picture; the one here, tasks/world-2.toml, is reconstructed from the values that it is "
    "compared with: from success without advice, and from success and helped steps with experts and novices (lab study run "
    "world-2). Differences there say little about the methods."
)
EXACT = "Advisors know the exact optimal values; without --advisor-table exact they know a learned table."
ADVISOR = (
    "In full view all agreement with chapter 9 depends on one table that the thesis loads but does not print: what its "
    "advisors know. Here it is learned by a session without advice of 1000 episodes that begin anywhere (beta .7, seed "
    f"{LEARNED_SEED}, chosen among 36 seeds as the one with which world I comes nearest to the printed values, one choice for "
    "all cells); --advisor-table exact takes the exact optimal values. The study 'readings' compares these and other readings."
)


CHOSEN, OTHER_SEED = "learned advisor table", "learned advisor table, seed "
READINGS: dict[str, dict[str, Any]] = {
    CHOSEN: {},
    "exact advisor table": {"advisor_table": "exact"},
    **{f"{OTHER_SEED}{seed}": {"table_seed": seed} for seed in (1, 2, 3, 4)},
    "unhelped episodes not judged": {"judge_unhelped": False},
    "success in any episode": {"success": "any"},
    "values per state and action": {"learner": "q"},
}


def best_scores(job: Job, reading: Reading, name: str) -> Findings:
    """The results of one of the tables 9.2-9.5, with a picture of its scores and ranks."""
    rows = table(job, name, reading)
    pictures = {f"{name}: scores and ranks": figures.ranks_picture(rows)}
    return Findings(rows, agreement(rows), pictures, _notes([TABLES[name][0]], reading))


def appendix_v(job: Job, reading: Reading) -> Findings:
    """The results of all cells of Appendix V."""
    rows = appendix(job, TABLES.values(), reading)
    return Findings(rows, agreement(rows), {}, _notes(BEST_BETA, reading))


def figure_9_4(job: Job, reading: Reading) -> Findings:
    """The results of learning alone with several decay factors; the reading, which is about advisors, has no effect."""
    rows = beta_rows(job)
    return Findings(rows, agreement(rows), {BY_BETA: figures.beta_picture(rows)}, (RECONSTRUCTED, SAYS["world-2"]))


def chapter_9(job: Job, reading: Reading) -> Findings:
    """The results of Appendix V, of the four tables' ranks, and of the figures; with a folder each cell is measured once."""
    cells, alone = appendix(job, TABLES.values(), reading), beta_rows(job)
    pictures = {BY_BETA: figures.beta_picture(alone)}
    ranks: Row = {}
    for name in TABLES:
        best = best_scores(job, reading, name)
        pictures |= best.figures
        as_printed, count, by_chance, pairs = (best.summary[key] for key in RANKED)
        ranks[f"{name} ranks"] = f"{as_printed} of {count} as printed ({by_chance} by chance)"
        ranks[f"{name} pairs in the printed order"] = pairs
    more, drawn = figures.figures(job, reading)
    rows = marked([*cells, *alone, *more])
    return Findings(rows, agreement(rows) | ranks, drawn | pictures, _notes(BEST_BETA, reading))


def readings(job: Job, reading: Reading) -> Findings:
    """The agreement of Appendix V's world I under several readings of what the thesis leaves open."""
    rows: list[Row] = []
    for name, changes in READINGS.items():
        cells = appendix(job, [TABLES["table-9.2"], TABLES["table-9.3"]], changes)
        for view in ("full", "limited"):
            for measure in ("SP_percent", "HS_steps", "score"):
                agree = [row["within"] for row in those(cells, view=view, measure=measure)]
                named = {"reading": name, "world": "world-1", "view": view}
                rows.append(share_row(named, f"{measure.split('_')[0]}_agreement_percent", agree))
    summary = {"readings": len(READINGS)} | agreement(rows) | by_seed(rows)
    return Findings(rows, summary, {}, (AGREEMENT, SYMBOLS, ADVISOR, SAYS["world-1"]))


def by_seed(rows: Sequence[Row]) -> Row:
    """The agreement with the chosen seed of the advisor's table, and the range with the others, by view and measure."""
    said: Row = {}
    for row in those(rows, reading=CHOSEN):
        same = {name: row[name] for name in ("view", "measure")}
        others = [other["value"] for other in those(rows, **same) if other["reading"].startswith(OTHER_SEED)]
        if others:
            name = f"{row['measure'].removesuffix('_agreement_percent')} agreement in {row['view']} view"
            chosen, low, high = row["value"], min(others), max(others)
            said[name] = f"{chosen:.0f} % with the chosen table, {low:.0f} to {high:.0f} % with {len(others)} others"
    return said


def advisor_note(reading: Reading) -> str:
    """The note on what advisors know."""
    return EXACT if reading.get("advisor_table") == "exact" else ADVISOR


def _notes(places: Iterable[str], reading: Reading) -> tuple[str, ...]:
    worlds = sorted({*places})
    notes = (SYMBOLS, advisor_note(reading), *(SAYS[place] for place in worlds))
    return (*notes, RECONSTRUCTED) if "world-2" in worlds else notes
