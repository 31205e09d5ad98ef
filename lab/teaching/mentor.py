"""A mentor for policies of any origin: at each step whether to ask somebody, and why, calibrated by a few episodes."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from typing import Any, Protocol

import numpy as np

from lab.errors import BadInput, unknown

Policy = Callable[[Any], Any]  # an observation to an action, or to what each action is worth


class Predicts(Protocol):
    """A policy as those of Stable-Baselines3 are."""

    def predict(self, observation: Any) -> Any:
        """The action, and what else it keeps."""


Step = tuple[Any, bool]  # an observation, and whether what the policy would do there is right
DECIMALS = 1  # of an observation's numbers, where visits are counted


@dataclass(frozen=True)
class Look:
    """A step as its mentor sees it: the policy's action, whether to ask, how doubtful it is (more is worse), and why."""

    action: int
    asks: bool
    doubt: float
    why: str


def margin(values: Sequence[Sequence[float]]) -> float:
    """How little the best action is ahead of the second, as a share of the values' width; 1: not at all."""
    ordered = sorted(values[0])
    width = ordered[-1] - ordered[0]
    return 1.0 - (ordered[-1] - ordered[-2]) / width if width > 0.0 else 1.0


def entropy(values: Sequence[Sequence[float]]) -> float:
    """The entropy of the values as chances (or of their softmax, where they are none), as a share of the most there can be."""
    row = np.asarray(values[0], np.float64)
    chances = row if row.min() >= 0.0 and abs(row.sum() - 1.0) < 1e-6 else _softmax(row)
    return float(-sum(p * log(p) for p in chances.tolist() if p > 0.0) / log(len(row)))


def disagreement(values: Sequence[Sequence[float]]) -> float:
    """The share of an ensemble that would do something else than most of it would."""
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
    """A policy with a mentor: called with an observation it says what to do, and whether to ask (see `Look`).

    `begin` tells it that an episode begins, which the rule "circles" needs to know.

    Raises BadInput for an unknown rule, an ensemble with another rule or a rule that the policy's answers do not serve.
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
        self._policies = [_called(one) for one in (policy if isinstance(policy, list | tuple) else [policy])]
        if rule == "ensemble" and len(self._policies) < 2:
            raise BadInput("rule 'ensemble' (watch): one policy: wanted a list of two or more")
        self.rule, self.threshold = rule, threshold
        self._visits = Counter(_key(observation) for observation in seen)
        if rule == VISITS and not self._visits:
            raise BadInput("rule 'visits' (watch): nothing was seen: give seen=, the observations of its training")

        self._met = Counter[Hashable]()  # in this episode

    def begin(self) -> None:
        """An episode begins."""
        self._met.clear()

    def __call__(self, observation: Any) -> Look:
        """The step at an observation."""
        self._met[_key(observation)] += 1
        answers = [one(observation) for one in self._policies]
        doubt = self._doubt(observation, answers)
        asks = doubt > self.threshold
        way = "above" if asks else "no more than"
        return Look(_action(answers), asks, doubt, f"{self.rule}: its doubt is {doubt:.2f}, {way} {self.threshold:.2f}")

    def _doubt(self, observation: Any, answers: list[Any]) -> float:
        if self.rule == CIRCLES:
            return 1.0 - 1.0 / self._met[_key(observation)]
        if self.rule == VISITS:
            return 1.0 / (1.0 + self._visits[_key(observation)])
        if self.rule != "ensemble" and np.ndim(answers[0]) == 0:
            raise BadInput(
                f"rule '{self.rule}' (watch): the policy answers {answers[0]!r}: wanted a value for each action"
            )
        if np.ndim(answers[0]) == 0:
            best = Counter(answers)
            return 1.0 - best.most_common(1)[0][1] / len(answers)
        return RULES[self.rule](answers)

    def calibrate(
        self, episodes: Iterable[Iterable[Step]], share: float | None = None, caught: float = 0.9
    ) -> "Watched":
        """Sets the threshold by labelled episodes: so that it asks in a share of their steps, or catches most wrong ones.

        share: of the steps; caught: of the steps in which the policy is wrong, with as few questions as that takes. Returns
        itself. Raises BadInput for no steps, and for no wrong ones where they are to be caught.
        """
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
    """A mentor for a policy: whether to ask at each step, and why.

    policy: a function of an observation, or an object with `predict` as those of Stable-Baselines3 have it; it answers an
    action, or what each is worth (values or chances); several in a list are an ensemble. gate: "margin" or "entropy" of the
    values, "ensemble" (they disagree), "visits" (how seldom an observation was met in training: `seen`), "circles" (how often
    it was met in this episode: the policy leads round; `begin` tells where one begins). It asks where the
    doubt, 0 to 1, is above the threshold: `calibrate` sets it.
    Source: the measures are those of Torrey and Taylor 2013 (importance), da Silva et al. 2020 (ensembles), and counts.
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
    """Stable-Baselines3 answers the action and its state."""
    found = answer[0] if isinstance(answer, tuple) else answer
    return int(found) if np.ndim(found) == 0 else found


def _action(answers: list[Any]) -> int:
    """What most would do; ties: the lowest."""
    votes = Counter(int(one) if np.ndim(one) == 0 else int(np.argmax(one)) for one in answers)
    return max(votes, key=lambda action: (votes[action], -action))


def _key(observation: Any) -> Hashable:
    """What makes observations the same: whole numbers, others rounded."""
    if isinstance(observation, dict):
        return tuple((name, _key(value)) for name, value in sorted(observation.items()))
    found = np.asarray(observation)
    if found.dtype.kind == "f":
        found = np.round(found, DECIMALS) + 0.0
    return found.shape, found.tobytes()
