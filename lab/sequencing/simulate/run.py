"""One pass through a cell, decision by decision: the readable simulation. `kernels` holds the compiled one."""

from collections.abc import Sequence

from lab.errors import BadInput, counted
from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.chance import Episode
from lab.sequencing.cell.routes import Option, choice_of, entry, part_of
from lab.sequencing.cell.schedule import Move, Schedule

SLACK_S = 1e-6  # so much later is not too late: what sums of times may differ by


class Run:
    """Where parts and robot are, and at what time; `move` carries one decision out.

    A decision is an entry of a sequence: the part's number, + the number of parts for the second choice it has, and so
    on. The robot travels empty to where the part, or its pallet, is picked, waits there until it is ready, does its
    service work and carries it on; processing starts at arrival. All is done as early as it can be: the robot never waits for
    anything else. A decision that would pick a part later than it may be picked is not allowed (see `Station.at_most_s`): what
    was left too long stays where it is, and the run ends as a deadlock does. locations: the position of each part, part 1 first.
    occupied: room taken at each station. ready_s: when each part may be picked. finished_s: when each part reached the
    end of its route (None: not yet; 0: before the work began, or nothing is to be done with it). fetched: how many parts
    were taken from the start of their routes. waited_s: how long the robot has waited. processed_s: how long machines were
    given work for.
    Source: thesis ch. 7.4, 7.5; App. III.
    """

    def __init__(self, cell: Cell, times: Episode | None = None) -> None:
        self.cell = cell
        self.times = times or Episode(cell)
        self.locations = list(cell.begin_at)
        self.occupied = [0] * len(cell.stations)
        for place in self.locations:
            for station in cell.positions[place].holds:
                self.occupied[station] += 1
        self.robot = cell.index(cell.robot_start)
        self.now_s = self.waited_s = self.processed_s = 0.0
        self.finished_s: list[float | None] = [None if n in cell.unfinished else 0.0 for n in range(1, cell.parts + 1)]
        self.fetched = 0
        self.ready_s = self._first_ready_s()

    @property
    def done(self) -> bool:
        """Whether every part is finished."""
        return None not in self.finished_s

    def allowed(self) -> tuple[int, ...]:
        """The decisions that may be taken now, ascending; none when all is done, or when nothing can move any more."""
        parts, full = self.cell.parts, self._full()
        found = [
            entry(part, option.choice, parts)
            for part in range(1, parts + 1)
            if self._in_turn(part)
            for option in self.cell.positions[self.locations[part - 1]].options
            if option.possible(full) and not self.too_late(part, option)
        ]
        return tuple(sorted(found))

    def option(self, decision: int) -> Option | None:
        """The way on that a decision means now; None when it may not be taken."""
        part = part_of(decision, self.cell.parts)
        if decision < 1 or not self._in_turn(part):
            return None
        choice, full = choice_of(decision, self.cell.parts), self._full()
        for option in self.cell.positions[self.locations[part - 1]].options:
            if option.choice == choice and option.possible(full):
                return None if self.too_late(part, option) else option
        return None

    def too_late(self, part: int, option: Option) -> bool:
        """Whether a part would be picked later than it may be, if that were done now."""
        at_most_s = self.cell.positions[self.locations[part - 1]].at_most_s
        if at_most_s is None or not option.waits:
            return False
        return self._pick_s(part, option) > self.ready_s[part - 1] + at_most_s + SLACK_S

    def spoils(self, decision: int) -> bool:
        """Whether a decision is not allowed only because it would pick its part too late."""
        part, choice = part_of(decision, self.cell.parts), choice_of(decision, self.cell.parts)
        if decision < 1 or not self._in_turn(part):
            return False
        options, full = self.cell.positions[self.locations[part - 1]].options, self._full()
        return any(o.choice == choice and o.possible(full) and self.too_late(part, o) for o in options)

    def move(self, decision: int) -> Move:
        """Carry a decision out; BadInput when it may not be taken."""
        option = self.option(decision)
        if option is None:
            raise BadInput(self.refusal(decision))
        cell, part = self.cell, part_of(decision, self.cell.parts)
        here, there = cell.positions[self.locations[part - 1]], cell.positions[option.to]
        start, leave_s = self.robot, self.now_s
        reach_s = self._reach_s(option)
        ready_s = max(reach_s, self.ready_s[part - 1]) if option.waits else reach_s
        pick_s = ready_s + option.service_s
        drop_s = pick_s + float(cell.loaded_s[option.origin, option.target])
        if not here.holds:
            self._fetch(pick_s)
        for station in here.holds:
            self.occupied[station] -= 1
        for station in there.holds:
            self.occupied[station] += 1
        self.locations[part - 1], self.robot, self.now_s = option.to, option.target, drop_s
        self.waited_s += ready_s - reach_s
        process_s = 0.0
        if there.processing_s is not None:
            process_s = self.times.processing_s(part, option.to)
            self.ready_s[part - 1] = drop_s + process_s
            self.processed_s += process_s
        if not there.options:
            self.finished_s[part - 1] = drop_s
        way = cell.names[start], cell.names[option.origin], cell.names[option.target]
        times_s = leave_s, reach_s, pick_s, drop_s, process_s
        return Move(part, *way, *times_s, option.service_s, option.carries)

    def refusal(self, decision: int) -> str:
        """Why the decision may not be taken now, in words; empty when it may."""
        cell, part = self.cell, part_of(decision, self.cell.parts)
        if decision < 1 or choice_of(decision, cell.parts) >= cell.most_choices:
            return f"there is no part {decision}, only 1 to {cell.parts}"
        if self.option(decision) is not None:
            return ""
        if self.spoils(decision):
            return self._burns(part)
        place = cell.positions[self.locations[part - 1]]
        name, where = cell.part_name(part), cell.names[place.station]
        if not place.options:
            return f"{name} {'is already' if not place.holds else 'stays'} at '{where}'"
        if not self._in_turn(part):
            return f"{name} has not come yet: {cell.part_name(cell.coming[self.fetched])} is before it"
        full = self._full()
        choice = choice_of(decision, cell.parts)
        if all(option.choice != choice for option in place.options):
            for option in cell.laid_out[self.locations[part - 1]].options:
                if option.choice == choice:
                    return f"{name} at '{where}': the way by '{cell.names[option.target]}' is closed"
        taken = dict.fromkeys(repr(cell.names[s]) for option in place.options for s in option.needs if full[s])
        if not taken:
            return f"{name} at '{where}' has no choice {choice_of(decision, cell.parts) + 1}"
        return f"{name} at '{where}' cannot move on: {' and '.join(taken)} full"

    def _burns(self, part: int) -> str:
        """That a part would be picked too late, in words."""
        cell, place = self.cell, self.cell.positions[self.locations[part - 1]]
        option = next(option for option in place.options if self.too_late(part, option))
        times_s = f"done at {self.ready_s[part - 1]:g} s, fetched at {self._pick_s(part, option):g} s"
        where = f"{cell.part_name(part)} in '{cell.names[place.station]}'"
        return f"{where} would burn: {times_s}, allowed {place.at_most_s:g} s"

    def _reach_s(self, option: Option) -> float:
        """When the robot is where it picks, if it goes there now."""
        return self.now_s + (
            0.0 if self.robot == option.origin else float(self.cell.empty_s[self.robot, option.origin])
        )

    def _pick_s(self, part: int, option: Option) -> float:
        return max(self._reach_s(option), self.ready_s[part - 1]) + option.service_s

    def _first_ready_s(self) -> list[float]:
        arrivals, all_s, came_s = self.cell.arrivals, list(self.cell.begin_s), 0.0
        if arrivals is not None:
            for part in self.cell.coming[: 1 if arrivals.after == "pick" else None]:
                came_s += self.times.interval_s(part)
                all_s[part - 1] = came_s
        return all_s

    def _fetch(self, pick_s: float) -> None:
        """A part was taken from its first station: where the next one is brought only now, it sets out."""
        self.fetched += 1
        arrivals, coming = self.cell.arrivals, self.cell.coming
        if arrivals is not None and arrivals.after == "pick" and self.fetched < len(coming):
            following = coming[self.fetched]
            self.ready_s[following - 1] = pick_s + self.times.interval_s(following)

    def _in_turn(self, part: int) -> bool:
        """Whether it is there: parts that arrive are taken in their order."""
        waits = self.locations[part - 1] == self.cell.starts[part - 1]
        return self.cell.arrivals is None or not waits or part == self.cell.coming[self.fetched]

    def _full(self) -> list[bool]:
        """Whether each station is."""
        return [taken >= most for taken, most in zip(self.occupied, self.cell.capacities, strict=True)]


