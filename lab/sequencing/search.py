"""What a sequencer is asked for, and what it returns: the same for all of them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Literal, Protocol

from lab.errors import BadInput, WorkFailed, counted, unknown
from lab.learning.requests import Request
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.cell.objectives import MAKESPAN, check_objective
from lab.sequencing.simulate.run import Run

if TYPE_CHECKING:
    from lab.sequencing.methods.carried_over_policy import CarriedPolicy


@dataclass(frozen=True, slots=True, kw_only=True)
class SequenceRequest(Request):
    """A request for advice on which part to move next; the means of its improvement are costs.

    run: the present state of the work. made: the decisions of the episode so far.
    """

    run: Run
    made: tuple[int, ...] = ()


def state_of(run: Run) -> int:
    """A number, without a limit of size, for the positions of robot and parts, whatever the time."""
    number = run.robot
    for location in run.locations:
        number = number * len(run.cell.positions) + location
    return number


# ---- The search, its settings and its result --------------------------------------------------------------------------


FACTORS = ("A", "B")
VALUES = ("pairs", "states")
STATES = ("parts", "stations")
SAME = 1e-6  # costs nearer than this are equal


@dataclass(frozen=True)
class EpisodeSequenced:
    """One sequence tried: its number from 1, its cost (see `SequenceResult`), and the best sequence so far; empty: none."""

    episode: int
    cost: float
    best_cost: float
    best: tuple[int, ...] = ()


@dataclass(frozen=True)
class SequenceResult:
    """The result of every sequencer: the best sequence found, its cost, and the cost of each sequence tried.

    The cost is the value of the objective, by default the makespan [s].
    """

    sequence: tuple[int, ...]
    cost: float
    episode_costs: tuple[float, ...]


@dataclass(frozen=True)
class LearnedSequence(SequenceResult):
    """The result of a learning sequencer, with the cost of its final greedy policy."""

    final_cost: float


OnEpisode = Callable[[EpisodeSequenced], None]


@dataclass(frozen=True)
class SrlSettings:
    """The parameters of SRL and of Monte Carlo: alpha, discount, beta (epsilon = n ** -beta), the reward factor's type.

    values: "pairs", Q(s,a) as in fig. 5.1; "states", a value per next state as in the listings. state: "parts", where each part
    is, or "stations", what stands at each station (thesis App. III). Raises BadInput for a value out of range.
    """

    alpha: float = 0.05
    discount: float = 0.9
    beta: float = 1.0
    factor: Literal["A", "B"] = "B"
    values: Literal["pairs", "states"] = "pairs"
    state: Literal["parts", "stations"] = "parts"

    def __post_init__(self) -> None:
        for name, known in (("factor", FACTORS), ("values", VALUES), ("state", STATES)):
            if getattr(self, name) not in known:
                raise unknown("reward factor" if name == "factor" else name, getattr(self, name), known, "SRL")
        for name in ("alpha", "discount"):
            if not 0 <= getattr(self, name) <= 1:
                raise BadInput(f"{name} = {getattr(self, name)}: allowed are 0 to 1")
        if not 0 <= self.beta < inf:
            raise BadInput(f"beta = {self.beta}: allowed are finite numbers from 0")


class WatchedSearch(Protocol):
    """The limits that a search checks while it runs; implemented by `methods.shared.Shared`."""

    def look(self) -> None:
        """Raises an error at a limit; every method calls it often."""


@dataclass(frozen=True)
class Search:
    """The request to a sequencer: episodes, objective, chance, settings, and the listener. Raises BadInput for episodes below 1.

    chance: the distributions of processing times and arrivals while it learns. settings: those of SRL and Monte Carlo; other
    methods have none. policy: of the method `carried` (None: the policy that ships), or the one that `srl-linear` begins with.
    practice: further cells in which `srl-linear` learns. shared: where a method without episodes reports incumbents and bounds
    and checks whether to go on.
    """

    episodes: int = 400
    objective: str = MAKESPAN
    chance: Chance = NO_CHANCE
    settings: SrlSettings = field(default_factory=SrlSettings)
    on_episode: OnEpisode | None = None
    policy: "CarriedPolicy | None" = None
    practice: tuple[Cell, ...] = ()
    shared: WatchedSearch | None = None

    def __post_init__(self) -> None:
        if self.episodes < 1:
            raise BadInput(f"episodes = {self.episodes}: allowed are whole numbers from 1")

    def check(self, cell: Cell) -> None:
        """Raises BadInput when the cell lacks the data that the objective needs."""
        check_objective(self.objective, cell)

    def look(self) -> None:
        """Ends the search at a limit (see `WatchedSearch.look`)."""
        if self.shared is not None:
            self.shared.look()


def gap(cost: float, bound: float) -> float:
    """The gap of a cost to a lower bound, as a fraction of the bound; inf where the bound is 0 and the cost is not.

    It is 0 for a cost that is below the bound or less than SAME above it, which is due to rounding.
    """
    if bound <= SAME:
        return 0.0 if cost <= bound + SAME else inf
    share = cost / bound - 1.0
    return share if share >= SAME else 0.0


@dataclass(frozen=True)
class Reference:
    """A lower bound of every sequence's cost, in the objective's unit; proven: whether some sequence reaches it.

    sequence: the best one found, without needless stopovers, with the method that found it; empty: none.
    """

    bound: float
    proven: bool
    method: str
    unit: str = " s"
    sequence: tuple[int, ...] = ()
    found_by: str = ""

    def gap(self, cost: float) -> float | None:
        """`gap` to the bound; None where the bound is 0 and the cost is not."""
        share = gap(cost, self.bound)
        return None if share == inf else share


@dataclass
class Log:
    """The costs of the sequences tried so far, and the best one; `note` adds one and tells the search's listener."""

    search: Search
    costs: list[float] = field(default_factory=list)
    best: tuple[int, ...] = ()
    best_cost: float = inf

    def note(self, sequence: tuple[int, ...], cost: float, complete: bool) -> None:
        """Adds one episode; an incomplete one ended in a deadlock and is never the best."""
        self.costs.append(cost)
        if complete and cost < self.best_cost:
            self.best, self.best_cost = sequence, cost
        if self.search.on_episode is not None:
            self.search.on_episode(EpisodeSequenced(len(self.costs), cost, self.best_cost, self.best))

    def found(self, cell: Cell) -> tuple[tuple[int, ...], float, tuple[float, ...]]:
        """The fields of a `SequenceResult`; raises WorkFailed when every sequence ended in a deadlock."""
        if not self.best:
            why = "deadlocks" + (", or parts that would be picked too late" if cell.has_windows else "")
            raise WorkFailed(
                f"no sequence for {cell.parts} parts came to its end in {counted(len(self.costs), 'episode')}: {why}"
            )
        return self.best, self.best_cost, tuple(self.costs)


def not_in_time(cell: Cell, who: str, bound: float) -> WorkFailed:
    """The error of a search that was cut off before it found any sequence; one may exist."""
    least = f"; none costs less than {bound:.1f}" if 0.0 < bound < inf else ""
    return WorkFailed(
        f"no sequence for {counted(cell.parts, 'part')} was found in time by {who}, which does not show that there is none"
        f"{least}: try another method (--method)"
    )


def only_one(
    cell: Cell, search: Search, sequence: tuple[int, ...], cost: float, complete: bool = True
) -> SequenceResult:
    """The result of a method that makes a single sequence; raises WorkFailed when that ends in a deadlock."""
    log = Log(search)
    log.note(sequence, cost, complete)
    return SequenceResult(*log.found(cell))
