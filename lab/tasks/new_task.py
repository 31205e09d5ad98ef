"""A new task from a few words (an arm, parts, machines), and the layout of its stations around the arm."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from math import ceil, cos, hypot, inf, isfinite, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

from lab.errors import BadInput, counted, unknown
from lab.tasks.robot_fields import MODELS
from lab.tasks.task_fields import MAX_PARTS

PART, MACHINE = "box:0.06x0.03x0.08:3", "press:30"  # the defaults
SIZES = {"box": ("XxYxZ", 3), "cylinder": ("DIAMETERxHEIGHT", 2)}
PART_WORDS = "SHAPE:SIZE:COUNT, in metres, such as box:0.12x0.015x0.12:2 or cup=cylinder:0.035x0.1:1"
MACHINE_WORDS = "NAME:SECONDS, such as oven:60"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,30}")
LARGEST_M, SMALLEST_M, LONGEST_S = 0.5, 0.005, 86_400
KG_M3 = 400.0  # the default density of a part, about that of wood
HEAVIEST_KG, LIGHTEST_KG = 3.0, 0.02  # limits of the default mass: a lighter part falls over when it is released
FRICTION = 0.8
MACHINE_HIGH_M, AROUND_PART_M = 0.05, 0.06  # height of a machine's box; its length and width beyond the part's
COLUMNS, BUFFER_ROOM = 4, 2  # columns of spots in a storage; capacity of a buffer
BETWEEN_M, GRIPPER_M = 0.04, 0.045  # least gap between parts of a station; width of the open gripper beside a part
OVER_M, CELL_M, LEVELS = 0.08, 0.12, 3  # clearance under a carried part; edge of a workspace cell; levels of cells
GAPS_M = (0.15, 0.10, 0.06, 0.03)  # gaps between stations, of which the widest that fits is taken
TURNS = (90, 75, 105, 60)  # [degrees] from ahead to the first and to the last station
# of the way from the nearest to the farthest place that is reached
SHARES = (0.44, 0.52, 0.36, 0.6, 0.68, 0.76, 0.84, 0.92)
EDGE_M = 0.03  # margin at both edges of the reach


@dataclass(frozen=True)
class NewPart:
    """A kind of part and its count; size_m: [x, y, z] of a box or [diameter, height] of a cylinder [m].

    given_kg: its mass; None: that of wood.
    """

    name: str
    shape: str
    size_m: tuple[float, ...]
    count: int
    given_kg: float | None = None
    friction: float = FRICTION

    @property
    def foot_m(self) -> tuple[float, float]:
        """Its extents along x and y."""
        return (self.size_m[0], self.size_m[1] if self.shape == "box" else self.size_m[0])

    @property
    def mass_kg(self) -> float:
        """The mass of one part [kg]."""
        if self.given_kg is not None:
            return self.given_kg
        share = 1.0 if self.shape == "box" else pi / 4
        x, y = self.foot_m
        return round(min(max(share * x * y * self.size_m[-1] * KG_M3, LIGHTEST_KG), HEAVIEST_KG), 3)


@dataclass(frozen=True)
class NewMachine:
    """A machine and its processing time [s]."""

    name: str
    processing_s: float


@dataclass(frozen=True)
class NewTask:
    """A task in which an arm carries parts from an input through all machines, in order, to an output.

    buffers: whether each machine has a buffer before it. capacities: by name, of stations that differ from the default. batches:
    the machines that work on all parts in them together.
    """

    name: str
    arm: str = "up6"
    parts: tuple[NewPart, ...] = ()
    machines: tuple[NewMachine, ...] = ()
    buffers: bool = False
    capacities: Mapping[str, int] = field(default_factory=dict)
    batches: tuple[str, ...] = ()

    @property
    def stations(self) -> dict[str, tuple[str, int]]:
        """The kind and the capacity of each station, in the order of the route."""
        by_name = {"input": ("storage", self.count)}
        for machine in self.machines:
            if self.buffers:
                by_name[f"{machine.name}_buffer"] = ("buffer", BUFFER_ROOM)
            by_name[machine.name] = ("machine", 1)
        by_name["output"] = ("storage", self.count)
        return {name: (kind, self.capacities.get(name, own)) for name, (kind, own) in by_name.items()}

    @property
    def count(self) -> int:
        """The number of parts."""
        return sum(part.count for part in self.parts)

    @property
    def foot_m(self) -> tuple[float, float]:
        """The largest extents of its parts along x and y."""
        return max(part.foot_m[0] for part in self.parts), max(part.foot_m[1] for part in self.parts)


class Around(NamedTuple):
    """The reach of an arm: nearest and farthest distance from its axis [m], and its turn from ahead to either side [rad]."""

    nearest_m: float
    farthest_m: float
    turn_rad: float


class PlacedStation(NamedTuple):
    """A station in a layout: its middle x, y [m], and its parts' spots relative to that [m].

    lists_spots: whether the file lists the spots; else the station has its default rows, a little closer together than these.
    """

    name: str
    kind: str
    capacity: int
    x: float
    y: float
    spots: tuple[tuple[float, float], ...]
    lists_spots: bool

    def half_m(self, foot: tuple[float, float]) -> tuple[float, float]:
        """How far parts with such a foot, and the gripper around them, reach from its middle at most, along x and y [m]."""
        along, across = (max(abs(spot[axis]) for spot in self.spots) + foot[axis] / 2 + GRIPPER_M for axis in (0, 1))
        return along, across


# ---- The task that words describe ---------------------------------------------------------------------------------


def file_of(word: str) -> tuple[Path, str]:
    """The file to be written and the task's name, from NAME with or without .toml; raises BadInput for an invalid name, and
    for a file that exists.
    """
    path = Path(word if word.endswith(".toml") else f"{word}.toml")
    if not NAME.fullmatch(path.stem):
        raise BadInput(
            f"name '{word}' (NAME): wanted up to 31 letters, digits, '_', '-' and spaces, a letter or digit first"
        )
    if path.exists():
        raise BadInput(f"task file '{path}' (NAME): there is one already: choose another name, or remove it")
    if not path.parent.is_dir():
        raise BadInput(f"task file '{path}' (NAME): there is no folder '{path.parent}'")
    return path, path.stem


def arm_of_word(word: str) -> str:
    """The name of an arm that ships; raises BadInput for any other."""
    if word not in MODELS:
        raise unknown("arm", word, MODELS, "--arm")
    return word


def part_of_word(word: str, taken: Collection[str] = ()) -> NewPart:
    """The kind of part of a word such as "cup=cylinder:0.035x0.1:1"; the default name is its shape's. Raises BadInput."""
    where = f"part '{word}' (--part)"
    match = re.fullmatch(r"(?:([^=:]*)=)?([^=:]*):([^=:]*):([^=:]*)", word)
    if match is None:
        raise BadInput(f"{where}: wanted {PART_WORDS}")
    named, shape, size, count = match.groups()
    if shape not in SIZES:
        raise unknown("shape", shape, SIZES, where)
    form, numbers = SIZES[shape]
    edges = tuple(_number(edge) for edge in size.split("x"))
    if len(edges) != numbers or not all(SMALLEST_M <= edge <= LARGEST_M for edge in edges):
        raise BadInput(f"{where}: the size of a {shape} is {form}, each {SMALLEST_M} to {LARGEST_M} m, not '{size}'")
    if not re.fullmatch(r"[0-9]{1,3}", count) or not 1 <= int(count) <= MAX_PARTS:
        raise BadInput(f"{where}: how many: '{count}': allowed are 1 to {MAX_PARTS}")
    own = next(name for n in range(1, MAX_PARTS + 2) if (name := shape if n == 1 else f"{shape}-{n}") not in taken)
    name = own if named is None else named
    _check_name(name, where, taken)
    return NewPart(name, shape, edges, int(count))


