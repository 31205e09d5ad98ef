"""CP-SAT in a thread of its own, stopped by Ctrl-C and by what other methods find meanwhile."""

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from time import perf_counter
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

from lab.optional import optional
from lab.sequencing.methods.shared import Shared

__all__ = ["cp_model"]

AT_ONCE = ("Index", "Series")  # what `cp_model` looks up in pandas while it is loaded, for annotations


class LazyPandas(ModuleType):
    """Stands for pandas while `cp_model` is loaded, and in it from then on: what is looked up in it is looked up in pandas.

    What `cp_model` looks up at once is dropped afterwards, so that a method that takes a series meets the true classes.
    """

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get("pandas") is self:  # more is looked up at once
            del sys.modules["pandas"]
        with optional("a series in a model of CP-SAT"):
            import pandas

        return getattr(pandas, name)


def _without_pandas() -> ModuleType:
    """`cp_model`. `sys.modules` is left as if nobody had asked for pandas."""
    import numpy  # noqa: F401  # first, as the helper is, so that the stand-in is there for a moment only
    from ortools.sat.python import cp_model_helper  # noqa: F401

    lazy = LazyPandas("pandas")
    vars(lazy).update({name: type(name, (), {}) for name in AT_ONCE})
    sys.modules["pandas"] = lazy
    try:
        from ortools.sat.python import cp_model
    finally:
        if sys.modules.get("pandas") is lazy:
            del sys.modules["pandas"]
        for name in AT_ONCE:
            delattr(lazy, name)
    return cp_model


if TYPE_CHECKING or "pandas" in sys.modules:
    from ortools.sat.python import cp_model
else:
    cp_model = _without_pandas()


# ---- cp sat solver ----------------------------------------------------------------------------------------------------


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
