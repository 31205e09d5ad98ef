"""Cells to test with: the thesis's three cases, a one-machine cell to redo by hand, and random small ones."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.sequencing.cell import Cell, Stage, Station, needed_moves

X = math.nan
# Thesis table 7.2, robot times [s], row from, column to, stations 1 to 6.
# Case III 1 -> 2 is unreadable in print; 50 s is what reproduces both printed optima.
ROBOT_S = {
    "I": [
        [X, 24, 36, X, X, X],
        [21, X, 24, 26, 15, X],
        [22, X, X, 22, 28, X],
        [24, 26, 19, X, 19, X],
        [26, 24, 20, X, X, 12],
        [25, 23, 19, 21, X, X],
    ],
    "II": [
        [X, 20, 30, X, X, X],
        [30, X, 30, 20, 30, X],
        [30, X, X, 30, 50, X],
        [30, 20, 30, X, 40, X],
        [30, 20, 30, X, X, 20],
        [30, 20, 20, 30, X, X],
    ],
    "III": [
        [X, 50, 70, X, X, X],
        [40, X, 40, 40, 50, X],
        [45, X, X, 30, 45, X],
        [50, 40, 30, X, 35, X],
        [55, 50, 45, X, X, 30],
        [60, 55, 50, 45, X, X],
    ],
}
MACHINE_S = {"I": 60, "II": 90, "III": 120}  # thesis table 7.1
TOAST_ROUTE = (Stage("plate"), Stage("toaster", "toaster buffer"), Stage("butter", "butter buffer"), Stage("done"))


def build_toast_cell(case: str, toasts: int, buffer_room: int = 50) -> Cell:
    stations = (
        Station("plate", "storage", 50),
        Station("toaster buffer", "buffer", buffer_room),
        Station("toaster", "machine", 1, MACHINE_S[case]),
        Station("butter buffer", "buffer", buffer_room),
        Station("butter", "machine", 1, MACHINE_S[case]),
        Station("done", "storage", 50),
    )
    table = np.array(ROBOT_S[case])
    return Cell(stations, TOAST_ROUTE, table, table, "toaster buffer", toasts)


def build_oven_cell(toasts: int = 2, **change: object) -> Cell:
    """in (0) -> oven (1), 10 s, one toast -> out (2), no buffer; empty moves 1 s, loaded moves 2 s."""
    parts: dict[str, object] = {
        "stations": (Station("in", "storage", 9), Station("oven", "machine", 1, 10.0), Station("out", "storage", 9)),
        "route": (Stage("in"), Stage("oven"), Stage("out")),
        "empty_s": np.ones((3, 3)) - np.eye(3),
        "loaded_s": 2 * (np.ones((3, 3)) - np.eye(3)),
        "robot_start": "in",
        "toasts": toasts,
    }
    return Cell(**(parts | change))  # type: ignore[arg-type]


@st.composite
def random_cells(draw: st.DrawFn, max_machines: int = 2, max_toasts: int = 3) -> Cell:
    """A small cell whose tables hold the needed moves and nothing else."""
    toasts = draw(st.integers(1, max_toasts))
    seconds = st.one_of(st.integers(0, 20).map(float), st.floats(0, 20, allow_subnormal=False))
    stations, route = [Station("in", "storage", toasts)], [Stage("in")]
    for number in range(draw(st.integers(1, max_machines))):
        buffer = f"buffer {number}" if draw(st.booleans()) else None
        if buffer:
            stations.append(Station(buffer, "buffer", draw(st.integers(1, 2))))
        kind = draw(st.sampled_from(["machine", "machine", "storage"]))
        time_s = draw(seconds) if kind == "machine" else 0.0
        stations.append(Station(f"stage {number}", kind, draw(st.integers(1, 2)), time_s))  # type: ignore[arg-type]
        route.append(Stage(f"stage {number}", buffer))
    stations.append(Station("out", "storage", toasts))
    route.append(Stage("out"))
    stations = draw(st.permutations(stations))
    start = draw(st.sampled_from(stations)).name
    names = [station.name for station in stations]
    moves = needed_moves(stations, route, start, toasts)
    tables = []
    for pairs in (moves.empty, moves.loaded):
        table = np.full((len(names), len(names)), np.nan)
        for origin, target in pairs:
            # Above 0, so that 1 / T exists.
            table[names.index(origin), names.index(target)] = 0.5 + draw(seconds)
        tables.append(table)
    return Cell(tuple(stations), tuple(route), tables[0], tables[1], start, toasts)


@pytest.fixture(scope="session")
def toast_cell() -> Callable[..., Cell]:
    return build_toast_cell


@pytest.fixture(scope="session")
def oven_cell() -> Callable[..., Cell]:
    return build_oven_cell


@pytest.fixture(scope="session")
def cells() -> Callable[..., SearchStrategy[Cell]]:
    return random_cells