def machine_of_word(word: str, taken: Collection[str] = ()) -> NewMachine:
    """The machine of a word such as "oven:60". Raises BadInput."""
    where = f"machine '{word}' (--machine)"
    name, colon, time = word.rpartition(":")
    if not colon:
        raise BadInput(f"{where}: wanted {MACHINE_WORDS}")
    seconds = _number(time)
    if not 0 <= seconds <= LONGEST_S:
        raise BadInput(f"{where}: '{time}' seconds: allowed are 0 to {LONGEST_S}")
    _check_name(name, where, taken)
    return NewMachine(name, seconds)


class Changes(NamedTuple):
    """What a new task changes by name: masses [kg] and frictions of kinds of parts, such as "pin=0.05"; capacities of stations,
    such as "oven=2"; the names of machines that work on batches.
    """

    masses: Sequence[str] = ()
    frictions: Sequence[str] = ()
    capacities: Sequence[str] = ()
    batches: Sequence[str] = ()


NO_CHANGES = Changes()


def new_task(
    name: str, arm: str, parts: Sequence[str], machines: Sequence[str], buffers: bool, changes: Changes = NO_CHANGES
) -> NewTask:
    """The new task that options, or answers, describe. Raises BadInput."""
    kinds: list[NewPart] = []
    for word in parts or (PART,):
        kinds.append(part_of_word(word, [part.name for part in kinds]))
    stations: list[NewMachine] = []
    for word in machines:
        stations.append(
            machine_of_word(word, ["input", "output", *(m.name for m in stations), *(p.name for p in kinds)])
        )
    names = [part.name for part in kinds]
    weigh = _by_name(changes.masses, "--mass", "part", names, (0.001, 6.0), "0.05")
    rub = _by_name(changes.frictions, "--friction", "part", names, (0.0, 5.0), "0.5")
    kinds = [replace(kind, given_kg=weigh.get(kind.name), friction=rub.get(kind.name, FRICTION)) for kind in kinds]
    new = NewTask(name, arm_of_word(arm), tuple(kinds), tuple(stations), buffers)
    if new.count > MAX_PARTS:
        raise BadInput(f"{new.count} parts (--part): allowed are 1 to {MAX_PARTS} in all")
    new = replace(new, capacities=_capacities(new, changes.capacities))
    for name in changes.batches:
        if name not in [machine.name for machine in new.machines]:
            raise unknown("machine", name, [machine.name for machine in new.machines], "--batch")
        if new.stations[name][1] < 2:
            raise BadInput(f"'{name}' (--batch): it holds 1 part, a batch needs room for 2: add --capacity {name}=2")
    return replace(new, batches=tuple(dict.fromkeys(changes.batches)))


