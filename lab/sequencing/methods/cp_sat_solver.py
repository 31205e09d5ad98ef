"""OR-Tools' `cp_model`, loaded without pandas, and CP-SAT in a thread of its own that Ctrl-C and other methods can stop."""

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
    """A stand-in for pandas inside `cp_model`, which loads pandas when an attribute of it is first needed.

    The attributes that `cp_model` looks up while it is loaded are dropped afterwards, so that a method that takes a series meets
    the true classes.
    """

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get("pandas") is self:  # more is looked up at once
            del sys.modules["pandas"]
        with optional("a series in a model of CP-SAT"):
            import pandas

        return getattr(pandas, name)


def _without_pandas() -> ModuleType:
    """The module `cp_model`, loaded without pandas; `sys.modules` is left as if nobody had asked for pandas."""
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


# ---- The solver in its thread -----------------------------------------------------------------------------------------


PATIENCE_S = 5.0  # the least time of a solve before it begins again with another method's better order
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
    """Passes each better solution and bound on. It runs in the solver's thread, where an error would end the process, so an
    error is kept for the caller."""

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
    """The solver's status for a model. known: the cost of the order that the model was built with.

    Solutions are passed to `hear` and bounds to `hear_bound`. The solver is stopped by Ctrl-C, which it would not notice itself,
    when the shared search ends or reaches a limit (see `Shared.look`), and when another method has a better order to begin with.
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
