"""Job shops with transport robots, built and drawn."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from lab.sequencing.cell.cell import Cell
from lab.sequencing.cell.stations import UNLIMITED, Product, Robot, Stage, Station

Jobs = Sequence[Sequence[tuple[int, float]]]  # for each part the machine, from 1, and the seconds of its operations


def build_job_shop(jobs: Jobs, travel_s: object, vehicles: int = 1, **change: object) -> Cell:
    """Parts that start at station 0 and end at their last machines, each with one server and room for all."""
    machines = [Station(f"M{n}", "machine", UNLIMITED, servers=1) for n in range(1, len(np.array(travel_s)))]
    products = tuple(
        Product(f"job {n}", ((Stage("LU"), *(Stage(f"M{machine}", processing_s=time_s) for machine, time_s in job)),))
        for n, job in enumerate(jobs, 1)
    )
    described = {
        "stations": (Station("LU", "storage", UNLIMITED), *machines),
        "products": products,
        "order": tuple(product.name for product in products),
        "empty_s": np.array(travel_s, float),
        "loaded_s": np.array(travel_s, float),
        "robots": tuple(Robot(f"vehicle {n}", "LU") for n in range(1, vehicles + 1)),
    }
    return Cell(**(described | change))  # type: ignore[arg-type]


@st.composite
def drawn_job_shops(draw: st.DrawFn, operations: Sequence[int], vehicles: int = 1) -> Cell:
    """Parts with so many operations at the most, on up to three machines that are nowhere near each other alike."""
    seconds, machine = st.integers(0, 12).map(float), st.integers(1, 3)
    jobs = []
    for most in operations:
        at = draw(st.lists(machine, min_size=1, max_size=most))
        places = [place for n, place in enumerate(at) if n == 0 or place != at[n - 1]]
        jobs.append([(place, draw(seconds)) for place in dict.fromkeys(places)])
    travel_s = [[0.0 if a == b else draw(st.integers(1, 9)) for b in range(4)] for a in range(4)]
    return build_job_shop(jobs, travel_s, vehicles)


# Job set 1 and layout 1 of Bilge and Ulusoy 1995, Operations Research 43(6): not symmetric.
EX11_JOBS = (
    ((1, 8), (2, 16), (4, 12)),
    ((1, 20), (3, 10), (2, 18)),
    ((3, 12), (4, 8), (1, 15)),
    ((4, 14), (2, 18)),
    ((3, 10), (1, 15)),
)
LAYOUT_1 = ((0, 6, 8, 10, 12), (12, 0, 6, 8, 10), (10, 6, 0, 6, 8), (8, 8, 6, 0, 6), (6, 10, 8, 6, 0))


@pytest.fixture(scope="session")
def job_shop() -> Callable[..., Cell]:
    return build_job_shop


@pytest.fixture(scope="session")
def job_shops() -> Callable[..., SearchStrategy[Cell]]:
    return drawn_job_shops


@pytest.fixture(scope="session")
def ex11() -> Callable[[int], Cell]:
    """The instance EX11, with so many vehicles."""
    return lambda vehicles: build_job_shop(EX11_JOBS, LAYOUT_1, vehicles)
