"""AdviceBench: every rule of when to ask and whom to believe, with every advisor, at every budget, on every problem."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from lab.statistics import interval
from lab.studies.findings import Findings, Row, row
from lab.studies.runner import Job
from lab_studies.comparisons.advice_bench.entered import Entered
from lab_studies.comparisons.advice_bench.figures import answers_and_gain, distances, gains, worst_cells
from lab_studies.comparisons.advice_bench.problems import HELD_OUT, Benched
from lab_studies.comparisons.advice_bench.ranks import Cell, Ranks, ranks
from lab_studies.comparisons.advice_bench.rules import NOBODY, OURS
from lab_studies.comparisons.advice_bench.sessions import (
    BINS,
    BUDGETS,
    Case,
    Outcome,
    Outcomes,
    case_outcomes,
)

MOST_BELOW = -2.0  # the project's target: no interval of the gain reaches below it
LEVEL = 0.9  # a learner has recovered at this share of nobody's last points
MEASURES = (
    "Points: the mean over all episodes (the area under the learning curve); 100 is the best policy's mean, 0 an episode that "
    "fails, and steps count in between. gain_points: points minus those of nobody's sessions with the same seeds, with the "
    "95 % interval of the paired differences; below 0 is harm. last: points of the last tenth of the episodes. answers: the "
    "advisor's answers in a session. later: episodes until the mean curve reaches nine tenths of nobody's last points, minus "
    "nobody's own; empty if it never does. Budget: answers of a session. Where moves are random (lake, windy-grids, inventory, "
    "queues) there are four times as many sessions."
)
RULES_NOTE = (
    "always with a budget is early advising. importance (teacher's): the advisor speaks only in the half of the states where "
    "most is at stake; correcting: there only against the move that the learner announces; predictive: there only against the "
    "learner's last move in the state (Torrey and Taylor 2013, who predict with a classifier). importance (learner's): "
    "Clouse's and Amir's. uncertainty: RCMP with five tables. novelty: advice novelty. reliability: CLUE with one advisor. two "
    "levels: ADMIRAL's successor, with one. shaping: policy shaping with a fixed consistency. fading: confidence decay. Rules "
    "that the literature gives for deep learners are carried over to tables."
)
CHOSEN = (
    "Chosen on the first twelve problems: the constants of 'earned-trust' (with seed 0, so that its figures there "
    "flatter it), the rivals' settings (the best mean gain of three to six values each, with seed 7), and the learner's "
    "settings (the best for learning without advice). The next six, other-worlds to crossing, were held out until their figures "
    "had been published. Held out are families of drawn instances, one for each of up to 100 sessions, whose learner has the "
    "common settings; nothing was chosen on them: " + ", ".join(HELD_OUT) + "."
)
RANKED = (
    "Ranks: the ranks of the points in each cell (problem, advisor, budget), ties shared, averaged within each problem, then "
    "over problems; the critical difference is Nemenyi's at 5 %, with problems as blocks. Whether points are above others': "
    "Wilcoxon's signed ranks of the problems' means with Holm's correction."
)


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
    says, pictures = in_short(rows, entered.problems, entered.rules)
    if any(name in HELD_OUT for name in entered.problems):
        says = {"families_seed": entered.families_seed} | says
    return Findings(rows, says, pictures, (MEASURES, RULES_NOTE, CHOSEN, RANKED))


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


def rows_of(
    place: Benched, outcomes: Mapping[Case, Outcomes], advisors: Sequence[str], rules: Sequence[str]
) -> list[Row]:
    """One row for nobody, and one for each advisor, budget and rule in a problem."""
    name, episodes = place.name, place.learner.episodes
    nobody = outcomes[Case(name, None)][NOBODY, "any"]
    group = {"held_out": name in HELD_OUT}
    alone = {
        "problem": name,
        "advisor": NOBODY,
        "budget": None,
        "rule": NOBODY,
        **group,
        **_shown(nobody, nobody, episodes),
    }
    rows = [row(alone, "gain_points", 0.0)]
    for advisor in advisors:
        for budget in BUDGETS:
            for rule in rules:
                outcome = outcomes[Case(name, advisor)][rule, budget]
                named = {"problem": name, "advisor": advisor, "budget": budget, "rule": rule, **group}
                mean, *ends = interval(outcome.points - nobody.points)
                rows.append(row(named | _shown(outcome, nobody, episodes), "gain_points", mean, ends))
    return rows


def _shown(outcome: Outcome, nobody: Outcome, episodes: int) -> Row:
    """The measures that are shown beside the gain."""
    later = _recovered(outcome, nobody, episodes), _recovered(nobody, nobody, episodes)
    return {
        "points": round(float(outcome.points.mean()), 2),
        "last": round(float(outcome.last.mean()), 2),
        "answers": round(float(outcome.answers.mean()), 1),
        "later": None if None in later else round(later[0] - later[1]),  # type: ignore[operator]
    }


def _recovered(outcome: Outcome, nobody: Outcome, episodes: int) -> float | None:
    """The episode from which the mean curve stays above nine tenths of nobody's last points; None if it does not."""
    enough = outcome.curve >= LEVEL * nobody.last.mean()
    below = np.flatnonzero(~enough)
    first = 0 if len(below) == 0 else int(below[-1]) + 1
    return None if first == BINS else first * episodes / BINS


def in_short(rows: Sequence[Row], problems: Sequence[str], rules: Sequence[str]) -> tuple[Row, dict[str, bytes]]:
    """The ranks and the harm, and their pictures, on the problems used for development and on those held out."""
    advised = [result for result in rows if result["rule"] != NOBODY]
    alone = {result["problem"]: result["points"] for result in rows if result["rule"] == NOBODY}
    scores: dict[str, dict[Cell, float]] = {rule: {} for rule in rules}
    scores[NOBODY] = {}
    for result in advised:
        cell = result["problem"], result["advisor"], result["budget"]
        scores[result["rule"]][cell], scores[NOBODY][cell] = result["points"], alone[result["problem"]]
    says: Row = {"rules": len(rules), "advisors": len({result["advisor"] for result in advised})}
    pictures: dict[str, bytes] = {}
    groups = {
        "": [name for name in problems if name not in HELD_OUT],
        "held out: ": [name for name in problems if name in HELD_OUT],
    }
    for words, those in groups.items():
        if not those:
            continue
        here = [result for result in advised if result["problem"] in those]
        ranked = ranks(scores, those, OURS)
        says |= _ranked(words, ranked) | _harm(words, here, rules)
        where = "held-out problems" if words else "problems"
        pictures |= {
            f"Mean ranks in {len(those)} {where}; rules joined by a bar are not told apart": distances(ranked),
            f"Points gained over nobody, means over {len(those)} {where}": gains(here, list(ranked.mean)),
            f"The worst cell of each rule in {len(those)} {where}": worst_cells(here, list(ranked.mean), MOST_BELOW),
            f"Answers and points gained, means over {len(those)} {where}": answers_and_gain(here, rules),
        }
    return says, pictures


def _ranked(words: str, ranked: Ranks) -> Row:
    best = [*ranked.mean.items()][:3]
    says: Row = {f"{words}best three mean ranks": ", ".join(f"{rule} {rank:.2f}" for rule, rank in best)}
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
