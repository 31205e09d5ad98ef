"""The rules by which a mentor doubts, one class each, and their family DOUBTS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, shortened, unknown
from lab.lazy import scipy
from lab.learning.members import Member
from lab.mentor.demonstrated import Array, Demonstrated
from lab.plugins.code_file import from_file
from lab.plugins.family import Family, first_line, wanted
from lab.recordings.episode import Episode

NEIGHBOURS = 5
_FEATURES, _MEMBERS, _RIDGE = 256, 5, 1e-3  # of the mentor's own ensemble
_PENALTY = 1.0  # on the squared weights of the failure predictor
Arrays = Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Step:
    """One step of a rollout as the measures see it: a standardized state (d,) and an action (k,).

    number: of the step in its episode, from 0. chunk (h, k): the actions that the policy plans from here on, if it tells them.
    members (m, k): the actions that the members of an ensemble would take, if the policy is one.
    """

    demonstrated: Demonstrated
    state: Array
    action: Array
    number: int
    chunk: Array | None = None
    members: Array | None = None

    @cached_property
    def near(self) -> tuple[Array, NDArray[np.int64]]:
        """The distances of the nearest demonstrated steps, and their numbers."""
        return self.demonstrated.near(self.state, NEIGHBOURS)

    @cached_property
    def left(self) -> float:
        """The steps until the end, as the nearest demonstrated steps had them: their mean."""
        return float(self.demonstrated.left[self.near[1]].mean())


class Doubt:
    """The base of the rules: a number for each step of an episode; a mentor asks where it is above a threshold.

    A rule of your own is a subclass with `__call__`, called once for each step, in order; `begin` is called before them. What it
    learns stands in `arrays`, which is all that a file keeps of it. `lab.testing.check_doubt` holds it to the contract.

        >>> import lab
        >>> class Slow(lab.Doubt):
        ...     "Asks where the action is small."
        ...
        ...     def __call__(self, step):
        ...         return -abs(step.action).max()
        >>> from lab.testing import check_doubt
        >>> check_doubt(Slow)
    """

    learns_from_rollouts: ClassVar[bool] = False  # which then calibrate nothing: in them it doubts less than in others

    def __init__(self, demonstrated: Demonstrated, arrays: Arrays) -> None:
        self.demonstrated, self.arrays = demonstrated, arrays
        self.begin()

    @classmethod
    def learned(cls, demonstrated: Demonstrated, rollouts: Sequence[Episode], rng: np.random.Generator) -> Arrays:
        """The arrays of the rule, of numbers of 64 bits, learned from demonstrations and from rollouts whose success is known."""
        return {}

    def begin(self) -> None:
        """An episode begins, or a teacher hands back."""

    def __call__(self, step: Step) -> float:
        """The doubt at a step."""
        raise NotImplementedError


class Distance(Doubt):
    """The distance of the state to its fifth nearest demonstrated state, in standard deviations.

    Source: Sun et al. 2022, out-of-distribution detection with deep nearest neighbours.
    """

    def __call__(self, step: Step) -> float:
        return float(step.near[0][-1])


class Discrepancy(Doubt):
    """The distance of the action to the mean of the actions that were demonstrated nearby, in standard deviations.

    Source: SafeDAgger (Zhang and Cho 2017), with nearest neighbours in place of a learned classifier.
    """

    def __call__(self, step: Step) -> float:
        there = self.demonstrated.actions[step.near[1]].mean(axis=0)
        return float(np.linalg.norm((step.action - there) / self.demonstrated.action_scale))


class Ensemble(Doubt):
    """The standard deviation of the actions of an ensemble, in those of the demonstrations.

    It is the policy's own ensemble if the policy hands its members over; otherwise the mentor's, of ridge regressions on random
    Fourier features of the state. Each learns from demonstrated steps that were drawn with replacement, and begins with a random
    function of its own, so that the members differ where nothing was demonstrated.
    Source: EnsembleDAgger (Menda et al. 2019); random features: Rahimi and Recht 2007; random priors: Osband et al. 2018.
    """

    @classmethod
    def learned(cls, demonstrated: Demonstrated, rollouts: Sequence[Episode], rng: np.random.Generator) -> Arrays:
        """frequencies (m, d, f), phases (m, f), weights (m, f, k)."""
        n, d = demonstrated.states.shape
        pairs = rng.integers(n, size=(2, 1000))
        length = float(np.median(np.linalg.norm(demonstrated.states[pairs[0]] - demonstrated.states[pairs[1]], axis=1)))
        frequencies = rng.normal(size=(_MEMBERS, d, _FEATURES)) / max(length, 1e-6)
        phases = rng.uniform(0.0, 2.0 * np.pi, (_MEMBERS, _FEATURES))
        weights = []
        for frequency, phase in zip(frequencies, phases, strict=True):
            drawn = rng.integers(n, size=n)
            seen, k = _fourier(demonstrated.states[drawn], frequency, phase), demonstrated.actions.shape[1]
            prior = rng.normal(size=(_FEATURES, k)) * demonstrated.action_scale
            missing = demonstrated.actions[drawn] - seen @ prior
            inner = seen.T @ seen + _RIDGE * n * np.eye(_FEATURES)
            weights.append(prior + np.linalg.solve(inner, seen.T @ missing))
        return {"frequencies": frequencies, "phases": phases, "weights": np.array(weights)}

    def __call__(self, step: Step) -> float:
        actions = step.members
        if actions is None:
            seen = _fourier(step.state, self.arrays["frequencies"], self.arrays["phases"])
            actions = (seen[:, None] @ self.arrays["weights"])[:, 0]
        return float(np.linalg.norm(actions.std(axis=0) / self.demonstrated.action_scale))


def _fourier(states: Array, frequencies: Array, phases: Array) -> Array:
    """Random Fourier features (n, f) of states (n, d), or (m, f) of one state (d,) by m members."""
    return np.asarray(np.cos(states @ frequencies + phases) * np.sqrt(2.0 / phases.shape[-1]))


class ChunkDisagreement(Doubt):
    """The distance between the chunk of actions that the policy plans now and what it planned for these steps before.

    The mean over the steps that both plan, in standard deviations of the demonstrated actions; 0 at the first step.
    Source: temporal consistency of action chunks (Agia et al. 2024, STAC).
    """

    def begin(self) -> None:
        """Forgets the plan."""
        self._before: Array | None = None

    def __call__(self, step: Step) -> float:
        if step.chunk is None or len(step.chunk) < 2:
            raise BadInput(
                "rule 'chunk' (mentor): the policy does not tell its plan: wanted chunk=, two or more planned actions; in a "
                "dataset the feature 'chunk'"
            )
        before, self._before = self._before, step.chunk
        if before is None:
            return 0.0
        both = min(len(before) - 1, len(step.chunk))
        apart = (step.chunk[:both] - before[1 : both + 1]) / self.demonstrated.action_scale
        return float(np.linalg.norm(apart, axis=1).mean())


class NoProgress(Doubt):
    """The number of steps since the end came nearer, by at least one step, than ever before in the episode.

    How far the end is, is told by the nearest demonstrated steps: the mean number of steps that they were from their ends.
    """

    def begin(self) -> None:
        """No step has been seen."""
        self._nearest, self._stalled = np.inf, 0

    def __call__(self, step: Step) -> float:
        self._stalled += 1
        if step.left <= self._nearest - 1.0 or self._nearest == np.inf:
            self._nearest, self._stalled = step.left, 0
        return float(self._stalled)


class FailurePredictor(Doubt):
    """The probability, by logistic regression, that a step belongs to a rollout that fails.

    It looks at the state, the other measures of doubt and the time; it is learned from rollouts of which some failed.
    """

    learns_from_rollouts = True

    def begin(self) -> None:
        """No step has been seen."""
        self._parts = (
            Distance(self.demonstrated, {}),
            Discrepancy(self.demonstrated, {}),
            NoProgress(self.demonstrated, {}),
        )

    @classmethod
    def learned(cls, demonstrated: Demonstrated, rollouts: Sequence[Episode], rng: np.random.Generator) -> Arrays:
        """middle (f,), scale (f,), weights (f + 1,), the last of them the bias."""
        rows, failed = [], []
        for episode in rollouts:
            if episode.success is None or episode.corrected.any():
                continue
            looks = cls(demonstrated, {})
            rows += [looks.features(step) for step in steps_of(demonstrated, episode)]
            failed += [not episode.success] * len(episode)
        if len(set(failed)) < 2:
            raise BadInput(
                "rule 'failure' (mentor): it learns from uncorrected rollouts, of which some failed and some did not"
            )
        seen, labels = np.array(rows), np.array(failed, np.float64)
        middle, scale = seen.mean(axis=0), np.maximum(seen.std(axis=0), 1e-6)
        inputs = np.column_stack([(seen - middle) / scale, np.ones(len(seen))])

        def loss(weights: Array) -> tuple[float, Array]:
            scores = inputs @ weights
            error = scipy.special.expit(scores) - labels
            penalized = np.append(weights[:-1], 0.0)
            value = np.logaddexp(0.0, scores).sum() - labels @ scores + _PENALTY / 2.0 * penalized @ penalized
            return float(value), inputs.T @ error + _PENALTY * penalized

        best = scipy.optimize.minimize(loss, np.zeros(inputs.shape[1]), jac=True, method="L-BFGS-B")
        return {"middle": middle, "scale": scale, "weights": np.asarray(best.x)}

    def features(self, step: Step) -> Array:
        """What the regression sees (f,): the logarithms of the other measures, the steps left, the time, the state."""
        doubts = [np.log1p(part(step)) for part in self._parts]
        return np.array([*doubts, step.left, step.number, *step.state])

    def __call__(self, step: Step) -> float:
        seen = (self.features(step) - self.arrays["middle"]) / self.arrays["scale"]
        *weights, bias = self.arrays["weights"]
        return float(scipy.special.expit(seen @ np.array(weights) + bias))


class Chance(Doubt):
    """A number that is drawn for each step, the same in each session: a rival that knows nothing."""

    @classmethod
    def learned(cls, demonstrated: Demonstrated, rollouts: Sequence[Episode], rng: np.random.Generator) -> Arrays:
        """seed (1,): of the numbers."""
        return {"seed": np.array([float(rng.integers(2**32))])}

    def __init__(self, demonstrated: Demonstrated, arrays: Arrays) -> None:
        self._rng = np.random.default_rng(int(arrays["seed"][0]))
        super().__init__(demonstrated, arrays)

    def __call__(self, step: Step) -> float:
        return float(self._rng.random())


class Clock(Doubt):
    """The number of steps since the episode began, or since a teacher handed back: a rival that asks at fixed times."""

    def begin(self) -> None:
        """The clock starts."""
        self._steps = -1

    def __call__(self, step: Step) -> float:
        self._steps += 1
        return float(self._steps)


class Always(Doubt):
    """Doubt without limit, so that it always asks."""

    def __call__(self, step: Step) -> float:
        return float("inf")


class Never(Doubt):
    """No doubt, so that it never asks."""

    def __call__(self, step: Step) -> float:
        return float("-inf")


_SHIPPED: Mapping[str, Member[type[Doubt]]] = {
    "distance": Member(Distance, "asks where the state is far from all demonstrated ones"),
    "discrepancy": Member(Discrepancy, "asks where the action differs from those that were demonstrated nearby"),
    "ensemble": Member(Ensemble, "asks where several learners of the same demonstrations disagree"),
    "chunk": Member(ChunkDisagreement, "asks where the policy's plan differs from the one that it had a step before"),
    "progress": Member(NoProgress, "asks where the end has not come nearer for a while"),
    "failure": Member(FailurePredictor, "asks where rollouts like this one have failed"),
    "random": Member(Chance, "asks at random"),
    "clock": Member(Clock, "asks at fixed times"),
    "always": Member(Always, "asks at every step"),
    "never": Member(Never, "asks at none"),
}
UNCALIBRATED = ("always", "never")


def _adopted(name: str, thing: Any) -> Member[type[Doubt]]:
    """The row of a rule that another package, a file or a Python session adds. Raises BadInput if it is none."""
    if not (isinstance(thing, type) and issubclass(thing, Doubt) and thing.__call__ is not Doubt.__call__):
        raise wanted(thing, "a subclass of lab.Doubt with __call__")
    return Member(thing, first_line(thing))


DOUBTS = Family("doubts", _SHIPPED, _adopted)


def check_rule(rule: str, where: str) -> None:
    """Raises BadInput, which names `where` it came from, for a rule that DOUBTS does not have."""
    if rule not in DOUBTS:
        raise from_file("rule", rule, where) or unknown("rule", rule, tuple(DOUBTS), where)


def doubted(doubt: Doubt, step: Step) -> float:
    """The doubt at a step. Raises BadInput if a rule of somebody's own returns no number."""
    value: Any = doubt(step)
    if isinstance(value, bool) or not isinstance(value, Real) or value != value:  # no number is above or below nan
        raise BadInput(f"the rule {type(doubt).__name__} returned {shortened(repr(value))}: wanted a number")
    return float(value)


