"""Sessions of a method on a cell, then a proof: whenever that is stopped, it returns an order and a bound."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from lab.interrupts import uninterrupted
from lab.learning.settings import GateSettings
from lab.production.order import SECOND_OPINION_S, reference_of, unit_of
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE
from lab.sequencing.cell.objectives import BUILT_IN
from lab.sequencing.methods.portfolio import known_of, look_first, look_on, tell_alone
from lab.sequencing.methods.rules import any_order
from lab.sequencing.methods.shared import NO_LIMITS, Limits, SearchOver, Shared
from lab.sequencing.search import SAME, EpisodeSequenced, Reference, Search, SequenceResult, not_in_time
from lab.teaching.events import SequenceFound, SequencingBegan, SequencingStands, Tell

CTRL_C, FIRST_COME = "Ctrl-C", "first come, first served"


class MethodSession(Protocol):
    """A session of a method."""

    def __call__(self, search: Search, *, session: int) -> SequenceResult:
        """The result of the session with that number, counted from 0."""


@dataclass(frozen=True)
class SearchResults:
    """The results of a search. sessions: at least one; method: what found them; known: what no order can beat.

    stopped_by: "Ctrl-C", "seconds" or "gap", where the search was cut short; None where it came to its end.
    """

    sessions: list[SequenceResult]
    method: str
    known: Reference
    stopped_by: str | None


@dataclass
class _Heard:
    """What a session has found and told so far. whole: its result, once the session has ended."""

    method: str
    search: Search
    shared: Shared
    tell: Tell
    best: EpisodeSequenced | None = None
    costs: list[float] = field(default_factory=list)
    whole: SequenceResult | None = None

    def __call__(self, event: EpisodeSequenced) -> None:
        self.costs.append(event.cost)
        if event.best and (self.best is None or event.best != self.best.best):
            self.shared.tell(self.method, event.best)
        self.best = event if event.best else self.best
        self.tell(event)
        self.shared.look()

    def result(self) -> SequenceResult | None:
        """The result of the session so far; None where it has found no order yet."""
        if self.whole is not None or (self.best is None and not self.shared.sequence):
            return self.whole
        if self.best is not None and self.search.chance != NO_CHANCE:  # each episode has times of its own
            return SequenceResult(self.best.best, self.best.best_cost, tuple(self.costs))
        # Of episodes that are tried many at once, the best one may not have been told of yet.
        cost = next((one for one in self.costs if abs(one - self.shared.cost) <= SAME), self.shared.cost)
        return SequenceResult(
            self.shared.sequence, cost, tuple(self.costs if cost in self.costs else [*self.costs, cost])
        )


@dataclass(frozen=True)
class SearchPlan:
    """The plan of a search: the method's name, its search, and how many sessions it has.

    limits: a session ends when its order is within their gap, the whole search at their moment; gate: that of a session with
    advice, for the page.
    """

    method: str
    search: Search
    sessions: int = 1
    limits: Limits = NO_LIMITS
    gate: GateSettings | None = None


def looked_for(cell: Cell, plan: SearchPlan, find: MethodSession, tell: Tell) -> SearchResults:
    """What the sessions find, and what is proven of the best order, unless the method's answer needs no proof beside it.

    find: carries out a session. A bound is known within a second, for small cells the optimum; with limits a proof is looked for
    whatever the method. Raises KeyboardInterrupt and WorkFailed only where there is no order at all, and as `find` does.
    """
    method, search, limits = plan.method, plan.search, plan.limits
    best = Shared(cell, search.objective, limits, lambda shared: tell(_stands(shared)))
    heard, stopped_by = list[_Heard](), ""
    try:
        if search.objective in BUILT_IN:
            look_first(best)
        for number in range(plan.sessions):
            shown = _known(best) if search.chance == NO_CHANCE else None
            one = _Heard(method, search, Shared(cell, search.objective, limits, parent=best), tell)
            heard.append(one)
            tell(SequencingBegan(search.episodes, shown, plan.gate, method))
            try:
                one.whole = find(replace(search, on_episode=one, shared=one.shared), session=number)
                best.tell(method, one.whole.sequence)
            except SearchOver as over:
                if over.by == "seconds":
                    raise
                stopped_by = over.by
            if result := one.result():
                shown = None if shown is None else _known(best)
                tell(SequenceFound(result, shown, cell.parts, method))
                if shown is not None and not best.cost < result.cost - SAME:
                    best.told()
        asked = limits != NO_LIMITS or not SEQUENCERS[method].alone
        if asked and search.objective in BUILT_IN and not best.over.is_set():
            look_on(best, best.left_s(SECOND_OPINION_S))
    except SearchOver as over:
        stopped_by = over.by
    except KeyboardInterrupt:
        stopped_by = CTRL_C
    return _found(heard, best, method, stopped_by)


@uninterrupted
def _found(heard: Sequence[_Heard], best: Shared, method: str, stopped_by: str) -> SearchResults:
    """The results of the sessions; where none has found an order, the best one that is known from elsewhere."""
    found = [result for one in heard if (result := one.result())]
    if not best.sequence:
        best.tell(FIRST_COME, any_order(best.cell))
    if not best.bound and best.objective in BUILT_IN:  # it was stopped before anything was proven
        tell_alone(best)
    best.report()
    if not (found or best.sequence):
        if stopped_by == CTRL_C:
            raise KeyboardInterrupt("stopped by Ctrl-C before an order was found")
        raise not_in_time(best.cell, method, best.bound)
    if not found:
        found, method = [SequenceResult(best.sequence, best.cost, (best.cost,))], best.found_by
    return SearchResults(found, method, _known(best), stopped_by or None)


def _known(best: Shared) -> Reference:
    return reference_of(best.cell, best.objective, known_of(best))


def _stands(shared: Shared) -> SequencingStands:
    known = Reference(shared.bound, shared.proven, shared.bound_by, unit_of(shared.objective))
    return SequencingStands(shared.cost, shared.found_by, known)