def simulate(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Schedule:
    """The schedule of a sequence of decisions (see `Run`; one entry a move), with the cell's times or an episode's.

    Raises BadInput, with the position, for a decision that may not be taken there and for a sequence that ends too early.
    Source: thesis ch. 7.4, 7.5; makespan to the last arrival at the end of a route.
    """
    run, moves = Run(cell, times), []
    came_s: list[float] = [0.0] * cell.parts
    for position, decision in enumerate(sequence, 1):
        reason = run.refusal(decision)
        if reason:
            allowed = ", ".join(str(other) for other in run.allowed()) or (
                "none, all are done" if run.done else "none, it is a deadlock"
            )
            raise BadInput(f"position {position} of the sequence: {reason}; allowed here: {allowed}")
        part = part_of(decision, cell.parts)
        if run.locations[part - 1] == cell.starts[part - 1]:
            came_s[part - 1] = run.ready_s[part - 1]
        moves.append(run.move(decision))
    if not run.done:
        left = run.finished_s.index(None) + 1
        where = cell.names[cell.positions[run.locations[left - 1]].station]
        raise BadInput(
            f"the sequence ends after {counted(len(moves), 'move')}, but {cell.part_name(left)} is still at '{where}'"
        )
    return Schedule.from_moves(cell, moves, sequence, came_s)


def branch(run: Run) -> Run:
    """Another run that goes on from where this one is, by the same times."""
    other = Run(run.cell, run.times)
    take_over(other, run)
    return other


def follow(cell: Cell, sequence: Sequence[int], times: Episode | None = None) -> Run:
    """The run of a list of decisions, one after the other whatever the times; BadInput where one may not be taken."""
    run = Run(cell, times)
    for decision in sequence:
        run.move(decision)
    return run


def take_over(run: Run, state: Run) -> None:
    """Put a run where another one is; both share the cell, not the times."""
    run.locations, run.occupied = state.locations.copy(), state.occupied.copy()
    run.ready_s, run.finished_s = state.ready_s.copy(), state.finished_s.copy()
    run.robot, run.fetched = state.robot, state.fetched
    run.now_s, run.waited_s, run.processed_s = state.now_s, state.waited_s, state.processed_s
