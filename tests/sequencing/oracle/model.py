"""The best plan of a cell by a plain time-based constraint model: which transfer, when, where and who are all decided at once.

Robots and parts may wait on purpose wherever they are, also a robot with a part in its gripper: the pick and the drop of a
transfer have times of their own. Nothing is interrupted. A part stays where it is, and takes its room, until it is picked.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Literal, NamedTuple

from ortools.sat.python import cp_model

from oracle.cell import Carried, Cell, Objective, Plan, Worked, ticks_per_s
from oracle.ways import Room, Step, Way, stretches, ways_of

FINER = 100  # ticks of the model in one of the cell, where two that swap places need an instant between them
Time = cp_model.IntVar


@dataclass(frozen=True)
class Best:
    """What is best: "optimal", the value is the least there is; "feasible", it is between bound and value; "impossible", there
    is no plan; "unknown". `within`: how far a value may be off by the model's instants."""

    status: Literal["optimal", "feasible", "impossible", "unknown"]
    value: float
    bound: float
    plan: Plan | None
    wall_s: float
    within: float = 0.0


class _Node(NamedTuple):
    """A step that somebody does, of a part on a way, and when; `there`: whether the part takes that way."""

    part: int
    way: int
    number: int
    step: Step
    there: cp_model.IntVar
    begin: Time
    end: Time


def best(
    cell: Cell,
    objective: Objective = "makespan",
    seconds: float = 60.0,
    seed: int = 0,
    workers: int = 1,
    may_hold: bool = True,
) -> Best:
    """The best plan, with its proof where the time suffices. ValueError where times have no common unit.

    may_hold: whether a robot may wait with a part in its gripper; without, how much that is worth can be told.
    """
    model = _Model(cell, objective)
    if not may_hold:
        model.never_hold()
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = seconds
    solver.parameters.random_seed = seed
    solver.parameters.num_workers = workers
    code = solver.solve(model.model)
    status = {cp_model.OPTIMAL: "optimal", cp_model.FEASIBLE: "feasible", cp_model.INFEASIBLE: "impossible"}.get(
        code, "unknown"
    )
    within = 0.0 if model.per_s == model.cells_per_s else len(model.nodes) / model.per_s
    if status in ("impossible", "unknown"):
        bound = solver.best_objective_bound * model.worth if status == "unknown" else float("inf")
        return Best(status, float("inf"), bound, None, solver.wall_time, within)  # type: ignore[arg-type]
    value, bound = solver.objective_value * model.worth, solver.best_objective_bound * model.worth
    return Best(status, value, bound, model.plan(solver), solver.wall_time, within)  # type: ignore[arg-type]