def learned_by(rule: str, demonstrated: Demonstrated, rollouts: Sequence[Episode], rng: np.random.Generator) -> Arrays:
    """What a rule learns. Raises BadInput if a rule of somebody's own returns other than arrays of finite numbers by name."""
    learned: Any = DOUBTS[rule].make.learned(demonstrated, rollouts, rng)
    try:
        arrays = {str(name): np.asarray(array, np.float64) for name, array in learned.items()}
    except (AttributeError, TypeError, ValueError):
        arrays = None
    if arrays is None or not all(np.isfinite(array).all() for array in arrays.values()):
        raise BadInput(
            f"rule '{rule}' (mentor): what it learned is {shortened(repr(learned))}: wanted arrays of finite numbers, by name"
        )
    return arrays


def steps_of(demonstrated: Demonstrated, episode: Episode) -> list[Step]:
    """The steps of an episode; its extra features "chunk" (n, h, k) and "members" (n, m, k), if it has them, are told."""
    chunks, members = episode.extra.get("chunk"), episode.extra.get("members")
    return [
        Step(
            demonstrated,
            state,
            np.asarray(action, np.float64),
            number,
            None if chunks is None else np.asarray(chunks[number], np.float64),
            None if members is None else np.asarray(members[number], np.float64),
        )
        for number, (state, action) in enumerate(
            zip(demonstrated.standardized(episode.states), episode.actions, strict=True)
        )
    ]


def doubts_of(doubt: Doubt, demonstrated: Demonstrated, episode: Episode) -> Array:
    """The doubt (n,) at each step of an episode; after each takeover the measure begins anew."""
    doubt.begin()
    doubts = []
    for step, corrected in zip(steps_of(demonstrated, episode), episode.corrected.tolist(), strict=True):
        doubts.append(doubted(doubt, step))
        if corrected:
            doubt.begin()
    return np.array(doubts)
