"""The optional tasks of robots and servers in a constraint model, when each may begin, and the room that parts take."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import SERVER, Option, from_the_ends, reached_from
from lab.sequencing.methods.cp_sat_solver import cp_model
from lab.sequencing.methods.cp_sat_times import Times


class Team(NamedTuple):
    """Robots (by index) of equal speed that serve the same stations; they may start at different ones."""

    robots: tuple[int, ...]

    def able(self, option: Option) -> bool:
        """Whether the option is one of theirs."""
        return option.robot in self.robots


@dataclass(frozen=True, eq=False)
class PartTask:
    """A task with a part at a position: a robot of a team carries it on, or a server of a station works on it.

    options: one for each robot of the team. begin: when the service before the pick, or the server's work, begins. left: when the
    part leaves its place. end: when it is dropped, or its work is done. rank, put: the ranks of begin and end among all events;
    None: only times order them.
    """

    part: int
    place: int
    options: tuple[Option, ...]
    done: cp_model.IntVar
    begin: cp_model.IntVar
    left: cp_model.LinearExprT
    end: cp_model.LinearExprT
    rank: cp_model.IntVar | None
    put: cp_model.IntVar | None

    @property
    def option(self) -> Option:
        """The way of the team's first robot."""
        return self.options[0]


class LeastTimes:
    """Least times by position, in units.

    stay: from a part's arrival there until it may leave. head: from the start of its routes until it arrives. tail: from its
    arrival until it is finished.
    """

    def __init__(self, cell: Cell, times: Times) -> None:
        self._cell, self._times = cell, times
        served = {way.to for at in cell.positions for way in at.options if way.robot == SERVER}
        self.stay = [
            0 if place in served or not all(way.waits for way in at.options) else times.processing(place)
            for place, at in enumerate(cell.positions)
        ]
        self.tail = from_the_ends(cell.positions, self._tail)
        self._ahead = from_the_ends(cell.positions, self._from)

    def takes(self, option: Option) -> int:
        """The duration of an option: service and carrying, or the server's work."""
        return self._times.processing(option.to) if option.robot == SERVER else self._times.work(option)

    def between(self, place: int, later: int) -> int | None:
        """The least time from a part's arrival at a position to its arrival at a later one; None: it never gets there."""
        return self._ahead[place].get(later)

    def by_servers(self, place: int) -> set[int]:
        """The positions that a part may reach from a position without a robot, that position included."""
        places = [place]
        for at in places:
            places += [way.to for way in self._cell.positions[at].options if way.robot == SERVER]
        return set(places)

    def _tail(self, place: int, ahead: list[int]) -> int:
        ways = self._cell.positions[place].options
        least = min([self.takes(way) + then for way, then in zip(ways, ahead, strict=True)], default=0)
        return self.stay[place] + least

    def _from(self, place: int, ahead: list[dict[int, int]]) -> dict[int, int]:
        least = {place: 0}
        for way, then in zip(self._cell.positions[place].options, ahead, strict=True):
            for later, after in then.items():
                reached = self.stay[place] + self.takes(way) + after
                least[later] = min(least.get(later, reached), reached)
        return least


def teams_of(cell: Cell) -> list[Team]:
    """The cell's robots, grouped into teams of identical ones."""
    alike = defaultdict[object, list[int]](list)
    for number, robot in enumerate(cell.robots):
        alike[robot.speed, robot.serves].append(number)
    return [Team(tuple(robots)) for robots in alike.values()]


def possible_tasks(cell: Cell) -> int:
    """How many tasks all parts may have: `Cell.possible_moves`, those of alike robots counted once."""
    team = {robot: number for number, own in enumerate(teams_of(cell)) for robot in own.robots} | {SERVER: SERVER}
    tasks = [len({(team[way.robot], *_same(way)) for way in place.options}) for place in cell.positions]
    ahead = {at: reached_from(cell.positions, {at}) for at in set(cell.begin_at)}
    return sum(tasks[place] for at in cell.begin_at for place in ahead[at])


