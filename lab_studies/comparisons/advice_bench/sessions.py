"""The sessions of AdviceBench: every rule of when to ask, with one advisor, in one problem, at each budget."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from lab.learning.batch import run_sessions
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import SPEAKS_AS_EXPECTED, SPEAKS_TO_CORRECT, Advice
from lab.mdp import FloatArray
from lab_studies.comparisons.advice_bench.bad_advisors import advice_of, importance
from lab_studies.comparisons.advice_bench.problems import RANDOM_WORLDS, SEVERAL, Benched, problem

BUDGETS = {"100": 100, "any": GateSettings.budget}  # answers of a session
CHANCE_TIMES = 4  # times as many sessions where moves are random, as their points vary more
LAST = 0.1  # the share of the episodes, at the end, that shows what was learned
BINS = 40  # of a learning curve
NOBODY, OURS = "nobody", "earned-trust"


class Rule(NamedTuple):
    """A rule of when to ask: the gate with its settings, and the states in which the advisor itself gives no answer."""

    gate: GateSettings
    important: bool = False  # the advisor speaks only where most is at stake
    speaks: int = 0


def _gate(gate: str, **settings: Any) -> GateSettings:
    return GateSettings(gate, spare_best=True, **settings)


EARLY: Any = {"first_episode": 1}
CCRL: Any = {"first_episode": 10, "lambda_threshold": 0.2, "omega": 3}
# each setting is, of a few values, the one with the highest mean gain over the problems not held out, with another seed
RULES: Mapping[str, Rule] = {
    "always": Rule(_gate("always")),
    "random": Rule(_gate("random", rate=0.02, **EARLY)),
    "introspection": Rule(_gate("ia", psi=0.03, **EARLY)),
    "importance (learner's)": Rule(_gate("importance", psi=0.03, **EARLY)),
    "uncertainty": Rule(_gate("uncertainty", spread=0.1, **EARLY)),
    "ccrl": Rule(_gate("ccrl", **CCRL)),
    "ccrl with memory": Rule(_gate("ccrl", memory=True, **CCRL)),
    "combined": Rule(_gate("combined", first_episode=10, psi=1.0)),
    "cq": Rule(_gate("cq", first_episode=5, enough_steps=100.0)),
    "novelty": Rule(_gate("novelty")),
    "fading": Rule(_gate("fading", fading=0.95)),
    "shaping": Rule(_gate("shaping", consistency=0.55)),
    "reliability": Rule(_gate("reliability")),
    "two levels": Rule(_gate("two-levels")),
    "importance (teacher's)": Rule(_gate("always"), important=True),
    "correcting": Rule(_gate("always"), important=True, speaks=SPEAKS_TO_CORRECT),
    "predictive": Rule(_gate("always"), important=True, speaks=SPEAKS_AS_EXPECTED),
    OURS: Rule(_gate(OURS)),
}


@dataclass(frozen=True)
class Case:
    """An advisor in a problem; None: nobody advises."""

    problem: str
    advisor: str | None


class Outcome(NamedTuple):
    """The results of N sessions: points (N,) of all episodes, last (N,) of the last, answers (N,); curve (BINS,) of points."""

    points: FloatArray
    last: FloatArray
    answers: FloatArray
    curve: FloatArray

    def to_json(self) -> list[list[float]]:
        """Plain lists."""
        return [values.tolist() for values in self]

    @classmethod
    def from_json(cls, lists: Any) -> "Outcome":
        """What `to_json` wrote. Raises TypeError or ValueError for anything else."""
        return cls(*(np.array(values, np.float64) for values in lists))


Outcomes = dict[tuple[str, str], Outcome]  # by rule and budget


def case_outcomes(case: Case, sessions: int, seed: int, rules: tuple[str, ...] = tuple(RULES)) -> Outcomes:
    """The outcomes of every rule at every budget, with the same seeds for each; for nobody the one of ("nobody", "any")."""
    worlds = min(RANDOM_WORLDS, sessions) if case.problem in SEVERAL else 1
    sessions *= CHANCE_TIMES if problem(case.problem).chances is not None else 1
    rng = np.random.default_rng([seed, crc32(case.problem.encode())])
    seeds = rng.integers(2**64, size=sessions, dtype=np.uint64)
    shares = np.array_split(seeds, worlds)
    parts_of: dict[tuple[str, str], list[Any]] = {}
    for world, own in enumerate(shares):
        place = problem(case.problem, world)
        for key, part in _place_outcomes(place, case.advisor, rules, own).items():
            parts_of.setdefault(key, []).append(part)
    return {key: _joined(parts) for key, parts in parts_of.items()}


def _place_outcomes(
    place: Benched, advisor: str | None, rules: tuple[str, ...], seeds: np.ndarray
) -> dict[tuple[str, str], Any]:
    if advisor is None:
        return {(NOBODY, "any"): _points(place, GateSettings("never"), None, seeds)}
    advice = advice_of(advisor, place)
    outcomes = {}
    for name in rules:
        rule = RULES[name]
        spoken = advice
        if rule.important:
            region = advice.region & importance(place)
            spoken = replace(advice, region=region, speaks=rule.speaks)
        for budget, most in BUDGETS.items():
            outcomes[name, budget] = _points(place, replace(rule.gate, budget=most), spoken, seeds)
    return outcomes


def _points(place: Benched, gate: GateSettings, advice: Advice | None, seeds: np.ndarray) -> Any:
    """Points (N, E) and answers (N,): 100 is the best policy's mean, 0 an episode that fails."""
    batch = run_sessions(place.place, place.learner, gate, advice, seeds)
    most = place.learner.max_steps + 1
    return 100.0 * (most - batch.steps) / (most - place.par), batch.helped_steps


def _joined(parts: list[Any]) -> Outcome:
    points, answers = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    last = max(1, round(LAST * points.shape[1]))
    curve = np.array([part.mean() for part in np.array_split(points.mean(axis=0), BINS)])
    values = points.mean(axis=1), points[:, -last:].mean(axis=1), answers.astype(np.float64), curve
    return Outcome(*(np.round(array, 2) for array in values))  # kept to a hundredth of a point
