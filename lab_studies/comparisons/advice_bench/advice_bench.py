"""AdviceBench: every rule of when to ask and whom to believe, with every advisor, at every budget, on every problem."""

import json
import re
from collections.abc import Mapping, Sequence
from functools import partial
from hashlib import sha256
from typing import Any

import numpy as np

from lab.errors import counted
from lab.files import csv_of
from lab.mdp import FloatArray
from lab.statistics import interval
from lab.studies.findings import Findings, Row, row
from lab.studies.leaderboard import scores_file
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench.aggregates import COLUMNS as AGGREGATE_COLUMNS
from lab_studies.comparisons.advice_bench.aggregates import (
    GREEDY,
    RETURN,
    SCORES,
    Aggregate,
    aggregates,
    table_of,
)
from lab_studies.comparisons.advice_bench.bad_advisors import ADVISORS
from lab_studies.comparisons.advice_bench.entered import Entered
from lab_studies.comparisons.advice_bench.figures import (
    answers_and_gain,
    distances,
    gains,
    means,
    profiles,
    worst_cells,
)
from lab_studies.comparisons.advice_bench.problems import HELD_OUT, Benched
from lab_studies.comparisons.advice_bench.ranks import Cell, Ranks, ranks
from lab_studies.comparisons.advice_bench.rules import BUDGETS, NOBODY, OURS
from lab_studies.comparisons.advice_bench.sessions import (
    Case,
    Outcome,
    Outcomes,
    case_outcomes,
)

MOST_BELOW = -1.0  # the project's target: no interval of the gain reaches below it
LEVEL = 0.9  # a learner has recovered at this share of nobody's last points
MEASURES = (
    "Points: the return while advised, as the mean over all episodes (the area under the learning curve); 100 is the best "
    "policy's mean, 0 an episode that fails, and steps count in between. gain_points: points minus those of nobody's sessions "
    "with the same seeds, with the 95 % interval of the paired differences; below 0 is harm. last: points of the last tenth of "
    "the episodes. greedy_points: the points of the greedy policy without the advisor, measured after every tenth episode in "
    "episodes that nobody learns from, mean over these; greedy_last: of the last of them; greedy_gain: greedy_points minus "
    "nobody's, with its interval. answers: the advisor's answers in a session. later, greedy_later: "
    "episodes until the mean curve (of points, of greedy points) reaches nine tenths of nobody's last points and stays above, "
    "minus nobody's own; empty if it never does. Budget: answers of a session. Where moves are random (lake, windy-grids, "
    "inventory, queues) there are four times as many sessions."
)
RULES_NOTE = (
    "always with a budget is early advising. importance (teacher's): the advisor speaks only where most is at stake, in a share "
    "of the states that was tuned; correcting: there only against the move that the learner announces; predictive: there only "
    "against the learner's last move in the state (Torrey and Taylor 2013, who predict with a classifier). importance "
    "(learner's): Clouse's and Amir's. uncertainty: RCMP with tables. novelty: advice novelty. reliability: CLUE with one "
    "advisor. two levels: ADMIRAL's successor, with one. shaping: policy shaping with a fixed consistency. fading: confidence "
    "decay. advice reuse: Zhu et al. 2020. advice imitation: Ilhan et al. 2021. policy reuse: PRQ-learning. value reuse: Q-value "
    "reuse, with a bonus for the answer instead of another table. Rules that the literature gives for deep learners are carried "
    "over to tables."
)
CHOSEN = (
    "Chosen on the 18 problems that are not held out: the settings of every rule, by one procedure with 16 trials at each budget "
    "(the study advicebench-tuning); before that, on the first twelve, the form of 'earned-trust' and the constants that are no "
    "settings of it; its figures there flatter it. The learner's settings are the best for learning without advice. Held out are "
    "families of 20 drawn instances, among which the sessions are shared out, and whose learner has the common settings; nothing "
    "was chosen on them: " + ", ".join(HELD_OUT) + "."
)
RANKED = (
    "Ranks: the ranks of the points in each cell (problem, advisor, budget), ties shared, averaged within each problem, then "
    "over problems; the critical difference is Nemenyi's at 5 %, with problems as blocks. Whether points are above others': "
    "Wilcoxon's signed ranks of the problems' means with Holm's correction. Both headline scores are ranked: points, and "
    "greedy_points."
)
AGGREGATED = (
    "Aggregates (aggregates.csv), as rliable defines them (Agarwal et al. 2021), over the sessions in all cells: the "
    "interquartile mean, with the 95 % interval of a bootstrap that draws each problem's sessions anew, the same in all of its "
    "cells; performance profiles, the share of sessions above each score; improvement, the chance that a session of "
    f"'{OURS}' scores above one of the rule in the same cell, a tie counting half. Every problem counts with as many sessions."
)
# by headline score: the beginning of its lines in short, the column of its points, and the measure of its gain
COLUMNS = {RETURN: ("", "points", "gain_points"), GREEDY: (f"{GREEDY}: ", "greedy_points", "greedy_gain")}