Follows = tuple[PartTask, PartTask, tuple[cp_model.LiteralT, ...]]


class Tasks:
    """The tasks of all parts: each part takes one path from its begin to an end, and each task begins when its part is ready.

    Parts are numbered from 0 here. ranked: whether the order of events must be known, not only their times. blocking: the
    stations that may be full. follows: precedences between tasks in the list of decisions, see `after`. frees: pairs of tasks of
    which the first frees room for the second; where another robot frees it, the list may have them in either order. brings: pairs
    of tasks that bring parts to the same room, one after the other. Each pair holds if all of its literals do.
    """

    def __init__(self, cell: Cell, model: cp_model.CpModel, times: Times, horizon: int) -> None:
        self.cell, self.model, self.times, self.horizon = cell, model, times, horizon
        self.least, self.teams = LeastTimes(cell, times), teams_of(cell)
        options = [way for at in cell.positions for way in at.options]
        self._ahead = {at: reached_from(cell.positions, {at}) for at in set(cell.begin_at)}
        self.blocking = [s for s in range(len(cell.stations)) if self._may_be_full(s)]
        self.ranked = bool(self.blocking) or cell.arrivals is not None or any(o.if_full is not None for o in options)
        self.all: list[PartTask] = []
        self.follows, self.frees, self.brings = list[Follows](), list[Follows](), list[Follows]()
        self._ready: dict[tuple[int, int], cp_model.LinearExprT] = {}
        self._certain: set[tuple[int, int]] = set()  # (part, place): wherever it may go, it comes there
        for part in cell.unfinished:
            self._add(part - 1)

    def of(self, part: int) -> list[PartTask]:
        """The tasks of one part."""
        return [task for task in self.all if task.part == part]

    def moment(self, name: str) -> cp_model.IntVar:
        """A time of the model."""
        return self.model.new_int_var(0, self.horizon, name)

    def after(self, task: PartTask, before: PartTask, *when: cp_model.LiteralT, begun: bool = False) -> None:
        """Puts a task after another one in the list of decisions, and its begin after the other's end, if all literals hold.

        begun: the task need only begin after the other's begin.
        """
        self.follows.append((before, task, when))
        passed = before.rank if begun else before.put
        if task.rank is not None and passed is not None:
            self.model.add(task.rank >= passed + 1).only_enforce_if(*when)

    def _may_be_full(self, station: int) -> bool:
        cell = self.cell
        holding = {place for place, at in enumerate(cell.positions) if station in at.holds}
        return sum(bool(self._ahead[at] & holding) for at in cell.begin_at) > cell.capacities[station]

    def _add(self, part: int) -> None:
        cell, start = self.cell, self.cell.begin_at[part]
        reached, into = [start], defaultdict[int, list[PartTask]](list)
        self._ready[part, start] = self._first_ready(part)
        left = defaultdict[int, int](int)  # options into a position that have no task yet
        for place in self._ahead[start]:
            for way in cell.positions[place].options:
                left[way.to] += 1
        for place in reached:
            own = self._leaving(part, place)
            self.all += own
            if own:
                arrived: list[cp_model.LiteralT] = [task.done for task in into[place]]
                self.model.add(sum(task.done for task in own) == (sum(arrived) if arrived else 1))
            for task in own:
                for before in into[place]:
                    self.after(task, before, task.done, before.done)
                    if not task.option.waits or cell.positions[place].processing_s is None:
                        self.model.add(task.left >= before.end).only_enforce_if(task.done, before.done)
                into[task.option.to].append(task)
                left[task.option.to] -= len(task.options)
                if left[task.option.to] == 0:
                    self._ready[part, task.option.to] = self._ready_at(part, task.option.to, into[task.option.to])
                    reached.append(task.option.to)

    def _ready_at(self, part: int, place: int, into: Sequence[PartTask]) -> cp_model.LinearExprT:
        """When a part may leave the position that the tasks `into` bring it to."""

        def ready(task: PartTask) -> cp_model.LinearExprT:
            if self.cell.positions[place].processing_s is None:
                return self._ready[part, task.place]
            return task.end if task.option.robot == SERVER else task.end + self.times.processing(place)

        if len(into) == 1:
            return ready(into[0])
        common = self.moment("ready")
        for task in into:
            self.model.add(common == ready(task)).only_enforce_if(task.done)
        return common

    def _leaving(self, part: int, place: int) -> list[PartTask]:
        at, leaving = self.cell.positions[place], list[tuple[Option, ...]]()
        for way in at.options:
            alike = [team for team in self.teams if team.able(way)]
            same = way.target, way.to
            known = [n for n, own in enumerate(leaving) if alike and alike[0].able(own[0]) and same == _same(own[0])]
            if known:
                leaving[known[0]] += (way,)
            else:
                leaving.append((way,))
        return [self._task(part, place, options, len(leaving) == 1) for options in leaving]

    def _task(self, part: int, place: int, options: tuple[Option, ...], only: bool) -> PartTask:
        model, option, at = self.model, options[0], self.cell.positions[place]
        start, takes = self.cell.begin_at[part], self.least.takes(option)
        certain = only and (place == start or (part, place) in self._certain)
        done = model.new_constant(1) if certain else model.new_bool_var("does")
        if certain:
            self._certain.add((part, option.to))
        head = 0
        if self.cell.begins is None:
            head = (self.least.between(start, place) or 0) + (self.least.stay[place] if option.waits else 0)
        begin = model.new_int_var(min(head, self.horizon), self.horizon, "begin")
        model.add(begin + takes + self.least.tail[option.to] <= self.horizon).only_enforce_if(done)
        ready = self._ready[part, place]
        if option.waits:
            model.add(begin >= ready).only_enforce_if(done)
            if at.at_most_s is not None:
                latest = ready + self.times.whole(at.at_most_s) - self.times.whole(option.service_s)
                model.add(begin <= latest).only_enforce_if(done)
        left, end = begin + self.times.whole(option.service_s), begin + takes
        if option.robot == SERVER:
            left = end
        elif self.cell.has_windows or self.cell.track or any(s in self.blocking for s in option.needs):
            end = self.moment("drop")
            model.add(end >= begin + takes).only_enforce_if(done)
        most = 2 * self.cell.possible_moves
        rank = put = model.new_int_var(0, most, "rank") if self.ranked else None
        if rank is not None and option.robot != SERVER and isinstance(end, cp_model.IntVar):
            put = model.new_int_var(0, most, "put")
            model.add(put >= rank)
        return PartTask(part, place, options, done, begin, left, end, rank, put)

    def _first_ready(self, part: int) -> cp_model.LinearExprT:
        """When a part may leave the place where it begins."""
        cell, arrivals = self.cell, self.cell.arrivals
        if arrivals is None or cell.begin_at[part] != cell.starts[part]:
            return self.times.whole(cell.begin_s[part])
        before = [other - 1 for other in cell.coming if other <= part]
        intervals = [self.times.whole(arrivals.interval_s[other]) for other in (*before, part)]
        if not before or arrivals.after == "clock":
            return sum(intervals)
        picked = self.moment("picked")
        for task in self.of(before[-1]):
            if task.place == cell.starts[before[-1]]:
                self.model.add(picked == (task.begin if task.option.robot == SERVER else task.left)).only_enforce_if(
                    task.done
                )
        return picked + intervals[-1]


