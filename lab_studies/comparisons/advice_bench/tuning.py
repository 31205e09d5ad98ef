"""The study that tunes every rule of AdviceBench by one procedure: as many drawn settings each, in the same sessions.

The first trial has the gate's defaults, the others a Latin hypercube over the ranges of the tuned settings (McKay et al. 1979).
At each budget the settings with the best mean of both headline scores, over the problems that are not held out and all
advisors, are written to TUNED. For the lab's own rule they are the same at all budgets, and those with the least loss: a
handicap in both scores. The sessions are others than those of the bench.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import exp, log
from typing import TYPE_CHECKING, Any, NamedTuple
from zlib import crc32

import numpy as np

from lab.errors import unknown
from lab.learning.settings import Range, Span
from lab.studies.findings import Findings, Row, row
from lab.studies.runner import Job
from lab.view.canvas import BLUE, GREY, ORANGE, picture_bytes
from lab_studies.comparisons.advice_bench.bad_advisors import ADVISORS
from lab_studies.comparisons.advice_bench.entered import listed
from lab_studies.comparisons.advice_bench.problems import PROBLEMS
from lab_studies.comparisons.advice_bench.rules import BUDGETS, NOBODY, OURS, RULES, TUNED
from lab_studies.comparisons.advice_bench.sessions import Case, case_outcomes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRIALS = 16
APART = 1_000_003  # added to the seed, so that no session of the bench is one of these
MEASURES = (
    "points: the mean of both headline scores (the return while advised, and the greedy policy along the way) over the problems "
    "that are not held out and all advisors, at one budget. loss: the mean, over the same cells, of what a score lies below "
    "nobody's. Every rule has as many trials: its defaults, and a Latin hypercube over the ranges of its settings; one without "
    "settings has one trial. The trial with the most points at a budget is the rule's entry in tuned.toml. The rule of the lab "
    "is to do no harm whatever the budget: its entry is the trial with the least loss over all budgets."
)
Trial = dict[str, Any]  # settings by name; {} for the defaults


@dataclass(frozen=True)
class Place:
    """A rule in a problem: the unit of work, in which all of its trials are measured."""

    rule: str
    problem: str


def trials_of(rule: str, trials: int, seed: int) -> list[Trial]:
    """The settings of each trial of a rule, with three significant digits; the first are the defaults."""
    ranges = RULES[rule].ranges()
    rng = np.random.default_rng([seed, crc32(rule.encode())])
    columns = {name: _spread(allowed, rng, trials - 1) for name, allowed in ranges.items()}
    return [{}] + [{name: column[n] for name, column in columns.items()} for n in range(trials - 1 if ranges else 0)]


def _spread(allowed: Range, rng: np.random.Generator, count: int) -> list[Any]:
    """`count` values, one in each of as many equal parts of a range, in random order."""
    assert isinstance(allowed, Span)
    shares = (rng.permutation(count) + rng.random(count)) / count
    low, high = allowed.low, allowed.high
    values: list[Any] = []
    for share in shares.tolist():
        if isinstance(low, int) and isinstance(high, int):
            values.append(min(high, low + int(share * (high - low + 1))))
        elif allowed.log:
            values.append(float(f"{exp(log(low) + share * (log(high) - log(low))):.3g}"))
        else:
            values.append(float(f"{low + share * (high - low):.3g}"))
    return values


class Measured(NamedTuple):
    """The results of a trial, means over cells: of both scores, and of what they lie below nobody's."""

    points: float
    loss: float


def measured(place: Place, sessions: int, seed: int, trials: int, advisors: Sequence[str]) -> dict[str, list[Measured]]:
    """By budget, the results of each trial, means over the advisors."""
    made = trials_of(place.rule, trials, seed)
    rules = {
        str(n): {budget: RULES[place.rule].rule(budget, trial) for budget in BUDGETS} for n, trial in enumerate(made)
    }
    nobody = case_outcomes(Case(place.problem, None), sessions, seed + APART)[NOBODY, "any"]
    scores: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for advisor in advisors:
        found = case_outcomes(Case(place.problem, advisor), sessions, seed + APART, rules=rules)
        for key, outcome in found.items():
            scores.setdefault(key, []).append((float(outcome.points.mean()), float(outcome.greedy.mean())))
    alone = float(nobody.points.mean()), float(nobody.greedy.mean())
    return {
        budget: [
            Measured(
                float(np.mean(scores[str(n), budget])),
                float(np.maximum(np.subtract(alone, scores[str(n), budget]), 0.0).mean()),
            )
            for n in range(len(made))
        ]
        for budget in BUDGETS
    }


