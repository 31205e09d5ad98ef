"""The sessions of AdviceBench: every rule of when to ask, with one advisor, in one problem, at each budget."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from lab.advice.advisors import AdvisorName
from lab.learning import splitmix
from lab.learning.batch import run_sessions
from lab.learning.greedy import greedy_every, measure_greedy
from lab.learning.session import Session
from lab.learning.settings import GateSettings
from lab.learning.simulated_advice import Advice
from lab.mdp import FloatArray
from lab_studies.comparisons.advice_bench.bad_advisors import HoldingBack, advice_of, advisor_of, importance
from lab_studies.comparisons.advice_bench.entered import Entered
from lab_studies.comparisons.advice_bench.problems import INSTANCES, Benched
from lab_studies.comparisons.advice_bench.rules import NOBODY, Rule

CHANCE_TIMES = 4  # times as many sessions where moves are random, as their points vary more
LAST = 0.1  # the share of the episodes, at the end, that shows what was learned
BINS = 40  # of a learning curve


@dataclass(frozen=True)
class Case:
    """An advisor in a problem; None: nobody advises."""

    problem: str
    advisor: str | None


class Outcome(NamedTuple):
    """The results of N sessions: points (N,) of all episodes, last (N,) of the last, answers (N,); curve (BINS,) of points.

    greedy, greedy_last (N,): the points of the greedy policy without the advisor, the mean of K measurements along the way and
    the last one; greedy_curve (K,): the mean of each. They have no values where no table says what a greedy policy does.
    """

    points: FloatArray
    last: FloatArray
    answers: FloatArray
    curve: FloatArray
    greedy: FloatArray
    greedy_last: FloatArray
    greedy_curve: FloatArray

    def to_json(self) -> list[list[float]]:
        """Plain lists."""
        return [values.tolist() for values in self]

    @classmethod
    def from_json(cls, lists: Any) -> "Outcome":
        """What `to_json` wrote. Raises TypeError or ValueError for anything else."""
        return cls(*(np.array(values, np.float64) for values in lists))


Outcomes = dict[tuple[str, str], Outcome]  # by rule and budget


def case_outcomes(
    case: Case,
    sessions: int,
    seed: int,
    entered: Entered | None = None,
    rules: Mapping[str, Mapping[str, Rule]] | None = None,
) -> Outcomes:
    """The outcomes of every rule at every budget, with the same seeds for each; for nobody the one of ("nobody", "any").

    entered: the members of the run, by default the bench's own; rules: by name and budget, by default those of `entered`.
    """
    entered = entered or Entered()
    rules = entered.own_rules() if rules is None else rules
    entered.load()
    worlds = min(INSTANCES.get(case.problem, 1), sessions)
    sessions *= CHANCE_TIMES if entered.place(case.problem).chances is not None else 1
    rng = np.random.default_rng([seed, crc32(case.problem.encode())])
    seeds = rng.integers(2**64, size=sessions, dtype=np.uint64)
    shares = np.array_split(seeds, worlds)
    advisor = None if case.advisor is None else entered.advisor(case.advisor)
    parts_of: dict[tuple[str, str], list[_Part]] = {}
    for world, own in enumerate(shares):
        place = entered.place(case.problem, world)
        for key, part in _place_outcomes(place, advisor, rules, own).items():
            parts_of.setdefault(key, []).append(part)
    return {key: _joined(parts) for key, parts in parts_of.items()}


class _Part(NamedTuple):
    """Sessions in one place: points (N, E), answers (N,), and the greedy policy's points (N, K)."""

    points: FloatArray
    answers: NDArray[np.int64]
    greedy: FloatArray


def _place_outcomes(
    place: Benched, advisor: str | AdvisorName | None, rules: Mapping[str, Mapping[str, Rule]], seeds: np.ndarray
) -> dict[tuple[str, str], _Part]:
    if advisor is None:
        return {(NOBODY, "any"): _part(place, GateSettings("never"), None, seeds)}
    advice = advice_of(advisor, place)
    outcomes = {}
    for name, budgets in rules.items():
        for budget, rule in budgets.items():
            if advice is None:
                assert isinstance(advisor, AdvisorName)
                outcomes[name, budget] = _part_one_by_one(place, advisor, rule, seeds)
            else:
                region = advice.region & importance(place, rule.share) if rule.holds_back else advice.region
                outcomes[name, budget] = _part(
                    place, rule.gate, replace(advice, region=region, speaks=rule.speaks), seeds
                )
    return outcomes


def _part(place: Benched, gate: GateSettings, advice: Advice | None, seeds: np.ndarray) -> _Part:
    every = greedy_every(place.place, place.learner)
    batch = run_sessions(place.place, place.learner, gate, advice, seeds, greedy_every=every)
    return _Part(_scored(place, batch.steps), batch.helped_steps, _scored(place, batch.greedy))


def _part_one_by_one(place: Benched, name: AdvisorName, rule: Rule, seeds: np.ndarray) -> _Part:
    """What `_part` returns, for an advisor from other code; each session makes its own, with a generator of its seed.

    The learner draws the same numbers as in the sessions that nobody advises.
    """
    every, steps, answers = greedy_every(place.place, place.learner), [], []
    greedy = np.zeros((len(seeds), place.learner.episodes // every if every else 0))
    for seed, measured in zip(seeds.tolist(), greedy, strict=True):
        advisor = advisor_of(name.for_session(), place, np.random.default_rng(seed))
        if rule.holds_back and advisor is not None:
            advisor = HoldingBack(advisor, importance(place, rule.share), rule.speaks)
        session = Session(place.place, place.learner, rule.gate, advisor, splitmix.stream(seed))
        result = session.run(enough=partial(measure_greedy, session, seed, every, measured))
        if result.interrupted:
            raise KeyboardInterrupt
        steps.append(result.steps)
        answers.append(result.helped_steps)
    return _Part(_scored(place, np.array(steps)), np.array(answers), _scored(place, greedy))


def _scored(place: Benched, steps: np.ndarray) -> FloatArray:
    """The points of episodes: 100 is the best policy's mean, 0 an episode that fails."""
    most = place.learner.max_steps + 1
    points: FloatArray = 100.0 * (most - steps) / (most - place.par)
    return points


def _joined(parts: list[_Part]) -> Outcome:
    points, answers, greedy = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    last = max(1, round(LAST * points.shape[1]))
    curve = np.array([part.mean() for part in np.array_split(points.mean(axis=0), BINS)])
    none = np.zeros(0)
    along = (greedy.mean(axis=1), greedy[:, -1], greedy.mean(axis=0)) if greedy.shape[1] else (none, none, none)
    values = points.mean(axis=1), points[:, -last:].mean(axis=1), answers.astype(np.float64), curve, *along
    return Outcome(*(np.round(array, 2) for array in values))  # kept to a hundredth of a point
