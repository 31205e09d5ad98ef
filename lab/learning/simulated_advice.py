"""Simulated advice: probabilities of actions from a table, drawn from in a session or compiled in `kernels`."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from lab.errors import BadInput
from lab.learning.requests import AdviceRequest
from lab.learning.selection import Draw
from lab.mdp import BoolArray, FloatArray

# When an advisor answers: always; if the learner would choose another action; if it did so when it last asked there.
SPEAKS_ALWAYS, SPEAKS_TO_CORRECT, SPEAKS_AS_EXPECTED = range(3)
SAME_VALUE = 1e-9  # of the span of the values: actions that differ by less are equally good
BISECTIONS = 60


@dataclass(frozen=True, eq=False)
class Advice:
    """The answers of a simulated advisor as probabilities, for the interactive session and the compiled kernel.

    thresholds: (T, S, A) float64, the cumulative probabilities of the actions; episode n uses row min(n, T) - 1.
    region: (S,) bool, the states in which the advisor sees the robot; late: each answer is that to the previous question;
    speaks: SPEAKS_ALWAYS, SPEAKS_TO_CORRECT or SPEAKS_AS_EXPECTED. Source: thesis section 9.2, limited view 9.7; Torrey and
    Taylor 2013 for when it speaks.
    """

    thresholds: FloatArray
    region: BoolArray
    late: bool = False
    speaks: int = SPEAKS_ALWAYS

    @classmethod
    def of(cls, chances: FloatArray, region: BoolArray | None = None) -> "Advice":
        """The advice with these probabilities (S, A) or (T, S, A). Raises BadInput if shapes or probabilities do not fit."""
        table = chances[None] if chances.ndim == 2 else chances
        states = table.shape[1] if table.ndim == 3 else 0
        view = np.ones(states, bool) if region is None else np.asarray(region, bool)
        if table.ndim != 3 or view.shape != (states,):
            raise BadInput(
                f"advice: chances of shape {chances.shape} with a region of {view.shape}: wanted (S, A), (S,)"
            )
        if not (np.isfinite(table).all() and (table >= 0.0).all() and np.allclose(table.sum(axis=2), 1.0)):
            raise BadInput("advice: the chances of a state's actions must be finite, at least 0 and sum to 1")
        return cls(np.cumsum(table, axis=2), view)


def advice_chances(q: FloatArray, tau: float | Sequence[float]) -> FloatArray:
    """The softmax probabilities (S, A) over a table q (S, A), from which an advisor draws; (T, S, A) for several tau.

    tau > 0: 0.01 is an expert, 1 a novice. Raises BadInput for values that are not finite and for tau <= 0. Source: thesis eq.
    9.1.
    """
    taus = np.atleast_1d(np.asarray(tau, np.float64))
    if q.ndim != 2 or not np.isfinite(q).all() or not (np.isfinite(taus).all() and (taus > 0.0).all()):
        raise BadInput(f"advisor: a table of shape {q.shape} at tau {tau}: wanted finite values (S, A) and tau above 0")
    best = q - q.max(axis=1, keepdims=True)
    with np.errstate(over="ignore"):
        weights = np.exp(best[None] / taus[:, None, None])
    chances: FloatArray = weights / weights.sum(axis=2, keepdims=True)
    return chances[0] if np.isscalar(tau) else chances


def accuracy(chances: FloatArray, q: FloatArray, states: BoolArray) -> float:
    """The share of optimal answers of an advisor: the mean over states (S,) of the chance of an action of the best value.

    chances, q: (S, A); values within SAME_VALUE of the best one, as a fraction of the span of all values, count as the best.
    """
    return float(np.where(_best(q, states), chances, 0.0).sum(axis=1)[states].mean())


def decisive(q: FloatArray, states: BoolArray) -> BoolArray:
    """The states (S,) bool, of those given, in which an answer matters: some action has a lower value than the best one."""
    some: BoolArray = states & (~_best(q, states) & np.isfinite(q)).any(axis=1)
    return some


def _best(q: FloatArray, states: BoolArray) -> BoolArray:
    """The actions (S, A) bool of the best value."""
    best: BoolArray = q >= q.max(axis=1, keepdims=True) - SAME_VALUE * _span(q, states)
    return best


def _span(q: FloatArray, states: BoolArray) -> float:
    values = q[states]
    return float(np.ptp(values[np.isfinite(values)])) if len(values) else 0.0


def chance_accuracy(q: FloatArray, states: BoolArray) -> float:
    """The `accuracy` of an advisor that draws evenly; q: as in `tau_of_accuracy`."""
    shares: FloatArray = _best(q, states).sum(axis=1) / np.isfinite(q).sum(axis=1)
    return float(shares[states].mean())


def tau_of_accuracy(q: FloatArray, states: BoolArray, share: float) -> float:
    """The tau at which an advisor that draws from a table q (S, A) gives this share of optimal answers, see `accuracy`.

    The share falls from 1 to that of an advisor that draws evenly as tau grows; tau is found by bisection, so that it means the
    same skill whatever the scale of the rewards. q: finite, -inf for actions that a state does not have. Raises BadInput for a
    share outside these limits, and where all answers are optimal.
    """
    if not states.any():
        raise BadInput(f"accuracy {share:g}: every answer is optimal here, so that none shows an advisor's skill")
    span, evenly, below = _span(q, states), chance_accuracy(q, states), q - q.max(axis=1, keepdims=True)
    if not evenly < share < 1.0:
        raise BadInput(
            f"accuracy {share:g}: allowed are shares of optimal answers above {evenly:.3f}, at random, and below 1"
        )
    low, high = log(span * 1e-9), log(span * 1e3)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        weights = np.exp(below / exp(middle))
        chances: FloatArray = weights / weights.sum(axis=1, keepdims=True)
        low, high = (middle, high) if accuracy(chances, q, states) > share else (low, middle)
    return exp((low + high) / 2)


def tau_schedule(taus: Sequence[float], episodes: int) -> list[float]:
    """The tau of each episode: [tau] for one, otherwise a geometric sequence from the first to the second tau."""
    return np.geomspace(taus[0], taus[1], episodes).tolist() if len(taus) > 1 else [*taus]


class TableAdvisor:
    """A simulated advisor, which draws from its `Advice` and does not answer where it cannot see the robot."""

    def __init__(self, advice: Advice, draw: Draw):
        self.advice = advice
        self._draw = draw
        self._region: list[bool] = advice.region.tolist()
        self._last = len(advice.thresholds) - 1
        self._thresholds = advice.thresholds
        self._before: int | None = None  # the state of the previous question
        self._chose: dict[int, int] = {}  # what the learner would have chosen in a state when it last asked there

    def advise(self, request: AdviceRequest) -> int | None:
        """An action drawn for the state asked about (if late, for the previous one); None if the advisor does not answer."""
        state: int | None = request.state
        if self.advice.late:
            state, self._before = self._before, state
        if state is None or not self._region[state]:
            return None
        row: list[float] = self._thresholds[min(request.episode - 1, self._last), state].tolist()
        mark = self._draw() * row[-1]
        action = sum(below <= mark for below in row[:-1])
        expected: int | None = None
        if self.advice.speaks == SPEAKS_TO_CORRECT:
            expected = request.own
        elif self.advice.speaks == SPEAKS_AS_EXPECTED:
            expected = self._chose.get(request.state)
            self._chose[request.state] = request.own
        return None if action == expected else action
