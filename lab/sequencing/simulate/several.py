"""Carrying work out with several robots or servers where times are drawn: decided anew whenever something happens."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Chance, Episode, drawn_seed
from lab.sequencing.cell.objectives import MAKESPAN, check_objective, cost
from lab.sequencing.cell.routes import SERVER, Option, part_of
from lab.sequencing.simulate.execution import WAIT, Choose, Execution, Observed, Policy, one_by_one
from lab.sequencing.simulate.run import Run, Windowless


@dataclass(frozen=True)
class Known(Episode):
    """What is known of an episode at a time: what is not over by then takes its mean, or ends now where that has passed.

    A robot that is out of order is repaired after its mean time from now on; none breaks down again.
    """

    real: Episode = field(kw_only=True)
    now_s: float = field(kw_only=True)

    def lasts_s(self, part: int, position: int, begin_s: float) -> float:
        lasts_s = self.real.lasts_s(part, position, begin_s)
        return self._by_now(begin_s, lasts_s, self.processing_s(part, position))

    def late_s(self, part: int) -> float:
        return self._by_now(self.cell.begin_s[part - 1], self.real.late_s(part), 0.0)

    def comes_s(self, part: int, since_s: float) -> float:
        lasts_s = self.real.comes_s(part, since_s) - since_s
        return since_s + self._by_now(since_s, lasts_s, self.interval_s(part))

    def outages(self, robot: int) -> Iterator[tuple[float, float]]:
        for from_s, until_s in self.real.outages(robot):
            if from_s > self.now_s:
                return
            yield from_s, until_s if until_s <= self.now_s else self.now_s + self.real.chance.robot_repair_s

    def _by_now(self, begin_s: float, lasts_s: float, mean_s: float) -> float:
        return lasts_s if begin_s + lasts_s <= self.now_s else max(mean_s, self.now_s - begin_s)


class Drive(NamedTuple):
    """A robot, by index, drives empty from a station to another one, both by index."""

    robot: int
    origin: int
    target: int
    leave_s: float
    reach_s: float


class _Task(NamedTuple):
    """What a robot is on its way to: a decision of a part in a position."""

    decision: int
    place: int


class Dispatch(Execution):
    """A run of several robots or servers whose times nobody knows beforehand, carried out event by event.

    Events: a robot is there, breaks down or is repaired, a part is ready, put down or there at last, a server is free. At each of
    them whoever decides is asked for every robot that is free, and for servers that could begin. A robot that is given a part
    drives to where that stands and picks it there once it may. Whatever it has not picked yet is not bound to it: as it
    stands there and waits, it is decided anew, and of what a robot that breaks down was on its way to, too; on its way it
    keeps to what it was given. What it holds when it breaks down waits with it. A server changes over for a part only once
    that is there. drives: the ways without a part; moves: all others.
    done: when each of either was begun, and a decision, or a robot and where it drives to, by index.
    """

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        super().__init__(cell, times)
        self.now_s = 0.0
        self.drives: list[Drive] = []
        self.done: list[tuple[float, int, int | None]] = []
        self._tasks: dict[int, _Task] = {}

    def decide(self, choose: Choose) -> None:
        """Ask for all that can be begun now, and begin it; again where what was begun takes no time."""
        driven = set[int]()
        while self._round(choose, driven):
            pass

    def _round(self, choose: Choose, driven: set[int]) -> bool:
        """Ask once for whoever is free; whether something was begun that is over by now. driven: who had a way of no time."""
        free, told, over = self._free(), set[int](), False
        self._tasks = {n: task for n, task in self._tasks.items() if n not in free and self._works(n)}
        seen = self.observe()
        for decision, place in self._tasks.values():
            if seen.locations[part_of(decision, seen.cell.parts) - 1] == place and seen.option(decision) is not None:
                seen.move(decision)
        while allowed := self._open(seen, self._free() - told):
            seen.ready = self._ready(seen)
            decision = choose(seen, allowed)
            if decision == WAIT:
                break
            option = seen.option(decision)
            if option is None or decision not in allowed:
                raise BadInput(f"decision {decision} at {self.now_s:g} s: allowed are {', '.join(map(str, allowed))}")
            told.add(option.robot)
            begun = len(self.sequence)
            self._begin(decision, option, seen)
            if len(self.sequence) > begun:
                over = over or self.moves[-1].end_s <= self.now_s
            elif option.robot in self._free() - driven and option.robot in self._tasks:
                over = True
                driven.add(option.robot)
            seen.move(decision)
        return over

    def goes_on(self) -> bool:
        """Whether anything is still to happen by itself; the time is then that of the next event."""
        run, robots = self.run, range(len(self.run.robots_s))
        servers = [free_s for own in run.servers.values() for free_s, _ in own]
        rooms = chain.from_iterable(run.rooms.free_s.values())
        known = chain(run.robots_s, run.ready_s, run.put_s, run.track_s, rooms, servers)
        coming_s = [at_s for at_s in known if at_s > self.now_s]
        if not coming_s and all(map(self._works, robots)):
            return False
        self.now_s = min([*coming_s, *(at_s for n in robots for at_s in self._next_s(n))])
        return True

    def observe(self) -> Observed:
        """What is known now: all that was begun, by the times that are over and the means of the others."""
        run = Windowless(self.run.cell, Known(self.run.cell, real=self.run.times, now_s=self.now_s))
        for at_s, what, station in self.done:
            _decided(run, at_s, what) if station is None else _set_out(run, at_s, what, station)
        run.robots_s = [run.in_order_s(n, max(self.now_s, at_s)) for n, at_s in enumerate(run.robots_s)]
        run.servers = {n: [(max(self.now_s, s), last) for s, last in own] for n, own in run.servers.items()}
        seen = Observed(run)
        seen.clock_s = self.now_s
        return seen

    def _free(self) -> set[int]:
        """The robots that stand in order with nothing in hand."""
        run = self.run
        return {n for n, s in enumerate(run.robots_s) if s <= self.now_s and not run.held[n] and self._works(n)}

    def _works(self, robot: int) -> bool:
        return self.run.in_order_s(robot, self.now_s) == self.now_s

    def _next_s(self, robot: int) -> Iterator[float]:
        """When a robot breaks down, or is repaired, next."""
        for time_s in chain.from_iterable(self.run.times.outages(robot)):
            if time_s > self.now_s:
                yield time_s
                return

    def _ready(self, seen: Observed) -> tuple[bool, ...]:
        """Whether each part may be picked now where it is seen."""
        run = self.run
        stand = [here == there and n + 1 not in run.held for n, (here, there) in enumerate(self._places(seen))]
        return tuple(
            stand[n] and max(s, run.put_s[n]) <= self.now_s and not self._coming(n) for n, s in enumerate(run.ready_s)
        )

    def _places(self, seen: Observed) -> Iterator[tuple[int, int]]:
        return zip(self.run.locations, seen.locations, strict=True)

    def _open(self, seen: Observed, free: set[int]) -> tuple[int, ...]:
        """The decisions for robots that are free, and for servers that could begin."""
        found = []
        for decision in seen.allowed():
            option, index = seen.option(decision), part_of(decision, seen.cell.parts) - 1
            if option is None:
                continue
            if option.robot == SERVER:
                stands = self.run.locations[index] == seen.locations[index]
                come_s = max(self.run.ready_s[index], self.run.put_s[index], self.run.free_s(option.target))
                begins = stands and come_s <= self.now_s and self.run.option(decision) is not None
            if option.robot in free if option.robot != SERVER else begins:
                found.append(decision)
        return tuple(found)

    def _begin(self, decision: int, option: Option, seen: Observed) -> None:
        """A server begins, a robot picks or sets out; where it can do neither yet, it stays until the next event."""
        run, robot, index = self.run, option.robot, part_of(decision, seen.cell.parts) - 1
        if robot == SERVER:
            self._commit(decision)
        elif run.robots_at[robot] != option.origin:
            leave_s, reach_s = run.drive_s(robot, option.origin, self.now_s)
            if leave_s == self.now_s:  # else it waits beside the track
                self.drives.append(Drive(robot, run.robots_at[robot], option.origin, leave_s, reach_s))
                self._tasks[robot] = _Task(decision, seen.locations[index])
                self.done.append((self.now_s, robot, option.origin))
                _set_out(run, *self.done[-1])  # type: ignore[arg-type]
        elif run.locations[index] == seen.locations[index]:
            _rest(run, robot, self.now_s)
            if (own := run.option(decision)) is not None and run.begin_s(index + 1, own) <= self.now_s:
                self._commit(decision)

    def _commit(self, decision: int) -> None:
        self.done.append((self.now_s, decision, None))
        _decided(self.run, self.now_s, decision)
        self.sequence.append(decision)


def _rest(run: Run, robot: int, until_s: float) -> None:
    """A robot has been waiting until then."""
    run.waited_s += max(0.0, until_s - run.robots_s[robot])
    run.robots_s[robot] = max(until_s, run.robots_s[robot])


def _set_out(run: Run, at_s: float, robot: int, station: int) -> None:
    _rest(run, robot, at_s)
    run.drive(robot, station)


def _decided(run: Run, at_s: float, decision: int) -> None:
    """A decision is carried out from a time on, a server's by one that is free then."""
    option = run.option(decision)
    if option is None or option.robot != SERVER:
        if option is not None:
            _rest(run, option.robot, at_s)
        run.move(decision)
        return
    servers = run.servers[option.target]
    busy = {n: server for n, server in enumerate(servers) if server[0] > at_s}
    run.servers[option.target] = [(float("inf") if n in busy else at_s, last) for n, (_, last) in enumerate(servers)]
    run.move(decision)
    for n, server in busy.items():
        run.servers[option.target][n] = server


