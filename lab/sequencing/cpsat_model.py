"""The cell as a constraint model for OR-Tools' CP-SAT: the robot's tour through the moves, and time along it.

It shares the cell's positions with the simulation, and nothing else: no states, no order of events.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from ortools.sat.python import cp_model

from lab.errors import BadInput
from lab.sequencing.bound import Way, distances, follows, ways_of
from lab.sequencing.cell import Cell
from lab.sequencing.objectives import MAKESPAN, WITH_DUE_TIMES, machine_places
from lab.sequencing.positions import entry, part_of
from lab.sequencing.run import Run

UNITS_S = (1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6)
MOST_UNITS = 1e12  # no time above it, in units: sums of many then stay exact
_SAME = 1e-12  # of the longest time: what two floats that are equal may differ by


class Times:
    """The cell's times in whole units: the largest unit in which they all are whole, else the smallest.

    rounded_s: by how much a time is changed at the most [s]; 0 when all are whole.
    """

    def __init__(self, cell: Cell, ways: Sequence[Way]) -> None:
        carries = [float(cell.loaded_s[way.option.origin, way.option.target]) for way in ways]
        tables = np.concatenate([cell.empty_s.ravel(), cell.loaded_s.ravel()])
        given = np.array(
            [
                *tables[~np.isnan(tables)],
                *(place.processing_s or 0.0 for place in cell.positions),
                *(way.option.service_s for way in ways),
                *(cell.arrivals.interval_s if cell.arrivals else ()),
                *(cell.due_s or ()),
            ]
        )
        longest_s = cell.longest_s + max(cell.due_s or (0.0,))
        units = [unit for unit in UNITS_S if longest_s / unit <= MOST_UNITS] or [longest_s / MOST_UNITS]
        fit = [unit for unit in units if _off_s(given, unit) <= _SAME * longest_s and min(carries) >= unit / 2]
        self.unit_s = fit[0] if fit else units[-1]
        # Moves that take no time are given a unit, see `carry`.
        self.rounded_s = 0.0 if fit else max(_off_s(given, self.unit_s), self.unit_s if min(carries) == 0 else 0.0)
        self._cell = cell

    def whole(self, seconds: float) -> int:
        """A time in units."""
        return round(seconds / self.unit_s)

    def travel(self, origin: int, target: int) -> int:
        """The robot's empty way between two stations."""
        return 0 if origin == target else self.whole(float(self._cell.empty_s[origin, target]))

    def work(self, way: Way) -> int:
        """Service and carrying; at least a unit, so that the order of moves is the order of their times."""
        carry_s = float(self._cell.loaded_s[way.option.origin, way.option.target])
        return self.whole(way.option.service_s) + max(1, self.whole(carry_s))

    def processing(self, place: int) -> int:
        """What begins in a position."""
        return self.whole(self._cell.positions[place].processing_s or 0.0)


def _off_s(given: NDArray[np.float64], unit_s: float) -> float:
    return float(np.abs(given - np.round(given / unit_s) * unit_s).max(initial=0.0))


class Task(NamedTuple):
    """A move that one part may make: whether it does, and when the robot begins it, its waiting over, and drops."""

    part: int
    way: Way
    done: cp_model.IntVar
    begin: cp_model.IntVar
    drop: cp_model.LinearExpr


class Visit(NamedTuple):
    """A part's room at a station: whether it comes there, from the begin of the move that brings it to the last drop."""

    part: int
    station: int
    here: cp_model.IntVar
    begin: cp_model.IntVar
    leave: cp_model.IntVar


