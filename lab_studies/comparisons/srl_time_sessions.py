"""The sessions of one method with one instance of the comparison: their gaps to the proven optimum, and their seconds."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.exact import Optimum, optimum
from lab.sequencing.methods.rules import usable
from lab.sequencing.methods.srl_time import srl_time
from lab.sequencing.methods.state_keys import keys_of
from lab.sequencing.search import LearnedSequence, Search, SequenceResult, SrlSettings
from lab.studies.runner import seeds_of
from lab_studies.many_sessions import METHODS, run_sessions
from lab_studies.thesis.appendix_3_makespans import fms, settings
from lab_studies.thesis.chapter_7_cells import beta_of, robot_cell

Floats = NDArray[np.float64]

FEW_TOASTS = 4  # the most toasts with which success is counted; with more, and in the FMS, gaps are measured
COMPILED, READABLE = "compiled", "readable"
UNBOUNDED = "srl-time without the bound"
CAPS = {  # the most sessions, by size of the instance and method, as more would take too long
    "few": {"srl-time": 100, UNBOUNDED: 100},
    "many": {"srl-time": 10, UNBOUNDED: 10, COMPILED: 50, READABLE: 2},
    "order": {"srl-time": 10, UNBOUNDED: 10, COMPILED: 200},
}
LEARNING = ("srl", "mc", "random", "srl-time", UNBOUNDED, "ga")


@dataclass(frozen=True)
class Instance:
    """What is sequenced: toasts in a case of ch. 7, or an order of the FMS with its interval of arrivals [s]."""

    case: str | None = None
    toasts: int | None = None
    order: str | None = None
    interval_s: float | None = None

    @property
    def cell(self) -> Cell:
        """The cell with its mean times."""
        if self.order is not None:
            return fms(self.order, self.interval_s or 0.0)
        return robot_cell(self.case or "", self.toasts or 0)

    @property
    def size(self) -> str:
        """The key of the instance's size in CAPS."""
        return "order" if self.order is not None else "few" if (self.toasts or 0) <= FEW_TOASTS else "many"


@dataclass(frozen=True)
class MethodSetting:
    """A method with an instance; episodes None: it has one sequence, without random choices."""

    work: Instance
    method: str
    episodes: int | None = None
    reward_factor: str | None = None


@dataclass(frozen=True, eq=False)
class MethodOutcome:
    """The results of N sessions, (N,) each: gaps to the proven optimum, as fractions, and seconds.

    gap: of the best sequence of a session; final_gap: of its final greedy policy, NaN without one. wall_s: the seconds of a
    session; for compiled ones, which run together, their mean.
    """

    gap: Floats
    final_gap: Floats
    wall_s: Floats


def single_sequence_methods(work: Instance) -> tuple[str, ...]:
    """The methods with one sequence for an instance: constructive ones, and those that prove the optimum within seconds."""
    proving = ("exact", "cp-sat") if work.size == "few" else ("exact",)
    return ("fifo", *usable(work.cell), *proving)


def method_outcome(setting: MethodSetting, *, sessions: int, seed: int) -> MethodOutcome:
    """The outcome of `sessions` sessions of a setting, or of as many as its cap allows."""
    count, search = sessions_for(setting, sessions), _search(setting)
    seeds = seeds_of(setting, count, seed)
    best = _optimum(setting.work)
    if setting.method in METHODS:
        cell = setting.work.cell
        run_sessions(
            cell, setting.method, Search(1, settings=search.settings), 1, 0
        )  # compiles what is not compiled yet
        began = time.perf_counter()
        sessions_done = run_sessions(cell, setting.method, search, count, int(seeds[0]))
        wall_s = (time.perf_counter() - began) / count
        return _outcome(best, sessions_done.best_cost, sessions_done.final_cost, np.full(count, wall_s))
    runs = [_timed_session(setting, search, int(own)) for own in seeds]
    costs = np.array([result.cost for result, _ in runs])
    finals = np.array([result.final_cost if isinstance(result, LearnedSequence) else np.nan for result, _ in runs])
    return _outcome(best, costs, finals, np.array([wall_s for _, wall_s in runs]))


def sessions_for(setting: MethodSetting, sessions: int) -> int:
    """The number of sessions that are run when `sessions` are asked for."""
    if setting.method not in LEARNING:
        return 1
    caps, kind = CAPS[setting.work.size], setting.method
    if kind in METHODS:
        kind = COMPILED if _is_compiled(setting) else READABLE
    return min(sessions, caps.get(kind, sessions))


def _is_compiled(setting: MethodSetting) -> bool:
    given = _settings(setting)
    return setting.method == "random" or keys_of(setting.work.cell, given.values, given.state) is not None


def _timed_session(setting: MethodSetting, search: Search, seed: int) -> tuple[SequenceResult, float]:
    unbounded: Callable[..., SequenceResult] = partial(srl_time, bounded=False)
    method = unbounded if setting.method == UNBOUNDED else SEQUENCERS[setting.method]
    cell, rng = setting.work.cell, np.random.default_rng(seed)
    method(cell, Search(1), rng)  # imports and prepares what the method needs
    began = time.perf_counter()
    return method(cell, search, rng), time.perf_counter() - began


def _outcome(best: Optimum, costs: Floats, finals: Floats, wall_s: Floats) -> MethodOutcome:
    return MethodOutcome(costs / best.bound_s - 1.0, finals / best.bound_s - 1.0, wall_s)


def _search(setting: MethodSetting) -> Search:
    return Search(setting.episodes or 1, settings=_settings(setting))


def _settings(setting: MethodSetting) -> SrlSettings:
    """The settings of fig. 5.1 with the parameters of section 7.6 for toasts, with those of App. III for the FMS."""
    work = setting.work
    factor: Literal["A", "B"] = "A" if setting.reward_factor == "A" else "B"
    if work.order is not None:
        return replace(settings(len(work.order)), factor=factor)
    return SrlSettings(beta=beta_of(work.toasts or 0), factor=factor)


@lru_cache(maxsize=64)
def _optimum(work: Instance) -> Optimum:
    """The proven optimum, or a bound if it cannot be proven."""
    return optimum(work.cell)
