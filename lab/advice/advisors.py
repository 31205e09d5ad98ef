"""Who advises: simulated advisors of any skill, a person at a terminal, recorded advice, or nobody."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Protocol

import numpy as np

from lab.errors import BadInput, unknown
from lab.learning.selection import Draw, uniforms
from lab.learning.updates import Table
from lab.mdp import BoolArray, FloatArray, TabularMDP, optimal_values


@dataclass(frozen=True, slots=True)
class AdviceRequest:
    """What a learner shows when it asks: where it is, what it thinks, how it has been doing, and why it asks.

    q: its live action values, q[state][action], not to be changed; step counts from 1; learner_action: what it
    would do itself; the means are step counts over the last K episodes and the K before, None (like the rate)
    before there are 2K; why: the gate's reason in words.
    """

    mdp: TabularMDP
    q: Table
    state: int
    episode: int
    step: int
    learner_action: int
    improvement_rate: float | None
    current_mean: float | None
    previous_mean: float | None
    why: str = ""


class AdvisorLeft(Exception):
    """The advisor ends its advice for the session."""


Ask = Callable[[AdviceRequest], int | None]


class Advisor(Protocol):
    """Whoever can be asked."""

    def advise(self, request: AdviceRequest) -> int | None:
        """The action to take; None leaves this step to the learner. Raises AdvisorLeft to end advice for good."""


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


class Recording:
    """An advisor whose advice is written to a file as it is given: a JSON line with signature, state and action.

    Raises BadInput when the file cannot be written.
    """

    def __init__(self, advisor: Advisor, path: Path):
        self._advisor, self._path = advisor, path
        try:
            first = path.read_bytes().splitlines()[:1] if path.exists() else []
        except OSError as error:
            raise BadInput(f"record '{path}' (--record): cannot be read: {error.strerror or error}") from error
        if first and not first[0].startswith(b'{"signature"'):
            raise BadInput(f"record '{path}' (--record): the file holds something else than advice: choose another one")

    def advise(self, request: AdviceRequest) -> int | None:
        """The advisor's answer, written down when there is one."""
        action = self._advisor.advise(request)
        if action is not None:
            line = {"signature": request.mdp.signature, "state": request.state, "action": action}
            try:
                with self._path.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(line) + "\n")
            except OSError as error:
                raise BadInput(f"record '{self._path}' (--record): {error.strerror or error}") from error
        return action


def read_record(path: Path, mdp: TabularMDP) -> dict[int, int]:
    """What was said by state, the last word counting; advice about other problems is passed over.

    Raises BadInput, with the line, for what is no record, and when nothing in it is about this problem.
    """
    said, others = dict[int, int](), 0
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"advisor 'recorded:{path}': cannot be read: {error}") from None
    for number, line in enumerate(lines, start=1):
        try:
            entry = json.loads(line)
            signature, state, action = entry["signature"], entry["state"], entry["action"]
        except (ValueError, KeyError, TypeError, RecursionError):
            if number == len(lines):
                break  # cut off while it was written
            raise BadInput(f"advisor 'recorded:{path}': line {number} is no record of advice: {line[:60]!r}") from None
        if signature != mdp.signature:
            others += 1
        elif type(state) is int and type(action) is int and 0 <= state < mdp.n_states and 0 <= action < mdp.n_actions:
            said[state] = action
        else:
            raise BadInput(f"advisor 'recorded:{path}': line {number}: state {state!r}, action {action!r} do not exist")
    if not said:
        raise BadInput(
            f"advisor 'recorded:{path}': it holds no advice about this problem ({mdp.signature[:8]})"
            + (f", {others} lines are about other ones" if others else "")
        )
    return said


class TerminalAdvisor:
    """A person, asked through a prompt that a view brings (see lab/view/terminal.py)."""

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
    """What an advisor is made from: the problem, the learner's discount and episodes, what the advisor sees."""

    mdp: TabularMDP
    discount: float
    rng: np.random.Generator
    ask: Ask | None = None
    region: BoolArray | None = None
    episodes: int = 1

    def from_table(self, tau: float | Sequence[float], sign: float = 1.0) -> Advisor:
        """A simulated advisor that knows the exact optimal values, or (sign -1) takes the worst for the best."""
        values = sign * optimal_values(self.mdp, self.discount)
        return TableAdvisor(Advice.of(skill(values, tau), self.region), uniforms(self.rng))


def _skilled(bench: Workbench, tau: float) -> Advisor:
    return bench.from_table(tau)


def _wrong(bench: Workbench) -> Advisor:
    return bench.from_table(0.01, sign=-1.0)


def _changing(bench: Workbench, first: float, last: float) -> Advisor:
    return bench.from_table(np.geomspace(first, last, bench.episodes).tolist())


def _terminal(bench: Workbench) -> Advisor:
    if bench.ask is None:
        raise BadInput("advisor 'terminal': this command has no prompt to ask a person through")
    return TerminalAdvisor(bench.ask)


def _nobody(bench: Workbench) -> None:
    return None


SKILLS = {"expert": 0.01, "moderate": 0.1, "limited": 0.3, "novice": 1.0}

ADVISORS: dict[str, Callable[[Workbench], Advisor | None]] = {
    **{name: partial(_skilled, tau=tau) for name, tau in SKILLS.items()},
    "wrong": _wrong,
    "terminal": _terminal,
    "none": _nobody,
}
FORMS = ("tau=X", "tau=X..Y", "recorded:FILE")  # names with something of the user's in them


def parse_advisor(name: str, where: str = "advisor") -> Callable[[Workbench], Advisor | None]:
    """How to make the advisor of that name: one in ADVISORS, "tau=X", "tau=X..Y" or "recorded:FILE".

    "tau=1..0.01" learns over the session from a novice to an expert. Raises BadInput for any other name.
    """
    if name in ADVISORS:
        return ADVISORS[name]
    if name.startswith("recorded:"):
        path = Path(name.removeprefix("recorded:"))
        if not path.name:
            raise BadInput(f"advisor '{name}' ({where}): it names no file: wanted recorded:FILE")
        return lambda bench: RecordedAdvisor(read_record(path, bench.mdp))
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
    ask: Ask | None = None,
    *,
    region: BoolArray | None = None,
    episodes: int = 1,
) -> Advisor | None:
    """The advisor of that name for a problem, None for "none".

    Simulated advisors know the problem's exact optimal values for `discount`; given a `region` (S,), nobody speaks
    outside it; `episodes` is the session's length; `ask` is the prompt behind "terminal".
    Raises BadInput for an unknown name, for "terminal" without `ask`, and for a record that does not fit.
    """
    advisor = parse_advisor(name)(Workbench(mdp, discount, rng, ask, region, episodes))
    if advisor is None or region is None or isinstance(advisor, TableAdvisor):
        return advisor
    return LimitedView(advisor, region)
