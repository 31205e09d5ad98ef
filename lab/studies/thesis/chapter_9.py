"""The studies of chapter 9: which cells and pictures belong together, and what is to be said about them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lab.mdp import optimal_values
from lab.studies.charts import bars, convergence, scores, success_by_beta
from lab.studies.findings import Findings
from lab.studies.runner import LEARNED_SEED, Job, Setting, example, learned_table, walk_of_advisor, world
from lab.studies.statistics import interval, proportion_interval
from lab.studies.thesis.chapter_9_cells import (
    BEST_BETA,
    TABLES,
    TAUS,
    Row,
    agreement,
    appendix,
    by_beta,
    describe,
    row,
    table,
)

Reading = Mapping[str, Any]
AGREEMENT = "Each value is the share of Appendix V's cells of world I that agree with the printed ones under a reading."
SKILLS = {0.01: "expert", 0.1: "moderate", 0.3: "limited", 1.0: "novice"}
METHODS = {"ccrl": "CCRL", "ia": "IA", "combined": "combined"}
NEVER_REJECTS = 1_000_000  # Omega: nobody misleads so often
SYMBOLS = (
    "SP: sessions whose last episode takes the shortest way; HS: steps of a session in which advice was followed; AR: episodes "
    "in which advice was asked for; score: eq. 9.4, success against effort. β: how fast the learner's softmax cools; τ: the "
    "advisor's temperature, .01 an expert, 1 a novice; Λ: the improvement below which CCRL asks; Ω: the misleads that it "
    "tolerates; Ψ: the width of values below which IA asks."
)
RECONSTRUCTED = (
    "World II is printed only as a picture: tasks/world-2.toml is a reconstruction, chosen by what learning alone does "
    "there, by success and by helped steps (lab task reconstruct). Differences there say little about the methods."
)
EXACT = "Advisors know the exact optimal values; without --advisor-table exact they know a learned table."
ADVISOR = (
    "The advisor's table is learned by an autonomous session of 1000 episodes that begin anywhere (beta .7, seed "
    f"{LEARNED_SEED}, chosen among 36 seeds by how near world I comes to the printed figures, one choice for all cells); "
    "--advisor-table exact takes the exact optimal values. The study 'readings' compares these and other readings."
)


def best_scores(job: Job, reading: Reading, name: str) -> Findings:
    """One of the tables 9.2-9.5, with a picture of its scores and ranks."""
    rows = table(job, name, reading)
    notes = _notes([TABLES[name][0]], reading)
    return Findings(rows, agreement(rows), {f"{name}: scores and ranks": _scores(rows)}, notes)


def all_cells(job: Job, reading: Reading) -> Findings:
    """Appendix V."""
    rows = appendix(job, TABLES.values(), reading)
    return Findings(rows, agreement(rows), {}, _notes(BEST_BETA, reading))


def decay_factors(job: Job, reading: Reading) -> Findings:
    """Figure 9.4."""
    rows = by_beta(job)
    return Findings(
        rows, agreement(rows), {"Figure 9.4 (bands: 95 % intervals)": _beta_picture(rows)}, (RECONSTRUCTED,)
    )


def whole(job: Job, reading: Reading) -> Findings:
    """All of it: Appendix V, the four tables' ranks, and the figures; with a folder, cells that several need are run once."""
    cells, alone = appendix(job, TABLES.values(), reading), by_beta(job)
    figures = {"Figure 9.4 (bands: 95 % intervals)": _beta_picture(alone)}
    rows, ranks = cells + alone, dict[str, Any]()
    for name in TABLES:
        best = table(job, name, reading)
        figures[f"{name}: scores and ranks"] = _scores(best)
        found = agreement(best)
        ranks[f"{name} ranks"] = f"{found['ranks as printed']} of {found['ranks']} as printed"
    more, pictures = _figures(job, reading)
    rows += more
    return Findings(rows, agreement(rows) | ranks, pictures | figures, _notes(BEST_BETA, reading))


