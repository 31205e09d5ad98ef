"""The portfolio: rules, annealing and the exact search that proves most, each beginning with the best order so far; and
`fewer_moves`, which leaves out stopovers."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from math import inf
from time import perf_counter

import numpy as np

from lab.errors import BadInput, WorkFailed
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, cost
from lab.sequencing.cell.routes import entry, part_of
from lab.sequencing.methods import deferred
from lab.sequencing.methods.exact import MAX_EXPANDED, optimum
from lab.sequencing.methods.one_robot import one_robot, why_not
from lab.sequencing.methods.rules import first_come, loads_s, work_left_s
from lab.sequencing.methods.shared import Shared, shared_of
from lab.sequencing.search import SAME, Search, SequenceResult, not_in_time, only_one
from lab.sequencing.simulate.cell_arrays import most_moves
from lab.sequencing.simulate.follow import follow, steps


def fewer_moves(cell: Cell, sequence: Sequence[int], objective: str = MAKESPAN) -> tuple[int, ...]:
    """The sequence without the stopovers that it does not need: they are left out one after the other, at no more cost.

    A stopover is a place where nothing is done with the part. The direct move is tried both at the time of the move to the
    stopover and at that of the move from it. It is a local search: of stopovers that exclude each other, the first is left out.
    """
    best, least = tuple(sequence), _cost(cell, sequence, objective)
    while True:
        shorter = next((one for one in _straight(cell, best) if _cost(cell, one, objective) <= least + SAME), None)
        if shorter is None:
            return best
        best, least = shorter, _cost(cell, shorter, objective)


def _straight(cell: Cell, sequence: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Each sequence with one stopover less."""
    came = dict[int, tuple[int, int]]()  # by part: where in the sequence it set out last, and from where
    for number, (run, decision, wait) in enumerate(steps(cell, sequence)):
        part = part_of(decision, cell.parts)
        here, option = run.locations[part - 1], run.option(decision)
        assert option is not None
        if part in came and not cell.positions[here].processing_s:
            before, place = came[part]
            for way in cell.positions[place].options:
                if way.to == option.to:
                    direct = entry(part, way.choice, cell.parts)
                    yield (*sequence[:before], direct, *sequence[before + 1 : number], *sequence[number + 1 :])
                    yield (*sequence[:before], *sequence[before + 1 : number], direct, *sequence[number + 1 :])
        came[part] = number, here
        run.move(decision, wait)


def _cost(cell: Cell, sequence: Sequence[int], objective: str) -> float:
    """The cost of a sequence; infinite when it is not feasible or not complete."""
    try:
        return cost(run, objective) if (run := follow(cell, sequence)).done else float("inf")
    except BadInput:
        return float("inf")


# ---- The best known order, and how it is searched ---------------------------------------------------------------------


MOVES, ROUND = 12_000_000, 3_000  # moves in all sequences of an annealing; sequences between two checks for Ctrl-C
EACH = 500  # how often annealing tries each neighbour of a list, on average: a short list takes far fewer moves
TIME_LIMIT_S = 60.0
WORKERS = 6  # threads of CP-SAT, even on two cores: each uses another strategy
ANNEALERS, ANNEALINGS = 2, 40  # annealing threads beside CP-SAT, with seeds of their own; the most restarts of each
FIRST_LOOK = 2_000  # states that A* may expand in `look_first`
SHORTEST_S, WAIT_S = 0.1, 0.05  # the least time left for CP-SAT; the time between two checks of the clock


@dataclass(frozen=True)
class BestKnown:
    """The best order found and the method that found it, and the best lower bound and the method that proved it.

    sequence: without needless stopovers; empty, and the cost infinite, where no order was found.
    """

    sequence: tuple[int, ...]
    cost: float
    found_by: str
    bound: float
    bound_by: str

    @property
    def proven(self) -> bool:
        """Whether no order costs less."""
        return self.cost <= self.bound + SAME


@lru_cache(maxsize=4)
def best_known(
    cell: Cell, objective: str = MAKESPAN, time_limit_s: float = TIME_LIMIT_S, seed: int = 0, workers: int = 1
) -> BestKnown:
    """The result of `look_on` for a cell of which nothing is known yet."""
    return look_on(Shared(cell, objective), time_limit_s, seed, workers)


def look_on(
    shared: Shared, time_limit_s: float = TIME_LIMIT_S, seed: int = 0, workers: int = 1, most: int = MAX_EXPANDED
) -> BestKnown:
    """The best order by the mean times with its bound; CP-SAT is used only where nothing faster proves the order.

    For a cell in which one robot does all the work, the shortest makespan is searched by states (`optimum`), at most `most` of
    them; for a job shop with one robot by its tours (`one_robot`). Otherwise annealing and CP-SAT search: with one worker one
    after the other, where the same seed gives the same order; with more side by side, each restarting from the incumbent, until
    it is proven. time_limit_s: of the search of tours, of CP-SAT, or of both together [s].
    Raises BadInput as they do, WorkFailed where no order can be completed or none was found, and the errors of `Shared.look`.
    """
    cell, objective = shared.cell, shared.objective
    if objective == MAKESPAN and cell.serial:
        best = optimum(cell, most, shared)
        shared.tell("A*", best.sequence, best.bound_s)
        return known_of(shared)
    tell_alone(shared)
    if objective == MAKESPAN and not why_not(cell):
        one_robot(cell, time_limit_s, shared)
    if not shared.over.is_set():
        _look(shared, time_limit_s, seed, workers)
    return known_of(shared)


