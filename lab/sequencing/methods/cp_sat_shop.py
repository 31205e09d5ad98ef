"""A constraint model of job shops: an operation has one begin, whichever machine it takes, and robots go from trip to trip.

It fits cells whose machines have servers, unlimited room, and no setups, time windows or precedences: job shops and flexible job
shops, without robots or with identical ones. Where parts may choose between machines it is much smaller than the model of
`cp_sat_transport`, whose tasks are pairs of a place and the next one.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import product
from types import MappingProxyType
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.objectives import MAKESPAN, WITH_DUE_TIMES, cost
from lab.sequencing.cell.routes import SERVER, Option, entry
from lab.sequencing.methods.cp_sat_solver import Solution, cp_model
from lab.sequencing.methods.cp_sat_tasks import add_chains, teams_of
from lab.sequencing.methods.cp_sat_times import Times
from lab.sequencing.simulate.follow import follow


class ShopStep(NamedTuple):
    """A part's step from one stop to the next: a robot's trip, if the machine is another one, and a server's work there.

    A stop is a position where a part begins, has been worked on, or is finished. trip: one option for each robot; empty: the part
    stays where it is. work: the server's option; None: the stop is the end of a route.
    """

    to: int
    trip: tuple[Option, ...]
    work: Option | None


class Shop(NamedTuple):
    """The steps that the parts of a cell may take. steps: by stop; layers: for each part, the sets of stops that it may reach
    after 0, 1, ... operations."""

    steps: Mapping[int, tuple[ShopStep, ...]]
    layers: tuple[tuple[tuple[int, ...], ...], ...]

    @property
    def flexible(self) -> bool:
        """Whether a part may take one of several machines."""
        return any(len(layer) > 1 for of_part in self.layers for layer in of_part)


def shop_of(cell: Cell, objective: str) -> Shop | None:
    """The cell as a shop; None: it has features that a shop has not, or the objective does not fit one."""
    alike = len(teams_of(cell)) <= 1 and len({robot.start for robot in cell.robots}) <= 1
    begun = cell.begin_at != cell.starts
    more = cell.rules or cell.has_windows or cell.track or cell.arrivals or begun or any(cell.setups)
    full = any(0 < room < cell.parts for room in _rooms(cell))
    if more or full or not alike or objective not in (MAKESPAN, *WITH_DUE_TIMES):
        return None
    steps, layers = dict[int, tuple[ShopStep, ...]](), list[tuple[tuple[int, ...], ...]]()
    for start in cell.begin_at:
        stations: list[tuple[int, ...]] = [(start,)]
        while any(cell.positions[stop].options for stop in stations[-1]):
            for stop in stations[-1]:
                if stop not in steps:
                    known = _steps(cell, stop)
                    if known is None:
                        return None
                    steps[stop] = known
            stations.append(tuple(sorted({step.to for stop in stations[-1] for step in steps[stop]})))
        stops = [stop for layer in stations for stop in layer]
        ends = [not cell.positions[stop].options for stop in stops]
        if len(set(stops)) < len(stops) or sum(ends) > len(stations[-1]):
            return None  # some routes are longer than others
        layers.append(tuple(stations))
    return Shop(steps, tuple(layers))


def _rooms(cell: Cell) -> list[int]:
    """The room at each station that parts take room at."""
    return [cell.capacities[station] for station in {s for place in cell.positions for s in place.holds}]


def _steps(cell: Cell, stop: int) -> tuple[ShopStep, ...] | None:
    """The steps from a stop; None: one of its options does not occur in a shop."""
    steps, trips = list[ShopStep](), defaultdict[tuple[int, int], list[Option]](list)
    for way in cell.positions[stop].options:
        if way.if_full is not None or way.carries == "pallet":
            return None
        if way.robot == SERVER:
            steps.append(ShopStep(way.to, (), way))
        else:
            trips[way.target, way.to].append(way)
    for (_, to), ways in trips.items():
        works = cell.positions[to].options
        if any(work.robot != SERVER for work in works) or (works and cell.positions[to].processing_s):
            return None
        steps += [ShopStep(work.to, tuple(ways), work) for work in works] or [ShopStep(to, tuple(ways), None)]
    return tuple(steps)


class _Operation(NamedTuple):
    """A part's operation from one layer to the next. takes: a literal by stop and step; at: a literal by the stop reached."""

    part: int
    takes: dict[tuple[int, ShopStep], cp_model.IntVar]
    at: dict[int, cp_model.IntVar]
    depart: cp_model.IntVar
    begin: cp_model.IntVar
    end: cp_model.IntVar

    def trips(self) -> dict[ShopStep, cp_model.IntVar]:
        """The literal of each step that needs a robot."""
        return {step: taken for (_, step), taken in self.takes.items() if step.trip}


