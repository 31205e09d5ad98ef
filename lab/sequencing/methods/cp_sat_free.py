"""CP-SAT on a cell whose robots are wherever they are wanted: a bound within seconds, also of large cells, and a good order.

With many robots the bound is near the best order; with few it is far from it.
"""

from collections.abc import Sequence
from time import perf_counter

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER, entry
from lab.sequencing.methods.cp_sat_solver import solved
from lab.sequencing.methods.cp_sat_transport import TransportModel
from lab.sequencing.methods.ortools_cp_sat import cp_model
from lab.sequencing.methods.shared import Shared
from lab.sequencing.simulate.run import Run

LOOK = 6.0  # about so many seconds of a thread, counted in what the solver does


def free_robots(shared: Shared, time_limit_s: float, seed: int, workers: int) -> None:
    """Tells all a bound of the makespan, and the order in which such robots would work, carried out by those that there are."""
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
    """A complete order of moves, each a part from 0, its position and the next one; empty: it gets stuck.

    Again and again the first move that may be made now is made, by the robot that can pick soonest; of several the one that was
    free last, so that the others stay where they are.
    """
    run, left, found = Run(cell), list(moves), list[int]()
    while left:
        ready = next(((move, decision) for move in left if (decision := _soonest(run, move))), None)
        if ready is None:
            return ()
        left.remove(ready[0])
        found.append(ready[1])
        run.move(ready[1])
    return tuple(found) if run.done else ()


def _soonest(run: Run, move: tuple[int, int, int]) -> int | None:
    """The decision that makes a move; None: it may not be made now."""
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
