"""Cells with known cycles."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import Product, Stage, Station, one_robot

# Phillips and Unger 1976: least and most soak [s] of tanks 1 to 12, loaded moves into each and out of the last, empty moves
# from tank (row) to tank (column; the first is the load), the last row from the unload.
SOAK_S = [
    *((150, 200), (90, 120), (120, 180), (90, 125), (30, 40), (60, 120), (60, 120), (45, 75)),
    *((130, math.inf), (120, math.inf), (90, 120), (30, 60)),
]
LOADED_S = [31, 22, 22, 22, 25, 23, 22, 22, 22, 47, 27, 22, 30]
EMPTY_S = """
    11  0  2  5  2  8 10 13 15 17 10  3  1
    14  2  0  2  0  5  8 10 13 15 12  6  3
    16  5  2  0  2  3  5  8 10 13 15  8  6
    14  2  0  2  0  5  8 10 13 15 12  6  3
    19  8  5  3  5  0  3  5  7 10 18 11  9
    22 10  8  5  8  3  0  2  5  7 20 14 11
    24 13 10  8 10  5  2  0  2  5 23 16 14
    26 15 13 10 13  7  5  2  0  2 25 19 16
    29 17 15 13 15 10  7  5  2  0 27 21 19
     6 10 12 15 12 18 20 23 25 27  0  7  9
     8  3  6  8  6 11 14 16 19 21  7  0  2
    10  1  3  6  3  9 11 14 16 19  9  2  0
     0 11 14 16 14 19 22 24 26 29  6  8 10
"""


def build_hoist_cell(parts: int = 6) -> Cell:
    """The line of Phillips and Unger: load, 12 tanks, unload."""
    tanks = [
        Station(f"tank {n}", "machine", 1, float(least), None if most == math.inf else float(most - least))
        for n, (least, most) in enumerate(SOAK_S, 1)
    ]
    stations = (Station("load", "storage", 200), *tanks, Station("unload", "storage", 200))
    empty, loaded = np.full((14, 14), np.nan), np.full((14, 14), np.nan)
    empty[1:, :-1] = np.array(EMPTY_S.split(), float).reshape(13, 13)
    for n, seconds in enumerate(LOADED_S):
        loaded[n, n + 1] = seconds
    route = tuple(Stage(station.name) for station in stations)
    return Cell(stations, (Product("carrier", (route,)),), ("carrier",) * parts, empty, loaded, one_robot("unload"))


@pytest.fixture(scope="session")
def hoist_cell() -> Callable[..., Cell]:
    return build_hoist_cell
