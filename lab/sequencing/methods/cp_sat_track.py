"""The track of a cell in a constraint model: each stretch holds one robot at a time."""

from collections import defaultdict

from lab.sequencing.methods.cp_sat_solver import cp_model
from lab.sequencing.methods.cp_sat_tasks import Tasks


class Track:
    """The ways that robots may drive on a cell's track, as optional intervals on its stretches.

    A way may begin whenever its stretches are free: a `Run` gives them out in the order of the decisions, so that no list may
    come to what is best here.
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
        """A robot that is free from a time on drives from a station to another, to be there by a time, if that is done."""
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
        """No two are on a stretch at a time."""
        for spans in self._held.values():
            self._tasks.model.add_no_overlap(spans)
