"""A second opinion on the best sequence, for every objective: the cell as a constraint model, solved by CP-SAT."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite
from time import perf_counter
from types import MappingProxyType

import numpy as np

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, check_built_in, check_objective, cost
from lab.sequencing.cell.routes import SERVER, entry
from lab.sequencing.methods.cp_sat_model import Model
from lab.sequencing.methods.cp_sat_shop import ShopModel, shop_of
from lab.sequencing.methods.cp_sat_solver import NAME, Solution, Status, cp_model, solved
from lab.sequencing.methods.cp_sat_tasks import possible_tasks
from lab.sequencing.methods.cp_sat_transport import TransportModel
from lab.sequencing.methods.rules import first_come
from lab.sequencing.methods.shared import Shared, shared_of
from lab.sequencing.search import SAME, Search, SequenceResult, not_in_time, only_one
from lab.sequencing.simulate.follow import follow, simulate, spoils
from lab.sequencing.simulate.run import Run

LOOK = 6.0  # deterministic time of one solve, in the solver's units: about seconds of one thread


def free_robots(shared: Shared, time_limit_s: float, seed: int, workers: int) -> None:
    """Tells `shared` a bound of the makespan from a model in which robots are always at hand, and that model's order as the
    cell's own robots carry it out."""
    begin_s, model = perf_counter(), TransportModel(shared.cell, shared.objective, (), free=True)
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(0.01, time_limit_s - (perf_counter() - begin_s))
    solver.parameters.max_deterministic_time = LOOK
    solver.parameters.num_workers, solver.parameters.random_seed = workers, seed
    status = solved(solver, model.model, shared, 0.0, lambda at: None, lambda bound: None)
    if status != "impossible":
        order = () if status == "unknown" else carried_out(shared.cell, model.moves(solver))
        shared.tell("CP-SAT", order, solver.best_objective_bound * model.worth)


def carried_out(cell: Cell, moves: Sequence[tuple[int, int, int]]) -> tuple[int, ...]:
    """The decisions that carry out an order of moves; empty: it ends in a deadlock. moves: part from 0, position, next position.

    The first move of the list that is allowed now is made, until none is left, by the robot that can pick soonest; of several
    such robots the one that was busy last takes it, so that the others stay where they are.
    """
    run, left, sequence = Run(cell), list(moves), list[int]()
    while left:
        ready = next(((move, decision) for move in left if (decision := _soonest(run, move))), None)
        if ready is None:
            return ()
        left.remove(ready[0])
        sequence.append(ready[1])
        run.move(ready[1])
    return tuple(sequence) if run.done else ()


def _soonest(run: Run, move: tuple[int, int, int]) -> int | None:
    """The decision that makes a move with the robot that picks soonest; None: the move is not allowed now."""
    part, place, to = move
    if run.locations[part] != place:
        return None
    able = list[tuple[float, float, int]]()
    for way in run.cell.positions[place].options:
        decision = entry(part + 1, way.choice, run.cell.parts)
        if way.to == to and run.option(decision) is not None and not run.spoils(decision):
            free_s = 0.0 if way.robot == SERVER else run.robots_s[way.robot]
            able.append((run.pick_s(part + 1, way), -free_s, decision))
    return min(able)[-1] if able else None


# ---- The method `cp-sat`, alone and beside others ---------------------------------------------------------------------


TIME_LIMIT_S = 60.0
MOST_MOVES = 800  # possible moves in a model: its memory grows with their square, to a gigabyte here

FIRST_LOOK = 3.0  # deterministic time of the first solve, in the solver's units (see `LOOK`)
SHOP_LOOK = 5.0  # the same for the model of a shop, which is tried before the general one
GROWS = 2.0


@dataclass(frozen=True)
class CpSatResult:
    """The sequence that CP-SAT found, and its status: "optimal", "feasible" (its cost lies above the bound), "unknown" (no
    sequence was found) or "impossible" (proven infeasible).

    cost: the simulated cost of the sequence; infinite without one. bound: a lower bound of every sequence's cost. rounded_s: the
    largest rounding error of a time in the model [s]; 0 when all times are whole in the model's unit, else the bound is proven
    for the rounded times.
    """

    status: Status
    cost: float
    bound: float
    sequence: tuple[int, ...]
    wall_s: float
    rounded_s: float = 0.0


