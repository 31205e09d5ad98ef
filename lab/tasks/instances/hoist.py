"""Cyclic hoist lines as cells: one hoist carries parts through tanks in order, each with a least and a largest soak time.

`read` reads the format of Phillips and Unger: CSV with a row for each tank.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lab.errors import BadInput
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import built
from lab.tasks.instances.layout import csv_rows, read_layout
from lab.tasks.instances.source import MOST_MACHINES, InstanceRequest, Source

LOAD, UNLOAD = "load", "unload"
PARTS = 4  # the default number of parts of a finite order
_STORE = 200


@dataclass(frozen=True)
class HoistLine:
    """A line of tanks, all times in the file's unit.

    least, most: soak times (None: no limit). full: the times of the loaded moves into each tank and, last, to the end. empty:
    from tank -> to tank -> time of the hoist, by the names of tanks, LOAD and UNLOAD. capacity: parts that a tank holds.
    """

    tanks: Sequence[str]
    least: Sequence[float]
    most: Sequence[float | None]
    full: Sequence[float]
    empty: Mapping[str, Mapping[str, float]]
    capacity: int = 1
    parts: int = PARTS


def cell_of_line(source: Source, line: HoistLine, asked: InstanceRequest) -> CellFile:
    """The cell of a hoist line; raises BadInput for several hoists, which would meet on their common track."""
    if asked.robots not in (None, 1):
        wanted = "wanted 1: hoists share a track, and the lab's robots do not hinder each other"
        raise BadInput(f"--robots {asked.robots} beside {source.path}: {wanted}")
    stations: list[dict[str, Any]] = [{"name": LOAD, "kind": "storage", "capacity": _STORE}]
    for name, least, most in zip(line.tanks, line.least, line.most, strict=True):
        tank: dict[str, Any] = {"name": name, "kind": "machine", "capacity": line.capacity, "processing_s": least}
        stations.append(tank | ({} if most is None else {"at_most_s": most - least}))
    stations.append({"name": UNLOAD, "kind": "storage", "capacity": _STORE})
    way = [LOAD, *line.tanks, UNLOAD]
    raw = {
        "kind": "cell",
        "name": source.name,
        "parts": line.parts,
        "robot": {"start": UNLOAD},
        "stations": stations,
        "products": [{"name": "carrier", "routes": [way]}],
        "travel": {a: {b: time for b, time in row.items() if a != b} for a, row in line.empty.items()},
        "loaded": {a: {b: time} for a, b, time in zip(way, way[1:], line.full, strict=False)},
        "sequencing": {"method": "exact", "episodes": 100},
    }
    return built(source, raw)


# ---- The format of Phillips and Unger ---------------------------------------------------------------------------------


HEADER = ("tank", "soak_min", "soak_max", "move_from_previous")


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of a file with a row for each tank, in the order of the parts' path, and a last row "unload".

    Raises BadInput, with file and line, for any other.
    """
    rows = csv_rows(source)
    line, header = next(rows, (1, []))
    if tuple(word.lower() for word in header) != HEADER:
        raise source.refusal(line, ",".join(HEADER), ",".join(header))
    tanks, least, full = list[str](), list[float](), list[float]()
    most = list[float | None]()
    ended = False
    for line, row in rows:
        if len(row) != len(HEADER) or ended or len(tanks) > MOST_MACHINES:
            wanted = (
                f"a tank's {len(HEADER)} values ({','.join(HEADER)}), at most {MOST_MACHINES} tanks, and unload last"
            )
            raise source.refusal(line, wanted, ",".join(row))
        full.append(source.time(row[3], line, f"the move to '{row[0]}'"))
        if row[0] == UNLOAD:
            ended = True
            continue
        tanks.append(f"tank-{row[0]}")
        least.append(source.time(row[1], line, f"the least time in tank '{row[0]}'"))
        most.append(source.time(row[2], line, f"the most time in tank '{row[0]}'") if row[2] else None)
        if most[-1] is not None and most[-1] < least[-1]:
            raise source.refusal(line, f"a most time of at least {row[1]}", row[2])
    if not ended:
        raise source.refusal(
            line, f"a last row '{UNLOAD}', with the move out of the last tank: the file ends before it"
        )
    if asked.layout is None:
        raise source.refusal(None, "the hoist's empty moves beside it: give --layout FILE")

    def named(name: str) -> str:
        return name if name in (LOAD, UNLOAD) else f"tank-{name}"

    travel = read_layout(asked.layout, asked.case).travel
    empty = {named(a): {named(b): time for b, time in row.items()} for a, row in travel.items()}
    return cell_of_line(source, HoistLine(tanks, least, most, full, empty), asked)
