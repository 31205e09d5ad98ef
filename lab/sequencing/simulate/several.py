"""The execution of work with several robots or servers when times are drawn, event by event; and the cost of policies and
sequences over many episodes."""

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
    """The times of an episode as known at a moment: what is not over takes its mean, or ends now if that has passed.

    A broken robot is repaired after its mean repair time from now on; no robot breaks down again.
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
    """An empty drive of a robot between two stations, all by index."""

    robot: int
    origin: int
    target: int
    leave_s: float
    reach_s: float


class _Task(NamedTuple):
    """A robot's target: a decision for a part in a position."""

    decision: int
    place: int


class Dispatch(Execution):
    """The execution, event by event, of a run with several robots or servers whose times are not known in advance.

    Events: a robot arrives, breaks down or is repaired; a part arrives, is put down or becomes ready; a server becomes free. At
    each event the policy is asked for every free robot, and for every server that could begin. A robot that is given a part
    drives to it and picks it as soon as that is allowed. On its way it keeps its target; while it stands and waits, or when it
    breaks down, the target is decided anew. A part that it holds when it breaks down waits with it. A server changes over for a
    part only after the part's arrival.

    drives: the empty drives; moves: all others. done: when each drive or move was begun, with its decision, or with the robot and
    the station that it drives to, by index.
    """

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        super().__init__(cell, times)
        self.now_s = 0.0
        self.drives: list[Drive] = []
        self.done: list[tuple[float, int, int | None]] = []
        self._tasks: dict[int, _Task] = {}

    def decide(self, choose: Choose) -> None:
        """Asks the policy for everything that can begin now, and begins it; repeats while something begun takes no time."""
        driven = set[int]()
        while self._round(choose, driven):
            pass

    def _round(self, choose: Choose, driven: set[int]) -> bool:
        """Asks once for each free robot and server; returns whether something begun is already over.

        driven: the robots that have already made a drive of no time, which is not counted twice.
        """
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
        """Whether another event will happen without a decision; if so, the time advances to it."""
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
        """The observable state now: past times are known, and unfinished ones have their means."""
        run = Windowless(self.run.cell, Known(self.run.cell, real=self.run.times, now_s=self.now_s))
        for at_s, what, station in self.done:
            _decided(run, at_s, what) if station is None else _set_out(run, at_s, what, station)
        run.robots_s = [run.in_order_s(n, max(self.now_s, at_s)) for n, at_s in enumerate(run.robots_s)]
        run.servers = {n: [(max(self.now_s, s), last) for s, last in own] for n, own in run.servers.items()}
        seen = Observed(run)
        seen.clock_s = self.now_s
        return seen

    def _free(self) -> set[int]:
        """The robots that stand still, in working order, without a part."""
        run = self.run
        return {n for n, s in enumerate(run.robots_s) if s <= self.now_s and not run.held[n] and self._works(n)}

    def _works(self, robot: int) -> bool:
        return self.run.in_order_s(robot, self.now_s) == self.now_s

    def _next_s(self, robot: int) -> Iterator[float]:
        """The next breakdown or repair of a robot."""
        for time_s in chain.from_iterable(self.run.times.outages(robot)):
            if time_s > self.now_s:
                yield time_s
                return

    def _ready(self, seen: Observed) -> tuple[bool, ...]:
        """Whether each part may be picked now, as observed."""
        run = self.run
        stand = [here == there and n + 1 not in run.held for n, (here, there) in enumerate(self._places(seen))]
        return tuple(
            stand[n] and max(s, run.put_s[n]) <= self.now_s and not self._coming(n) for n, s in enumerate(run.ready_s)
        )

    def _places(self, seen: Observed) -> Iterator[tuple[int, int]]:
        return zip(self.run.locations, seen.locations, strict=True)

    def _open(self, seen: Observed, free: set[int]) -> tuple[int, ...]:
        """The allowed decisions for free robots, and for servers that could begin."""
        decisions = []
        for decision in seen.allowed():
            option, index = seen.option(decision), part_of(decision, seen.cell.parts) - 1
            if option is None:
                continue
            if option.robot == SERVER:
                stands = self.run.locations[index] == seen.locations[index]
                come_s = max(self.run.ready_s[index], self.run.put_s[index], self.run.free_s(option.target))
                begins = stands and come_s <= self.now_s and self.run.option(decision) is not None
            if option.robot in free if option.robot != SERVER else begins:
                decisions.append(decision)
        return tuple(decisions)

    def _begin(self, decision: int, option: Option, seen: Observed) -> None:
        """Begins a decision: a server begins its work, or a robot picks or sets out; otherwise it stays until the next event."""
        run, robot, index = self.run, option.robot, part_of(decision, seen.cell.parts) - 1
        if robot == SERVER:
            self._commit(decision)
        elif run.robots_at[robot] != option.origin:
            leave_s, reach_s = run.drive_s(robot, option.origin, self.now_s)
            if leave_s == self.now_s:  # otherwise it waits beside the track
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
    """Counts a robot's wait up to `until_s`."""
    run.waited_s += max(0.0, until_s - run.robots_s[robot])
    run.robots_s[robot] = max(until_s, run.robots_s[robot])


def _set_out(run: Run, at_s: float, robot: int, station: int) -> None:
    _rest(run, robot, at_s)
    run.drive(robot, station)


def _decided(run: Run, at_s: float, decision: int) -> None:
    """Carries out a decision from a time on; a server's decision by one that is free then."""
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
    """The execution of one episode by a policy with several robots or servers, until no event is left."""
    execution, choose = Dispatch(cell, times), policy(cell)
    execution.decide(choose)
    while not execution.run.done and execution.goes_on():
        execution.decide(choose)
    return execution


# ---- Many episodes ----------------------------------------------------------------------------------------------------


def carry_out(cell: Cell, policy: Policy, times: Episode | None = None) -> Execution:
    """The execution of one episode by a policy, to the end or to a deadlock; several robots or servers go by `Dispatch`."""
    if not cell.serial:
        return dispatched(cell, policy, times)
    return one_by_one(cell, policy, times)


def _followed(cell: Cell, sequence: Sequence[int], times: Episode) -> Run:
    """The run of a list of decisions, up to one that would pick its part too late by these times."""
    run = Run(cell, times)
    for decision in sequence:
        if run.spoils(decision):
            break
        run.move(decision)
    return run


def replicate(
    cell: Cell, how: Policy | Sequence[int], chance: Chance, episodes: int, seed: int, objective: str = MAKESPAN
) -> NDArray[np.float64]:
    """The costs (episodes,) of a policy, or of a fixed list of decisions, in each episode; in seconds for most objectives.

    Episode n has the same times for every policy and every number of episodes (common random numbers), so two policies are best
    compared by their differences. A deadlock costs `stuck_cost`, and so does a list that picks a part too late. Raises BadInput
    for fewer than 1 episode, a negative seed, an objective that the cell does not allow, and a list that does not fit the cell.
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