def cp_sat(
    cell: Cell,
    objective: str = MAKESPAN,
    time_limit_s: float = TIME_LIMIT_S,
    seed: int = 0,
    hint: Sequence[int] | None = None,
    workers: int = 1,
    shared: Shared | None = None,
) -> CpSatResult:
    """The best sequence that CP-SAT finds within the time limit [s], by the cell's own times.

    hint: a complete sequence to begin with (None: `first_come`; empty: none). workers: threads; with one, the same seed gives
    the same result unless the time limit cuts it off; with several robots six are worth while, even on two cores. Building the
    model takes up to half a minute. shared: receives incumbents and bounds as they are found, and may end the search (see
    `Shared.look`). Raises BadInput for an objective that the cell has no times for, a time limit that is not above 0, an
    infeasible hint, and more than MOST_MOVES moves.
    Source: circuit and interval constraints of OR-Tools CP-SAT.
    """
    check_objective(objective, cell)
    check_built_in(objective, "CP-SAT")
    if not fits(cell):
        allowed = f"allowed are {MOST_MOVES}; order fewer parts"
        raise BadInput(f"CP-SAT: the {cell.parts} parts have {possible_tasks(cell)} moves to choose from; {allowed}")
    if not (isfinite(time_limit_s) and time_limit_s > 0):
        raise BadInput(f"time limit = {time_limit_s} s: allowed are finite times above 0")
    if workers < 1:
        raise BadInput(f"workers = {workers}: allowed are whole numbers from 1")
    check_no_batches(cell)
    known = first_come(cell) if hint is None else _checked(cell, hint)
    return _searched(_Asked(shared or Shared(cell, objective), seed, workers, time_limit_s), tuple(known))


def _checked(cell: Cell, hint: Sequence[int]) -> Sequence[int]:
    """The hint; BadInput when it is not a complete sequence of the cell."""
    try:
        if hint:
            simulate(cell, hint)
    except BadInput as error:
        raise BadInput(f"hint: {error}") from None
    return hint


def check_no_batches(cell: Cell) -> None:
    """BadInput for a cell with batches, which the constraint models do not know."""
    if cell.batches:
        name = cell.names[min(cell.batches)]
        raise BadInput(
            f"CP-SAT: station '{name}' has batch = true, which its model does not support: --method exact searches the shortest "
            "makespan, --method srl-time any objective"
        )


def beside(shared: Shared, time_limit_s: float, seed: int, workers: int) -> None:
    """Runs `cp_sat` beside other methods: it begins with the best order in `shared`, and anew when another method improves it.

    Its incumbents and bounds go to `shared` as they are found; it ends when the shared search does. For a cell that is too large
    for a model it gives a bound only. time_limit_s: of all its solves together [s].
    """
    begin_s, cell, large = perf_counter(), shared.cell, not fits(shared.cell)
    check_no_batches(cell)
    of_use = large or (shared.objective == MAKESPAN and not cell.serial)
    if cell.robots and shared.objective != "robot-idle" and of_use:
        free_robots(shared, time_limit_s, seed, workers)
    left_s = time_limit_s - (perf_counter() - begin_s)
    if not large and left_s > 0 and not shared.over.is_set():
        _searched(_Asked(shared, seed, workers, left_s), shared.sequence)


@dataclass
class _Asked:
    """One request to the solver. until_s: the deadline on the clock `perf_counter`, set when the first solve begins."""

    shared: Shared
    seed: int
    workers: int
    time_limit_s: float
    until_s: float = inf

    @property
    def goes_on(self) -> bool:
        """Whether time is left and the optimum is not proven yet."""
        return perf_counter() < self.until_s and not self.shared.over.is_set()


def _searched(asked: _Asked, known: tuple[int, ...]) -> CpSatResult:
    """The solver's result for a cell. known: the order to begin with; empty: none.

    For a shop with robots where no part may choose between machines, the model of a shop is solved first, then the general one.
    Measured on Bilge and Ulusoy's instances with two robots: the first proves the easy ones in a tenth to a third of the time; on
    set 7 its bounds stay far below those of the general model.
    """
    cell, objective, shared = asked.shared.cell, asked.shared.objective, asked.shared
    shop, bound = None if cell.serial else shop_of(cell, objective), 0.0
    while True:
        if shop is not None:
            model: Model | ShopModel | TransportModel = ShopModel(cell, shop, objective, known)
        else:
            model = Model(cell, objective, known) if cell.serial else TransportModel(cell, objective, known)
        asked.until_s = min(asked.until_s, perf_counter() + asked.time_limit_s)
        worth = cost(follow(cell, known), objective) if known else inf
        in_turn = shop is not None and bool(cell.robots) and not shop.flexible
        if isinstance(model, ShopModel):
            most = {"max_deterministic_time": SHOP_LOOK} if in_turn else {}
            found = _result(asked, model, worth, {**model.parameters, **most})
        elif isinstance(model, TransportModel) and objective == MAKESPAN and not model.times.rounded_s:
            found = _narrowed(asked, model, worth)
        else:
            found = _result(asked, model, worth)
        if found.status == "unknown" and known:
            found = replace(found, status="feasible", cost=worth, sequence=known)
        found = replace(found, bound=min(found.cost, max(found.bound, bound)))
        _tell(shared, found)
        proven = found.status in ("optimal", "impossible")
        if proven or not asked.goes_on or (shared.cost >= found.cost - SAME and not in_turn):
            return found
        known, bound = shared.sequence, found.bound
        shop = None if in_turn else shop


