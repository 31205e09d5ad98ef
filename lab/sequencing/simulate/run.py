"""The readable simulation of a cell, decision by decision; `kernels` holds the compiled one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from lab.errors import BadInput
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.precedence import missing
from lab.sequencing.cell.routes import SERVER, Option, Position, choice_of, entry, part_of
from lab.sequencing.cell.schedule import Move
from lab.sequencing.simulate.refusals import Rooms, refusal, rooms_of

SLACK_S = 1e-6  # tolerance of latest picks, for the rounding of sums of times


class Wait(NamedTuple):
    """The deliberate waits of a move (see `waits_of`): before the robot's work at the pick, and before its drop [s].

    A server waits before it begins.
    """

    pick_s: float = 0.0
    drop_s: float = 0.0


NO_WAIT = Wait()


class Run:
    """The state of a simulated cell: positions of parts and robots, and times; `move` carries out one decision.

    A decision is an entry of a sequence: the part's number, + the number of parts for its second choice, and so on. The robot
    drives empty to the pick of the part, or of its pallet, waits until it is ready, does its service work, and carries it on.
    Processing starts at arrival or, where a machine has servers, with the decision that lets a server take the part.

    Times: every move is made as early as possible after earlier decisions with the same robot, server, part or room, unless
    `move` is given deliberate waits. With one robot and no servers, decisions are carried out in their order (`Cell.serial`).

    Room: a robot that comes to a station before there is room waits there. Where another robot can still free the room, it need
    not be free at the decision: the robot picks, drives there and holds the part until a later decision frees the room; robots
    get it in the order of their decisions, and meanwhile nothing is decided for the robot or its part. A buffer ahead of a full
    station is used only while that is full: after its parts were picked to come, and before one of them leaves.

    Not allowed are decisions that a precedence makes wait (see `Precedence`), and those that pick a part after its latest time
    (see `Station.at_most_s`): such a part stays where it is, and the run ends as a deadlock does.

    Batches (see `Station.batch`): the order decides them. A batch is all parts brought before one of them is taken out, and
    begins with the last one brought. `ready_s` assumes that no more parts come. Parts in such a machine at time 0 have begun.

    Track: a robot stands beside it at a station, drives the shortest path without stopping, and holds each stretch while it is
    on it; it sets out as soon as every stretch will be free when it gets there, after earlier decisions.

    locations: the position of each part, part 1 first. occupied: room taken at each station. ready_s: when each part may be
    picked. finished_s: when each part was finished (None: not yet; 0: before time 0, or the part makes no move). robots_at,
    robots_s: where and when each robot is free. end_s: when all decided moves are done. fetched: how many parts were taken from
    the start of their routes. waited_s: the robots' total waits. processed_s: the machines' total processing. moves: the decided
    moves in order, a drop that waits for room at its earliest time. held: the part that each robot holds and cannot drop yet;
    0: none.
    Source: thesis ch. 7.4, 7.5; App. III; serial schedule generation, Kolisch 1996.
    """

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        self.cell = cell
        self.times = times or Episode(cell)
        self.locations = list(cell.begin_at)
        self.occupied = [0] * len(cell.stations)
        for held in [station for place in self.locations for station in cell.positions[place].holds]:
            self.occupied[held] += 1
        for held in cell.batches:
            self._close(held)
        self.robots_at = [cell.index(robot.start) for robot in cell.robots]
        self.robots_s = [0.0] * len(cell.robots)
        self.track_s = [0.0] * len(cell.track)  # since when each stretch is free
        self.end_s = self.waited_s = self.processed_s = 0.0
        self.finished_s: list[float | None] = [None if n in cell.unfinished else 0.0 for n in range(1, cell.parts + 1)]
        self.fetched = 0
        self.ready_s = self._first_ready_s()
        self.moves: list[Move] = []
        self.held = [0] * len(cell.robots)
        # Where decisions are not carried out in their order: since when each room and server is free, and its last product.
        self.rooms = Rooms() if cell.serial else rooms_of(cell.capacities, self.occupied)
        servers = enumerate(() if cell.serial else cell.stations)
        self.servers = {n: [(0.0, "")] * (station.servers or 0) for n, station in servers}
        # By part: when it was picked for its present position; and when it, or its pallet, was put down there, or the part that
        # arrived before it was taken. By station: the earliest time at which a part may leave it.
        self._fetched_s, self.put_s = [0.0] * cell.parts, [0.0] * cell.parts
        self._kept_s = [0.0] * len(cell.stations)

    @property
    def robot(self) -> int:
        """The station (by index) of the first robot."""
        return self.robots_at[0]

    @property
    def now_s(self) -> float:
        """When the first of the robots is free [s]; without robots, when all decided moves are done."""
        return min(self.robots_s, default=self.end_s)

    @property
    def done(self) -> bool:
        """Whether every part is finished."""
        return None not in self.finished_s

    def allowed(self) -> tuple[int, ...]:
        """The decisions allowed now, ascending; empty when all parts are finished, or in a deadlock."""
        parts, full = self.cell.parts, self.full()
        decisions = [
            entry(part, option.choice, parts)
            for part in range(1, parts + 1)
            if self.in_turn(part)
            for option in self.cell.positions[self.locations[part - 1]].options
            if self._possible(part, option, full) and not self.waits_for(part, option)
            if not self.too_late(part, option)
        ]
        return tuple(sorted(decisions))

    def option(self, decision: int) -> Option | None:
        """The option that a decision takes now; None when it is not allowed."""
        part = part_of(decision, self.cell.parts)
        if decision < 1 or not self.in_turn(part):
            return None
        choice, full = choice_of(decision, self.cell.parts), self.full()
        for option in self.cell.positions[self.locations[part - 1]].options:
            if option.choice == choice and self._possible(part, option, full) and not self.waits_for(part, option):
                return None if self.too_late(part, option) else option
        return None

    def too_late(self, part: int, option: Option) -> bool:
        """Whether an option, if taken now, would pick its part after the latest time."""
        at_most_s = self.cell.positions[self.locations[part - 1]].at_most_s
        if at_most_s is None or not option.waits:
            return False
        return self.pick_s(part, option) > self.ready_s[part - 1] + at_most_s + SLACK_S

    def spoils(self, decision: int) -> bool:
        """Whether a decision is not allowed only because it would pick its part too late."""
        part, choice = part_of(decision, self.cell.parts), choice_of(decision, self.cell.parts)
        if decision < 1 or not self.in_turn(part):
            return False
        options, full = self.cell.positions[self.locations[part - 1]].options, self.full()
        own = [o for o in options if o.choice == choice and self._possible(part, o, full)]
        return any(self.too_late(part, option) for option in own if not self.waits_for(part, option))

    def _possible(self, part: int, option: Option, full: Sequence[bool]) -> bool:
        """Whether an option has room, or another robot can free it, and neither its part nor its robot waits for room."""
        if part in self.held or (option.robot != SERVER and self.held[option.robot]):
            return False
        if option.possible(full):
            return True
        fits = option.if_full is None or full[option.if_full]
        return fits and all(not full[station] or self._comes_free(station, option) for station in option.needs)

    def _comes_free(self, station: int, option: Option) -> bool:
        """Whether a full station may still be freed: by a server, or by another robot that does not wait itself, or that waits
        only for room which this option frees."""
        return any(
            other == SERVER
            or (other != option.robot and (not self.held[other] or other in self.rooms.waiting(option.origin)))
            for other in self.cell.takers[station]
        )

    def waits_for(self, part: int, option: Option) -> str:
        """The precedence that an option waits for, in words; "" when it waits for none."""
        cell, place = self.cell, self.locations[part - 1]
        for rule, precedence in zip(cell.rules, cell.precedences, strict=True):
            if rule.applies(place, option):
                counted = [self.locations.count(n) for n in range(len(cell.positions))]
                if count := missing(rule, counted):
                    kinds = " or ".join(dict.fromkeys(cell.order[other - 1] for other in precedence.of))
                    return f"{precedence.step} before {count} more of {kinds} {precedence.of_step}"
        return ""

    def move(self, decision: int, wait: Wait = NO_WAIT) -> Move:
        """Carries out a decision with its deliberate waits; raises BadInput when it is not allowed."""
        option = self.option(decision)
        if option is None:
            raise BadInput(self.refusal(decision))
        cell, part = self.cell, part_of(decision, self.cell.parts)
        if option.robot == SERVER:
            return self._serve(part, option, wait)
        there, robot = cell.positions[option.to], option.robot
        start, free_s = self.robots_at[robot], self.robots_s[robot]
        leave_s, reach_s, served_s, pick_s = self._times_s(part, option)
        served_s, pick_s = served_s + wait.pick_s, pick_s + wait.pick_s
        out_s = self._clear_s(robot, option.origin, option.target, pick_s)
        carried_s = self.times.until_s(robot, out_s, self.carry_s(option))
        drop_s = carried_s + wait.drop_s
        if self.locations[part - 1] == cell.starts[part - 1]:
            self._fetch(pick_s)
        lacking = self.rooms.lacking(option.needs)
        drop_s = max(drop_s, self.rooms.take([s for s in option.needs if s not in lacking]))
        drop_s = self.in_order_s(robot, drop_s) if drop_s > carried_s else drop_s
        for station in lacking:
            self.rooms.wait(robot, station)
            self.held[robot] = part
        self.waited_s += drop_s - carried_s
        if option.if_full is not None:
            self._kept_s[option.if_full] = max(self._kept_s[option.if_full], pick_s)
        if option.waits:
            self._fetched_s[part - 1] = pick_s
        self._leave(part, option, pick_s)
        self._hold(robot, start, option.origin, leave_s)
        self._hold(robot, option.origin, option.target, out_s)
        self.robots_at[robot], self.robots_s[robot] = option.target, drop_s
        self.waited_s += leave_s - free_s + served_s - reach_s + out_s - pick_s
        process_s = 0.0 if there.processing_s is None else self.times.lasts_s(part, option.to, drop_s)
        self.processed_s += process_s
        self._put(part, drop_s, process_s)
        if there.station in cell.batches and there.processing_s is not None:
            self._batch(there.station, drop_s)
        way = cell.names[start], cell.names[option.origin], cell.names[option.target]
        times_s = leave_s, reach_s, pick_s, drop_s, process_s
        by = cell.robots[robot].name
        self.moves.append(Move(part, *way, *times_s, option.service_s, option.carries, by, out_s - pick_s))
        return self.moves[-1]

    def _put(self, part: int, at_s: float, process_s: float) -> None:
        """Puts down a part, or its pallet, in its present position."""
        there = self.cell.positions[self.locations[part - 1]]
        self.put_s[part - 1] = at_s
        if there.processing_s is not None:
            self.ready_s[part - 1] = at_s + process_s
        self._ends(part, there, at_s)

    def _grant(self, robot: int, at_s: float) -> None:
        """Gives room from a time on to a robot that waits for it with a part."""
        part, drop_s = self.held[robot], self.robots_s[robot]
        drop_s = self.in_order_s(robot, at_s) if at_s > drop_s else drop_s
        self.waited_s += drop_s - self.robots_s[robot]
        self.robots_s[robot] = drop_s
        own = [n for n, move in enumerate(self.moves) if move.by == self.cell.robots[robot].name][
            -1:
        ]  # none: not known
        for number in own:
            self.moves[number] = replace(self.moves[number], drop_s=drop_s)
        self._put(part, drop_s, self.times.lasts_s(part, self.locations[part - 1], drop_s))
        if not self.rooms.awaited(robot):
            self.held[robot] = 0

    def _serve(self, part: int, option: Option, wait: Wait) -> Move:
        """The move in which a server of a machine takes a part and works on it."""
        cell = self.cell
        begin_s, server = self._server(part, option)
        begin_s += wait.pick_s
        process_s = self.times.lasts_s(part, option.to, begin_s)
        end_s = begin_s + process_s
        if self.locations[part - 1] == cell.starts[part - 1]:
            self._fetch(begin_s)
        self.servers[option.target][server] = end_s, cell.order[part - 1]
        self._leave(part, option, end_s)
        self.ready_s[part - 1] = end_s
        self.processed_s += process_s
        self._ends(part, cell.positions[option.to], end_s)
        way, times_s = (cell.names[option.origin], cell.names[option.target]), (begin_s, begin_s, begin_s, begin_s)
        self.moves.append(Move(part, way[0], *way, *times_s, process_s, by=way[1]))
        return self.moves[-1]

    def _server(self, part: int, option: Option) -> tuple[float, int]:
        """The earliest begin of a part at a machine with servers, and the index of the server that allows it."""
        product, setups = self.cell.order[part - 1], self.cell.setups[option.target]
        ready_s, there = max(self.ready_s[part - 1], self.put_s[part - 1]), self.cell.positions[option.to]
        if option.target not in there.holds:
            ready_s = max(ready_s, self._kept_s[option.target] - (there.processing_s or 0.0))
        free_s = [max(ready_s, free + setups.get((last, product), 0.0)) for free, last in self.servers[option.target]]
        return min(free_s), free_s.index(min(free_s))

    def _leave(self, part: int, option: Option, left_s: float) -> None:
        """Moves a part to the position that an option leads to; the room that it leaves is free from `left_s` on."""
        cell = self.cell
        here, there = cell.positions[self.locations[part - 1]], cell.positions[option.to]
        for station in here.holds:
            self.occupied[station] -= 1
            if station not in there.holds and (robot := self.rooms.free(station, left_s)) is not None:
                self._grant(robot, left_s)
        for station in there.holds:
            self.occupied[station] += 1
        self.locations[part - 1] = option.to
        for station in cell.batches.intersection(here.holds):
            self._close(station)

    def inside(self, station: int) -> list[int]:
        """The parts, from 1, that take room at a station."""
        return [n for n, at in enumerate(self.locations, 1) if station in self.cell.positions[at].holds]

    def _close(self, station: int) -> None:
        """Closes a machine with batches until it is empty: all its room counts as taken."""
        self.occupied[station] = self.cell.capacities[station] if self.inside(station) else 0

    def _batch(self, station: int, at_s: float) -> None:
        """Begins the processing of all parts in a machine together."""
        parts = self.inside(station)
        longest_s = max(self.times.processing_s(part, self.locations[part - 1]) for part in parts)
        for part in parts:
            self.ready_s[part - 1] = at_s + longest_s

    def _ends(self, part: int, there: Position, at_s: float) -> None:
        """Notes the arrival of a part in a position: its processing, or its end."""
        self.end_s = max(self.end_s, at_s)
        if not there.options:
            self.finished_s[part - 1] = at_s

    def wait(self, until_s: float) -> None:
        """Makes all robots that are free earlier wait where they are until `until_s`."""
        self.waited_s += sum(max(0.0, until_s - free_s) for free_s in self.robots_s)
        self.robots_s = [max(until_s, free_s) for free_s in self.robots_s]

    def refusal(self, decision: int) -> str:
        """The reason why a decision is not allowed now, in words; empty when it is allowed."""
        return "" if self.option(decision) is not None else refusal(self, decision)

    def free_s(self, station: int) -> float:
        """When the first of a station's servers is free; 0 for a station without servers."""
        return min((free_s for free_s, _ in self.servers.get(station, ())), default=0.0)

    def reach_s(self, option: Option) -> float:
        """When the robot of an option arrives at its pick if it drives there now."""
        return self._reached_s(option)[1]

    def _reached_s(self, option: Option) -> tuple[float, float]:
        """When the robot of an option sets out for its pick, and when it arrives there."""
        return self.drive_s(option.robot, option.origin, self.robots_s[option.robot])

    def drive_s(self, robot: int, station: int, at_s: float) -> tuple[float, float]:
        """When a robot sets out empty for a station, not before `at_s`, and when it arrives there."""
        at = self.robots_at[robot]
        if at == station:
            return at_s, at_s
        leave_s = self._clear_s(robot, at, station, self.in_order_s(robot, at_s))
        empty_s = float(self.cell.empty_s[at, station]) / self.cell.robots[robot].speed
        return leave_s, self.times.until_s(robot, leave_s, empty_s)

    def drive(self, robot: int, station: int) -> None:
        """Makes a robot drive empty to a station as soon as it is free."""
        leave_s, reach_s = self.drive_s(robot, station, self.robots_s[robot])
        self._hold(robot, self.robots_at[robot], station, leave_s)
        self.waited_s += leave_s - self.robots_s[robot]
        self.robots_at[robot], self.robots_s[robot] = station, reach_s

    def in_order_s(self, robot: int, at_s: float) -> float:
        """The earliest time from `at_s` on when a robot is not broken down [s]."""
        return self.times.until_s(robot, at_s, 0.0)

    def _clear_s(self, robot: int, origin: int, target: int, at_s: float) -> float:
        """The earliest start from `at_s` on with which a robot finds every stretch of its path free when it gets there [s]."""
        if not self.track_s:
            return at_s
        speed = self.cell.robots[robot].speed
        way = self.cell.ways[origin, target]
        return max([at_s, *(self.track_s[held.stretch] - held.from_s / speed for held in way)])

    def _hold(self, robot: int, origin: int, target: int, leave_s: float) -> None:
        """Reserves the stretches of a robot's path: each is free again when the robot has left it."""
        speed = self.cell.robots[robot].speed
        for held in self.cell.ways[origin, target] if self.track_s else ():
            self.track_s[held.stretch] = leave_s + held.until_s / speed

    def pick_s(self, part: int, option: Option) -> float:
        """When an option, if taken now, picks its part, or when a server begins to work on it [s]."""
        return self._server(part, option)[0] if option.robot == SERVER else self._times_s(part, option)[3]

    def begin_s(self, part: int, option: Option) -> float:
        """When the robot of an option, if taken now, begins its service, or picks where there is none [s]."""
        return self._times_s(part, option)[2]

    def drop_s(self, part: int, option: Option) -> float:
        """When an option, if taken now and if there is room, drops its part or ends a server's work, by the cell's times [s]."""
        if option.robot == SERVER:
            return self.pick_s(part, option) + (self.cell.positions[option.to].processing_s or 0.0)
        out_s = self._clear_s(option.robot, option.origin, option.target, self.pick_s(part, option))
        return out_s + self.carry_s(option)

    def carry_s(self, option: Option) -> float:
        """The duration of an option's loaded move [s]."""
        return float(self.cell.loaded_s[option.origin, option.target]) / self.cell.robots[option.robot].speed

    def _times_s(self, part: int, option: Option) -> tuple[float, float, float, float]:
        """When the robot sets out, when it arrives, when it begins its service, and when it then picks the part [s]."""
        leave_s, reach_s = self._reached_s(option)
        ready_s = max(reach_s, self.ready_s[part - 1]) if option.waits else reach_s
        if not self.cell.serial:
            ready_s = max(ready_s, self._may_go_s(part, option) - option.service_s)
        return leave_s, reach_s, ready_s, self.times.until_s(option.robot, ready_s, option.service_s)

    def _may_go_s(self, part: int, option: Option) -> float:
        """The earliest pick of an option, whichever robot takes it [s]: after the part or its pallet was put down, the part
        before it was taken, and all earlier decisions that depend on a full station."""
        here, there = self.cell.positions[self.locations[part - 1]], self.cell.positions[option.to]
        inside = self.inside(option.if_full) if option.if_full is not None else ()
        kept_s = [self._kept_s[station] for station in here.holds if station not in there.holds]
        return max([self.put_s[part - 1], *(self._fetched_s[other - 1] for other in inside), *kept_s])

    def _first_ready_s(self) -> list[float]:
        arrivals, came_s = self.cell.arrivals, 0.0
        places = zip(self.cell.begin_s, self.locations, self.cell.starts, strict=True)
        all_s = [s + (self.times.late_s(n) if at == start else 0.0) for n, (s, at, start) in enumerate(places, 1)]
        if arrivals is not None:
            for part in self.cell.coming[: 1 if arrivals.after == "pick" else None]:
                came_s = self.times.comes_s(part, came_s)
                all_s[part - 1] = came_s
        return all_s

    def _fetch(self, pick_s: float) -> None:
        """Notes that a part was taken from its first station; where arrivals follow picks, the next one sets out."""
        self.fetched += 1
        arrivals, coming = self.cell.arrivals, self.cell.coming
        if arrivals is None or self.fetched == len(coming):
            return
        following = coming[self.fetched]
        self.put_s[following - 1] = pick_s
        if arrivals.after == "pick":
            self.ready_s[following - 1] = self.times.comes_s(following, pick_s)

    def in_turn(self, part: int) -> bool:
        """Whether a part is not behind another one in the order of arrivals."""
        waits = self.locations[part - 1] == self.cell.starts[part - 1]
        return self.cell.arrivals is None or not waits or part == self.cell.coming[self.fetched]

    def full(self) -> list[bool]:
        """Whether each station is full."""
        return [taken >= most for taken, most in zip(self.occupied, self.cell.capacities, strict=True)]


