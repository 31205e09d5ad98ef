"""`lab.watch`: a mentor for any policy, which decides at each step whether to ask, and why, calibrated on a few episodes."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from typing import Annotated, Any, Protocol

import numpy as np
from annotated_types import Ge, Le

from lab.errors import BadInput, check_value, unknown

Policy = Callable[[Any], Any]  # a function from an observation to an action, or to a value per action


class Predicts(Protocol):
    """The interface of the policies of Stable-Baselines3."""

    def predict(self, observation: Any) -> Any:
        """The action, or a tuple that begins with it."""


Step = tuple[Any, bool]  # an observation, and whether the policy's action there is right
DECIMALS = 1  # to which the numbers of observations are rounded for counting visits


@dataclass(frozen=True)
class Look:
    """The mentor's view of a step: the policy's action, whether to ask, the doubt (0 to 1), and why."""

    action: int
    asks: bool
    doubt: float
    why: str


def margin(values: Sequence[Sequence[float]]) -> float:
    """1 minus the lead of the best action over the second, as a share of the span of the values; 1 for no lead."""
    ordered = sorted(values[0])
    width = ordered[-1] - ordered[0]
    return 1.0 - (ordered[-1] - ordered[-2]) / width if width > 0.0 else 1.0


def entropy(values: Sequence[Sequence[float]]) -> float:
    """The entropy of the values as probabilities (of their softmax if they are none), as a share of its maximum."""
    row = np.asarray(values[0], np.float64)
    chances = row if row.min() >= 0.0 and abs(row.sum() - 1.0) < 1e-6 else _softmax(row)
    return float(-sum(p * log(p) for p in chances.tolist() if p > 0.0) / log(max(2, len(row))))


def disagreement(values: Sequence[Sequence[float]]) -> float:
    """The share of an ensemble that disagrees with its majority action."""
    best = Counter(int(np.argmax(row)) for row in values)
    return 1.0 - best.most_common(1)[0][1] / len(values)


def _softmax(row: Any) -> Any:
    weights = np.array([exp(max(value - row.max(), -700.0)) for value in row])
    return weights / weights.sum()


RULES: dict[str, Callable[[Sequence[Sequence[float]]], float]] = {
    "margin": margin,
    "entropy": entropy,
    "ensemble": disagreement,
}
VISITS, CIRCLES = "visits", "circles"
NAMES = (*RULES, VISITS, CIRCLES)


class Watched:
    """A policy with a mentor; a call with an observation returns a `Look`: the action, and whether to ask.

    `begin` has to be called at the begin of each episode for the rule "circles".
    Raises BadInput for an unknown rule, and for a rule that does not fit the policy or its answers.
    """

    def __init__(
        self,
        policy: "Policy | Predicts | Sequence[Policy | Predicts]",
        rule: str,
        threshold: float,
        seen: Iterable[Any],
    ):
        if rule not in NAMES:
            raise unknown("rule", rule, NAMES, "watch")
        self._policies = [_called(member) for member in (policy if isinstance(policy, list | tuple) else [policy])]
        if not self._policies:
            raise BadInput("policy [] (watch): wanted a policy, or a list of one or more")
        if rule == "ensemble" and len(self._policies) < 2:
            raise BadInput("rule 'ensemble' (watch): one policy: wanted a list of two or more")
        check_value("threshold", threshold, float, "watch")
        if not isinstance(seen, Iterable):
            raise BadInput(f"seen {seen!r} (watch): wanted the observations of the training")
        self.rule, self.threshold = rule, threshold
        self._visits = Counter(_key(observation) for observation in seen)
        if rule == VISITS and not self._visits:
            raise BadInput("rule 'visits' (watch): nothing was seen: give seen=, the observations of its training")

        self._met = Counter[Hashable]()  # observations of this episode

    def begin(self) -> None:
        """Begins an episode."""
        self._met.clear()

    def __call__(self, observation: Any) -> Look:
        """The mentor's view of the step at an observation."""
        self._met[_key(observation)] += 1
        answers = [policy(observation) for policy in self._policies]
        doubt = self._doubt(observation, answers)
        asks = doubt > self.threshold
        relation = "above" if asks else "no more than"
        return Look(
            _action(answers), asks, doubt, f"{self.rule}: its doubt is {doubt:.2f}, {relation} {self.threshold:.2f}"
        )

    def _doubt(self, observation: Any, answers: list[Any]) -> float:
        if self.rule == CIRCLES:
            return 1.0 - 1.0 / self._met[_key(observation)]
        if self.rule == VISITS:
            return 1.0 / (1.0 + self._visits[_key(observation)])
        if self.rule != "ensemble" and np.ndim(answers[0]) == 0:
            raise BadInput(
                f"rule '{self.rule}' (watch): the policy answers {answers[0]!r}: wanted a value for each action"
            )
        if np.size(answers[0]) == 0:
            raise BadInput(f"rule '{self.rule}' (watch): the policy answers []: wanted a value for each action")
        if np.ndim(answers[0]) == 0:
            best = Counter(answers)
            return 1.0 - best.most_common(1)[0][1] / len(answers)
        return RULES[self.rule](answers)

    def calibrate(
        self, episodes: Iterable[Iterable[Step]], share: float | None = None, caught: float = 0.9
    ) -> "Watched":
        """This object, after its threshold was set by labelled episodes.

        share: of all steps that it asks about; if None, caught: the share of the wrong steps that it asks about, with as few
        questions as possible. Raises BadInput if there are no steps, or no wrong ones to be caught.
        """
        for name, value in (("share", share), ("caught", caught)):
            if value is not None:
                check_value(name, value, Annotated[float, Ge(0), Le(1)], "calibrate")
        steps = []
        for episode in episodes:
            self.begin()
            steps += [(self(observation).doubt, right) for observation, right in episode]
        self.begin()
        if not steps:
            raise BadInput("calibrate: no steps: wanted a few episodes of (observation, right)")
        if share is not None:
            doubts = sorted((doubt for doubt, _ in steps), reverse=True)
            most = min(len(doubts) - 1, round(share * len(doubts)))
            self.threshold = doubts[most]
            return self
        wrong = sorted((doubt for doubt, right in steps if not right), reverse=True)
        if not wrong:
            raise BadInput("calibrate: the policy is right in every step: nothing to catch; give share= instead")
        least = wrong[max(0, min(len(wrong), round(caught * len(wrong))) - 1)]
        self.threshold = float(np.nextafter(least, -np.inf))
        return self