def readings(job: Job, reading: Reading) -> Findings:
    """Appendix V's world I under several readings of what the thesis leaves open."""
    rows: list[Row] = []
    for name, changes in READINGS.items():
        cells = appendix(job, [TABLES["table-9.2"], TABLES["table-9.3"]], changes)
        for view in ("full", "limited"):
            for measure in ("SP_percent", "HS_steps", "score"):
                of = [one["within"] for one in cells if (one["view"], one["measure"]) == (view, measure)]
                share, low, high = proportion_interval(sum(of), len(of))
                named = {"reading": name, "world": "world-1", "view": view}
                rows.append(row(named, f"{measure.split('_')[0]}_agreement_percent", share, (low, high), None))
    return Findings(rows, {"readings": len(READINGS)} | agreement(rows), {}, (AGREEMENT, SYMBOLS, ADVISOR))


READINGS: dict[str, dict[str, Any]] = {
    "learned advisor table": {},
    "exact advisor table": {"advisor_table": "exact"},
    **{f"learned advisor table, seed {seed}": {"table_seed": seed} for seed in (1, 2, 3, 4)},
    "unhelped episodes not judged": {"judge_unhelped": False},
    "success in any episode": {"success": "any"},
    "values per state and action": {"learner": "q"},
}


def _notes(places: Sequence[str] | Mapping[str, Any], reading: Reading) -> tuple[str, ...]:
    advisor = EXACT if reading.get("advisor_table") == "exact" else ADVISOR
    return (SYMBOLS, advisor, RECONSTRUCTED) if "world-2" in places else (SYMBOLS, advisor)


def _beta_picture(rows: Sequence[Row]) -> bytes:
    curves = {
        place: [(one["beta"], one["value"], *one["ci95"]) for one in rows if one["world"] == place]
        for place in BEST_BETA
    }
    return success_by_beta(curves, BEST_BETA)


def _scores(rows: Sequence[Row]) -> bytes:
    """Scores by advisor and method, from the rows of one of the tables 9.2-9.5."""
    found = {(one["gate"], one["tau"]): one for one in rows if one["measure"] == "score"}
    taus: list[float | str] = [*TAUS, "all"]
    groups = [f"{SKILLS[tau]} ({tau:g})" if isinstance(tau, float) else "all" for tau in taus]

    def of(name: str) -> list[list[Any]]:
        return [[found[gate, tau][name] for tau in taus] for gate in METHODS]

    return scores(groups, list(METHODS.values()), of("value"), of("rank"), intervals=of("ci95"), printed=of("thesis"))


def _figures(job: Job, reading: Reading) -> tuple[list[Row], dict[str, bytes]]:
    """Figures 9.1, 9.3 and 9.5-9.13: their cells and pictures."""
    rows: list[Row] = []
    pictures = {"Figure 9.1: an advisor's own way by tau": _advisors(rows, reading)}
    alone, guided = Setting("world-1"), Setting("world-1", gate="ccrl", tau=0.01, lambda_threshold=0.05, omega=1)
    optimum = 13
    for caption, setting, threshold in (
        ("Figure 9.3: a session in world I, learning alone", alone, None),
        ("Figures 9.5 and 9.6: a session with CCRL and an expert", replace(guided, **reading), 0.05),
    ):
        steps, helped = example(setting, job.seed)
        pictures[caption] = convergence(steps.tolist(), helped.tolist(), optimum, threshold=threshold)
    for caption, settings in _series().items():
        outcomes = job.run([replace(setting, **reading) for line in settings.values() for setting in line.values()])
        for what, measure in (("sessions that end optimal [%]", "SP_percent"), ("helped steps", "HS_steps")):
            values: dict[str, list[Row]] = {}
            for name, line in settings.items():
                for setting in line.values():
                    asked = replace(setting, **reading)
                    found = _measured(measure, outcomes[asked])
                    named = {"table": caption, **describe(asked)}
                    values.setdefault(name, []).append(row(named, measure, found[0], found[1:], None))
            rows += [one for line in values.values() for one in line]
            pictures[f"{caption}: {what}"] = bars(
                list(next(iter(settings.values()))),
                list(settings),
                [[one["value"] for one in line] for line in values.values()],
                [[one["ci95"] for one in line] for line in values.values()],
                what,
                xlabel=next(
                    (symbol for word, symbol in {"by Lambda": "Λ", "by Psi": "Ψ"}.items() if word in caption), ""
                ),
            )
    return rows, pictures


