"""Hoist lines as CSV, as those of Phillips and Unger (1976): the tanks; the hoist's empty moves are in a layout file."""

from lab.tasks.cell_file import CellFile
from lab.tasks.instances.hoist import LOAD, UNLOAD, HoistLine, cell_of_line
from lab.tasks.instances.layout import csv_rows, read_layout
from lab.tasks.instances.source import MOST_MACHINES, Asked, Source

HEADER = ("tank", "soak_min", "soak_max", "move_from_previous")


def read(source: Source, asked: Asked) -> CellFile:
    """The cell of such a file: a row a tank, in the order of the parts' way, and a last one, "unload". BadInput, with line."""
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
