"""CP-SAT in a thread of its own, stopped by Ctrl-C and by what other methods find meanwhile."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from time import perf_counter
from typing import Literal

from lab.sequencing.methods.ortools_cp_sat import cp_model
from lab.sequencing.methods.shared import Shared

PATIENCE_S = 5.0  # so long it looks at least before it begins again with another method's better order
WAIT_S = 0.05

Status = Literal["optimal", "feasible", "unknown", "impossible"]
_STATUS: dict[object, Status] = {
    cp_model.OPTIMAL: "optimal",
    cp_model.FEASIBLE: "feasible",
    cp_model.UNKNOWN: "unknown",
    cp_model.INFEASIBLE: "impossible",
}


NAME = "CP-SAT"
Solution = cp_model.CpSolver | cp_model.CpSolverSolutionCallback  # where the values of a solution are looked up


class _Listener(cp_model.CpSolverSolutionCallback):
    """Hands each better solution and bound on, in the solver's own thread, where an error would end the process: it is kept."""

    def __init__(self, hear: Callable[[Solution], None], hear_bound: Callable[[float], None]) -> None:
        super().__init__()
        self._hear, self._hear_bound = hear, hear_bound
        self.failed: Exception | None = None

    def on_solution_callback(self) -> None:
        """A solution, whose values are those of `self`."""
        try:
            self._hear(self)
        except Exception as error:
            self.failed = error

    def bound(self, value: float) -> None:
        """A bound, in the model's units."""
        try:
            self._hear_bound(value)
        except Exception as error:
            self.failed = error


def solved(
    solver: cp_model.CpSolver,
    model: cp_model.CpModel,
    shared: Shared,
    known: float,
    hear: Callable[[Solution], None],
    hear_bound: Callable[[float], None],
) -> Status:
    """What the solver makes of a model that was built with an order of a known cost; it hands on what it finds and proves.

    It is stopped by Ctrl-C, which it would not hear itself, when all is over or at a limit (see `Shared.look`), and when there is
    a better order to begin with.
    """
    listener = _Listener(hear, hear_bound)
    solver.parameters.catch_sigint_signal = False
    solver.best_bound_callback = listener.bound
    begin_s = perf_counter()
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(solver.solve, model, listener)
        try:
            while not wait([answer], WAIT_S).done:
                shared.look()
                better = shared.beats(known, NAME) and perf_counter() > begin_s + PATIENCE_S
                if better or shared.over.is_set() or listener.failed:
                    break
        finally:
            while not wait([answer], 0.0 if answer.done() else WAIT_S).done:
                solver.stop_search()
    if listener.failed:
        raise listener.failed
    return _STATUS[answer.result()]