class Windowless(Run):
    """A run without latest picks, for callers that handle time windows themselves."""

    def __init__(self, cell: Cell, times: Episode | None = None, state: Run | None = None) -> None:
        """state: the run whose state it begins with; None: the cell's initial state."""
        super().__init__(cell, times)
        if state is not None:
            take_over(self, state)

    def too_late(self, part: int, option: Option) -> bool:
        return False


def branch(run: Run) -> Run:
    """A copy of a run, with the same times, that can be continued independently."""
    other = Run(run.cell, run.times)
    take_over(other, run)
    return other


def take_over(run: Run, state: Run) -> None:
    """Copies the state of another run of the same cell into a run, which keeps its own times."""
    run.locations, run.occupied = state.locations.copy(), state.occupied.copy()
    run.ready_s, run.finished_s = state.ready_s.copy(), state.finished_s.copy()
    run.robots_at, run.robots_s, run.fetched = state.robots_at.copy(), state.robots_s.copy(), state.fetched
    run.end_s, run.waited_s, run.processed_s = state.end_s, state.waited_s, state.processed_s
    run.track_s, run.moves, run.held, run.rooms = (
        state.track_s.copy(),
        state.moves.copy(),
        state.held.copy(),
        state.rooms.copy(),
    )
    run.servers = {station: servers.copy() for station, servers in state.servers.items()}
    run._fetched_s, run.put_s, run._kept_s = state._fetched_s.copy(), state.put_s.copy(), state._kept_s.copy()