def dispatched(cell: Cell, policy: Policy, times: Episode | None = None) -> Dispatch:
    """What a policy makes of one episode of several robots or servers, to the end or until nothing happens any more."""
    execution, choose = Dispatch(cell, times), policy(cell)
    execution.decide(choose)
    while not execution.run.done and execution.goes_on():
        execution.decide(choose)
    return execution


# ---- replications -----------------------------------------------------------------------------------------------------


def carry_out(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """What a policy makes of one episode, to the end or to a deadlock; several robots or servers as `several.Dispatch` says."""
    if not cell.serial:
        return dispatched(cell, policy, times)
    return one_by_one(cell, policy, times)


def _followed(cell: Cell, sequence: Sequence[int], times: Episode) -> Run:
    """The run of a list of decisions, to where one would pick its part too late by these times."""
    run = Run(cell, times)
    for decision in sequence:
        if run.spoils(decision):
            break
        run.move(decision)
    return run


def replicate(
    cell: Cell, how: Policy | Sequence[int], chance: Chance, episodes: int, seed: int, objective: str = MAKESPAN
) -> NDArray[np.float64]:
    """The cost of a policy, or of a fixed list, in each of so many episodes (episodes,); in seconds, for most objectives.

    Episode n meets the same times whatever is carried out, and however many episodes there are: common random numbers,
    so compare two policies by their differences. A deadlock costs `stuck_cost`, and so does a part that a list would pick
    too late. Raises BadInput for fewer than 1
    episode, a negative seed, an objective that the cell does not allow, and a list that is not one of the cell's.
    Source: thesis App. III (50 replications).
    """
    check_objective(objective, cell)
    for name, value, least in (("episodes", episodes, 1), ("seed", seed, 0)):
        if value < least:
            raise BadInput(f"{name} = {value}: allowed are whole numbers from {least}")
    rng, costs = np.random.default_rng(seed), np.empty(episodes)
    for number in range(episodes):
        times = Episode(cell, chance, drawn_seed(rng))
        run = carry_out(cell, how, times).run if callable(how) else _followed(cell, how, times)
        if not run.done and not callable(how) and run.allowed() and not cell.has_windows:
            raise BadInput(f"the sequence ends after {counted(len(how), 'move')}, but not every part is finished")
        costs[number] = cost(run, objective)
    return costs
