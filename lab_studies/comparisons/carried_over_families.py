"""Families of cells: small cells on which a policy is learned, and larger cells on which it is tested."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import UNLIMITED, Product, Robot, Stage, Station
from lab.tasks.task_file import load_cell
from lab_studies.comparisons.transport_instances import board, cell_of
from lab_studies.thesis.chapter_7_cells import robot_cell

PRINTED = "Bilge and Ulusoy, two robots"  # a family of the board
CASES = ("I", "II", "III")
SHOP, TOAST, FMS = "job shops with two vehicles", "toast cells", "manufacturing cells"
JOBS, TOASTS, PARTS = (3, 5), (3, 8), (3, 8)  # the least and the most in small cells


@dataclass(frozen=True)
class LargerCell:
    """A larger cell: its family, the group that it is reported in, and its number there.

    printed: the best published value; None: it has to be computed.
    """

    family: str
    group: str
    number: int
    printed: float | None = None


def shop(rng: np.random.Generator, least: int, most: int) -> Cell:
    """A random job shop like Bilge and Ulusoy's: four machines, two vehicles, travel times that depend on the direction."""
    machines, jobs = 4, int(rng.integers(least, most + 1))
    at = rng.uniform(0.0, 1.0, (machines + 1, 2))
    ways = np.abs(at[:, None] - at[None]).sum(axis=-1) * rng.uniform(0.7, 1.3, (machines + 1, machines + 1))
    times = np.maximum(2.0, np.round(12.0 * rng.uniform(0.3, 1.5) * ways))
    np.fill_diagonal(times, 0.0)
    names = [f"M{number}" for number in range(1, machines + 1)]
    stations = Station("LU", "storage", UNLIMITED), *(Station(n, "machine", UNLIMITED, servers=1) for n in names)
    products = []
    for job in range(1, jobs + 1):
        visited = rng.permutation(machines)[: rng.integers(2, machines + 1)]
        stages = [Stage(names[machine], processing_s=float(rng.integers(6, 21))) for machine in visited]
        products.append(Product(f"job {job}", ((Stage("LU"), *stages),)))
    robots = tuple(Robot(f"vehicle {number}", "LU") for number in (1, 2))
    return Cell(stations, tuple(products), tuple(product.name for product in products), times, times, robots)


def toasts(rng: np.random.Generator, least: int, most: int) -> Cell:
    """A random case of the thesis's toast cell: each machine up to twice as slow or fast, all moves a little slower or faster."""
    cell = robot_cell(CASES[rng.integers(len(CASES))], int(rng.integers(least, most + 1)))
    factor = rng.uniform(0.7, 1.4)
    return replace(
        cell,
        stations=tuple(
            replace(s, processing_s=round(s.processing_s * rng.uniform(0.5, 2.0), 1)) for s in cell.stations
        ),
        empty_s=np.round(cell.empty_s * factor, 2),
        loaded_s=np.round(cell.loaded_s * factor, 2),
    )


def manufacturing(rng: np.random.Generator, least: int, most: int) -> Cell:
    """The manufacturing cell of App. III with a random order, random processing times and another interval of arrivals."""
    cell = _fms(rng, int(rng.integers(least, most + 1)))
    factors = dict(zip(("rook", "sign"), rng.uniform(0.6, 1.5, 2), strict=True))
    products = tuple(
        replace(
            product,
            routes=tuple(
                tuple(s.each(partial(_slower, factor=factors[product.name])) for s in route) for route in product.routes
            ),
        )
        for product in cell.products
    )
    assert cell.arrivals is not None  # App. III has them
    interval_s = (round(200.0 * rng.uniform(0.3, 1.5), 1),) * cell.parts
    return replace(cell, products=products, arrivals=replace(cell.arrivals, interval_s=interval_s))


def _fms(rng: np.random.Generator, parts: int) -> Cell:
    order = tuple(str(name) for name in rng.choice(["rook", "sign"], parts))
    return replace(load_cell("fms").cell(order), due_s=None)  # only the makespan counts


def _slower(stage: Stage, factor: float) -> Stage:
    return stage if stage.processing_s is None else replace(stage, processing_s=round(stage.processing_s * factor, 1))


SMALL: Mapping[str, Callable[[np.random.Generator], Cell]] = {
    SHOP: lambda rng: shop(rng, *JOBS),
    TOAST: lambda rng: toasts(rng, *TOASTS),
    FMS: lambda rng: manufacturing(rng, *PARTS),
}
BILGE_ULUSOY, MORE_JOBS = "Bilge and Ulusoy, two vehicles", "drawn, 10 to 20 jobs"
THESIS_TOASTS, DRAWN_TOASTS, ORDERS = (
    "cases I to III, 20 to 60 toasts",
    "drawn, 20 to 60 toasts",
    "orders of 12 to 30 parts",
)


def larger_cells() -> tuple[LargerCell, ...]:
    """The larger cells, which do not depend on the study's seed."""
    printed = [instance.printed for instance in board() if instance.family == PRINTED]
    return (
        *(LargerCell(SHOP, BILGE_ULUSOY, number, value) for number, value in enumerate(printed)),
        *(LargerCell(SHOP, MORE_JOBS, number) for number in range(12)),
        *(LargerCell(TOAST, THESIS_TOASTS, number) for number in range(15)),
        *(LargerCell(TOAST, DRAWN_TOASTS, number) for number in range(20)),
        *(LargerCell(FMS, ORDERS, number) for number in range(10)),
    )


@lru_cache(maxsize=256)
def larger_cell(cell: LargerCell) -> Cell:
    """The cell that is meant, the same every time."""
    rng = np.random.default_rng([2026, [*GROUPS].index(cell.group), cell.number])
    return GROUPS[cell.group](cell.number, rng)


GROUPS: Mapping[str, Callable[[int, np.random.Generator], Cell]] = {
    BILGE_ULUSOY: lambda number, rng: cell_of([instance for instance in board() if instance.family == PRINTED][number]),
    MORE_JOBS: lambda number, rng: shop(rng, 10, 20),
    THESIS_TOASTS: lambda number, rng: robot_cell(CASES[number // 5], 20 + 10 * (number % 5)),
    DRAWN_TOASTS: lambda number, rng: toasts(rng, 20, 60),
    ORDERS: lambda number, rng: _fms(rng, 12 + 2 * number),
}


def small_cells(family: str, count: int, seed: int) -> list[Cell]:
    """`count` random small cells of a family; for an unknown family, of all families in turn."""
    drawn = [SMALL[family]] if family in SMALL else [*SMALL.values()]
    rng = np.random.default_rng([seed, 2, [*SMALL].index(family) if family in SMALL else len(SMALL)])
    return [drawn[number % len(drawn)](rng) for number in range(count)]