class Model:
    """The variables and constraints; `worth`: what a unit of the model's objective is in the cell's.

    Parts are numbered from 0 here. `come`: by part and position, when it is dropped there.
    """

    def __init__(self, cell: Cell, objective: str) -> None:
        self.cell, self.model, self._ways = cell, cp_model.CpModel(), ways_of(cell)
        self.times = Times(cell, self._ways)
        self._longest = self.times.whole(cell.longest_s) + len(self._ways) * cell.parts + 1
        self._holds = [[s in place.holds for place in cell.positions] for s in range(len(cell.stations))]
        self._distances = distances(cell, self.times.unit_s)
        self._tasks: list[Task] = []
        self._arcs: dict[tuple[int, int], cp_model.IntVar] = {}
        self._come: dict[tuple[int, int], cp_model.IntVar] = {}
        self._travels: list[cp_model.LinearExpr] = []
        self._waits: list[cp_model.LinearExpr] = []
        self._end = self._moment("makespan")
        for part in range(cell.parts):
            self._add_part(part)
        self._add_tour()
        self._add_full([visit for station in range(len(cell.stations)) for visit in self._add_room(station)])
        self._add_order(objective)
        self.worth = self._add_objective(objective)

    def suggest(self, sequence: Sequence[int]) -> None:
        """Give the solver a sequence to begin with; BadInput when a decision of it may not be taken."""
        run, before = Run(self.cell), 0
        tasks = {(task.part, task.way.place, task.way.option): n for n, task in enumerate(self._tasks, 1)}
        hinted = dict.fromkeys([task.done for task in self._tasks] + [*self._arcs.values()], 0)
        for decision in sequence:
            part = part_of(decision, self.cell.parts) - 1
            place, option = run.locations[part], run.option(decision)
            if option is None:
                raise BadInput(f"hint: {run.refusal(decision)}")
            move, number = run.move(decision), tasks[part, place, option]
            task = self._tasks[number - 1]
            self.model.add_hint(task.begin, self.times.whole(move.pick_s - move.service_s))
            hinted[task.done] = hinted[self._arcs[before, number]] = 1
            before = number
        for variable, value in hinted.items():
            self.model.add_hint(variable, value)

    def sequence(self, solver: cp_model.CpSolver) -> tuple[int, ...]:
        """The decisions of the solution, in the order of the robot's tour."""
        after = {left: then for (left, then), arc in self._arcs.items() if solver.boolean_value(arc)}
        decisions, number = list[int](), 0
        while number in after:
            number = after[number]
            task = self._tasks[number - 1]
            decisions.append(entry(task.part + 1, task.way.option.choice, self.cell.parts))
        return tuple(decisions)

    def _moment(self, name: str) -> cp_model.IntVar:
        return self.model.new_int_var(0, self._longest, name)

    def _add_part(self, part: int) -> None:
        """The part's way from its start to an end: one option of each position that it comes to."""
        reached, own = [self.cell.starts[part]], list[Task]()
        for place in reached:
            self._come[part, place] = self._moment(f"come {part} {place}")
            for way in self._ways:
                if way.place == place:
                    begin = self._moment(f"begin {part}")
                    done = self.model.new_bool_var(f"do {part}")
                    own.append(Task(part, way, done, begin, begin + self.times.work(way)))
                    reached += [way.option.to] if way.option.to not in reached else []
        self._tasks += own
        self.model.add(self._come[part, reached[0]] == 0)
        for place in reached:
            into = [task.done for task in own if task.way.option.to == place]
            out = [task.done for task in own if task.way.place == place]
            if out:
                self.model.add(sum(out) == (sum(into) if into else 1))
        for task in own:
            self.model.add(self._come[part, task.way.option.to] == task.drop).only_enforce_if(task.done)
            self._add_wait(task)

    def _add_wait(self, task: Task) -> None:
        """The pick comes after the processing that was begun last."""
        place = task.way.place
        if not task.way.option.waits:
            return
        while self.cell.positions[place].processing_s is None:
            place = next(way.place for way in self._ways if way.option.to == place)
        ready = self._come[task.part, place] + self.times.processing(place)
        self.model.add(task.begin >= ready).only_enforce_if(task.done)

    def _add_tour(self) -> None:
        """The robot goes from move to move, in one tour from its start to the last end; time follows."""
        start, arcs = self.cell.index(self.cell.robot_start), list[tuple[int, int, cp_model.LiteralT]]()
        for number, task in enumerate(self._tasks, 1):
            arcs.append((number, number, ~task.done))
            if task.way.place == self.cell.starts[task.part]:
                arcs.append((0, number, self._arc(0, number, self.times.travel(start, task.way.option.origin), 0)))
            if not self.cell.positions[task.way.option.to].options:
                arcs.append((number, 0, self.model.new_bool_var("last")))
            for other, after in enumerate(self._tasks, 1):
                same = task.part == after.part
                if follows(self.cell, task.way, after.way, same):
                    travel = self.times.travel(task.way.option.target, after.way.option.origin)
                    process = self.times.processing(after.way.place) if same and after.way.option.waits else 0
                    arcs.append((number, other, self._arc(number, other, travel, max(0, process - travel))))
        self.model.add_circuit(arcs)

    def _arc(self, left: int, then: int, travel: int, wait: int) -> cp_model.IntVar:
        done = self._arcs[left, then] = self.model.new_bool_var("follows")
        before = self._tasks[left - 1].drop if left else 0
        self.model.add(self._tasks[then - 1].begin >= before + travel).only_enforce_if(done)
        self._travels.append(travel * done)
        self._waits.append(wait * done)
        return done

    def _add_room(self, station: int) -> list[Visit]:
        """A station never holds more than it can: a part has its room from when it is begun to be brought.

        With room for one, the robot also has to get from where it took the part before to where it fetches the next.
        """
        holds, room = self._holds[station], self.cell.capacities[station]
        into = [way for way in self._ways if holds[way.option.to] and not holds[way.place]]
        out = [way for way in self._ways if holds[way.place] and not holds[way.option.to]]
        ways = [self._distances[left.option.target][way.option.origin] for left in out for way in into]
        change = min([*ways, self._longest]) if room == 1 and self.cell.parts > 1 else 0
        visits, intervals, least = list[Visit](), list[cp_model.IntervalVar](), list[cp_model.LinearExprT]()
        for part in range(self.cell.parts):
            own = [task for task in self._tasks if task.part == part]
            brings, takes = [t for t in own if t.way in into], [t for t in own if t.way in out]
            if brings:
                visit = Visit(part, station, *self._visit(brings, takes))
                size = self._moment("stay")
                least.append(self._least(brings, takes) + change * visit.here)
                self.model.add(size >= least[-1])
                span = visit.begin, size, visit.leave + change, visit.here
                intervals.append(self.model.new_optional_interval_var(*span, "visit"))
                visits.append(visit)
        if room == 1 and visits:
            self.model.add_no_overlap(intervals)
            self.model.add(self._end >= sum(least) - change)
        elif room < len(visits):
            self.model.add_cumulative(intervals, [1] * len(visits), room)
        return visits

    def _visit(self, brings: list[Task], takes: list[Task]) -> tuple[cp_model.IntVar, cp_model.IntVar, cp_model.IntVar]:
        here, begin, leave = self.model.new_bool_var("here"), self._moment("from"), self._moment("until")
        self.model.add(sum(task.done for task in brings) == here)
        for task in brings:
            self.model.add(begin == task.begin).only_enforce_if(task.done)
        for task in takes:
            self.model.add(leave == task.drop).only_enforce_if(task.done)
        return here, begin, leave

    def _least(self, brings: list[Task], takes: list[Task]) -> cp_model.LinearExprT:
        """How long a visit lasts at least: the moves that begin and end it, and the processing."""
        waits = all(task.way.option.waits for task in takes)
        process = [self.times.processing(task.way.option.to) if waits else 0 for task in brings]
        begins = [(self.times.work(t.way) + more) * t.done for t, more in zip(brings, process, strict=True)]
        return sum([*begins, *(self.times.work(task.way) * task.done for task in takes)])

    def _add_full(self, visits: Sequence[Visit]) -> None:
        """A buffer is used only when the station ahead is full at that moment, where the cell says so."""
        for task in self._tasks:
            station = task.way.option.if_full
            if station is None:
                continue
            inside = []
            for visit in visits:
                if visit.station == station and visit.part != task.part:
                    then = self.model.new_bool_var("inside")
                    self.model.add_implication(then, visit.here)
                    self.model.add(visit.begin < task.begin).only_enforce_if(then)
                    self.model.add(visit.leave > task.drop).only_enforce_if(then)
                    inside.append(then)
            self.model.add(sum(inside) >= self.cell.capacities[station]).only_enforce_if(task.done)

    def _add_order(self, objective: str) -> None:
        """Parts that arrive are taken in their order; of parts that are alike in all, the first in number goes first."""
        cell, arrivals, came_s = self.cell, self.cell.arrivals, 0.0
        first = [self._moment(f"first {part}") for part in range(cell.parts)]
        taken = [self._moment(f"taken {part}") for part in range(cell.parts)]
        for task in self._tasks:
            if task.way.place == cell.starts[task.part]:
                self.model.add(first[task.part] == task.begin).only_enforce_if(task.done)
                self.model.add(taken[task.part] == task.drop).only_enforce_if(task.done)
        for part in range(cell.parts) if arrivals is not None else ():
            came_s += arrivals.interval_s[part]
            if part == 0 or arrivals.after == "clock":
                self.model.add(first[part] >= self.times.whole(came_s))
            else:
                self.model.add(first[part] >= first[part - 1] + self.times.whole(arrivals.interval_s[part]))
        due_s = cell.due_s if cell.due_s and objective in WITH_DUE_TIMES else (0.0,) * cell.parts
        latest: dict[object, int] = {}
        for part, product in enumerate(cell.order):
            kind = None if arrivals is not None else (product, due_s[part])
            if kind in latest:
                self.model.add(first[part] >= taken[latest[kind]])
            latest[kind] = part

    def _add_objective(self, objective: str) -> float:
        """What is to be as low as possible; the worth of its unit in the cell's."""
        model, positions = self.model, self.cell.positions
        busy = sum(self._travels) + sum(self.times.work(task.way) * task.done for task in self._tasks)
        model.add(self._end >= busy + sum(self._waits))
        ends = [task for task in self._tasks if not positions[task.way.option.to].options]
        for task in ends:
            model.add(self._end >= task.drop).only_enforce_if(task.done)
        if objective == MAKESPAN:
            model.minimize(self._end)
        elif objective == "robot-idle":
            model.minimize(self._end - busy)
        elif objective == "machine-idle":
            processed = sum(self.times.processing(task.way.option.to) * task.done for task in self._tasks)
            model.minimize(machine_places(self.cell) * self._end - processed)
        else:
            return self._add_late(ends, objective)
        return self.times.unit_s

    def _add_late(self, ends: Sequence[Task], objective: str) -> float:
        due = [self.times.whole(due_s) for due_s in self.cell.due_s or ()]
        if objective == "tardy-parts":
            late = [self.model.new_bool_var("late") for _ in due]
            for task in ends:
                self.model.add(task.drop <= due[task.part]).only_enforce_if(task.done, ~late[task.part])
            self.model.minimize(sum(late))
            return 1.0
        lateness = [self._moment("late") for _ in due]
        for task in ends:
            self.model.add(lateness[task.part] >= task.drop - due[task.part]).only_enforce_if(task.done)
        self.model.minimize(sum(lateness))
        return self.times.unit_s / self.cell.parts