def advice_bench(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The results of the bench; reading: lists "problem", "methods" (rules) and "advisors", which replace all: see `Entered.of`.

    Raises BadInput for a problem that cannot be a table, and for an unknown rule or advisor.
    """
    entered = Entered.of(reading)
    cases = [Case(name, advisor) for name in entered.problems for advisor in (None, *entered.advisors)]
    outcomes = measured(job, cases, entered)
    rows = [
        result
        for name in entered.problems
        for result in rows_of(entered.place(name), outcomes, entered.advisors, entered.rules)
    ]
    says, pictures, lines = in_short(rows, outcomes, entered, job.seed)
    if any(name in HELD_OUT for name in entered.problems):
        says = {"families_seed": entered.families_seed} | says
    notes = (MEASURES, RULES_NOTE, CHOSEN, RANKED, AGGREGATED)
    files = {"aggregates.csv": csv_of(lines, AGGREGATE_COLUMNS)} | score_files(rows, outcomes, entered, job)
    return Findings(rows, says, pictures, notes, files)


def measured(job: Job, cases: Sequence[Case], entered: Entered) -> dict[Case, Outcomes]:
    """The outcomes of each case; cases whose results are in the job's folder are not run again."""
    # without a folder nothing is kept, and own code needs no source file
    own = {case: "" if job.folder is None else entered.key(case.problem, case.advisor) for case in cases}
    marks = {case: [job.sessions, job.seed, *entered.rules, *filter(None, [key])] for case, key in own.items()}

    def read(entry: Any) -> tuple[Case, Outcomes] | None:
        case = Case(*entry["case"])
        outcomes = {(str(rule), str(budget)): Outcome.from_json(lists) for (rule, budget), lists in entry["found"]}
        return (case, outcomes) if case in marks and entry["of"] == marks[case] else None

    done: dict[Case, Outcomes] = job.kept_as(read)
    left = [case for case in cases if case not in done]
    job.progress(len(done), len(cases))
    work = partial(case_outcomes, sessions=job.sessions, seed=job.seed, entered=entered)
    for case, outcomes in job.computed(work, left, 1):
        done[case] = outcomes
        entry = {"case": [case.problem, case.advisor], "of": marks[case]}
        job.keep(entry | {"found": [[list(key), outcome.to_json()] for key, outcome in outcomes.items()]})
        job.progress(len(done), len(cases))
    return done


def score_files(rows: Sequence[Row], outcomes: Mapping[Case, Outcomes], entered: Entered, job: Job) -> dict[str, str]:
    """A file of scores for each rule, by file name, for a leaderboard; none with problems or advisors that are not the bench's.

    The version is a hash of problems, learners, advisors, budgets and seeds, and of nobody's scores, which change with whatever
    else learning and scoring depend on.
    """
    if entered.places or any(name not in ADVISORS for name in entered.advisors):
        return {}
    digest = sha256(json.dumps([job.sessions, job.seed, BUDGETS, entered.problems, entered.advisors]).encode())
    for name in entered.problems:
        place = entered.place(name)
        digest.update(json.dumps([place.mdp.signature, vars(place.learner)]).encode())
        digest.update(json.dumps(outcomes[Case(name, None)][NOBODY, "any"].to_json()).encode())
        for advisor in entered.advisors:
            advice = ADVISORS[advisor](place)
            digest.update(np.round(advice.thresholds, 6).tobytes() + advice.region.tobytes() + bytes([advice.late]))
    cell = ("problem", "advisor", "budget")
    return {
        f"scores/{re.sub('[^a-z0-9]+', '-', rule.lower()).strip('-')}.csv": scores_file(
            "advicebench", digest.hexdigest()[:16], rule, [result for result in rows if result["rule"] == rule], cell
        )
        for rule in entered.rules
    }


def rows_of(
    place: Benched, outcomes: Mapping[Case, Outcomes], advisors: Sequence[str], rules: Sequence[str]
) -> list[Row]:
    """The rows for nobody, and for each advisor, budget and rule in a problem."""
    name, episodes = place.name, place.learner.episodes
    nobody = outcomes[Case(name, None)][NOBODY, "any"]
    group = {"held_out": name in HELD_OUT}
    alone = {"problem": name, "advisor": NOBODY, "budget": None, "rule": NOBODY, **group}
    rows = _cell_rows(alone, nobody, nobody, episodes)
    for advisor in advisors:
        for budget in BUDGETS:
            for rule in rules:
                outcome = outcomes[Case(name, advisor)][rule, budget]
                named = {"problem": name, "advisor": advisor, "budget": budget, "rule": rule, **group}
                rows += _cell_rows(named, outcome, nobody, episodes)
    return rows


def _cell_rows(named: Row, outcome: Outcome, nobody: Outcome, episodes: int) -> list[Row]:
    """The rows of a cell: the gains in both scores, the one of the greedy policy only where that was measured."""
    measured = bool(len(outcome.greedy))
    last = float(nobody.greedy_last.mean()) if measured else 0.0
    shown = named | {
        "points": round(float(outcome.points.mean()), 2),
        "last": round(float(outcome.last.mean()), 2),
        "greedy_points": round(float(outcome.greedy.mean()), 2) if measured else None,
        "greedy_last": round(float(outcome.greedy_last.mean()), 2) if measured else None,
        "answers": round(float(outcome.answers.mean()), 1),
        "later": _later(outcome.curve, nobody.curve, float(nobody.last.mean()), episodes),
        "greedy_later": _later(outcome.greedy_curve, nobody.greedy_curve, last, episodes) if measured else None,
    }
    rows: list[Row] = []
    for measure, field in (("gain_points", "points"), ("greedy_gain", "greedy")):
        own, others = getattr(outcome, field), getattr(nobody, field)
        if outcome is nobody and len(own):
            rows.append(row(shown, measure, 0.0))
        elif len(own):
            mean, *ends = interval(own - others)
            rows.append(row(shown, measure, mean, ends))
    return rows


def _later(curve: FloatArray, nobody: FloatArray, last: float, episodes: int) -> int | None:
    """Episodes until a mean curve has recovered, minus those of nobody's; None if one of them never does."""
    ends = _recovered(curve, last, episodes), _recovered(nobody, last, episodes)
    return None if ends[0] is None or ends[1] is None else round(ends[0] - ends[1])


def _recovered(curve: FloatArray, last: float, episodes: int) -> float | None:
    """The episode from which a mean curve stays above nine tenths of nobody's last points; None if it does not."""
    below = np.flatnonzero(curve < LEVEL * last)
    first = 0 if len(below) == 0 else int(below[-1]) + 1
    return None if first == len(curve) else first * episodes / len(curve)


def in_short(
    rows: Sequence[Row], outcomes: Mapping[Case, Outcomes], entered: Entered, seed: int
) -> tuple[Row, dict[str, bytes], list[Row]]:
    """Ranks, harm and aggregates in both scores, their pictures, and the lines of aggregates.csv.

    Problems used for development and those held out are apart. seed: of the bootstrap.
    """
    advised = [result for result in rows if result["rule"] != NOBODY]
    says: Row = {"rules": len(entered.rules), "advisors": len(entered.advisors)}
    pictures: dict[str, bytes] = {}
    lines: list[Row] = []
    held_out = [name for name in entered.problems if name in HELD_OUT]
    groups = {"": [name for name in entered.problems if name not in HELD_OUT], "held out: ": held_out}
    for words, those in groups.items():
        if not those:
            continue
        where = counted(len(those), "held-out problem" if words else "problem")
        here = [result for result in advised if result["problem"] in those and result["measure"] == "gain_points"]
        found: dict[str, dict[str, Aggregate]] = {}
        order: list[str] = []
        for score, (prefix, points, gain) in COLUMNS.items():
            whole = [name for name in those if len(getattr(outcomes[Case(name, None)][NOBODY, "any"], SCORES[score]))]
            if not whole:
                continue
            tables = {
                rule: table_of(outcomes, rule, score, whole, entered.advisors) for rule in (*entered.rules, NOBODY)
            }
            ranked = ranks(_means(rows, points), whole, OURS)
            found[score] = aggregates(tables, OURS, seed)
            order = order or list(ranked.mean)
            gained = [result for result in advised if result["problem"] in whole and result["measure"] == gain]
            says |= _ranked(words + prefix, ranked) | _in_short(words + prefix, found[score])
            says |= _harm(words + prefix, gained, entered.rules)
            lines += _lines("held out" if words else "development", score, found[score], ranked)
            caption = f"Mean ranks in {where}" if score == RETURN else f"Mean ranks by the greedy policy in {where}"
            pictures[f"{caption}; rules joined by a bar are not told apart"] = distances(ranked)
        pictures |= {
            f"Interquartile means of both scores in {where}, with bootstrap intervals": means(found, order),
            f"Performance profiles of both scores in {where}": profiles(found),
            f"Points gained over nobody, means over {where}": gains(here, order),
            f"The worst cell of each rule in {where}": worst_cells(here, order, MOST_BELOW),
            f"Answers and points gained, means over {where}": answers_and_gain(here, entered.rules),
        }
    return says, pictures, lines


def _means(rows: Sequence[Row], measure: str) -> dict[str, dict[Cell, float]]:
    """The scores by rule and cell; nobody's stand in each cell of their problem."""
    alone = {result["problem"]: result[measure] for result in rows if result["rule"] == NOBODY}
    scores: dict[str, dict[Cell, float]] = {}
    for result in rows:
        if result["rule"] != NOBODY:
            cell = result["problem"], result["advisor"], result["budget"]
            scores.setdefault(result["rule"], {})[cell] = result[measure]
            scores.setdefault(NOBODY, {})[cell] = alone[result["problem"]]
    return scores


def _lines(group: str, score: str, found: Mapping[str, Aggregate], ranked: Ranks) -> list[Row]:
    """The lines of aggregates.csv, best rank first."""
    lines: list[Row] = []
    for rule, rank in ranked.mean.items():
        own, p = found[rule], ranked.beaten.get(rule)
        numbers = *own.iqm, own.improvement, rank, p
        names = "interquartile_mean", "ci95_low", "ci95_high", "improvement", "mean_rank", "p"
        rounded = (None if number is None else round(number, 4) for number in numbers)
        lines.append({"problems": group, "score": score, "rule": rule} | dict(zip(names, rounded, strict=True)))
    return lines


def _in_short(words: str, found: Mapping[str, Aggregate]) -> Row:
    """The best interquartile mean and ours, and the rival with the lowest chance that ours is better."""
    best = max(found, key=lambda rule: found[rule].iqm[0])
    says: Row = {}
    for rule in dict.fromkeys((best, OURS)):
        if rule in found:
            says[f"{words}interquartile mean of '{rule}'"] = "{:.1f} ({:.1f} to {:.1f})".format(*found[rule].iqm)
    chances = {rule: own.improvement for rule, own in found.items() if own.improvement is not None}
    if chances:
        rival = min(chances, key=lambda rule: chances[rule])
        says[f"{words}'{OURS}' improves on"] = (
            f"{sum(chance > 0.5 for chance in chances.values())} of {len(chances)} others with a chance above 0.5; "
            f"least on '{rival}', {chances[rival]:.2f}"
        )
    return says


def _ranked(words: str, ranked: Ranks) -> Row:
    best = [*ranked.mean.items()][:3]
    says: Row = {
        f"{words}winner": best[0][0],
        f"{words}best three mean ranks": ", ".join(f"{rule} {rank:.2f}" for rule, rank in best),
    }
    if OURS in ranked.mean:
        ahead = [rule for rule, rank in ranked.mean.items() if rank < ranked.mean[OURS]]
        sure = sum(p < 0.05 for p in ranked.beaten.values())
        says[f"{words}'{OURS}'"] = (
            f"rank {len(ahead) + 1} of {len(ranked.mean)}; its points over problems are above those of {sure} others at 5 %"
        )
    return says | {f"{words}critical difference of ranks": round(ranked.critical, 2), f"{words}Friedman p": ranked.p}


def _harm(words: str, rows: Sequence[Row], rules: Sequence[str]) -> Row:
    """The number of cells in which each rule's interval reaches below the target, and the worst cell."""
    says: Row = {}
    for rule in rules:
        own = [result for result in rows if result["rule"] == rule]
        below = sum(result["ci95"][0] < MOST_BELOW for result in own)
        surely = sum(result["ci95"][1] < MOST_BELOW for result in own)
        worst = min(own, key=lambda result: result["ci95"][0])
        place = f"{worst['problem']}, {worst['advisor']}, budget {worst['budget']}"
        says[f"{words}harm by {rule}"] = (
            f"{below} of {len(own)} intervals reach below {MOST_BELOW:g}, {surely} lie there whole; "
            f"worst {worst['value']:+.1f} ({worst['ci95'][0]:.1f} to {worst['ci95'][1]:.1f}): {place}"
        )
    return says
