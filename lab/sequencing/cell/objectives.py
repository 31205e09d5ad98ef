"""Objectives of a sequence: one number of a finished run, to be minimised."""

from collections.abc import Callable
from typing import Protocol

from lab.errors import BadInput, unknown
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER

MAKESPAN = "makespan"
WITH_DUE_TIMES = ("mean-tardiness", "tardy-parts")


class ObservedRun(Protocol):
    """The values of a run that objectives use; implemented by `lab.sequencing.simulate.run.Run`."""

    cell: Cell
    end_s: float
    waited_s: float
    processed_s: float
    finished_s: list[float | None]

    @property
    def done(self) -> bool:
        """Whether every part is finished."""


def _makespan(run: ObservedRun) -> float:
    """When the last part is finished [s]."""
    return run.end_s


def _mean_tardiness(run: ObservedRun) -> float:
    """The mean tardiness of the parts; an early part counts 0 [s]."""
    return sum(_late_s(run)) / run.cell.parts


def _tardy_parts(run: ObservedRun) -> float:
    """The number of parts that are finished later than due."""
    return float(sum(late > 0 for late in _late_s(run)))


def _robot_idle(run: ObservedRun) -> float:
    """The total time that the robot waits, at machines and for arrivals [s]."""
    return run.waited_s


def _machine_idle(run: ObservedRun) -> float:
    """The idle time of all places of the routes' machines from time 0 to the makespan, added up [s]."""
    return machine_places(run.cell) * run.end_s - run.processed_s


def machine_places(cell: Cell) -> int:
    """The number of parts that all machines on the routes can process at once."""
    used = {station for place in cell.positions for station in place.holds}
    used |= {way.target for place in cell.positions for way in place.options if way.robot == SERVER}
    machines = [station for number, station in enumerate(cell.stations) if station.kind == "machine" and number in used]
    return sum(station.servers or station.capacity for station in machines)


# name -> function(run) of a finished run
OBJECTIVES: dict[str, Callable[[ObservedRun], float]] = {
    MAKESPAN: _makespan,
    "mean-tardiness": _mean_tardiness,
    "tardy-parts": _tardy_parts,
    "robot-idle": _robot_idle,
    "machine-idle": _machine_idle,
}
BUILT_IN = tuple(OBJECTIVES)  # an objective that is added later is a function of finished runs only


def check_objective(name: str, cell: Cell) -> None:
    """Raises BadInput for an unknown objective, and for one that needs due times when the cell has none."""
    if name not in OBJECTIVES:
        raise unknown("objective", name, OBJECTIVES, "--objective")
    if name in WITH_DUE_TIMES and cell.due_s is None:
        untimed = [other for other in OBJECTIVES if other not in WITH_DUE_TIMES]
        raise BadInput(f"objective '{name}': the cell has no due times (due_s); without them: {', '.join(untimed)}")


def check_built_in(name: str, who: str) -> None:
    """Raises BadInput for an objective that was added to OBJECTIVES, for methods that need a compiled or stepwise form."""
    if name not in BUILT_IN:
        raise BadInput(f"objective '{name}': {who} has no rule for it, only for {', '.join(BUILT_IN)}")


def cost(run: ObservedRun, objective: str) -> float:
    """The objective's value of a run; for a deadlock `stuck_cost`, which is more than that of any finished run."""
    return OBJECTIVES[objective](run) if run.done else stuck_cost(run.cell, objective)


def stuck_cost(cell: Cell, objective: str) -> float:
    """A cost above that of any finished run, as long as no drawn time is ten times its mean."""
    if objective == "tardy-parts":
        return cell.parts + 1.0
    return 10.0 * cell.longest_s * (machine_places(cell) if objective == "machine-idle" else 1.0) + 1.0


def _late_s(run: ObservedRun) -> list[float]:
    due_s = run.cell.due_s or (0.0,) * run.cell.parts
    return [max(0.0, (end or 0.0) - due) for end, due in zip(run.finished_s, due_s, strict=True)]