def look_first(shared: Shared) -> None:
    """Tells `shared` what is known within a second: bounds and, of the makespan where one robot does all the work, an order,
    which is the optimum of a small cell."""
    if shared.objective == MAKESPAN and shared.cell.serial:
        with suppress(WorkFailed):  # a longer search reports it
            look_on(shared, most=FIRST_LOOK)
    else:
        tell_alone(shared)


def tell_alone(shared: Shared) -> None:
    """Tells `shared` the bounds that are known without any search."""
    shared.tell("each part alone", bound=_alone(shared.cell, shared.objective))
    if shared.objective == MAKESPAN:
        shared.tell("each machine alone", bound=_machines_alone(shared.cell))


def known_of(shared: Shared) -> BestKnown:
    """The best known order in `shared` without needless stopovers, and its bound."""
    sequence = fewer_moves(shared.cell, shared.sequence, shared.objective) if shared.sequence else ()
    value = cost(follow(shared.cell, sequence), shared.objective) if sequence else inf
    return BestKnown(sequence, value, shared.found_by, min(shared.bound, value), shared.bound_by)


def portfolio(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that any method finds within its time; it draws nothing from `rng`."""
    search.check(cell)
    shared = shared_of(cell, search)
    proof = look_on(shared, shared.left_s(TIME_LIMIT_S), workers=WORKERS)
    if not proof.sequence and proof.bound < inf:
        raise not_in_time(cell, "any method", proof.bound)
    return only_one(cell, search, proof.sequence, proof.cost, bool(proof.sequence))


def _look(shared: Shared, time_limit_s: float, seed: int, workers: int) -> None:
    """Runs annealing and CP-SAT, side by side or in turn; in turn CP-SAT goes first where one robot does all the work."""
    until_s = perf_counter() + time_limit_s
    if shared.cell.serial and workers == 1:
        shared.tell("first come, first served", first_come(shared.cell))
        _prove(shared, time_limit_s, seed, workers)
    _anneal(shared, seed, 0)
    if workers > 1:
        _side_by_side(shared, until_s, seed, workers)
    elif not shared.cell.serial:
        _prove(shared, time_limit_s, seed, workers)


def _machines_alone(cell: Cell) -> float:
    """The least time of the machine with the most work [s]; machines with batches are left out."""
    to_come, total = loads_s(cell, least=True), dict[int, float]()
    for part in cell.unfinished:
        for station, seconds in to_come[cell.begin_at[part - 1]].items():
            total[station] = total.get(station, 0.0) + seconds
    places = [cell.stations[number].servers or cell.capacities[number] for number in range(len(cell.stations))]
    return max(
        [seconds / places[number] for number, seconds in total.items() if number not in cell.batches], default=0.0
    )


def _alone(cell: Cell, objective: str) -> float:
    """A lower bound of the cost from parts that never wait for one another; 0 where that gives no bound."""
    if not all(way.waits for place in cell.positions for way in place.options):
        return 0.0
    left_s = work_left_s(cell)
    ends = {part: cell.begin_s[part - 1] + left_s[cell.begin_at[part - 1]] for part in cell.unfinished}
    late = [max(0.0, ends.get(part, 0.0) - due) for part, due in enumerate(cell.due_s or (), 1)]
    known = {MAKESPAN: max(ends.values(), default=0.0)}
    if late:
        known |= {"mean-tardiness": sum(late) / cell.parts, "tardy-parts": float(sum(late_s > SAME for late_s in late))}
    return float(known.get(objective, 0.0))  # a Python float, since JSON has no numpy types


def _side_by_side(shared: Shared, until_s: float, seed: int, workers: int) -> None:
    """Runs repeated annealing and CP-SAT in threads of their own until the order is proven or the time is over."""
    with ThreadPoolExecutor() as pool:
        left_s = max(SHORTEST_S, until_s - perf_counter())
        working = [pool.submit(_prove, shared, left_s, seed, workers)]
        working += [pool.submit(_anneal_on, shared, seed + ANNEALINGS * number) for number in range(ANNEALERS)]
        try:
            while perf_counter() < until_s and not shared.over.wait(WAIT_S):
                shared.look()
                if any(worker.done() and worker.exception() for worker in working):
                    break
        finally:  # Ctrl-C, too
            shared.over.set()
    for worker in working:
        worker.result()


def _prove(shared: Shared, time_limit_s: float, seed: int, workers: int) -> None:
    """Runs CP-SAT on the shared cell."""
    deferred.beside(shared, time_limit_s, seed, workers)


def _anneal_on(shared: Shared, seed: int) -> None:
    """Repeats annealing, each time longer."""
    for again in range(1, ANNEALINGS):
        _anneal(shared, seed + again, again)


def _anneal(shared: Shared, seed: int, again: int) -> None:
    """Runs annealing once, longer with each repetition; every third one begins with the incumbent."""
    if shared.over.is_set():
        return
    annealing = deferred.Annealing(shared.cell, shared.objective, seed, shared.sequence if again % 3 == 1 else ())
    size = most_moves(shared.cell)
    steps = max(ROUND, min(MOVES // size, EACH * size**2) << (again + 3) // 4)
    for done in range(0, steps, ROUND):
        annealing.advance(ROUND, done / steps)
        if annealing.best and annealing.best_cost < shared.cost - SAME:
            shared.tell("annealing", annealing.best)
        shared.look()
        if shared.over.is_set():
            return