class _Model:
    """Variables and constraints; times in ticks, of which a second has per_s."""

    def __init__(self, cell: Cell, objective: Objective) -> None:
        self.cell, self.model = cell, cp_model.CpModel()
        self.cells_per_s = ticks_per_s(cell)
        self.ways = {name: ways_of(cell, name) for name in set(cell.order)}
        self._may_be_full = self._full_ones()
        shared = any(capacity > 1 for capacity in self._may_be_full.values()) or any(
            room.station in self._may_be_full and _passes(way, room)
            for ways in self.ways.values()
            for way in ways
            for room in way.rooms
        )
        self.per_s = self.cells_per_s * (FINER if shared and len(cell.robots) > 1 else 1)
        self.horizon = self._horizon()
        self.nodes = list[_Node]()
        self.finish, self.first = list[Time](), list[Time]()
        self._takes = list[list[cp_model.IntVar]]()
        self._after: dict[tuple[str, int, int], cp_model.IntVar] = {}  # by robot: a node straight after another one
        self._by: dict[tuple[int, str], cp_model.IntVar] = {}  # a node by a robot
        self._servers: dict[tuple[int, int], cp_model.IntVar] = {}
        self._leave: dict[int, Time] = {}
        self._out: dict[int, Time] = {}
        self.last: dict[str, Time] = {}
        for part in range(len(cell.order)):
            self._add_part(part)
        self._add_release()
        self._add_robots()
        self._add_rooms()
        self._add_servers()
        self._add_full()
        self._add_alike()
        self.worth = self._add_objective(objective)

    # ---- times

    def ticks(self, seconds: float) -> int:
        """A time in ticks."""
        return round(seconds * self.per_s)

    def _horizon(self) -> int:
        """A time by which all is done in some best plan: everything at its slowest, one after the other."""
        cell = self.cell
        speed = min([one.speed for one in cell.robots], default=1.0)
        empty = max([*cell.empty_s.values(), 0.0]) / speed
        setup = max([s for one in cell.stations for s in one.setup_s.values()] + [0.0])
        total = 0.0
        for name in cell.order:
            total += max(
                sum(
                    step.service_s + step.processing_s + empty
                    + (cell.loaded_s.get((step.origin, step.target), 0.0) / speed if step.kind == "carry" else setup)
                    for step in way.steps
                )
                for way in self.ways[name]
            )  # fmt: skip
        total += max([*(cell.release_s or ()), 0.0]) + sum(cell.interval_s or ())
        steps = sum(max(len(way.steps) for way in self.ways[name]) for name in cell.order)
        drives = sum(seconds for *_, seconds in cell.track) / speed * steps
        return self.ticks(total + drives) + 1000

    def _full_ones(self) -> dict[str, int]:
        """The stations that may be full, and how many parts they hold."""
        names = {room.station for ways in self.ways.values() for way in ways for room in way.rooms}
        found = dict[str, int]()
        for name in names:
            capacity = self.cell.station(name).capacity
            most = max(
                sum(
                    max(sum(room.station == name for room in way.rooms) for way in self.ways[part])
                    for part in self.cell.order
                ),
                1,
            )
            if capacity is not None and capacity < most:
                found[name] = capacity
        return found

    def _time(self, name: str) -> Time:
        return self.model.new_int_var(0, self.horizon, name)

    def _drive(self, table: str, robot: str, origin: str, target: str) -> int | None:
        """Ticks of a robot's way; None: there is none."""
        if origin == target:
            return 0
        times = self.cell.empty_s if table == "empty" else self.cell.loaded_s
        if (origin, target) not in times:
            return None
        speed = next(one.speed for one in self.cell.robots if one.name == robot)
        return self.ticks(times[origin, target] / speed)

    # ---- what happens to a part

    def _add_part(self, part: int) -> None:
        name = self.cell.order[part]
        ways = self.ways[name]
        taken = [self.model.new_bool_var(f"part {part + 1} way {n}") for n in range(len(ways))]
        self.model.add_exactly_one(taken)
        finish, first = self._time(f"finish {part + 1}"), self._time(f"first {part + 1}")
        for number, (way, there) in enumerate(zip(ways, taken, strict=True)):
            own = [
                _Node(
                    part,
                    number,
                    n,
                    step,
                    there,
                    self._time(f"b{part}.{number}.{n}"),
                    self._time(f"e{part}.{number}.{n}"),
                )
                for n, step in enumerate(way.steps)
            ]
            for n, node in enumerate(own):
                self._add_step(node, own, n)
            self.model.add(finish == own[-1].end).only_enforce_if(there)
            self.model.add(first == own[0].begin).only_enforce_if(there)
            self.nodes += own
        self.finish.append(finish)
        self.first.append(first)
        self._takes.append(taken)

    def _add_step(self, node: _Node, own: list[_Node], n: int) -> None:
        step, there = node.step, node.there
        if n:
            self.model.add(node.begin >= own[n - 1].end).only_enforce_if(there)
        if step.kind == "work":
            self.model.add(node.end == node.begin + self.ticks(step.processing_s)).only_enforce_if(there)
        if step.ready is not None and step.ready >= 0:
            before = own[step.ready]
            done = before.end + (self.ticks(before.step.processing_s) if before.step.kind == "carry" else 0)
            self.model.add(node.begin >= done + self.ticks(step.service_s)).only_enforce_if(there)
            if step.at_most_s is not None:
                self.model.add(node.begin <= done + self.ticks(step.at_most_s)).only_enforce_if(there)

    def _add_release(self) -> None:
        """When parts are there at first; those that come are taken in their order."""
        cell, came = self.cell, 0
        for part, first in enumerate(self.first):
            if cell.release_s is not None:
                self.model.add(first >= self.ticks(cell.release_s[part]))
            if cell.interval_s is not None:
                came += self.ticks(cell.interval_s[part])
                if cell.after == "clock" or part == 0:
                    self.model.add(first >= came)
                else:
                    self.model.add(first >= self.first[part - 1] + self.ticks(cell.interval_s[part]))
                if part:
                    self.model.add(first >= self.first[part - 1])

    # ---- who carries

    def _add_robots(self) -> None:
        carries = [n for n, node in enumerate(self.nodes) if node.step.kind == "carry"]
        able = dict[int, list[str]]()
        for n in carries:
            step = self.nodes[n].step
            able[n] = [
                robot.name
                for robot in self.cell.robots
                if (robot.serves is None or {step.origin, step.target} <= robot.serves)
                and self._drive("loaded", robot.name, step.origin, step.target) is not None
            ]
            for name in able[n]:
                self._by[n, name] = self.model.new_bool_var(f"{n} by {name}")
            self.model.add(sum(self._by[n, name] for name in able[n]) == 1).only_enforce_if(self.nodes[n].there)
            self.model.add(sum(self._by[n, name] for name in able[n]) == 0).only_enforce_if(
                self.nodes[n].there.negated()
            )
            self._out[n] = self._time(f"out {n}")
            self._leave[n] = self._time(f"leave {n}")
            self.model.add(self._out[n] >= self.nodes[n].begin)
        spans: dict[int, list[cp_model.IntervalVar]] = {}
        for robot in self.cell.robots:
            own = [n for n in carries if robot.name in able[n]]
            self._add_tour(robot.name, robot.start, own, spans)
        for held in spans.values():
            self.model.add_no_overlap(held)

    def _add_tour(self, robot: str, start: str, own: list[int], spans: dict[int, list[cp_model.IntervalVar]]) -> None:
        """One after the other: a robot's transfers and its empty ways between them."""
        idle = self.model.new_bool_var(f"{robot} idle")
        arcs: list[tuple[int, int, cp_model.LiteralT]] = [(0, 0, idle)]
        last = self.last[robot] = self._time(f"last of {robot}")
        for place, n in enumerate(own, 1):
            node, by = self.nodes[n], self._by[n, robot]
            arcs.append((place, place, by.negated()))
            carry = self._drive("loaded", robot, node.step.origin, node.step.target)
            assert carry is not None
            self.model.add(node.end >= self._out[n] + carry).only_enforce_if(by)
            self._hold(robot, node.step.origin, node.step.target, self._out[n], by, spans)
            begins = self._arc(robot, -1, n, start, spans)
            if begins is not None:
                arcs.append((0, place, begins))
            ends = self.model.new_bool_var("")
            arcs.append((place, 0, ends))
            self.model.add(last >= node.end).only_enforce_if(ends)
            for other_place, m in enumerate(own, 1):
                if m == n or not self._may_follow(self.nodes[m], node):
                    continue
                follows = self._arc(robot, m, n, self.nodes[m].step.target, spans)
                if follows is not None:
                    arcs.append((other_place, place, follows))
        self.model.add_circuit(arcs)

    def _may_follow(self, before: _Node, node: _Node) -> bool:
        if before.part == node.part:
            return before.way == node.way and before.number < node.number
        # With an empty gripper only: what it has just put down needs room that this one would have to leave first.
        same = before.step.target == node.step.origin
        room = self.cell.station(node.step.origin).capacity
        return not (same and room == 1 and self._takes_room(before, True) and self._takes_room(node, False))

    def _takes_room(self, node: _Node, at_target: bool) -> bool:
        rooms = self._way(node).rooms
        if at_target:
            return any(one.since == node.number for one in rooms)
        return any(one.until == node.number and not one.at_end for one in rooms)

    def _arc(
        self, robot: str, before: int, n: int, where: str, spans: dict[int, list[cp_model.IntervalVar]]
    ) -> cp_model.IntVar | None:
        """A robot's empty way to where a step begins, straight after another one (-1: none), and the service there."""
        node = self.nodes[n]
        drive = self._drive("empty", robot, where, node.step.origin)
        if drive is None:
            return None
        arc = self._after[robot, before, n] = self.model.new_bool_var(f"{robot}: {before} then {n}")
        free = 0 if before < 0 else self.nodes[before].end
        self.model.add(self._leave[n] >= free).only_enforce_if(arc)
        there = self._leave[n] + drive + self.ticks(node.step.service_s)
        self.model.add(node.begin >= there).only_enforce_if(arc)
        self._hold(robot, where, node.step.origin, self._leave[n], arc, spans)
        return arc

    def never_hold(self) -> None:
        """Whatever is picked is put down as soon as its way is driven."""
        for (n, robot), by in self._by.items():
            node = self.nodes[n]
            carry = self._drive("loaded", robot, node.step.origin, node.step.target) or 0
            self.model.add(self._out[n] == node.begin).only_enforce_if(by)
            self.model.add(node.end == node.begin + carry).only_enforce_if(by)

    def _hold(
        self, robot: str, origin: str, target: str, leave: Time, there: cp_model.IntVar,
        spans: dict[int, list[cp_model.IntervalVar]],
    ) -> None:  # fmt: skip
        """The stretches of the track that a robot is on, one after the other."""
        if not self.cell.track or origin == target:
            return
        speed = next(one.speed for one in self.cell.robots if one.name == robot)
        for number, from_s, until_s in stretches(self.cell, origin, target):
            a, b = self.ticks(from_s / speed), self.ticks(until_s / speed)
            begin = self.model.new_int_var(0, 2 * self.horizon, "")
            self.model.add(begin == leave + a)
            spans.setdefault(number, []).append(
                self.model.new_optional_fixed_size_interval_var(begin, b - a, there, "")
            )

    # ---- rooms and servers

    def _add_rooms(self) -> None:
        """A part takes room from when it is put down until it is picked; no station holds more than it can."""
        held = dict[str, list[cp_model.IntervalVar]]()
        for own in self._paths():
            way = self._way(own[0][1])
            for room in way.rooms:
                since, (number, until) = own[room.since][1], own[room.until]
                end: cp_model.LinearExprT = until.end if room.at_end else until.begin
                capacity = self._may_be_full.get(room.station)
                if capacity is None:
                    continue
                if not room.at_end and (capacity > 1 or _passes(way, room)):
                    instant = 1 if _passes(way, room) else 0
                    swaps = self._swaps(number) if capacity > 1 else []
                    end = cp_model.LinearExpr.sum([until.begin, *swaps]) + instant
                stop = self.model.new_int_var(0, self.horizon + 2, "")
                self.model.add(stop == end).only_enforce_if(since.there)
                size = self.model.new_int_var(0, self.horizon + 2, "")
                held.setdefault(room.station, []).append(
                    self.model.new_optional_interval_var(since.end, size, stop, since.there, "")
                )
        for name, spans in held.items():
            self.model.add_cumulative(spans, [1] * len(spans), self._may_be_full[name])

    def _swaps(self, n: int) -> list[cp_model.IntVar]:
        """One of these holds where the robot that picks has just put another part down there: for an instant both are there."""
        node = self.nodes[n]
        return [
            arc
            for (_, before, after), arc in self._after.items()
            if after == n and before >= 0 and self.nodes[before].step.target == node.step.origin
        ]

    def _paths(self) -> list[list[tuple[int, _Node]]]:
        """The steps of each way of each part, with their numbers."""
        found = dict[tuple[int, int], list[tuple[int, _Node]]]()
        for n, node in enumerate(self.nodes):
            found.setdefault((node.part, node.way), []).append((n, node))
        return list(found.values())

    def _way(self, node: _Node) -> Way:
        return self.ways[self.cell.order[node.part]][node.way]

    def _add_servers(self) -> None:
        works = dict[str, list[int]]()
        for n, node in enumerate(self.nodes):
            if node.step.kind == "work":
                works.setdefault(node.step.target, []).append(n)
        for name, own in works.items():
            station = self.cell.station(name)
            assert station.servers is not None
            if not station.setup_s:
                spans = [
                    self.model.new_optional_interval_var(
                        self.nodes[n].begin, self.ticks(self.nodes[n].step.processing_s), self.nodes[n].end,
                        self.nodes[n].there, "",
                    )
                    for n in own
                ]  # fmt: skip
                self.model.add_cumulative(spans, [1] * len(spans), station.servers)
                continue
            at = {(n, k): self.model.new_bool_var("") for n in own for k in range(station.servers)}
            for n in own:
                self.model.add(sum(at[n, k] for k in range(station.servers)) == self.nodes[n].there)
            for k in range(station.servers):
                arcs: list[tuple[int, int, cp_model.LiteralT]] = [(0, 0, self.model.new_bool_var(""))]
                for place, n in enumerate(own, 1):
                    arcs += [(place, place, at[n, k].negated())]
                    arcs += [(0, place, self.model.new_bool_var("")), (place, 0, self.model.new_bool_var(""))]
                    for other_place, m in enumerate(own, 1):
                        if m == n:
                            continue
                        arc = self.model.new_bool_var("")
                        pair = self.cell.order[self.nodes[m].part], self.cell.order[self.nodes[n].part]
                        setup = self.ticks(station.setup_s.get(pair, 0.0))
                        self.model.add(self.nodes[n].begin >= self.nodes[m].end + setup).only_enforce_if(arc)
                        arcs.append((other_place, place, arc))
                self.model.add_circuit(arcs)

    def _add_full(self) -> None:
        """A buffer is used only while the station behind it is full: of others, or of those that are on their way there."""
        paths = self._paths()
        for own in paths:
            for _, node in own:
                name = node.step.only_full
                if name is None:
                    continue
                room = self.cell.station(name).capacity
                if room is None:
                    self.model.add(node.there == 0)
                    continue
                there = list[cp_model.IntVar]()
                for other in paths:
                    if other[0][1].part == node.part:
                        continue
                    for held in self._way(other[0][1]).rooms:
                        if held.station != name:
                            continue
                        inside = self.model.new_bool_var("")
                        until = other[held.until][1]
                        self.model.add_implication(inside, until.there)
                        self.model.add(other[held.since][1].begin <= node.begin).only_enforce_if(inside)
                        self.model.add((until.end if held.at_end else until.begin) >= node.begin).only_enforce_if(
                            inside
                        )
                        there.append(inside)
                self.model.add(sum(there) >= room).only_enforce_if(node.there)

    def _add_alike(self) -> None:
        """Parts that differ in nothing but their number begin in the order of their numbers."""
        cell = self.cell
        for one, other in combinations(range(len(cell.order)), 2):
            given = [values for values in (cell.due_s, cell.release_s) if values is not None]
            alike = cell.order[one] == cell.order[other] and all(values[one] == values[other] for values in given)
            if alike and cell.interval_s is None:
                self.model.add(self.first[one] <= self.first[other])

    # ---- what is best

    def _add_objective(self, objective: Objective) -> float:
        """Adds the objective; how much a unit of the model's is worth."""
        cell, parts = self.cell, len(self.cell.order)
        makespan = self._time("makespan")
        self.model.add_max_equality(makespan, self.finish)
        due = [self.ticks(seconds) for seconds in cell.due_s or (0.0,) * parts]
        if objective == "makespan":
            self.model.minimize(makespan)
            return 1.0 / self.per_s
        if objective == "mean-tardiness":
            late = [self._time(f"late {n}") for n in range(parts)]
            for n in range(parts):
                self.model.add(late[n] >= self.finish[n] - due[n])
            self.model.minimize(sum(late))
            return 1.0 / self.per_s / parts
        if objective == "tardy-parts":
            tardy = [self.model.new_bool_var(f"tardy {n}") for n in range(parts)]
            for n in range(parts):
                self.model.add(self.finish[n] <= due[n]).only_enforce_if(tardy[n].negated())
            self.model.minimize(sum(tardy))
            return 1.0
        if objective == "robot-idle":
            busy = list[cp_model.LinearExprT]()
            for (robot, before, n), arc in self._after.items():
                step, start = self.nodes[n].step, next(one.start for one in cell.robots if one.name == robot)
                where = start if before < 0 else self.nodes[before].step.target
                drive = self._drive("empty", robot, where, step.origin) or 0
                carry = self._drive("loaded", robot, step.origin, step.target) or 0
                busy.append(arc * (drive + carry + self.ticks(step.service_s)))
            self.model.minimize(cp_model.LinearExpr.sum([*self.last.values()]) - cp_model.LinearExpr.sum(busy))
            return 1.0 / self.per_s
        work = list[cp_model.LinearExprT]()
        for part, taken in enumerate(self._takes):
            for way, there in zip(self.ways[cell.order[part]], taken, strict=True):
                work.append(there * sum(self.ticks(step.processing_s) for step in way.steps))
        self.model.minimize(places(cell) * makespan - cp_model.LinearExpr.sum(work))
        return 1.0 / self.per_s

    def plan(self, solver: cp_model.CpSolver) -> Plan:
        """The plan that was found."""
        carried, worked = list[Carried](), list[Worked]()
        for n, node in enumerate(self.nodes):
            if not solver.value(node.there):
                continue
            begin_s, end_s = solver.value(node.begin) / self.per_s, solver.value(node.end) / self.per_s
            step = node.step
            if step.kind == "work":
                worked.append(Worked(node.part + 1, step.target, begin_s, end_s))
                continue
            robot = next(name for (m, name), by in self._by.items() if m == n and solver.value(by))
            leave_s, out_s = solver.value(self._leave[n]) / self.per_s, solver.value(self._out[n]) / self.per_s
            carried.append(
                Carried(
                    node.part + 1, robot, step.origin, step.target, leave_s, begin_s, out_s, end_s, step.service_s,
                    "pallet" if step.pallet else "part",
                )
            )  # fmt: skip
        return Plan(
            tuple(sorted(carried, key=lambda one: one.pick_s)), tuple(sorted(worked, key=lambda one: one.begin_s))
        )


def _passes(way: Way, room: Room) -> bool:
    """Whether a part may be put down and picked in one instant: even then there has to be room."""
    work = [step.processing_s for step in way.steps[room.since : room.until]]
    return not room.at_end and sum(work) == 0


def places(cell: Cell) -> int:
    """How many parts the machines of all routes can work on at once."""
    used = {step.target for name in cell.routes for way in ways_of(cell, name) for step in way.steps}
    machines = [cell.station(name) for name in used if cell.station(name).machine]
    return sum(one.servers or one.capacity or 10**6 for one in machines)