def _by_name(
    words: Sequence[str], option: str, label: str, names: Collection[str], allowed: tuple[float, float], example: str
) -> dict[str, float]:
    """The numbers of an option such as --mass pin=0.05 by name. Raises BadInput."""
    numbers: dict[str, float] = {}
    for word in words:
        name, equals, number = word.rpartition("=")
        if not equals:
            raise BadInput(f"'{word}' ({option}): wanted NAME=NUMBER, such as {min(names)}={example}")
        if name not in names:
            raise unknown(label, name, names, option)
        value = _number(number, -inf)
        if not allowed[0] <= value <= allowed[1]:
            raise BadInput(f"'{word}' ({option}): '{number}': allowed are {allowed[0]:g} to {allowed[1]:g}")
        if name in numbers:
            raise BadInput(f"'{word}' ({option}): {label} '{name}' has {numbers[name]:g} already: once is allowed")
        numbers[name] = value
    return numbers


def _capacities(new: NewTask, words: Sequence[str]) -> dict[str, int]:
    by_station = _by_name(words, "--capacity", "station", [*new.stations], (1, MAX_PARTS), "2")
    for name, most in by_station.items():
        least = new.count if new.stations[name][0] == "storage" else 1
        if most != int(most) or most < least:
            raise BadInput(f"'{name}={most:g}' (--capacity): allowed are whole numbers from {least} to {MAX_PARTS}")
    return {name: int(most) for name, most in by_station.items()}