def _same(option: Option) -> tuple[int, int]:
    return option.target, option.to


# ---- Room at stations -------------------------------------------------------------------------------------------------


Nodes = Sequence[tuple[int, int, cp_model.LiteralT]]


class PartVisit(NamedTuple):
    """A part's visit to a station: the task that brings it (None: it begins there) and the tasks that may take it away."""

    part: int
    bring: PartTask | None
    takes: tuple[PartTask, ...]


def add_chains(model: cp_model.CpModel, nodes: Nodes, most: int, chains: int) -> None:
    """Puts the nodes 1 to `most` into at most `chains` chains from node 0 to node 0; a node with a loop may be left out."""
    if not most:
        return
    sure = model.new_constant(1)
    # An empty chain, so that no node has to be in a chain.
    nodes = [*nodes, (0, most + 1, sure), (most + 1, 0, sure)]
    model.add_multiple_circuit(nodes)
    model.add(sum(arc for left, _, arc in nodes if not left) <= chains + 1)


def add_rooms(tasks: Tasks) -> None:
    """Adds the capacities of stations, and the rule that a buffer is used only when the station ahead is full."""
    for station in tasks.blocking:
        _add_room(tasks, station, _visits(tasks, station))
    for task in tasks.all:
        if task.option.if_full is not None:
            _add_full(tasks, task, task.option.if_full)


