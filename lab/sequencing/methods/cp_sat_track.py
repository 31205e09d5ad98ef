"""The track of a cell in a constraint model: each stretch holds one robot at a time."""

from collections import defaultdict

from lab.sequencing.methods.cp_sat_solver import cp_model
from lab.sequencing.methods.cp_sat_tasks import Tasks


class Track:
    """The drives that robots may make on a cell's track, as optional intervals on its stretches.

    A drive may begin whenever its stretches are free. A `Run` gives stretches out in the order of the decisions, so the model's
    optimum may be below what any sequence reaches.
    """

    def __init__(self, tasks: Tasks) -> None:
        self._tasks = tasks
        self._held = defaultdict[int, list[cp_model.IntervalVar]](list)

    def drive_between(
        self,
        robot: int,
        ends: tuple[int, int],
        free: cp_model.LinearExprT,
        by: cp_model.LinearExprT,
        done: cp_model.LiteralT,
    ) -> None:
        """Adds a robot's drive between two stations, if `done`: it begins at `free` or later and arrives at `by` or earlier."""
        cell, times, model = self._tasks.cell, self._tasks.times, self._tasks.model
        if not cell.ways[ends]:
            return
        leave, speed = self._tasks.moment("leave"), cell.robots[robot].speed
        model.add(leave >= free).only_enforce_if(done)
        model.add(leave + times.travel(*ends, robot) <= by).only_enforce_if(done)
        for held in cell.ways[ends]:
            begin, end = times.whole(held.from_s / speed), times.whole(held.until_s / speed)
            span = model.new_optional_interval_var(leave + begin, end - begin, leave + end, done, "holds")
            self._held[held.stretch].append(span)

    def close(self) -> None:
        """Adds a no-overlap constraint for each stretch, once all drives were added."""
        for spans in self._held.values():
            self._tasks.model.add_no_overlap(spans)