def _number(text: str, none: float = -1.0) -> float:
    """The number in a text; `none` when it holds none."""
    try:
        value = float(text)
    except ValueError:
        return none
    return value if isfinite(value) else none


def _check_name(name: str, where: str, taken: Collection[str]) -> None:
    if not NAME.fullmatch(name):
        raise BadInput(f"{where}: the name '{name}': wanted letters, digits, '_', '-' and spaces, up to 31")
    if name in taken:
        raise BadInput(f"{where}: the name '{name}' is taken: {', '.join(taken)}")


# ---- The layout of its stations -----------------------------------------------------------------------------------


def heights_m(new: NewTask) -> tuple[float, float]:
    """The approximate lowest height at which the tool grips a part, and the height at which it carries parts [m]."""
    tallest = max(part.size_m[-1] for part in new.parts)
    return SMALLEST_M, round(MACHINE_HIGH_M + 2 * tallest + OVER_M, 3)


def layouts(new: NewTask, around: Around, between_m: float | None = None) -> Iterator[tuple[PlacedStation, ...]]:
    """Layouts of the stations on an arc around the arm, in the order of the route, the widest first; empty when none fits.

    between_m: the gap between parts of a station [m]; None: the default of stations.
    """
    stations = _stations(new, between_m)
    for gap, turn, share in product(GAPS_M, TURNS, SHARES):
        if radians(turn) > around.turn_rad:
            continue
        far = around.nearest_m + share * (around.farthest_m - around.nearest_m)
        angles = [radians(turn) * (1 - 2 * number / (len(stations) - 1)) for number in range(len(stations))]
        placed = tuple(
            station._replace(x=round(far * cos(angle), 3), y=round(far * sin(angle), 3))
            for station, angle in zip(stations, angles, strict=True)
        )
        if all(_reached(station, around) for station in placed) and _apart(placed, new.foot_m, gap):
            yield placed


def does_not_fit(new: NewTask, around: Around) -> BadInput:
    """The error for a task without a layout."""
    return BadInput(
        f"{counted(len(_stations(new)), 'station')} for {counted(new.count, 'part')} do not fit around the arm '{new.arm}', "
        f"which reaches {around.nearest_m:.2f} to {around.farthest_m:.2f} m there: take fewer or smaller parts, or fewer machines"
    )


def _stations(new: NewTask, between_m: float | None = None) -> list[PlacedStation]:
    """The stations in the order of the route, before they are laid out: all at the arm's foot."""
    pitch = [foot + (between_m or BETWEEN_M) for foot in new.foot_m]

    def placed(name: str, kind: str, capacity: int) -> PlacedStation:
        columns = min(COLUMNS, capacity) if kind == "storage" else 1
        rows = ceil(capacity / columns)
        at = product(range(columns), range(rows))
        first = (rows - 1) / 2 if kind == "machine" else (rows - 1) // 2  # a machine's body lies around its middle
        spots = [((c - (columns - 1) / 2) * pitch[0], (r - first) * pitch[1]) for c, r in at]
        spots = sorted(spots, key=lambda spot: (round(hypot(*spot), 6), spot))[:capacity]
        lists_spots = capacity > 1 and (between_m is not None or kind == "machine")
        return PlacedStation(name, kind, capacity, 0.0, 0.0, tuple(spots), lists_spots)

    return [placed(name, kind, capacity) for name, (kind, capacity) in new.stations.items()]


def _reached(station: PlacedStation, around: Around) -> bool:
    far = [hypot(station.x + x, station.y + y) for x, y in station.spots]
    return around.nearest_m + EDGE_M <= min(far) and max(far) <= around.farthest_m - EDGE_M


def _apart(placed: Sequence[PlacedStation], foot: tuple[float, float], gap: float) -> bool:
    for one, other in combinations(placed, 2):
        (along, across), (length, width) = one.half_m(foot), other.half_m(foot)
        if abs(one.x - other.x) < along + length + gap and abs(one.y - other.y) < across + width + gap:
            return False
    return True
