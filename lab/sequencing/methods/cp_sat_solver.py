"""CP-SAT in a thread of its own, stopped by Ctrl-C and by what other methods find meanwhile."""

from concurrent.futures import ThreadPoolExecutor, wait
from time import perf_counter
from typing import Literal

from ortools.sat.python import cp_model

from lab.sequencing.methods.shared import Shared
from lab.sequencing.search import SAME

PATIENCE_S = 5.0  # so long it looks at least before it begins again with another method's better order
WAIT_S = 0.05

Status = Literal["optimal", "feasible", "unknown", "impossible"]
_STATUS: dict[object, Status] = {
    cp_model.OPTIMAL: "optimal",
    cp_model.FEASIBLE: "feasible",
    cp_model.UNKNOWN: "unknown",
    cp_model.INFEASIBLE: "impossible",
}


def solved(solver: cp_model.CpSolver, model: cp_model.CpModel, shared: Shared, known: float) -> Status:
    """What the solver makes of a model that was built with an order of a known cost.

    It is stopped by Ctrl-C, which it would not hear itself, when all is over, and when there is a better order to begin with.
    """
    solver.parameters.catch_sigint_signal = False
    begin_s = perf_counter()
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(solver.solve, model)
        try:
            while not wait([answer], WAIT_S).done:
                better = shared.cost < known - SAME and perf_counter() > begin_s + PATIENCE_S
                if better or shared.over.is_set():
                    break
        finally:
            while not wait([answer], 0.0 if answer.done() else WAIT_S).done:
                solver.stop_search()
    return _STATUS[answer.result()]
