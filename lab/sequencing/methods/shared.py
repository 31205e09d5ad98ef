"""What is known while methods look, alone or side by side: the best order, the best bound, and whether to go on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from threading import Event, Lock, get_ident
from time import perf_counter
from typing import Literal, NamedTuple, Optional

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import cost
from lab.sequencing.search import SAME, Search, gap
from lab.sequencing.simulate.follow import follow

REPORT_S = 1.0  # between two reports to the listener at least
LEAST_S = 0.01


class SearchOver(Exception):
    """A limit ends a search; `by` which one. What it found until then is in its `Shared`."""

    def __init__(self, by: Literal["seconds", "gap"]) -> None:
        super().__init__(by)
        self.by = by


@dataclass(frozen=True)
class Limits:
    """When a search ends early: at a moment of the clock `perf_counter`, or within a gap of the bound (see `search.gap`)."""

    until_s: float = inf
    gap: float | None = None

    @classmethod
    def of(cls, seconds: float | None, gap: float | None) -> "Limits":
        """So many seconds from now on, and a gap as a fraction; None: no such limit. BadInput for what is none."""
        if seconds is not None and not 0 < seconds < inf:
            raise BadInput(f"seconds = {seconds} (--seconds): allowed are finite times above 0")
        if gap is not None and not 0 <= gap < inf:
            raise BadInput(f"gap = {gap} (--gap): allowed are fractions from 0, such as 0.05")
        return cls(inf if seconds is None else perf_counter() + seconds, gap)


NO_LIMITS = Limits()


class _Best(NamedTuple):
    sequence: tuple[int, ...] = ()
    cost: float = inf
    by: str = ""


class _Bound(NamedTuple):
    value: float = 0.0
    by: str = "nothing"


class Shared:
    """The best order and the best bound that any method found, and whose they are; told and asked from any thread.

    sequence: empty, and its cost infinite, where there is none yet. over: nobody has to go on, since it is proven, a limit is
    reached, or it was stopped. Whoever is interrupted leaves it whole: Ctrl-C loses nothing that was told.
    limits: see `look`. hear: is told of news, by `look`. parent: is told what is told here, and its listener hears of it; its
    bound holds here.
    """

    def __init__(
        self,
        cell: Cell,
        objective: str,
        limits: Limits = NO_LIMITS,
        hear: Callable[["Shared"], None] | None = None,
        parent: Optional["Shared"] = None,
    ) -> None:
        self.cell, self.objective, self.limits = cell, objective, limits
        self._best = _Best()
        self._bound: _Bound = _Bound() if parent is None else parent._bound
        self.over = Event()
        self._lock, self._owner = Lock(), get_ident()
        self._hear, self._parent = hear, parent
        self._heard: tuple[_Best, _Bound] = self._best, self._bound
        self._heard_s = perf_counter()

    @property
    def sequence(self) -> tuple[int, ...]:
        """The best order."""
        return self._best.sequence

    @property
    def cost(self) -> float:
        """What the best order costs."""
        return self._best.cost

    @property
    def found_by(self) -> str:
        """Who found the best order."""
        return self._best.by

    @property
    def bound(self) -> float:
        """What no order costs less than."""
        return self._bound.value

    @property
    def bound_by(self) -> str:
        """Who proved the bound."""
        return self._bound.by

    @property
    def proven(self) -> bool:
        """Whether no order costs less."""
        return self.cost <= self.bound + SAME

    @property
    def near(self) -> bool:
        """Whether the best order is within the gap that was asked for."""
        return self.limits.gap is not None and self.cost < inf and gap(self.cost, self.bound) <= self.limits.gap

    def beats(self, known: float, by: str) -> bool:
        """Whether somebody else than `by` has an order that costs less."""
        best = self._best
        return best.by != by and best.cost < known - SAME

    def tell(self, by: str, sequence: Sequence[int] = (), bound: float = 0.0) -> None:
        """A complete order, which is carried out here, and a cost that none is below; either is kept if it is better."""
        if self._parent is not None:
            self._parent.tell(by, sequence, bound)
        value = cost(follow(self.cell, sequence), self.objective) if sequence else inf
        with self._lock:
            if value < self.cost - SAME:
                self._best = _Best(tuple(sequence), value, by)
            if bound > self.bound + SAME:
                self._bound = _Bound(bound, by)
            if self.proven or self.near:
                self.over.set()

    def left_s(self, usual_s: float) -> float:
        """How long a search may still take [s], above 0: to the limit, or `usual_s` where there is none."""
        return usual_s if self.limits.until_s == inf else max(LEAST_S, self.limits.until_s - perf_counter())

    def look(self) -> None:
        """Tell the listener what is new, and end the search at a limit: raises SearchOver. Every method calls it, often.

        Only in the thread that made this; in any other it does nothing, and `over` says when to end.
        """
        if get_ident() != self._owner:
            return
        (self if self._parent is None else self._parent).report(REPORT_S)
        if self.near or perf_counter() >= self.limits.until_s:
            self.over.set()
            raise SearchOver("gap" if self.near else "seconds")

    def told(self) -> None:
        """What is known now has been told in another way: it is no news for the listener."""
        self._heard = self._best, self._bound

    def report(self, least_s: float = 0.0) -> None:
        """Tell the listener what is new, unless it was told of something within the last seconds."""
        now_s, news = perf_counter(), (self._best, self._bound)
        if self._hear is not None and now_s >= self._heard_s + least_s and self._heard != news:
            self._heard, self._heard_s = news, now_s
            self._hear(self)


def shared_of(cell: Cell, search: Search) -> Shared:
    """What a search shares with whoever asked for it, or what is its own."""
    return search.shared if isinstance(search.shared, Shared) else Shared(cell, search.objective)