def watch(
    policy: "Policy | Predicts | Sequence[Policy | Predicts]",
    gate: str = "margin",
    *,
    threshold: float = 0.5,
    seen: Iterable[Any] = (),
) -> Watched:
    """A mentor for a policy: it decides at each step whether to ask, and why.

    policy: a function of an observation, or an object with `predict` as in Stable-Baselines3; it returns an action, or a value or
    probability per action. A list of them is an ensemble.
    gate: the measure of doubt, 0 to 1: "margin" or "entropy" of the values, "ensemble" (disagreement), "visits" (how rare an
    observation was in training), "circles" (how often it was met in this episode; call `begin` at the begin of each).
    threshold: it asks if the doubt is above it; `calibrate` sets it.
    seen: the observations of the training, for "visits".

    Raises BadInput for an unknown gate, and for one that does not fit the policy.
    Source: Torrey and Taylor 2013 (importance), da Silva et al. 2020 (ensembles); the others are counts.

        >>> import lab
        >>> mentor = lab.watch(lambda observation: [0.1, 0.9] if observation else [0.5, 0.5])
        >>> mentor(0).asks, mentor(1).asks
        (True, False)
    """
    return Watched(policy, gate, threshold, seen)


def _called(policy: Any) -> Policy:
    predict = getattr(policy, "predict", None)
    if predict is not None:
        return lambda observation: _first(predict(observation))
    if not callable(policy):
        raise BadInput(f"policy {policy!r} (watch): wanted a function of an observation, or an object with `predict`")
    return policy  # type: ignore[no-any-return]


def _first(answer: Any) -> Any:
    """The action in an answer of `predict`, which may be a tuple of action and state."""
    first = answer[0] if isinstance(answer, tuple) else answer
    return int(first) if np.ndim(first) == 0 else first


def _action(answers: list[Any]) -> int:
    """The majority action; ties: the lowest."""
    votes = Counter(int(answer) if np.ndim(answer) == 0 else int(np.argmax(answer)) for answer in answers)
    return max(votes, key=lambda action: (votes[action], -action))


def _key(observation: Any) -> Hashable:
    """A key that is equal for equal observations; floats are rounded."""
    if isinstance(observation, dict):
        return tuple((name, _key(value)) for name, value in sorted(observation.items()))
    values = np.asarray(observation)
    if values.dtype.kind == "f":
        values = np.round(values, DECIMALS) + 0.0
    return values.shape, values.tobytes()
