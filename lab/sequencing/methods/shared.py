"""The state that methods share while they search, alone or side by side: incumbent, bound, limits, and whether to go on."""

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

REPORT_S = 1.0  # the least time between two reports to the listener
LEAST_S = 0.01


class SearchOver(Exception):
    """Ends a search at the limit `by`; its results so far are in its `Shared`."""

    def __init__(self, by: Literal["seconds", "gap"]) -> None:
        super().__init__(by)
        self.by = by


@dataclass(frozen=True)
class Limits:
    """The limits of a search: a deadline on the clock `perf_counter`, and a gap to the bound (see `search.gap`)."""

    until_s: float = inf
    gap: float | None = None

    @classmethod
    def of(cls, seconds: float | None, gap: float | None) -> "Limits":
        """The limits of `seconds` from now on and of a gap as a fraction; None: no limit. Raises BadInput for other values."""
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
    """The incumbent and the best bound of all methods, and which methods they are from; it may be used from any thread.

    sequence: empty, and its cost infinite, where there is none yet. over: every method is to stop, since the order is proven, a
    limit is reached, or the search was stopped. An interruption such as Ctrl-C loses nothing that was told.
    limits: see `look`. hear: called by `look` when something is new. parent: receives all that is told here and reports it to
    its own listener; its bound holds here too.
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
        """The decisions of the incumbent."""
        return self._best.sequence

    @property
    def cost(self) -> float:
        """The cost of the incumbent."""
        return self._best.cost

    @property
    def found_by(self) -> str:
        """The method that found the incumbent."""
        return self._best.by

    @property
    def bound(self) -> float:
        """The best lower bound of the cost."""
        return self._bound.value

    @property
    def bound_by(self) -> str:
        """The method that proved the bound."""
        return self._bound.by

    @property
    def proven(self) -> bool:
        """Whether the incumbent's cost equals the bound."""
        return self.cost <= self.bound + SAME

    @property
    def near(self) -> bool:
        """Whether the incumbent is within the gap of the limits."""
        return self.limits.gap is not None and self.cost < inf and gap(self.cost, self.bound) <= self.limits.gap

    def beats(self, known: float, by: str) -> bool:
        """Whether a method other than `by` has an order of lower cost than `known`."""
        best = self._best
        return best.by != by and best.cost < known - SAME

    def tell(self, by: str, sequence: Sequence[int] = (), bound: float = 0.0) -> None:
        """Reports an order, which is simulated here, and a lower bound; each is kept if it improves the one known."""
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
        """The time that a search may still take [s], above 0: up to the deadline, or `usual_s` where there is none."""
        return usual_s if self.limits.until_s == inf else max(LEAST_S, self.limits.until_s - perf_counter())

    def look(self) -> None:
        """Tells the listener what is new, and raises SearchOver at a limit. Every method calls it often.

        It acts only in the thread that made this object; in any other it does nothing, and `over` says when to end.
        """
        if get_ident() != self._owner:
            return
        (self if self._parent is None else self._parent).report(REPORT_S)
        if self.near or perf_counter() >= self.limits.until_s:
            self.over.set()
            raise SearchOver("gap" if self.near else "seconds")

    def told(self) -> None:
        """Marks the present state as known to the listener, who was told of it in another way."""
        self._heard = self._best, self._bound

    def report(self, least_s: float = 0.0) -> None:
        """Tells the listener what is new, unless the last report is less than `least_s` seconds old."""
        now_s, news = perf_counter(), (self._best, self._bound)
        if self._hear is not None and now_s >= self._heard_s + least_s and self._heard != news:
            self._heard, self._heard_s = news, now_s
            self._hear(self)


def shared_of(cell: Cell, search: Search) -> Shared:
    """The shared state that a search was given, or a new one."""
    return search.shared if isinstance(search.shared, Shared) else Shared(cell, search.objective)
