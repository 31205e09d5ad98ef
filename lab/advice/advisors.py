"""Who advises: simulated advisors of any skill, a person at a terminal or a page, recorded advice, or nobody."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import isfinite
from pathlib import Path

import numpy as np

from lab.advice.entries import read_journal
from lab.errors import BadInput, unknown
from lab.learning.requests import AdviceRequest, Advisor, Ask
from lab.learning.selection import Draw, uniforms
from lab.mdp import BoolArray, FloatArray, TabularMDP, optimal_values


@dataclass(frozen=True, eq=False)
class Advice:
    """What a simulated advisor would say: the same for the interactive session and the compiled kernel.

    thresholds (T, S, A) float64: the cumulated chances of the actions in each state, in episode n those of row
    min(n, T) - 1; region (S,) bool: where the advisor sees the robot. Source: thesis section 9.2, limited view 9.7.
    """

    thresholds: FloatArray
    region: BoolArray

    @classmethod
    def of(cls, chances: FloatArray, region: BoolArray | None = None) -> "Advice":
        """From the chances (S, A) or (T, S, A) of the actions. Raises BadInput when shapes or chances do not fit."""
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


def skill(q: FloatArray, tau: float | Sequence[float]) -> FloatArray:
    """The chances (S, A) of an advisor that draws from a softmax over a table q (S, A); (T, S, A) for several tau.

    tau > 0: .01 is an expert, 1 a novice. Source: thesis eq. 9.1.
    """
    taus = np.atleast_1d(np.asarray(tau, np.float64))
    if q.ndim != 2 or not np.isfinite(q).all() or not (np.isfinite(taus).all() and (taus > 0.0).all()):
        raise BadInput(f"advisor: a table of shape {q.shape} at tau {tau}: wanted finite values (S, A) and tau above 0")
    best = q - q.max(axis=1, keepdims=True)
    with np.errstate(over="ignore"):
        weights = np.exp(best[None] / taus[:, None, None])
    chances: FloatArray = weights / weights.sum(axis=2, keepdims=True)
    return chances[0] if np.isscalar(tau) else chances


class TableAdvisor:
    """A simulated advisor: draws from its `Advice`, and says nothing where it does not see the robot."""

    def __init__(self, advice: Advice, draw: Draw):
        self._draw = draw
        self._region: list[bool] = advice.region.tolist()
        self._last = len(advice.thresholds) - 1
        self._thresholds = advice.thresholds

    def advise(self, request: AdviceRequest) -> int | None:
        """One draw for the state asked about."""
        if not self._region[request.state]:
            return None
        row: list[float] = self._thresholds[min(request.episode - 1, self._last), request.state].tolist()
        mark = self._draw() * row[-1]
        return sum(below <= mark for below in row[:-1])


class RecordedAdvisor:
    """Says again in each state what was last said there, and nothing elsewhere."""

    def __init__(self, said: Mapping[int, int]):
        self._said = dict(said)

    def advise(self, request: AdviceRequest) -> int | None:
        """What the record holds for this state."""
        return self._said.get(request.state)


class Person:
    """A person, asked through a prompt or a page that is brought along (see lab/seat)."""

    def __init__(self, ask: Ask):
        self._ask = ask

    def advise(self, request: AdviceRequest) -> int | None:
        """What the person says."""
        return self._ask(request)


class LimitedView:
    """Any advisor, a person too, who is heard only where the robot is in a region; (S,) bool."""

    def __init__(self, advisor: Advisor, region: BoolArray):
        self._advisor, self._region = advisor, region

    def advise(self, request: AdviceRequest) -> int | None:
        """What the advisor says, nothing outside the region."""
        return self._advisor.advise(request) if self._region[request.state] else None


@dataclass(frozen=True)
class Workbench:
    """What an advisor is made from: the problem, the learner's discount and episodes, what the advisor sees.

    people: who can be asked, by name; values: where the optimal action values come from, by default the problem's table.
    """

    mdp: TabularMDP
    discount: float
    rng: np.random.Generator
    people: Mapping[str, Ask] = field(default_factory=dict)
    region: BoolArray | None = None
    episodes: int = 1
    values: Callable[[float], FloatArray] | None = None

    def from_table(self, tau: float | Sequence[float], sign: float = 1.0) -> Advisor:
        """A simulated advisor that knows the exact optimal values, or (sign -1) takes the worst for the best."""
        known = optimal_values(self.mdp, self.discount) if self.values is None else self.values(self.discount)
        values = sign * known
        return TableAdvisor(Advice.of(skill(values, tau), self.region), uniforms(self.rng))


def _skilled(bench: Workbench, tau: float) -> Advisor:
    return bench.from_table(tau)


def _wrong(bench: Workbench) -> Advisor:
    return bench.from_table(0.01, sign=-1.0)


def _changing(bench: Workbench, first: float, last: float) -> Advisor:
    return bench.from_table(np.geomspace(first, last, bench.episodes).tolist())


def _person(bench: Workbench, name: str) -> Advisor:
    if name not in bench.people:
        raise BadInput(f"advisor '{name}': this command has no {PEOPLE[name]} to ask a person through")
    return Person(bench.people[name])


def _recorded(bench: Workbench, path: Path) -> Advisor:
    found, name = read_journal(path, "--advisor"), f"advisor 'recorded:{path}'"
    if found.session.signature != bench.mdp.signature:
        raise BadInput(
            f"{name}: it is advice about another problem, '{found.session.problem}' ({found.session.signature[:8]}): "
            f"wanted {bench.mdp.signature[:8]}"
        )
    said = found.said()
    if not said:
        raise BadInput(f"{name}: nothing was advised in that session")
    for state, action in said.items():
        if not (0 <= state < bench.mdp.n_states and 0 <= action < bench.mdp.n_actions):
            raise BadInput(f"{name}: state {state}, action {action} do not exist")
    return RecordedAdvisor(said)


def _nobody(bench: Workbench) -> None:
    return None


PEOPLE = {"terminal": "prompt", "web": "page"}
SKILLS = {"expert": 0.01, "moderate": 0.1, "limited": 0.3, "novice": 1.0}

ADVISORS: dict[str, Callable[[Workbench], Advisor | None]] = {
    **{name: partial(_skilled, tau=tau) for name, tau in SKILLS.items()},
    "wrong": _wrong,
    **{name: partial(_person, name=name) for name in PEOPLE},
    "none": _nobody,
}
FORMS = ("tau=X", "tau=X..Y", "recorded:DIR")  # names with something of the user's in them


def parse_advisor(name: str, where: str = "advisor") -> Callable[[Workbench], Advisor | None]:
    """How to make the advisor of that name: one in ADVISORS, "tau=X", "tau=X..Y" or "recorded:DIR".

    "tau=1..0.01" learns over the session from a novice to an expert. Raises BadInput for any other name.
    """
    if name in ADVISORS:
        return ADVISORS[name]
    if name.startswith("recorded:"):
        path = Path(name.removeprefix("recorded:"))
        if not path.name:
            raise BadInput(
                f"advisor '{name}' ({where}): it names no file: wanted recorded:DIR, the folder of a session"
            )
        return partial(_recorded, path=path)
    if not name.startswith("tau="):
        raise unknown("advisor", name, [*ADVISORS, *FORMS], where)
    try:
        taus = [float(part) for part in name[4:].split("..", 1)]
    except ValueError:
        taus = [0.0]
    if not all(isfinite(tau) and tau > 0.0 for tau in taus):
        raise BadInput(f"advisor '{name}' ({where}): tau must be a number above 0, such as tau=0.05 or tau=1..0.01")
    return partial(_skilled, tau=taus[0]) if len(taus) == 1 else partial(_changing, first=taus[0], last=taus[1])


def make_advisor(
    name: str,
    mdp: TabularMDP,
    discount: float,
    rng: np.random.Generator,
    people: Mapping[str, Ask] | None = None,
    *,
    region: BoolArray | None = None,
    episodes: int = 1,
    values: Callable[[float], FloatArray] | None = None,
) -> Advisor | None:
    """The advisor of that name for a problem, None for "none".

    Simulated advisors know the problem's exact optimal values for `discount`; given a `region` (S,), nobody speaks
    outside it; `episodes` is the session's length; `people`: who answers behind "terminal" and "web".
    Raises BadInput for an unknown name, for a person who is not there, and for a record that does not fit.
    """
    advisor = parse_advisor(name)(Workbench(mdp, discount, rng, people or {}, region, episodes, values))
    if advisor is None or region is None or isinstance(advisor, TableAdvisor):
        return advisor
    return LimitedView(advisor, region)