def _visits(tasks: Tasks, station: int) -> list[PartVisit]:
    """Every visit of a part to a station; a route may lead to it more than once, and each visit has its own leaving tasks."""
    positions, visits = tasks.cell.positions, list[PartVisit]()
    holds = [station in place.holds for place in positions]

    def visit(part: int, bring: PartTask | None, begin: int) -> PartVisit:
        there, ahead = {begin}, [begin]
        while ahead:
            more = {way.to for way in positions[ahead.pop()].options if holds[way.to]} - there
            there |= more
            ahead += more
        takes = tuple(t for t in tasks.of(part) if t.place in there and not holds[t.option.to])
        return PartVisit(part, bring, takes)

    for part, begin in enumerate(tasks.cell.begin_at):
        if holds[begin]:
            visits.append(visit(part, None, begin))
        own = tasks.of(part)
        visits += [visit(part, t, t.option.to) for t in own if holds[t.option.to] and not holds[t.place]]
    return visits


def _add_room(tasks: Tasks, station: int, visits: Sequence[PartVisit]) -> None:
    """Gives each place of a station to one part after the other: the next is dropped after the one before was taken out."""
    model, nodes = tasks.model, list[tuple[int, int, cp_model.LiteralT]]()
    for number, visit in enumerate(visits, 1):
        nodes += [(0, number, model.new_bool_var("first")), (number, 0, model.new_bool_var("last"))]
        if visit.bring is not None:
            nodes.append((number, number, ~visit.bring.done))
        for other, after in enumerate(visits, 1):
            if visit is after or after.bring is None or not visit.takes:
                continue
            arc = model.new_bool_var("room")
            nodes.append((number, other, arc))
            if visit.bring is not None:
                tasks.brings.append((visit.bring, after.bring, (arc,)))
            for take in visit.takes:
                model.add(after.bring.end >= take.left).only_enforce_if(arc, take.done)
                tasks.frees.append((take, after.bring, (arc, take.done)))
                if after.bring.put is not None and take.rank is not None:
                    model.add(after.bring.put >= take.rank + 1).only_enforce_if(arc, take.done)
    add_chains(model, nodes, len(visits), tasks.cell.capacities[station])


def _add_full(tasks: Tasks, task: PartTask, station: int) -> None:
    """Allows a task into a buffer only when the station ahead is full, counting parts that are on their way there."""
    model, inside = tasks.model, list[cp_model.IntVar]()
    for visit in _visits(tasks, station):
        if visit.part == task.part:
            continue
        then = model.new_bool_var("inside")
        inside.append(then)
        if visit.bring is not None:
            model.add_implication(then, visit.bring.done)
            tasks.after(task, visit.bring, then, task.done, begun=True)
            model.add(visit.bring.left <= task.left).only_enforce_if(then, task.done)
        for take in visit.takes:
            tasks.after(take, task, then, take.done, task.done, begun=True)
            model.add(take.left >= task.left).only_enforce_if(then, take.done, task.done)
    model.add(sum(inside) >= tasks.cell.capacities[station]).only_enforce_if(task.done)


# ---- the track of the robots ------------------------------------------------------------------------------------------


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
