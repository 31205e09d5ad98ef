"""Since when the rooms of stations are free, and which robots wait for one: where what is decided later may happen earlier."""

from bisect import insort
from collections.abc import Sequence
from dataclasses import dataclass, field

from lab.sequencing.cell.stations import UNLIMITED


@dataclass
class Rooms:
    """free_s: by station that may be full, since when each of its free rooms is free, ascending [s]. robots: by station, those
    that wait for room there, in the order of their decisions."""

    free_s: dict[int, list[float]] = field(default_factory=dict)
    robots: dict[int, list[int]] = field(default_factory=dict)

    def lacking(self, stations: Sequence[int]) -> list[int]:
        """Those in which there is no room."""
        return [station for station in stations if station in self.free_s and not self.free_s[station]]

    def take(self, stations: Sequence[int]) -> float:
        """Since when there is room in all of these, which has it [s]: in each what is free first is taken."""
        return max((self.free_s[s].pop(0) for s in stations if s in self.free_s), default=0.0)

    def wait(self, robot: int, station: int) -> None:
        """A robot waits for room in a station, behind those that do so already."""
        self.robots.setdefault(station, []).append(robot)

    def free(self, station: int, at_s: float) -> int | None:
        """A room is free from a time on; the robot that has waited for it and takes it; None: nobody has."""
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
        """The same, which changes by itself."""
        return Rooms(
            {at: times_s.copy() for at, times_s in self.free_s.items()},
            {at: one.copy() for at, one in self.robots.items()},
        )


def rooms_of(capacities: Sequence[int], occupied: Sequence[int]) -> Rooms:
    """The rooms at time 0."""
    both = enumerate(zip(capacities, occupied, strict=True))
    return Rooms({n: [0.0] * (room - taken) for n, (room, taken) in both if room < UNLIMITED})
