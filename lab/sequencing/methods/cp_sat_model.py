"""The cell as a constraint model for OR-Tools' CP-SAT: the robot's tour through the moves, and time along it.

It shares only the cell's positions with the simulation, neither states nor the order of events.
"""

from collections.abc import Sequence
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES, machine_places
from lab.sequencing.cell.routes import entry
from lab.sequencing.cell.ways import Way, distances, follows, ways_of
from lab.sequencing.methods.cp_sat_solver import Solution, cp_model
from lab.sequencing.methods.cp_sat_times import ScheduledMove, Times, longest, timed


class MoveTask(NamedTuple):
    """A move that one part may make: whether it does, and when the robot begins it, its waiting over, and drops.

    waits: whether the robot has to wait before; None: it never does.
    """

    part: int
    way: Way
    done: cp_model.IntVar
    begin: cp_model.IntVar
    drop: cp_model.LinearExpr
    waits: cp_model.IntVar | None


class Visit(NamedTuple):
    """A part's stay in a station's room, as an optional interval: from the begin of the move that brings it to the drop of the
    move that takes it, or to the end."""

    part: int
    station: int
    here: cp_model.IntVar
    begin: cp_model.IntVar
    leave: cp_model.IntVar


class Model:
    """The variables and constraints. Parts are numbered from 0 here.

    worth: one unit of the model's objective, in the cell's unit. blur: the units by which rounding may change a sequence's cost;
    0 when no time is rounded.
    """

    def __init__(self, cell: Cell, objective: str, hint: Sequence[int]) -> None:
        self.cell, self.model, self._ways = cell, cp_model.CpModel(), ways_of(cell)
        self.times = Times(cell)
        known = timed(cell, self.times, self._ways, hint) if hint else []
        most = longest(cell, self.times, self._ways)
        self._longest = known[-1].drop if objective == MAKESPAN and known else most
        self._holds = [[s in place.holds for place in cell.positions] for s in range(len(cell.stations))]
        self._distances = distances(cell, self.times.per_s)
        self._tasks: list[MoveTask] = []
        self._arcs: dict[tuple[int, int], cp_model.IntVar] = {}
        self._come: dict[tuple[int, int], cp_model.IntVar] = {}
        self._travels: list[cp_model.LinearExpr] = []
        self._waits: list[cp_model.LinearExpr] = []
        self._first = [self._moment(f"first {part}") for part in range(cell.parts)]
        self._taken = [self._moment(f"taken {part}") for part in range(cell.parts)]
        self._end = self._moment("makespan")
        for part in range(cell.parts):
            self._add_part(part)
        self._add_tour()
        self._add_full([visit for station in range(len(cell.stations)) for visit in self._add_room(station)])
        self._add_order(objective)
        for number in range(len(cell.rules)):
            self._add_precedence(number)
        self.worth = self._add_objective(objective)
        each = {"machine-idle": machine_places(cell), "mean-tardiness": cell.parts, "tardy-parts": 0}.get(objective, 1)
        self.blur = 2 * each * len(self._tasks) if self.times.rounded_s else 0
        if known:
            self._suggest(known)

    def sequence(self, solver: Solution) -> tuple[int, ...]:
        """The decisions of the solution, in the order of the robot's tour."""
        after = {left: then for (left, then), arc in self._arcs.items() if solver.boolean_value(arc)}
        decisions, number = list[int](), 0
        while number in after:
            number = after[number]
            task = self._tasks[number - 1]
            decisions.append(entry(task.part + 1, task.way.option.choice, self.cell.parts))
        return tuple(decisions)

    def _suggest(self, known: Sequence[ScheduledMove]) -> None:
        """Give the solver a sequence to begin with."""
        tasks = {(task.part, task.way): number for number, task in enumerate(self._tasks, 1)}
        hints = dict.fromkeys([*self._arcs.values(), *self._come.values()], 0)
        for task in self._tasks:
            hints |= {task.done: 0, task.begin: 0}
        before = 0
        for move in known:
            number = tasks[move.part, move.way]
            task = self._tasks[number - 1]
            hints |= {task.done: 1, task.begin: move.begin, self._arcs[before, number]: 1}
            if isinstance(task.drop, cp_model.IntVar):
                hints[task.drop] = move.drop
            hints[self._come[move.part, move.way.option.to]] = move.drop
            before = number
        hints[self._end] = known[-1].drop
        for variable, value in hints.items():
            self.model.add_hint(variable, value)

    def _moment(self, name: str) -> cp_model.IntVar:
        return self.model.new_int_var(0, self._longest, name)

    def _add_part(self, part: int) -> None:
        """Adds the part's path from its start to an end: one option of each position that it comes to."""
        reached, own = [self.cell.begin_at[part]], list[MoveTask]()
        for place in reached:
            self._come[part, place] = self._moment(f"come {part} {place}")
            for way in self._ways:
                if way.place == place:
                    own.append(self._task(part, way))
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
            if task.way.place == reached[0]:
                self.model.add(self._first[part] == task.begin).only_enforce_if(task.done)
                self.model.add(self._taken[part] == task.drop).only_enforce_if(task.done)

    def _task(self, part: int, way: Way) -> MoveTask:
        """The optional move of a part: it begins when the part is ready, or when the robot arrives if that is later.

        In a cell with time windows it may also begin later, and the robot may hold the part before it drops it.
        """
        done, begin, waits = self.model.new_bool_var("does"), self._moment("begin"), None
        self.model.add(begin >= self._come[part, way.place]).only_enforce_if(done)
        ready = self._ready(part, way) if way.option.waits else None
        if ready is not None:
            waits = self.model.new_bool_var("waits")
            self.model.add(begin >= ready).only_enforce_if(done)
            if not self.cell.has_windows:
                self.model.add(begin <= ready).only_enforce_if(done, waits)
        at_most_s = self.cell.positions[way.place].at_most_s
        if at_most_s is not None and ready is not None:
            latest = ready + self.times.whole(at_most_s) - self.times.whole(way.option.service_s)
            self.model.add(begin <= latest).only_enforce_if(done)
        drop = begin + self.times.work(way.option)
        if self.cell.has_windows:
            drop, least = self._moment("drop"), drop
            self.model.add(drop >= least).only_enforce_if(done)
        return MoveTask(part, way, done, begin, drop, waits)

    def _ready(self, part: int, way: Way) -> cp_model.LinearExprT | None:
        """When the part is ready to be picked; None: it always is by the time the robot arrives."""
        place, arrivals = way.place, self.cell.arrivals
        begin, begin_s = self.cell.begin_at[part], self.cell.begin_s[part]
        if place == begin and arrivals is not None and place == self.cell.starts[part]:
            before = [other - 1 for other in self.cell.coming if other <= part]
            intervals = [self.times.whole(arrivals.interval_s[other]) for other in (*before, part)]
            after_pick = before and arrivals.after == "pick"
            return self._first[before[-1]] + intervals[-1] if after_pick else sum(intervals)
        while place != begin and self.cell.positions[place].processing_s is None:
            place = next(way.place for way in self._ways if way.option.to == place)
        if place == begin:
            known = begin_s > 0 or self.cell.positions[place].at_most_s is not None
            return self.times.whole(begin_s) if known else None
        process, limited = self.times.processing(place), self.cell.positions[way.place].at_most_s is not None
        return self._come[part, place] + process if process or limited else None

    def _add_tour(self) -> None:
        """The robot goes from move to move, in one tour from its start to the last end; time follows."""
        start, arcs = self.cell.index(self.cell.robot_start), list[tuple[int, int, cp_model.LiteralT]]()
        for number, task in enumerate(self._tasks, 1):
            arcs.append((number, number, ~task.done))
            if task.way.place == self.cell.begin_at[task.part] and self.times.known(start, task.way.option.origin):
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
        before, task = self._tasks[left - 1].drop if left else 0, self._tasks[then - 1]
        self.model.add(task.begin >= before + travel).only_enforce_if(done)
        # Unless the robot waits, the move is not later either: else the solver would repeat the same tour a little later.
        at_once = [done] if task.waits is None else [done, ~task.waits]
        if not self.cell.has_windows:
            self.model.add(task.begin <= before + travel).only_enforce_if(*at_once)
        self._travels.append(travel * done)
        self._waits.append(wait * done)
        return done

    def _add_room(self, station: int) -> list[Visit]:
        """The visits to a station, constrained to its capacity: a part takes room from the begin of the move that brings it.

        With capacity 1, the robot must also have time to drive from where it took the last part to where it fetches the next.
        """
        holds, room = self._holds[station], self.cell.capacities[station]
        into = [way for way in self._ways if holds[way.option.to] and not holds[way.place]]
        out = [way for way in self._ways if holds[way.place] and not holds[way.option.to]]
        ways = [self._distances[left.option.target][way.option.origin] for left in out for way in into]
        change = min([*ways, self._longest]) if room == 1 and len(self.cell.unfinished) > 1 else 0
        visits, intervals, least = list[Visit](), list[cp_model.IntervalVar](), list[cp_model.LinearExpr]()
        for part in range(self.cell.parts):
            own = [task for task in self._tasks if task.part == part]
            brings, takes = [t for t in own if t.way in into], [t for t in own if t.way in out]
            inside = holds[self.cell.begin_at[part]]
            if brings or inside:
                visit = Visit(part, station, *self._visit(brings, takes, inside))
                # It may begin before 0, and the change after it may lie behind the end.
                size = self.model.new_int_var(0, 2 * self._longest + 2, "stay")
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

    def _visit(
        self, brings: list[MoveTask], takes: list[MoveTask], inside: bool
    ) -> tuple[cp_model.IntVar, cp_model.IntVar, cp_model.IntVar]:
        """A visit's presence, begin and end. inside: the part is there before all moves, and stays if no move takes it."""
        here, begin, leave = self.model.new_bool_var("here"), self._moment("from"), self._moment("until")
        if inside:
            begin = self.model.new_constant(-1)
            self.model.add(here == 1)
            leave = leave if takes else self.model.new_constant(self._longest + 1)
        else:
            self.model.add(sum(task.done for task in brings) == here)
        for task in brings:
            self.model.add(begin == task.begin).only_enforce_if(task.done)
        for task in takes:
            self.model.add(leave == task.drop).only_enforce_if(task.done)
        return here, begin, leave

    def _least(self, brings: list[MoveTask], takes: list[MoveTask]) -> cp_model.LinearExpr:
        """How long a visit lasts at least: the moves that begin and end it, and the processing."""
        waits = all(task.way.option.waits for task in takes)
        process = [self.times.processing(task.way.option.to) if waits else 0 for task in brings]
        begins = [(self.times.work(t.way.option) + more) * t.done for t, more in zip(brings, process, strict=True)]
        ends = [self.times.work(task.way.option) * task.done for task in takes]
        return cp_model.LinearExpr.sum([*begins, *ends])

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
        cell = self.cell
        due_s = cell.due_s if cell.due_s and objective in WITH_DUE_TIMES else (0.0,) * cell.parts
        latest: dict[object, int] = {}
        for part, product in enumerate(cell.order):
            if part + 1 not in cell.unfinished:
                continue
            comes = cell.arrivals is not None and part + 1 in cell.coming
            kind = None if comes else (product, due_s[part], cell.begin_at[part], cell.begin_s[part])
            if kind in latest:
                self.model.add(self._first[part] >= self._taken[latest[kind]])
            latest[kind] = part

    def _add_precedence(self, number: int) -> None:
        """Adds a precedence: the k-th part to begin its step waits until as many others have ended theirs as it needs.

        A part that still has its step ahead has a variable for when it begins the step, and one for when it has ended.
        """
        rule, precedence, model = self.cell.rules[number], self.cell.precedences[number], self.model
        mine = {part: self._step(part - 1, rule.made) for part in precedence.parts if part in self.cell.unfinished}
        theirs = {part: self._step(part - 1, rule.ended) for part in precedence.of if part in self.cell.unfinished}
        waiting = {part: step for part, step in mine.items() if step is not None}
        made = sum(self.cell.begin_at[part - 1] in rule.made for part in precedence.parts)
        ended = sum(self.cell.begin_at[part - 1] in rule.ended for part in precedence.of)
        first = {(a, b): model.new_bool_var("first") for a in waiting for b in waiting if a < b}
        for (a, b), is_first in first.items():
            model.add(waiting[b][0] >= waiting[a][1]).only_enforce_if(is_first)
            model.add(waiting[a][0] >= waiting[b][1]).only_enforce_if(~is_first)
        for part, (begin, _) in waiting.items():
            before = [is_first if b == part else 1 - is_first for (a, b), is_first in first.items() if part in (a, b)]
            done = list[cp_model.IntVar]()
            for step in (step for other, step in theirs.items() if step is not None and other != part):
                done.append(model.new_bool_var("ended"))
                model.add(begin >= step[1]).only_enforce_if(done[-1])
            counts = [*rule.counts, *(0,) * len(precedence.parts)]
            needs = model.new_int_var(0, len(precedence.of), "needs")
            model.add_element(made + sum(before), counts, needs)
            model.add(ended + sum(done) >= needs)

    def _step(self, part: int, made: frozenset[int]) -> tuple[cp_model.IntVar, cp_model.IntVar] | None:
        """When a part (from 0) begins and ends the move to one of these positions; None: it is already in one of them."""
        tasks = [t for t in self._tasks if t.part == part and t.way.option.to in made and t.way.place not in made]
        if not tasks:
            return None
        begin, end = self._moment("begins step"), self._moment("ends step")
        for task in tasks:
            self.model.add(begin == task.begin).only_enforce_if(task.done)
            self.model.add(end == task.drop).only_enforce_if(task.done)
        return begin, end

    def _add_objective(self, objective: str) -> float:
        """Adds the objective to be minimised; returns the worth of its unit in the cell's unit."""
        model, positions = self.model, self.cell.positions
        busy = sum(self._travels) + sum(self.times.work(task.way.option) * task.done for task in self._tasks)
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
        return 1.0 / self.times.per_s

    def _add_late(self, ends: Sequence[MoveTask], objective: str) -> float:
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
        return 1.0 / self.times.per_s / self.cell.parts