def _measured(measure: str, outcome: Any) -> tuple[float, float, float]:
    if measure == "SP_percent":
        return proportion_interval(int(outcome.success.sum()), len(outcome.success))
    return interval(outcome.helped_steps)


def _series() -> dict[str, dict[str, dict[str, Setting]]]:
    """Figures 9.7-9.13: caption -> series -> group -> setting."""
    by_skill = {f"{name} ({tau:g})": tau for tau, name in SKILLS.items()}
    one = Setting("world-1", "limited", "ccrl", 0.01, 0.05, 1)
    two = Setting("world-2", "limited", "ccrl", 0.01, 0.05, 7)
    introspecting = Setting("world-2", "limited", "ia", 0.01, psi=1.0)

    def skills(setting: Setting) -> dict[str, Setting]:
        return {name: replace(setting, tau=tau) for name, tau in by_skill.items()}

    def by_threshold(setting: Setting) -> dict[str, Setting]:
        return {f"{value:g}": replace(setting, lambda_threshold=value) for value in (0.01, 0.05, 0.1, 0.3, 0.5, 0.9)}

    both = Setting("world-2", "limited", "combined", 0.01, 0.05, 5, 1.0)
    return {
        "Figure 9.7: CCRL by Lambda, expert, world II, limited view": {
            "never rejects": by_threshold(replace(two, omega=NEVER_REJECTS)),
            "Omega 7": by_threshold(two),
        },
        "Figures 9.8 and 9.9: CCRL without and with the assessment of advice, world I, limited view": {
            "never rejects": skills(replace(one, omega=NEVER_REJECTS)),
            "Omega 1": skills(one),
        },
        "Figure 9.10: CCRL by Omega, world I, limited view": {
            f"Omega {omega}": skills(replace(one, omega=omega)) for omega in (1, 3, 5, 7)
        },
        "Figure 9.11: IA by Psi, expert, world II, limited view": {
            "IA": {f"{psi:g}": replace(introspecting, psi=psi) for psi in (0.1, 0.3, 0.7, 1.0, 1.3)}
        },
        "Figures 9.12 and 9.13: IA and the combined method by advisor, world II, limited view": {
            "IA": skills(introspecting),
            "combined, Omega 5": skills(both),
        },
    }


def _advisors(rows: list[Row], reading: Reading) -> bytes:
    """Figure 9.1: how often advisors of several skills take the shortest way themselves, and in how many steps they arrive."""
    taus = (0.01, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
    place = world("world-1")
    known = reading.get("advisor_table", "learned")
    table = learned_table(place) if known == "learned" else optimal_values(place.mdp(), place.learner.discount)
    walked = [walk_of_advisor(place, table, tau) for tau in taus]
    shares = [proportion_interval(int((steps == 13).sum()), len(steps)) for steps in walked]
    means = [interval(steps) for steps in walked]
    for tau, share, mean in zip(taus, shares, means, strict=True):
        named = {"table": "Figure 9.1", "world": "world-1", "advisor": "alone", "tau": tau, "advisor_table": known}
        rows.append(row(named, "SP_percent", share[0], share[1:], 100.0 if tau == 0.01 else None))
        rows.append(row(named, "mean_steps", mean[0], mean[1:], {0.01: 13.0, 1.0: 178.0}.get(tau)))
    ends = [[share[1:] for share in shares], [mean[1:] for mean in means]]
    groups = [f"{tau:g}" for tau in taus]
    return bars(
        groups,
        ["shortest way [%]", "mean steps (201: not arrived)"],
        [[share[0] for share in shares], [mean[0] for mean in means]],
        ends,
        "percent, steps",
        xlabel="tau",
        printed=np.array([[100.0] + [np.nan] * 7, [13.0] + [np.nan] * 6 + [178.0]]),
    )
