"""The advisors of AdviceBench: skill models from expert to novice, and experts with a defect."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from zlib import crc32

import numpy as np

from lab.advice.advisors import AdvisorName, RecordedAdvisor
from lab.advice.table_level import PolicyAdvisor, TableLevel
from lab.learning.requests import AdviceRequest, Advisor, Reply
from lab.learning.simulated_advice import (
    SPEAKS_AS_EXPECTED,
    SPEAKS_TO_CORRECT,
    Advice,
    TableAdvisor,
    advice_chances,
    chance_accuracy,
    decisive,
    tau_of_accuracy,
)
from lab.mdp import BoolArray, FloatArray
from lab_studies.comparisons.advice_bench.problems import Benched

# The share of optimal answers, over the states in which an answer matters. An advisor that draws evenly has 0.23 to 0.44 in the
# problems of the bench; in world 1 the thesis's taus give 1.00, 0.83, 0.60 and 0.50.
ACCURACIES = {"expert": 0.99, "moderate": 0.85, "limited": 0.7, "novice": 0.55}
EVEN = 1e6  # times the span of the values: a tau with which answers are drawn almost evenly
WRONG_THERE, SILENT = 0.25, 0.75  # the shares of states with wrong and without answers
DRIFTS = 50  # the steps in which an expert becomes contrary
Made = Callable[[Benched], Advice]


def tau_for(benched: Benched, share: float = ACCURACIES["expert"]) -> float:
    """The tau of a simulated advisor with that share of optimal answers over the states in which an answer matters.

    Where an advisor that draws evenly has that share or more, a tau with which nearly that is drawn.
    """
    states = decisive(benched.values, ~benched.mdp.terminal)
    if not states.any() or chance_accuracy(benched.values, states) >= share:
        return EVEN * (1.0 + float(np.ptp(benched.values)))
    return tau_of_accuracy(benched.values, states, share)


def skilled(share: float) -> Made:
    """The simulated advisor with that share of optimal answers, see `tau_for`."""
    return lambda benched: Advice.of(advice_chances(benched.values, tau_for(benched, share)))


def contrary(benched: Benched) -> Advice:
    """An advisor that takes the worst action for the best."""
    return Advice.of(advice_chances(-benched.values, tau_for(benched)))


def wrong_there(benched: Benched) -> Advice:
    """An expert that is contrary in a quarter of the states, which are drawn once."""
    wrong = _drawn(benched, WRONG_THERE)
    return Advice.of(advice_chances(np.where(wrong[:, None], -benched.values, benched.values), tau_for(benched)))


def late(benched: Benched) -> Advice:
    """An expert that answers the previous question."""
    return replace(Advice.of(advice_chances(benched.values, tau_for(benched))), late=True)


def stuck(benched: Benched) -> Advice:
    """An advisor that always gives the action that is best at the start."""
    always = int(benched.values[benched.mdp.start].argmax())
    return Advice.of(np.tile(np.eye(benched.mdp.n_actions)[always], (benched.mdp.n_states, 1)))


def drifting(benched: Benched) -> Advice:
    """An expert whose chance of a contrary answer grows from 0 to 1 over the session."""
    tau = tau_for(benched)
    good, bad = advice_chances(benched.values, tau), advice_chances(-benched.values, tau)
    rows = np.minimum(np.arange(benched.learner.episodes) * DRIFTS // benched.learner.episodes, DRIFTS - 1)
    shares = np.linspace(0.0, 1.0, DRIFTS)[rows]
    return Advice.of((1.0 - shares)[:, None, None] * good + shares[:, None, None] * bad)


def long_winded(benched: Benched) -> Advice:
    """An advisor that gives the best action in half of its answers, else any action without failure: it makes detours."""
    best = advice_chances(benched.values, tau_for(benched))
    mdp = benched.mdp
    safe = (~(mdp.terminal & ~mdp.goal)[mdp.successor]).astype(np.float64)
    safe[safe.sum(axis=1) == 0.0] = 1.0
    return Advice.of(0.5 * best + 0.5 * safe / safe.sum(axis=1, keepdims=True))


def silent(benched: Benched) -> Advice:
    """An expert that is silent in three quarters of the states, which are drawn once."""
    return Advice.of(advice_chances(benched.values, tau_for(benched)), ~_drawn(benched, SILENT))


def _drawn(benched: Benched, share: float) -> BoolArray:
    rng = np.random.default_rng(crc32(f"{benched.name} {benched.mdp.signature}".encode()))
    return rng.random(benched.mdp.n_states) < share


ADVISORS: Mapping[str, Made] = {
    **{name: skilled(share) for name, share in ACCURACIES.items()},
    "contrary": contrary,
    "wrong there": wrong_there,
    "late": late,
    "stuck": stuck,
    "drifting": drifting,
    "long-winded": long_winded,
    "silent": silent,
}


def advisor_of(name: AdvisorName, benched: Benched, rng: np.random.Generator) -> Advisor | None:
    """The advisor of that name in a problem, None for "none". Raises BadInput for a record of another problem."""
    own = benched.learner.discount, rng
    level = TableLevel(benched.mdp, *own, episodes=benched.learner.episodes, values=lambda discount: benched.values)
    return level.advisor(name)


def advice_of(name: str | AdvisorName, benched: Benched) -> Advice | None:
    """The advice of an advisor of the bench, or of one whose answers are a table, such as a recorded one; None for any other.

    Raises BadInput for an unknown advisor, and for a record of another problem.
    """
    if isinstance(name, str) and name in ADVISORS:
        return ADVISORS[name](benched)
    parsed = AdvisorName.of(name, "--advisors") if isinstance(name, str) else name
    advisor = advisor_of(parsed, benched, np.random.default_rng(0))
    if isinstance(advisor, TableAdvisor):
        return advisor.advice
    if not (advisor is None or isinstance(advisor, RecordedAdvisor | PolicyAdvisor)):
        return None
    says = np.zeros(benched.mdp.successor.shape)
    q = [[0.0] * benched.mdp.n_actions] * benched.mdp.n_states
    for state in np.flatnonzero(~benched.mdp.terminal).tolist():
        request = AdviceRequest(
            episode=1, step=1, state=state, own=0, allowed=range(benched.mdp.n_actions), mdp=benched.mdp, q=q
        )
        action = None if advisor is None else advisor.advise(request)
        if action is not None:
            says[state, action] = 1.0
    heard: BoolArray = says.sum(axis=1) > 0.0
    says[~heard, 0] = 1.0
    return Advice.of(says, heard)


class HoldingBack:
    """An advisor that is asked only in a region, (S,) bool, and keeps an answer that it expects of the learner to itself.

    speaks: as in `Advice`, whose rules these are.
    """

    def __init__(self, advisor: Advisor, region: BoolArray, speaks: int):
        self._advisor, self._region, self._speaks = advisor, region, speaks
        self._chose: dict[int, int] = {}  # what the learner would have chosen in a state when it last asked there
        self.followed = getattr(advisor, "followed", None)

    def advise(self, request: AdviceRequest) -> Reply:
        """The advisor's answer, None outside the region and for the action that is expected."""
        if not self._region[request.state]:
            return None
        action, expected = self._advisor.advise(request), None
        if self._speaks == SPEAKS_TO_CORRECT:
            expected = request.own
        elif self._speaks == SPEAKS_AS_EXPECTED:
            expected = self._chose.get(request.state)
            self._chose[request.state] = request.own
        return None if action == expected else action


def importance(benched: Benched, share: float) -> BoolArray:
    """Whether each state is among the given share with the widest range of values, (S,) bool (Torrey and Taylor 2013)."""
    live = ~benched.mdp.terminal
    width: FloatArray = benched.values.max(axis=1) - benched.values.min(axis=1)
    wide: BoolArray = width >= np.quantile(width[live], 1.0 - share)
    return wide & live
