"""The features of drawn cells: each function changes the tables of a task file, and returns whether it applied."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import product
from math import ceil
from typing import Any

import numpy as np

from devtools.drawn_parts import DrawnPart, Rng, Table

SPARE_WINDOW_S, FORCE_N = (15.0, 90.0), (8.0, 80.0)  # forces are drawn log-uniformly
LAYER_M = 0.08  # the gap between the stacks of a layer
LEVEL_HIGH_M = 0.03  # the least height of a part that a level tool takes


@dataclass
class DrawnCell:
    """The tables of a task file while it is drawn."""

    rng: Rng
    parts: list[DrawnPart]
    robot: Table
    stations: dict[str, Table]
    route: list[str]  # the stations, in the order in which parts come to them
    more: Table = field(default_factory=dict)  # processes, obstacles, sequencing
    features: list[str] = field(default_factory=list)

    def machines(self) -> list[str]:
        """The machines, in the order of the route."""
        return [name for name, table in self.stations.items() if table["kind"] == "machine"]

    def routes(self) -> list[list[Any]]:
        """The routes through the stations, one for each choice among parallel machines."""
        choices = [self.stations[name].get("parallel", [name]) for name in self.route]
        return [[self._stage(name) for name in way] for way in product(*choices)]

    def _stage(self, name: str) -> Any:
        table = self.stations[name]
        stage = {key: table[key] for key in ("buffer", "service", "pallet") if key in table}
        return {"station": name, **stage} if stage else name

    def count(self) -> int:
        """How many parts there are."""
        return sum(part.table["count"] for part in self.parts)


def evenly(rng: Rng, ends: tuple[float, float]) -> float:
    """A log-uniform random number with three significant digits."""
    return float(f"{float(np.exp(rng.uniform(*np.log(ends)))):.3g}")


def grip_force(cell: DrawnCell) -> bool:
    """The file limits the force of the fingers."""
    cell.robot["grip_force_n"] = evenly(cell.rng, FORCE_N)
    return True


def buffers(cell: DrawnCell) -> bool:
    """Parts wait before each machine while it is busy."""
    for name in cell.machines():
        cell.stations[name]["buffer"] = f"{name}-buffer"
        cell.stations[f"{name}-buffer"] = {"kind": "buffer", "capacity": int(cell.rng.integers(1, 3))}
    return bool(cell.machines())


def capacities(cell: DrawnCell) -> bool:
    """Machines have room for several parts, and process each by itself."""
    for name in cell.machines():
        cell.stations[name]["capacity"] = int(cell.rng.integers(2, 4))
    return bool(cell.machines())


def alternatives(cell: DrawnCell) -> bool:
    """A second machine stands in parallel to the first, which makes two routes."""
    if not cell.machines():
        return False
    first = cell.machines()[0]
    other = f"{first}-b"
    cell.stations[other] = {**cell.stations[first]}
    cell.stations[first]["parallel"] = [first, other]
    return True


def windows(cell: DrawnCell) -> bool:
    """Parts spoil in a machine when they stay too long."""
    for name in cell.machines()[:1]:
        cell.stations[name]["at_most_s"] = round(float(cell.rng.uniform(*SPARE_WINDOW_S)), 1)
    return bool(cell.machines())


def cover(cell: DrawnCell) -> bool:
    """The last machine has a head that covers the side of slices; they stand in its slot."""
    if not cell.machines() or len(cell.parts) > 1 or cell.parts[0].form != "box":
        return False
    table, part = cell.stations[cell.machines()[-1]], cell.parts[0]
    if "at_most_s" in table:
        return False
    long, high = (round(float(edge), 4) for edge in cell.rng.uniform(0.1, 0.12, 2))
    size = (long, 0.015, high)
    slices = {key: value for key, value in part.table.items() if key != "grip"}
    cell.parts = [replace(part, table={**slices, "size_m": list(size), "mass_kg": 0.05}, extents_m=size)]
    for key in ("processing_s", "high_m"):
        del table[key]
    table |= {"process": "glue", "capacity": 1, "body": "applier.urdf", "floor_m": 0.02}
    grid = [int(count) for count in cell.rng.integers(1, 4, 2)]
    cell.more.setdefault("processes", {})["glue"] = {"grid": grid, "dwell_s": 1.0, "speed_m_s": 0.03}
    return True


def service(cell: DrawnCell) -> bool:
    """The robot cleans beside the part before it takes it out of the first machine."""
    if not cell.machines():
        return False
    table = cell.stations[cell.machines()[0]]
    if "process" in table:
        return False
    table["service"] = "vacuum"
    process = {"by": "robot", "grid": [2, 2], "dwell_s": 2.0, "speed_m_s": 0.1, "area_m": [0.06, 0.06]}
    cell.more.setdefault("processes", {})["vacuum"] = process | {"off_m": [-0.12, 0.0, table["high_m"] + 0.03]}
    table["ahead_m"] = 0.2  # how much farther its body reaches towards the arm
    return True


def pallets(cell: DrawnCell) -> bool:
    """Parts of one kind come and go on pallets, and are lifted off them in the machines."""
    if len(cell.parts) > 1 or cell.robot["model"] != "up6" or len(cell.machines()) != 1:
        return False
    x, y, z = cell.parts[0].extents_m
    if max(x, y) > 0.1 or y > 0.028 or z > 0.05:
        return False
    cell.parts[0].table["pallet"] = "pallet"
    size = [round(max(0.08, x + 0.03), 3), 0.034, 0.02]
    pallet = {"name": "pallet", "shape": "box", "size_m": size, "mass_kg": 0.12, "friction": 0.8}
    cell.more["pallet"] = pallet | {"grip": {"yaw": 0.0, "up_m": 0.005}}
    for name in cell.machines():  # an empty pallet is carried from the buffer before a machine to the one after it
        cell.stations[name] |= {"pallet": True}
        cell.stations[name].pop("buffer", None)
    cell.stations = {name: table for name, table in cell.stations.items() if table["kind"] != "buffer"}
    route = ["in"]
    for name in cell.route[1:-1]:
        for beside_it in (f"{name}-in", f"{name}-out"):
            cell.stations[beside_it] = {"kind": "buffer", "capacity": 1}
        route += [f"{name}-in", name, f"{name}-out"]
    cell.route = [*route, "out"]
    return True


def layers(cell: DrawnCell) -> bool:
    """Parts of one kind are stacked where they end, two or three high."""
    part = cell.parts[0]
    if len(cell.parts) > 1 or not part.stacks or "pallet" in part.table or part.extents_m[2] > 0.06:
        return False
    part.table["count"] = count = int(cell.rng.integers(2, 5))
    high = 2 if count < 4 or cell.rng.random() < 0.5 else 3
    columns = ceil(count / high)
    pitch, height = part.extents_m[1] + LAYER_M, round(part.extents_m[2], 4)
    places = [
        {"at": [0.0, round((column - (columns - 1) / 2) * pitch, 4), 0.0], "height_m": round(layer * height, 4)}
        for layer in range(high)
        for column in range(columns)
    ]
    cell.stations["out"] |= {"places": places, "capacity": len(places)}
    cell.stations["in"]["capacity"] = count
    return True


def nests(cell: DrawnCell) -> bool:
    """Parts end in a kit, where each kind has its own places."""
    if len(cell.parts) < 2:
        return False
    along, across = (max(part.extents_m[axis] for part in cell.parts) for axis in (0, 1))
    kinds = [part.name for part in cell.parts for _ in range(part.table["count"])]
    columns = 1 if len(kinds) < 3 else 2
    rows = ceil(len(kinds) / columns)
    at = [
        [
            round((c - (columns - 1) / 2) * (along + LAYER_M), 4),
            round((r - (rows - 1) / 2) * (across + LAYER_M), 4),
            0.0,
        ]
        for r in range(rows)
        for c in range(columns)
    ]
    places = [{"at": here, "kind": kind} for here, kind in zip(at, kinds, strict=False)]
    cell.stations["out"] |= {"places": places, "capacity": len(places)}
    return True


def obstacle(cell: DrawnCell) -> bool:
    """A tower stands between two stations; its position is computed once theirs are known."""
    cell.more["obstacles"] = [{"name": "tower", "cubes": int(cell.rng.integers(2, 6)), "area": [0.02, 0.02]}]
    return True


def methods(cell: DrawnCell) -> bool:
    """The file names a sequencing method."""
    method = str(cell.rng.choice(["fifo", "exact", "cp-sat", "srl", "shortest-move"]))
    cell.more["sequencing"] = {"method": method, "episodes": 300}
    return True


def level_tool(cell: DrawnCell) -> bool:
    """A furnace between shelves is entered from the side with a level tool; it comes last, as it replaces all stations."""
    if any(part.extents_m[2] < LEVEL_HIGH_M for part in cell.parts):
        return False
    cell.robot = cell.robot | {"model": "iiwa"}
    cell.robot.pop("base_up_m", None)
    shelf = round(float(cell.rng.uniform(0.10, 0.14)), 3)
    for part in cell.parts:
        part.table.pop("grip", None)
    ends = {name: cell.stations[name] | {"high_m": shelf} for name in ("in", "out")}
    for table in ends.values():
        table.pop("places", None)
        table["capacity"] = cell.count()
    furnace = {"kind": "machine", "capacity": 1, "processing_s": 20.0, "body": "furnace.urdf", "floor_m": 0.12,
               "approach": "side"}  # fmt: skip
    cell.stations = {"in": ends["in"], "furnace": furnace, "out": ends["out"]}
    cell.route, cell.more = ["in", "furnace", "out"], {}
    cell.features.clear()
    return True


FEATURES: dict[str, tuple[float, Callable[[DrawnCell], bool]]] = {
    "grip force": (0.2, grip_force),
    "buffers": (0.3, buffers),
    "capacities": (0.3, capacities),
    "windows": (0.25, windows),
    "cover": (0.12, cover),
    "service": (0.12, service),
    "alternatives": (0.25, alternatives),
    "pallets": (0.35, pallets),
    "layers": (0.5, layers),
    "nests": (0.35, nests),
    "obstacle": (0.25, obstacle),
    "another method": (0.25, methods),
    "level tool": (0.08, level_tool),
}
