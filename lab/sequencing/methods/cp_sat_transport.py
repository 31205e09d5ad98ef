"""A cell with several robots, or machines with servers, as a constraint model: a tour for each team, a chain for each server.

It shares only the cell's positions with the simulation. For cells of one robot the model `cp_sat_model` proves more.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from graphlib import CycleError, TopologicalSorter
from heapq import heappop, heappush
from itertools import pairwise
from math import inf
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES, cost, machine_places
from lab.sequencing.cell.routes import SERVER, choice_of, entry, part_of
from lab.sequencing.methods.cp_sat_solver import Solution, cp_model
from lab.sequencing.methods.cp_sat_tasks import Follows, PartTask, Tasks, Team, Track, add_chains, add_rooms
from lab.sequencing.methods.cp_sat_times import Times
from lab.sequencing.simulate.follow import follow, spoils, steps
from lab.sequencing.simulate.run import Run, Windowless

Arcs = dict[tuple[int, int], cp_model.IntVar]


class Tours(NamedTuple):
    """The tours of a team. arcs: literals from task to task, numbered from 1; 0 is the begin and the end of every tour.

    firsts: literals by start station (index) and first task; empty where all robots of the team start at one station.
    """

    team: Team
    tasks: list[PartTask]
    arcs: Arcs
    firsts: Arcs


class TransportModel:
    """The variables and constraints. worth, blur: as in `cp_sat_model.Model`.

    below: only makespans shorter than the hint's are searched. free: a small relaxed model, for a bound and an order to begin
    with, in which robots are always at hand, stations are never full, and setups take no time. The model admits more plans than
    a `Run` does: any place or server of a station may be taken, and robots and servers may wait and hold parts as long as they
    like, while a `Run` takes the place or server that is free first. So the solver proves a bound, and an optimum where a run
    reaches it.
    """

    def __init__(
        self, cell: Cell, objective: str, hint: Sequence[int], below: bool = False, free: bool = False
    ) -> None:
        self._objective = objective
        self.cell, self.model, self.times, self._free = cell, cp_model.CpModel(), Times(cell, shortest=0), free
        known = _known(cell, self.times, hint) if hint else {}
        rounding = 2 * cell.possible_moves if self.times.rounded_s else 0
        horizon = self.times.whole(cell.longest_s) + cell.possible_moves
        if objective == MAKESPAN and known:
            horizon = max(drop for _, drop in known.values()) + (-1 if below else rounding)
        self.tasks = Tasks(cell, self.model, self.times, horizon)
        self._end = self.tasks.moment("makespan")
        self._tours: list[Tours] = []
        self._idle: list[cp_model.LinearExprT] = []
        self._track = Track(self.tasks) if cell.track and not free else None
        for team in self.tasks.teams:
            self._add_team(team, objective)
        for station in range(len(cell.stations)):
            self._add_servers(station)
        if not free:
            add_rooms(self.tasks)
        if self._track is not None:
            for task in self.tasks.all:
                if task.option.robot != SERVER:
                    ends = task.option.origin, task.option.target
                    self._track.drive_between(task.option.robot, ends, task.left, task.end, task.done)
            self._track.close()
        self._add_order(objective)
        for task in self.tasks.all:
            rest = self.tasks.least.tail[task.option.to]
            self.model.add(self._end >= task.end + rest).only_enforce_if(task.done)
        self.worth = self._add_objective(objective)
        each = {"machine-idle": machine_places(cell), "mean-tardiness": cell.parts, "tardy-parts": 0}.get(objective, 1)
        self.blur = each * rounding
        self._suggest(known)

    def sequence(self, solver: Solution) -> tuple[int, ...]:
        """The decisions of the solution in the order of their begins, each after all that it depends on; empty: no order works.

        On a track, whose stretches a `Run` gives out in the order of decisions, the order of their ends is tried as well; where
        several robots make room for each other, so is the order of their picks. The cheapest order is returned. A decision that
        is not allowed yet, because a robot holds a part longer than it must, is taken as soon as it is allowed.
        """
        value, tasks = solver.value, self.tasks
        orders = [self._in_order(solver, tasks.frees, lambda task: (value(task.begin), value(task.end)))]
        if self.cell.track:
            orders.append(self._in_order(solver, tasks.frees, lambda task: (value(task.end), value(task.begin))))
        if any(self.cell.takers):
            orders += [self._in_order(solver, more, self._picked(solver)) for more in (tasks.brings, ())]
        runs = [self._carried_out(sequence) for sequence in dict.fromkeys(orders)]
        return min(runs, key=lambda run: run[1])[0]

    @staticmethod
    def _picked(solver: Solution) -> Callable[[PartTask], tuple[int, int]]:
        """The sort key of a task by when its part leaves its place."""
        value = solver.value
        return lambda task: (value(task.begin if task.option.robot == SERVER else task.left), value(task.end))

    def _carried_out(self, order: tuple[int, ...]) -> tuple[tuple[int, ...], float]:
        """The decisions, reordered so that each is allowed, and their cost; () and inf when they end in a deadlock."""
        run, left, decisions = Windowless(self.cell), list(order), list[int]()
        while left:
            tried = set[int]()
            for n, decision in enumerate(left):
                part = part_of(decision, self.cell.parts)
                if part not in tried and run.option(decision) is not None:
                    run.move(decision)
                    decisions.append(left.pop(n))
                    break
                tried.add(part)
            else:
                return (), inf
        if not run.done or spoils(self.cell, decisions):
            return (), inf
        return tuple(decisions), cost(follow(self.cell, decisions) if self.cell.has_windows else run, self._objective)

    def _in_order(
        self, solver: Solution, more: Sequence[Follows], when: Callable[[PartTask], tuple[int, int]]
    ) -> tuple[int, ...]:
        """The decisions sorted by `when` within the precedences `follows` and `more`; empty: these contain a cycle."""
        number = {task: n for n, task in enumerate(self.tasks.all) if solver.boolean_value(task.done)}
        robot = dict[PartTask, int]()
        for team, tasks, arcs, firsts in self._tours:
            free = list(team.robots)
            for tour in _routes(solver, arcs):
                starts = [at for (at, node), first in firsts.items() if node == tour[0] and solver.boolean_value(first)]
                own = next(one for one in free if not starts or self._start(one) == starts[0])
                free.remove(own)
                robot |= {tasks[node - 1]: own for node in tour}
        order = TopologicalSorter[PartTask](dict.fromkeys(number, ()))
        for before, task, literals in (*self.tasks.follows, *more):
            if all(solver.boolean_value(literal) for literal in literals):
                order.add(task, before)
        try:
            order.prepare()
        except CycleError:
            return ()
        ready, ordered = list[tuple[int, int, int, PartTask]](), list[int]()
        while order.is_active():
            for task in order.get_ready():
                heappush(ready, (*when(task), number[task], task))
            task = heappop(ready)[-1]
            option = next(way for way in task.options if way.robot == robot.get(task, SERVER))
            ordered.append(entry(task.part + 1, option.choice, self.cell.parts))
            order.done(task)
        return tuple(ordered)

    def moves(self, solver: Solution) -> list[tuple[int, int, int]]:
        """The tasks of the solution by time, each as part (from 0), position and next position."""
        done = [task for task in self.tasks.all if solver.boolean_value(task.done)]
        done.sort(key=lambda task: (solver.value(task.begin), solver.value(task.end), task.part))
        return [(task.part, task.place, task.option.to) for task in done]

    def _suggest(self, known: dict[tuple[int, int, int], tuple[int, int]]) -> None:
        """Give the solver a sequence to begin with."""
        hints, last = dict[int, tuple[cp_model.IntVar, int]](), dict[int, PartTask]()
        follows, begins = set[tuple[PartTask | None, PartTask | None]](), set[tuple[int, PartTask]]()
        for rank, ((part, place, choice), (begin, _)) in enumerate(known.items()):
            for task in self.tasks.all:
                if (task.part, task.place) != (part, place):
                    continue
                robot = next((way.robot for way in task.options if way.choice == choice), None)
                hints[task.done.index] = task.done, robot is not None
                if robot is None:
                    continue
                hints[task.begin.index] = task.begin, begin
                for number in (task.rank, task.put):
                    if number is not None:
                        hints[number.index] = number, 2 * rank
                if robot != SERVER:
                    follows.add((last.get(robot), task))
                    begins |= {(self._start(robot), task)} if robot not in last else set()
                    last[robot] = task
        follows |= {(task, None) for task in last.values()}
        for _, tasks, arcs, firsts in self._tours:
            nodes = [None, *tasks]
            for (left, then), arc in arcs.items():
                hints[arc.index] = arc, (nodes[left], nodes[then]) in follows
            for (at, node), first in firsts.items():
                hints[first.index] = first, (at, tasks[node - 1]) in begins
        for variable, value in hints.values():
            self.model.add_hint(variable, value)

    def _add_team(self, team: Team, objective: str) -> None:
        """Adds the tours of a team of identical robots: at most one for each robot, through all tasks of the team."""
        tasks = [task for task in self.tasks.all if task.option.robot in team.robots]
        least, robots, alone = self.tasks.least, len(team.robots), len(self.cell.robots) == 1
        starts = Counter(self._start(robot) for robot in team.robots)
        arcs, firsts, spent = Arcs(), Arcs(), [least.takes(task.option) * task.done for task in tasks]
        travels, rests = list(spent), list[cp_model.LinearExpr]()
        for number, task in enumerate(() if self._free else tasks, 1):
            place, option = task.place, task.option
            before = least.by_servers(self.cell.begin_at[task.part])
            if not alone or place in before:
                gaps = {at: self.times.travel(at, option.origin, team.robots[0]) for at in starts}
                head = (least.between(self.cell.begin_at[task.part], place) or 0) if self.cell.begins is None else 0
                begun = firsts if len(starts) > 1 else arcs
                for at, gap in gaps.items():
                    arc = self._arc(begun, at if len(starts) > 1 else 0, number, None, task, gap)
                    if self._track is not None:
                        self._track.drive_between(team.robots[0], (at, option.origin), 0, task.begin, arc)
                    spent.append(max(gap, head) * arc)
                    travels.append(gap * arc)
                if len(starts) > 1:
                    arcs[0, number] = self.model.new_bool_var("first")
                    self.model.add(sum(firsts[at, number] for at in starts) == arcs[0, number])
            reached = least.by_servers(option.to)
            if not alone or any(not self.cell.positions[to].options for to in reached):
                arc = arcs[number, 0] = self.model.new_bool_var("last")
                rests.append(least.tail[option.to] * arc)
            for other, then in enumerate(tasks, 1):
                between = self._gap(task, then, alone) if other != number else None
                if between is not None:
                    travel = self.times.travel(option.target, then.option.origin, team.robots[0])
                    arc = self._arc(arcs, number, other, task, then, travel)
                    if self._track is not None:
                        way = option.target, then.option.origin
                        self._track.drive_between(team.robots[0], way, task.end, then.begin, arc)
                    spent.append(max(between, travel) * arc)
                    travels.append(travel * arc)
        if not self._free:
            self._chain(tasks, arcs, robots)
        for at, count in starts.items() if firsts else ():
            self.model.add(sum(first for (start, _), first in firsts.items() if start == at) <= count)
        self._tours.append(Tours(team, tasks, arcs, firsts))
        self.model.add(robots * self._end >= sum(spent) + sum(rests))
        if len(tasks) > robots:
            spans = [self._span(task) for task in tasks]
            self.model.add_cumulative(spans, [1] * len(spans), robots)
        if objective == "robot-idle":
            ends = self._last(tasks, arcs)
            self.model.add(sum(ends) >= sum(spent))
            self._idle += [*ends, -sum(travels)]

    def _start(self, robot: int) -> int:
        return self.cell.index(self.cell.robots[robot].start)

    def _gap(self, task: PartTask, then: PartTask, alone: bool) -> int | None:
        """The least time between two tasks of a robot that the part itself requires; None: they cannot follow each other."""
        if task.part != then.part:
            return 0
        least, to = self.tasks.least, task.option.to
        gap = least.between(to, then.place)
        if gap is None or (alone and then.place not in least.by_servers(to)):
            return None
        return gap + (least.stay[then.place] if then.option.waits else 0)

    def _last(self, tasks: Sequence[PartTask], arcs: Arcs) -> list[cp_model.LinearExprT]:
        """When each robot has done all its tasks: the end of its last one, 0 where it has none."""
        ends = list[cp_model.LinearExprT]()
        for number, task in enumerate(tasks, 1):
            if (number, 0) in arcs:
                end = self.tasks.moment("last")
                self.model.add(end >= task.end).only_enforce_if(arcs[number, 0])
                ends.append(end)
        return ends

    def _arc(
        self, arcs: Arcs, left: int, then: int, before: PartTask | None, task: PartTask, gap: int
    ) -> cp_model.IntVar:
        """The literal that a robot or server does one task right after another, or as its first, at least `gap` later."""
        done = arcs[left, then] = self.model.new_bool_var("follows")
        free = gap if before is None else before.end + gap
        self.model.add(task.begin >= free).only_enforce_if(done)
        if before is not None:
            self.tasks.after(task, before, done)
        return done

    def _chain(self, tasks: Sequence[PartTask], arcs: Arcs, chains: int) -> None:
        """Puts every task that is done into one of at most `chains` chains of these arcs."""
        nodes: list[tuple[int, int, cp_model.LiteralT]] = [(left, then, arc) for (left, then), arc in arcs.items()]
        nodes += [(number, number, ~task.done) for number, task in enumerate(tasks, 1)]
        add_chains(self.model, nodes, len(tasks), chains)

    def _span(self, task: PartTask) -> cp_model.IntervalVar:
        size = self.tasks.least.takes(task.option)
        return self.model.new_optional_interval_var(task.begin, size, task.begin + size, task.done, "works")

    def _add_servers(self, station: int) -> None:
        """A server works on one part after the other."""
        own = [t for t in self.tasks.all if t.option.robot == SERVER and t.option.target == station]
        servers, setups = self.cell.stations[station].servers or 1, self.cell.setups[station]
        if not own:
            return
        spans = [self._span(task) for task in own]
        if servers == 1:
            self.model.add_no_overlap(spans)
        elif len(own) > servers:
            self.model.add_cumulative(spans, [1] * len(spans), servers)
        if self._free or not (setups or self.tasks.ranked):
            return
        arcs = Arcs()
        for number, task in enumerate(own, 1):
            self._arc(arcs, 0, number, None, task, 0)
            arcs[number, 0] = self.model.new_bool_var("last")
            for other, then in enumerate(own, 1):
                if task.part != then.part or self.tasks.least.between(task.option.to, then.place) is not None:
                    change_s = setups.get((self.cell.order[task.part], self.cell.order[then.part]), 0.0)
                    self._arc(arcs, number, other, task, then, self.times.whole(change_s))
        self._chain(own, arcs, servers)

    def _add_order(self, objective: str) -> None:
        """Parts that arrive are taken in their order; of parts that are alike in all, the first in number goes first."""
        cell = self.cell
        first = {
            part - 1: [t for t in self.tasks.of(part - 1) if t.place == cell.begin_at[part - 1]]
            for part in cell.unfinished
        }
        coming = [part - 1 for part in cell.coming] if cell.arrivals is not None else []
        for part, then in pairwise(coming):
            for before in first[part]:
                for task in first[then]:
                    self.tasks.after(task, before, before.done, task.done, begun=True)
                    first_s = [t.begin if t.option.robot == SERVER else t.left for t in (before, task)]
                    self.model.add(first_s[1] >= first_s[0]).only_enforce_if(before.done, task.done)
        due_s = cell.due_s if cell.due_s and objective in WITH_DUE_TIMES else (0.0,) * cell.parts
        latest: dict[object, int] = {}
        for part, own in first.items():
            kind = cell.order[part], due_s[part], cell.begin_at[part], cell.begin_s[part]
            if part in coming:
                continue
            for before in first[latest[kind]] if kind in latest else ():
                for task in own:
                    self.model.add(task.begin >= before.begin).only_enforce_if(task.done, before.done)
            latest[kind] = part

    def _add_objective(self, objective: str) -> float:
        """Adds the objective to be minimised; returns the worth of its unit in the cell's unit."""
        if objective == MAKESPAN:
            self.model.minimize(self._end)
        elif objective == "robot-idle":
            self.model.minimize(sum(self._idle))
        elif objective == "machine-idle":
            processed = [self.times.processing(t.option.to) * t.done for t in self.tasks.all]
            self.model.minimize(machine_places(self.cell) * self._end - sum(processed))
        else:
            return self._add_late(objective)
        return 1.0 / self.times.per_s

    def _add_late(self, objective: str) -> float:
        due = [self.times.whole(due_s) for due_s in self.cell.due_s or ()]
        ends = [task for task in self.tasks.all if not self.cell.positions[task.option.to].options]
        if objective == "tardy-parts":
            late = [self.model.new_bool_var("late") for _ in due]
            for task in ends:
                self.model.add(task.end <= due[task.part]).only_enforce_if(task.done, ~late[task.part])
            self.model.minimize(sum(late))
            return 1.0
        lateness = [self.tasks.moment("late") for _ in due]
        for task in ends:
            self.model.add(lateness[task.part] >= task.end - due[task.part]).only_enforce_if(task.done)
        self.model.minimize(sum(lateness))
        return 1.0 / self.times.per_s / self.cell.parts


def _routes(solver: Solution, arcs: Arcs) -> list[list[int]]:
    """The nodes of each tour without node 0."""
    taken = [pair for pair, arc in arcs.items() if solver.boolean_value(arc)]
    after, routes = {left: then for left, then in taken if left}, list[list[int]]()
    for _, node in (pair for pair in taken if not pair[0]):
        tour = [node]
        while after[tour[-1]]:
            tour.append(after[tour[-1]])
        routes.append(tour)
    return routes


def _known(cell: Cell, times: Times, sequence: Sequence[int]) -> dict[tuple[int, int, int], tuple[int, int]]:
    """When each task of a sequence begins and ends, by part, place and choice, in units."""
    run, done = Run(cell), list[tuple[int, int, int]]()
    for run, decision, wait in steps(cell, sequence):
        part = part_of(decision, cell.parts) - 1
        place = run.locations[part]
        run.move(decision, wait)
        done.append((part, place, choice_of(decision, cell.parts)))
    return {
        key: (times.whole(move.pick_s - (0.0 if move.served else move.service_s)), times.whole(move.end_s))
        for key, move in zip(done, run.moves, strict=True)
    }
