"""A plain simulation, half a second by half a second, of robots that stop: given what each was told to do, and when."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from oracle.cell import Cell, Stage, Station

TICK_S = 0.5


@dataclass(frozen=True)
class Told:
    """At a time a robot is told to drive somewhere (part 0), or to take a part where it is and bring it somewhere, or, without a
    robot, a server of a machine is told to work on a part."""

    at_s: float
    robot: str
    part: int
    target: str


@dataclass
class _Robot:
    at: str
    target: str = ""  # where it is on its way to
    left_s: float = 0.0
    hand: int = 0
    busy: bool = False
    promised: bool = True  # whether there is room where it brings its part


@dataclass
class _Part:
    route: tuple[Stage, ...]
    stage: int = 0
    done_s: float | None = 0.0  # when it is worked on to the end; None: it waits for a server
    in_hand: bool = False
    ended_s: float | None = None

    @property
    def at(self) -> str:
        return self.route[self.stage].station

    def stands_at(self, station: str) -> bool:
        return self.at == station and not self.in_hand and self.ended_s is None

    def is_done(self, now_s: float) -> bool:
        return self.done_s is not None and self.done_s <= now_s


class Stops:
    """All that happens; works: by part and station, how long it is worked on there; stops: by robot, from when until when it does
    nothing at all [s]. AssertionError for what cannot be done at the time at which it is told."""

    def __init__(
        self, cell: Cell, works: Mapping[tuple[int, str], float], stops: Mapping[str, Sequence[tuple[float, float]]]
    ) -> None:
        self.cell, self.works, self.stops = cell, works, stops
        self.robots = {one.name: _Robot(one.start) for one in cell.robots}
        self.parts = {n: _Part(cell.routes[name][0]) for n, name in enumerate(cell.order, 1)}
        self.servers = {one.name: [(0.0, "")] * one.servers for one in cell.stations if one.servers}
        self.waiting: list[str] = []  # robots that took a part before there was room for it, in their order
        self.dropped: list[tuple[int, str, float]] = []
        self.now_s = 0.0

    def play(self, told: Sequence[Told], until_s: float) -> None:
        """To the end of all parts, or to a time."""
        ahead = list(told)
        while self.now_s <= until_s:
            changed = True
            while changed:
                changed = self._arrive()
                if ahead and ahead[0].at_s <= self.now_s and not changed:
                    self._begin(ahead.pop(0))
                    changed = True
            if all(part.ended_s is not None for part in self.parts.values()) and not ahead:
                return
            for name, robot in self.robots.items():
                if not self._stopped(name):
                    robot.left_s = max(0.0, robot.left_s - TICK_S)
            self.now_s += TICK_S

    def _stopped(self, robot: str) -> bool:
        return any(from_s <= self.now_s < until_s for from_s, until_s in self.stops.get(robot, ()))

    def _station(self, name: str) -> Station:
        return self.cell.station(name)

    def _room(self, name: str) -> bool:
        most = self._station(name).capacity
        if self._is_end(name):
            return True
        inside = sum(one.stands_at(name) for one in self.parts.values())
        coming = sum(one.promised and one.hand > 0 and one.target == name for one in self.robots.values())
        return most is None or inside + coming < most

    def _is_end(self, name: str) -> bool:
        if self._station(name).machine:
            return False
        return all(way[0].station == name or way[-1].station == name for way in self._ways(name))

    def _ways(self, name: str) -> list[tuple[Stage, ...]]:
        return [way for ways in self.cell.routes.values() for way in ways if name in [stage.station for stage in way]]

    def _arrive(self) -> bool:
        changed = False
        for name, robot in self.robots.items():
            if robot.busy and robot.left_s == 0.0 and robot.target:
                if robot.hand and not (robot.promised and (robot.at != robot.target or not self._stopped(name))):
                    robot.at = robot.target
                    continue
                robot.at, changed = robot.target, True
                if robot.hand:
                    self._drop(robot)
                robot.busy, robot.target = False, ""
        for name in list(self.waiting):
            if self._room(self.robots[name].target):
                self.waiting.remove(name)
                self.robots[name].promised = changed = True
        for part in self.parts.values():
            served = self._station(part.at).servers
            last = part.stage == len(part.route) - 1
            if last and served and part.is_done(self.now_s) and part.stands_at(part.at):
                part.ended_s = part.done_s
                changed = True
        return changed

    def _drop(self, robot: _Robot) -> None:
        part, number = self.parts[robot.hand], robot.hand
        part.in_hand, robot.hand = False, 0
        self.dropped.append((number, part.at, self.now_s))
        station = self._station(part.at)
        part.done_s = None if station.servers else self.now_s + self.works.get((number, part.at), 0.0)
        if part.stage == len(part.route) - 1 and not station.servers:
            part.ended_s = self.now_s

    def _begin(self, told: Told) -> None:
        assert told.at_s == self.now_s, f"{told}: no half second"
        if not told.robot:
            self._serve(told)
            return
        robot, own = self.robots[told.robot], next(one for one in self.cell.robots if one.name == told.robot)
        assert not robot.busy, f"{told}: it is busy"
        assert not self._stopped(told.robot), f"{told}: it is out of order"
        table = self.cell.empty_s
        if told.part:
            part = self.parts[told.part]
            assert part.stands_at(robot.at), f"{told}: the part is not there"
            assert part.is_done(self.now_s), f"{told}: the part is not done"
            part.stage, part.in_hand, part.done_s, robot.hand = part.stage + 1, True, None, told.part
            assert part.at == told.target, f"{told}: its route goes on to {part.at}"
            table = self.cell.loaded_s
        robot.busy, robot.promised = True, not told.part or self._room(told.target)
        robot.target = told.target
        if not robot.promised:
            self.waiting.append(told.robot)
        robot.left_s = 0.0 if told.target == robot.at else table[robot.at, told.target] / own.speed

    def _serve(self, told: Told) -> None:
        part, servers = self.parts[told.part], self.servers[told.target]
        assert part.stands_at(told.target), f"{told}: the part is not there"
        assert part.done_s is None, f"{told}: the part is done"
        product, setups = self.cell.order[told.part - 1], self._station(told.target).setup_s
        free = [n for n, (free_s, _) in enumerate(servers) if free_s <= self.now_s]
        assert free, f"{told}: no server is free"
        server = min(free, key=lambda n: setups.get((servers[n][1], product), 0.0))
        begin_s = self.now_s + setups.get((servers[server][1], product), 0.0)
        part.done_s = begin_s + self.works.get((told.part, told.target), 0.0)
        servers[server] = part.done_s, product