def tuning(job: Job, reading: Mapping[str, Any]) -> Findings:
    """The trials of each rule, and the file of the best; reading: "methods", "problem" and "advisors" to measure fewer.

    Raises BadInput for a name that the bench does not have, or that is held out.
    """
    rules = _named(reading, "methods", "rule", RULES)
    problems, advisors = (
        _named(reading, "problem", "problem", PROBLEMS),
        _named(reading, "advisors", "advisor", ADVISORS),
    )
    places = [Place(rule, problem) for problem in problems for rule in rules]
    work = partial(measured, sessions=job.sessions, seed=job.seed, trials=TRIALS, advisors=advisors)
    found = job.each(work, places)
    rows: list[Row] = []
    best: dict[str, dict[str, Trial]] = {}
    for rule in rules:
        made = trials_of(rule, TRIALS, job.seed)
        points, loss = np.zeros((len(Measured._fields), len(BUDGETS), len(made)))
        for k, budget in enumerate(BUDGETS):
            results = np.mean([found[Place(rule, problem)][budget] for problem in problems], axis=0)
            points[k], loss[k] = results.T
            for n, trial in enumerate(made):
                shown = {"rule": rule, "budget": budget, "trial": n, "settings": _in_words(trial)}
                rows += [
                    row(shown, name, float(value)) for name, value in zip(Measured._fields, results[n], strict=True)
                ]
        chosen = [loss.sum(axis=0).argmin()] * len(BUDGETS) if rule == OURS else points.argmax(axis=1)
        best[rule] = {budget: made[int(n)] for budget, n in zip(BUDGETS, chosen, strict=True)}
    says = {f"{rule}, budget {budget}": _in_words(trial) for rule, of in best.items() for budget, trial in of.items()}
    pictures = {
        "Points of each trial; orange: the rule of the lab; large: the most; cross: the defaults": _drawn(rows, rules)
    }
    return Findings(rows, says, pictures, (MEASURES,), {TUNED: toml_of(best)})


def toml_of(best: Mapping[str, Mapping[str, Trial]]) -> str:
    """The settings by rule and budget as TOML; the defaults are left out."""
    parts = [
        "\n".join([f'["{rule}".{budget}]', *(f"{name} = {value}" for name, value in trial.items())])
        for rule, budgets in best.items()
        for budget, trial in budgets.items()
        if trial
    ]
    return "# written by the study advicebench-tuning\n\n" + "\n\n".join(parts) + "\n"


def _named(reading: Mapping[str, Any], option: str, noun: str, known: Mapping[str, Any]) -> tuple[str, ...]:
    """The names that an option lists, all known ones by default; noun: for one of them."""
    several = listed(reading, option, known)
    for name in several:
        if name not in known:
            raise unknown(noun, str(name), known, f"--{option}")
    return tuple(several)


def _in_words(trial: Trial) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in trial.items()) or "defaults"


def _drawn(rows: Sequence[Row], rules: Sequence[str]) -> bytes:
    """A picture of the points of each trial, by budget."""

    def draw(figure: "Figure") -> None:
        both = figure.subplots(1, len(BUDGETS), sharey=True)
        for axes, budget in zip(both, BUDGETS, strict=True):
            for line, rule in enumerate(rules):
                here = (rule, budget, "points")
                points = [one["value"] for one in rows if (one["rule"], one["budget"], one["measure"]) == here]
                colour = ORANGE if rule == OURS else BLUE
                axes.plot(points, [line] * len(points), "o", color=colour, markersize=3, alpha=0.5)
                axes.plot(max(points), line, "o", color=colour, markersize=6)
                axes.plot(points[0], line, "x", color=GREY, markersize=6)
            axes.set(xlabel="points, mean of both scores", title=f"budget {budget}", ylim=(len(rules) - 0.5, -0.5))
            axes.grid(axis="x")
        both[0].set_yticks(range(len(rules)), rules)

    return picture_bytes(draw, 9.5, 1.0 + 0.24 * len(rules))