def _tell(shared: Shared, found: CpSatResult) -> None:
    """Tells `shared` the result; "impossible" is withheld where an order is known, since rounded times may have caused it."""
    known = found.status == "impossible" and shared.sequence
    shared.tell(NAME, found.sequence, 0.0 if known else found.bound)


def _narrowed(asked: _Asked, model: TransportModel, worth: float) -> CpSatResult:
    """The shortest makespan: after a first solve, only makespans below the incumbent are searched, until none exists.

    Measured: without linear relaxations and with a known upper bound, infeasibility is proven in a tenth of the time; with the
    relaxations, short orders are found and bounded better. So the two settings take turns, each time with more time.
    """
    begin_s, most, shared = perf_counter(), FIRST_LOOK, asked.shared
    best = _result(asked, model, worth, {"max_deterministic_time": most})
    if best.status == "unknown" and asked.goes_on and shared.cost >= worth - SAME:
        best = _result(asked, model, worth)
    while best.status == "feasible" and asked.goes_on:
        _tell(shared, best)
        if shared.cost < best.cost - SAME:
            best = replace(best, sequence=shared.sequence, cost=shared.cost)
        below = TransportModel(shared.cell, shared.objective, best.sequence, below=True)
        for linear in (False, True):
            most *= GROWS
            more: dict[str, object] = {"max_deterministic_time": most}
            if not linear:
                more |= {"linearization_level": 0, "stop_after_first_solution": True}
            found = _result(asked, below, best.cost, more)
            if found.cost < best.cost:
                best = replace(found, bound=max(found.bound, best.bound))
                best = replace(best, status="optimal" if best.cost <= best.bound + SAME else "feasible")
                break
            if found.status == "impossible":
                best = replace(best, status="optimal", bound=best.cost)
                break
            best = replace(best, bound=min(best.cost, max(best.bound, found.bound)))
            if found.status == "feasible":  # shorter in the model only: the simulated run is not
                return replace(best, wall_s=perf_counter() - begin_s)
            if not asked.goes_on or shared.cost < best.cost - SAME:
                break
    return replace(best, wall_s=perf_counter() - begin_s)


def _result(
    asked: _Asked,
    model: Model | ShopModel | TransportModel,
    worth: float,
    more: Mapping[str, object] = MappingProxyType({}),
) -> CpSatResult:
    """The solver's result for a model. worth: the cost of the order that the model was built with; more: solver parameters."""
    cell, solver = asked.shared.cell, cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = max(0.01, asked.until_s - perf_counter())
    solver.parameters.num_workers = asked.workers
    solver.parameters.random_seed = asked.seed
    # Measured: without these, ten toasts are not proven within a minute; with several robots less is proven.
    solver.parameters.use_strong_propagation_in_disjunctive = cell.serial
    solver.parameters.use_dynamic_precedence_in_disjunctive = cell.serial
    solver.parameters.absolute_gap_limit = model.blur
    for name, value in more.items():
        setattr(solver.parameters, name, value)

    def order(solution: Solution) -> tuple[int, ...]:
        found = model.sequence(solution)
        return () if model.times.rounded_s and spoils(cell, found) else found

    def hear(solution: Solution) -> None:
        asked.shared.tell(NAME, order(solution))

    def hear_bound(bound: float) -> None:
        asked.shared.tell(NAME, bound=min(bound * model.worth, worth, asked.shared.cost))

    status = solved(solver, model.model, asked.shared, worth, hear, hear_bound)
    sequence = order(solver) if status in ("optimal", "feasible") else ()
    if not sequence and status in ("optimal", "feasible"):
        status = "unknown"
    value = cost(follow(cell, sequence), asked.shared.objective) if sequence else inf
    bound = inf if status == "impossible" else min(value, solver.best_objective_bound * model.worth)
    if status == "optimal" and value > bound + model.blur * model.worth + SAME:
        status = "feasible"  # the model may give a part another room or server than a run does
    return CpSatResult(status, value, bound, sequence, solver.wall_time, model.times.rounded_s)


def cp_sat_sequencer(cell: Cell, search: Search, rng: np.random.Generator) -> SequenceResult:
    """The best sequence that CP-SAT finds by the mean times within TIME_LIMIT_S; it draws nothing from `rng`.

    Raises WorkFailed when it proves that no sequence exists, and when it finds none in time.
    """
    search.check(cell)
    shared = shared_of(cell, search)
    found = cp_sat(cell, search.objective, shared.left_s(TIME_LIMIT_S), shared=shared)
    if found.status == "unknown":
        raise not_in_time(cell, f"CP-SAT ({found.wall_s:.0f} s)", found.bound)
    return only_one(cell, search, found.sequence, found.cost, bool(found.sequence))


def fits(cell: Cell) -> bool:
    """Whether the cell is small enough for a model (MOST_MOVES)."""
    return possible_tasks(cell) <= MOST_MOVES