class ShopModel:
    """The variables and constraints. worth, blur: as in `cp_sat_model.Model`. parameters: the solver parameters that were
    measured to be fastest for it."""

    parameters = MappingProxyType({"linearization_level": 0})

    def __init__(self, cell: Cell, shop: Shop, objective: str, hint: Sequence[int]) -> None:
        self.cell, self.model, self.times, self._shop = cell, cp_model.CpModel(), Times(cell, shortest=0), shop
        rounding = 2 * cell.possible_moves if self.times.rounded_s else 0
        known = cost(follow(cell, hint), MAKESPAN) if hint and objective == MAKESPAN else cell.longest_s
        self._horizon = self.times.whole(known) + (rounding or cell.possible_moves)
        self._servers = {step.to: step.work.target for steps in shop.steps.values() for step in steps if step.work}
        self._operations: list[_Operation] = []
        self._arcs: dict[tuple[int, int], cp_model.IntVar] = {}
        ends = [self._add_part(part) for part in range(cell.parts)]
        self._add_servers()
        self._end = self._moment()
        self.model.add_max_equality(self._end, ends)
        if cell.robots:
            self._add_robots()
        self.worth = self._add_objective(objective, ends)
        self.blur = {"mean-tardiness": cell.parts, "tardy-parts": 0}.get(objective, 1) * rounding

    def _moment(self) -> cp_model.IntVar:
        return self.model.new_int_var(0, self._horizon, "")

    def _add_part(self, part: int) -> cp_model.LinearExprT:
        """Adds the operations of a part, one after the other; returns when it is finished."""
        model, times = self.model, self.times
        layers, free = self._shop.layers[part], cp_model.LinearExpr.sum([times.whole(self.cell.begin_s[part])])
        at = {layers[0][0]: model.new_constant(1)}
        for layer in layers[1:]:
            before, at = at, {stop: model.new_bool_var("") for stop in layer}
            takes = {(stop, step): model.new_bool_var("") for stop in before for step in self._shop.steps[stop]}
            model.add_exactly_one(takes.values())
            model.add_exactly_one(at.values())
            operation = _Operation(part, takes, at, self._moment(), self._moment(), self._moment())
            model.add(operation.depart >= free)
            for (stop, step), taken in takes.items():
                model.add_implication(taken, before[stop])
                model.add_implication(taken, at[step.to])
                model.add(operation.begin >= operation.depart + self._carried(step)).only_enforce_if(taken)
            for stop, comes in at.items():
                model.add(operation.end == operation.begin + self._worked(stop)).only_enforce_if(comes)
            self._operations.append(operation)
            free = operation.end
        return free

    def _carried(self, step: ShopStep) -> int:
        return self.times.work(step.trip[0]) if step.trip else 0

    def _worked(self, stop: int) -> int:
        return self.times.processing(stop) if stop in self._servers else 0

    def _add_servers(self) -> None:
        """A server works on one part after the other."""
        spans = defaultdict[int, list[cp_model.IntervalVar]](list)
        for operation in self._operations:
            for stop, comes in operation.at.items():
                if stop in self._servers:
                    span = self.model.new_optional_interval_var(
                        operation.begin, self._worked(stop), operation.end, comes, ""
                    )
                    spans[self._servers[stop]].append(span)
        for station, own in spans.items():
            servers = self.cell.stations[station].servers or 1
            if servers == 1:
                self.model.add_no_overlap(own)
            elif len(own) > servers:
                self.model.add_cumulative(own, [1] * len(own), servers)

    def _add_robots(self) -> None:
        """Each robot goes from one trip to the next; those of one part are in their order."""
        model, times = self.model, self.times
        start, robots = self.cell.index(self.cell.robots[0].start), len(self.cell.robots)
        nodes, spent = list[tuple[int, int, cp_model.LiteralT]](), list[cp_model.LinearExprT]()
        moved = [operation.trips() for operation in self._operations]
        for number, (operation, trips) in enumerate(zip(self._operations, moved, strict=True), 1):
            stays = model.new_bool_var("")
            if not trips:
                nodes.append((number, number, stays))
                continue
            model.add_exactly_one([stays, *trips.values()])
            first, last = model.new_bool_var(""), model.new_bool_var("")
            nodes += [(number, number, stays), (0, number, first), (number, 0, last)]
            self._arcs[0, number], self._arcs[number, 0] = first, last
            ways = {step: times.travel(start, step.trip[0].origin) for step in trips}
            for step, taken in trips.items():
                model.add(operation.depart >= ways[step]).only_enforce_if(first, taken)
                spent.append(self._carried(step) * taken)
            spent.append(min(ways.values()) * first)
            for other, (then, more) in enumerate(zip(self._operations, moved, strict=True), 1):
                if other == number or not more or (then.part == operation.part and other < number):
                    continue
                follows = self._arcs[number, other] = model.new_bool_var("")
                nodes.append((number, other, follows))
                gaps = {
                    pair: times.travel(pair[0].trip[0].target, pair[1].trip[0].origin) for pair in product(trips, more)
                }
                least = min(gaps.values())
                for (step, after), gap in gaps.items():
                    begin = operation.depart + self._carried(step) + gap
                    model.add(then.depart >= begin).only_enforce_if(follows, trips[step], more[after])
                spent.append(least * follows)
        add_chains(model, nodes, len(self._operations), robots)
        model.add(robots * self._end >= sum(spent))

    def _add_objective(self, objective: str, ends: Sequence[cp_model.LinearExprT]) -> float:
        """Adds the objective to be minimised; returns the worth of its unit in the cell's unit."""
        due = [self.times.whole(due_s) for due_s in self.cell.due_s or ()]
        if objective == MAKESPAN:
            self.model.minimize(self._end)
        elif objective == "tardy-parts":
            late = [self.model.new_bool_var("") for _ in due]
            for is_late, end, until in zip(late, ends, due, strict=True):
                self.model.add(end <= until).only_enforce_if(~is_late)
            self.model.minimize(sum(late))
            return 1.0
        else:
            lateness = [self._moment() for _ in due]
            for late_by, end, until in zip(lateness, ends, due, strict=True):
                self.model.add(late_by >= end - until)
            self.model.minimize(sum(lateness))
            return 1.0 / self.times.per_s / self.cell.parts
        return 1.0 / self.times.per_s

    def sequence(self, solver: Solution) -> tuple[int, ...]:
        """The decisions of the solution by their begins; those of one part stay in their order."""
        robot, after = dict[int, int](), {a: b for (a, b), arc in self._arcs.items() if a and solver.boolean_value(arc)}
        firsts = [number for (a, number), arc in self._arcs.items() if not a and solver.boolean_value(arc)]
        for own, number in enumerate(firsts):
            while number:
                robot[number], number = own, after[number]
        queues = defaultdict[int, list[tuple[int, int, int]]](list)  # a part's decisions, the last one first
        for number, operation in enumerate(self._operations, 1):
            step = next(step for (_, step), takes in operation.takes.items() if solver.boolean_value(takes))
            taken = [option for option in step.trip if option.robot == robot[number]]
            begins = [(option, solver.value(operation.depart), self._carried(step)) for option in taken]
            if step.work is not None:
                begins.append((step.work, solver.value(operation.begin), self._worked(step.to)))
            for option, begin, long in begins:
                queues[operation.part].append(
                    (begin, begin + long, entry(operation.part + 1, option.choice, self.cell.parts))
                )
        decisions = list[int]()
        waiting = {part: queue[::-1] for part, queue in queues.items()}
        while waiting:
            part = min(waiting, key=lambda part: waiting[part][-1])
            decisions.append(waiting[part].pop()[-1])
            if not waiting[part]:
                del waiting[part]
        return tuple(decisions)
