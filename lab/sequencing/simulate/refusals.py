"""The rooms of stations that may be full and the robots that wait for them; and why a run does not allow a decision."""

from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.routes import Option, choice_of, part_of
from lab.sequencing.cell.stations import UNLIMITED


@dataclass
class Rooms:
    """The rooms of stations that may be full.

    free_s: by station, since when each of its free rooms is free, ascending [s]. robots: by station, the robots that wait for
    room there, in the order of their decisions.
    """

    free_s: dict[int, list[float]] = field(default_factory=dict)
    robots: dict[int, list[int]] = field(default_factory=dict)

    def lacking(self, stations: Sequence[int]) -> list[int]:
        """The stations among these that have no free room."""
        return [station for station in stations if station in self.free_s and not self.free_s[station]]

    def take(self, stations: Sequence[int]) -> float:
        """Since when all these stations have room [s]; the room that was free first is taken in each."""
        return max((self.free_s[s].pop(0) for s in stations if s in self.free_s), default=0.0)

    def wait(self, robot: int, station: int) -> None:
        """Adds a robot to those that wait for room in a station, behind the others."""
        self.robots.setdefault(station, []).append(robot)

    def free(self, station: int, at_s: float) -> int | None:
        """Frees a room from a time on; returns the robot that waited for it and takes it, None when no robot waited."""
        if self.robots.get(station):
            return self.robots[station].pop(0)
        if station in self.free_s:
            insort(self.free_s[station], at_s)
        return None

    def waiting(self, station: int) -> Sequence[int]:
        """The robots that wait for room in a station."""
        return self.robots.get(station, ())

    def awaited(self, robot: int) -> list[int]:
        """The stations in which a robot waits for room."""
        return [station for station, robots in self.robots.items() if robot in robots]

    def copy(self) -> "Rooms":
        """An independent copy."""
        return Rooms(
            {at: times_s.copy() for at, times_s in self.free_s.items()},
            {at: robot.copy() for at, robot in self.robots.items()},
        )


def rooms_of(capacities: Sequence[int], occupied: Sequence[int]) -> Rooms:
    """The rooms of all stations at time 0."""
    both = enumerate(zip(capacities, occupied, strict=True))
    return Rooms({n: [0.0] * (room - taken) for n, (room, taken) in both if room < UNLIMITED})


# ---- Reasons for refusals ---------------------------------------------------------------------------------------------


class Decided(Protocol):
    """The part of `Run` that reasons are derived from."""

    cell: Cell
    locations: list[int]
    ready_s: list[float]
    held: list[int]
    rooms: Rooms
    fetched: int

    def full(self) -> Sequence[bool]: ...
    def inside(self, station: int) -> Sequence[int]: ...
    def in_turn(self, part: int) -> bool: ...
    def spoils(self, decision: int) -> bool: ...
    def too_late(self, part: int, option: Option) -> bool: ...
    def waits_for(self, part: int, option: Option) -> str: ...
    def pick_s(self, part: int, option: Option) -> float: ...


def refusal(run: Decided, decision: int) -> str:
    """The reason, in words, why a decision is not allowed now; it must be one that is not."""
    cell, part = run.cell, part_of(decision, run.cell.parts)
    if decision < 1 or choice_of(decision, cell.parts) >= cell.most_choices:
        return f"there is no part {decision}, only 1 to {cell.parts}"
    if run.spoils(decision):
        return _burns(run, part)
    place = cell.positions[run.locations[part - 1]]
    name, where = cell.part_name(part), cell.names[place.station]
    if not place.options:
        return f"{name} {'is already' if not place.holds else 'stays'} at '{where}'"
    if not run.in_turn(part):
        return f"{name} has not come yet: {cell.part_name(cell.coming[run.fetched])} is before it"
    full = run.full()
    choice = choice_of(decision, cell.parts)
    if all(option.choice != choice for option in place.options):
        for option in cell.laid_out[run.locations[part - 1]].options:
            if option.choice == choice:
                return f"{name} at '{where}': the route by '{cell.names[option.target]}' is closed"
    waits = next((why for o in place.options if o.possible(full) and (why := run.waits_for(part, o))), "")
    if waits:
        return f"{name} at '{where}' may not {waits}"
    for robot, held in enumerate(run.held):
        if held and (held == part or any(o.choice == choice and o.robot == robot for o in place.options)):
            where = " and ".join(repr(cell.names[station]) for station in run.rooms.awaited(robot))
            return f"'{cell.robots[robot].name}' holds {cell.part_name(held)} until there is room in {where}"
    taken = dict.fromkeys(repr(cell.names[s]) for option in place.options for s in option.needs if full[s])
    if not taken:
        return f"{name} at '{where}' has no choice {choice_of(decision, cell.parts) + 1}"
    emptied = [s for option in place.options for s in option.needs if full[s] and s in cell.batches]
    if any(len(run.inside(station)) < cell.capacities[station] for station in emptied):
        return f"{name} at '{where}' cannot move on: the batch in {' and '.join(taken)} has begun"
    return f"{name} at '{where}' cannot move on: {' and '.join(taken)} full"


def _burns(run: Decided, part: int) -> str:
    """The reason, in words, that a part would be picked too late."""
    cell, place = run.cell, run.cell.positions[run.locations[part - 1]]
    option = next(option for option in place.options if run.too_late(part, option))
    times_s = f"done at {run.ready_s[part - 1]:g} s, fetched at {run.pick_s(part, option):g} s"
    where = f"{cell.part_name(part)} in '{cell.names[place.station]}'"
    return f"{where} would burn: {times_s}, allowed {place.at_most_s:g} s"
