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
    """A request about which part to move next; the means of its improvement are costs. run: where the work stands; made: the
    decisions of the episode until now.
    """

    run: Run
    made: tuple[int, ...] = ()


def state_of(run: Run) -> int:
    """A number for where robot and parts are, whatever the time; as long as it takes."""
    number = run.robot
    for location in run.locations:
        number = number * len(run.cell.positions) + location
    return number


# ---- search -----------------------------------------------------------------------------------------------------------


FACTORS = ("A", "B")
VALUES = ("pairs", "states")
STATES = ("parts", "stations")
SAME = 1e-6  # costs nearer than this are equal


@dataclass(frozen=True)
class EpisodeSequenced:
    """One sequence tried: number from 1, its cost (see `SequenceResult`) and the best one so far, empty: there is none."""

    episode: int
    cost: float
    best_cost: float
    best: tuple[int, ...] = ()


@dataclass(frozen=True)
class SequenceResult:
    """What every sequencer returns: the best sequence found, its cost, and the cost of each sequence tried.

    The cost is the value of the objective asked for: the makespan [s] unless it was another one.
    """

    sequence: tuple[int, ...]
    cost: float
    episode_costs: tuple[float, ...]


@dataclass(frozen=True)
class LearnedSequence(SequenceResult):
    """What a learning sequencer returns beside: the cost of its greedy policy at the end."""

    final_cost: float


OnEpisode = Callable[[EpisodeSequenced], None]


@dataclass(frozen=True)
class SrlSettings:
    """The parameters of SRL and of Monte Carlo: alpha, discount, beta (epsilon = n ** -beta), the reward factor's type.

    values: "pairs", Q(s,a) as fig. 5.1; "states", a value per next state, as the listings have it. state: "parts", where
    each part is, or "stations", what stands at each station (thesis App. III). Raises BadInput for what is out of range.
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


class Watched(Protocol):
    """What is known while a search runs, and whether it goes on: a `methods.shared.Shared`."""

    def look(self) -> None:
        """Ends the search at a limit, by an error; every method calls it, often."""


@dataclass(frozen=True)
class Search:
    """How long to look, for what, in which environment, and whom to tell. BadInput for fewer than 1 episode.

    chance: what the processing times and arrivals are drawn from while it learns. settings: those of SRL and Monte
    Carlo; the others have none. policy: of the method `carried`; None: the one that ships. shared: where a method that has no
    episodes tells what it finds and proves, and looks whether to go on.
    """

    episodes: int = 400
    objective: str = MAKESPAN
    chance: Chance = NO_CHANCE
    settings: SrlSettings = field(default_factory=SrlSettings)
    on_episode: OnEpisode | None = None
    policy: "CarriedPolicy | None" = None
    shared: Watched | None = None

    def __post_init__(self) -> None:
        if self.episodes < 1:
            raise BadInput(f"episodes = {self.episodes}: allowed are whole numbers from 1")

    def check(self, cell: Cell) -> None:
        """BadInput when the cell does not have what the objective needs."""
        check_objective(self.objective, cell)

    def look(self) -> None:
        """Ends the search at a limit (see `Watched.look`)."""
        if self.shared is not None:
            self.shared.look()


def gap(cost: float, bound: float) -> float:
    """How much more a cost is than what no cost is below, as a fraction; inf where the bound is 0 and the cost is not.

    What lies below the bound, or less than SAME above it, is due to rounding, and is 0.
    """
    if bound <= SAME:
        return 0.0 if cost <= bound + SAME else inf
    share = cost / bound - 1.0
    return share if share >= SAME else 0.0


@dataclass(frozen=True)
class Reference:
    """What no sequence can beat: `bound`, in the objective's unit; `proven`: some sequence reaches it.

    sequence: the best one that was found, without pointless hops, and by which method; empty: none.
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
    """The sequences tried so far: the cost of each, and the best one. `note` keeps them and tells the search's listener."""

    search: Search
    costs: list[float] = field(default_factory=list)
    best: tuple[int, ...] = ()
    best_cost: float = inf

    def note(self, sequence: tuple[int, ...], cost: float, complete: bool) -> None:
        """One episode; what ended in a deadlock is not complete, and never the best."""
        self.costs.append(cost)
        if complete and cost < self.best_cost:
            self.best, self.best_cost = sequence, cost
        if self.search.on_episode is not None:
            self.search.on_episode(EpisodeSequenced(len(self.costs), cost, self.best_cost, self.best))

    def found(self, cell: Cell) -> tuple[tuple[int, ...], float, tuple[float, ...]]:
        """The fields of a `SequenceResult`; WorkFailed when no sequence came to its end."""
        if not self.best:
            why = "deadlocks" + (", or parts that would be picked too late" if cell.has_windows else "")
            raise WorkFailed(
                f"no sequence for {cell.parts} parts came to its end in {counted(len(self.costs), 'episode')}: {why}"
            )
        return self.best, self.best_cost, tuple(self.costs)


def not_in_time(cell: Cell, who: str, bound: float) -> WorkFailed:
    """The error of a search that was cut off before it had any sequence: there may be one."""
    least = f"; none costs less than {bound:.1f}" if 0.0 < bound < inf else ""
    return WorkFailed(
        f"no sequence for {counted(cell.parts, 'part')} was found in time by {who}, which does not show that there is none"
        f"{least}: try another method (--method)"
    )


def only_one(
    cell: Cell, search: Search, sequence: tuple[int, ...], cost: float, complete: bool = True
) -> SequenceResult:
    """The result of a method that has one sequence; WorkFailed when that is not complete, which is a deadlock."""
    log = Log(search)
    log.note(sequence, cost, complete)
    return SequenceResult(*log.found(cell))
